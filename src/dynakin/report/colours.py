"""One colour for each segment, the same in every figure, in the page and in the files."""

from __future__ import annotations

from collections.abc import Sequence

# Paul Tol's "muted" scheme (SRON/EPS/TN/09-002), made for people with any kind of colour vision; the light ones are
# darkened to be seen as thin lines on white. Neighbours in the body are far apart in hue or lightness.
_KNOWN = {
    "foot": "#332288",
    "shank": "#2e9c8b",
    "thigh": "#c4556a",
    "pelvis": "#8a8a1f",
    "trunk": "#5aa9d6",
    "upper_arm": "#117733",
    "forearm": "#882255",
    "head": "#aa4499",
    "hand": "#b38f2a",
}
_FURTHER = ("#aa4499", "#b38f2a", "#4d4d4d", "#7a5195", "#00798c", "#a44a3f", "#6b8e23", "#5b6ee1")
_SIDES = ("_right", "_left", "_r", "_l")

# Okabe and Ito's blue and vermilion, told apart by people with any kind of colour vision.
SIDE_COLOURS = {"right": "#0072B2", "left": "#D55E00", "": "#4d5661"}
"""Right, left and what is in the middle, in every figure of a body with two sides."""


def side_of(name: str) -> str:
    """ "right", "left" or "" of a segment or coordinate, by its name."""
    if name.endswith(("_right", "_r")) or name.startswith("right_"):
        return "right"
    return "left" if name.endswith(("_left", "_l")) or name.startswith("left_") else ""


def segment_colours(segments: Sequence[str]) -> dict[str, str]:
    """Colour of each segment: by its name without a side where it is a common one, else by its place in the list."""
    found: dict[str, str] = {}
    unknown: list[str] = []
    for segment in segments:
        stem = _stem(segment)
        if stem not in _KNOWN and stem not in unknown:
            unknown.append(stem)
        found[segment] = _KNOWN.get(stem) or _FURTHER[unknown.index(stem) % len(_FURTHER)]
    return found


def _stem(segment: str) -> str:
    for side in _SIDES:
        if segment.endswith(side):
            return segment.removesuffix(side)
    return segment.removeprefix("right_").removeprefix("left_")
