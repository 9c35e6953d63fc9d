"""One colour for each segment and side, one line for each method: the same in every figure, key and table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dynakin.report.plot import ESTIMATED, LIMIT, MEASURED, QUIET, REFERENCE
from dynakin.results.measures.sources import DERIVED, PRIOR

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

# Okabe and Ito's blue and vermilion, distinguished by people with any kind of colour vision.
SIDE_COLOURS = {"right": "#0072B2", "left": "#D55E00", "": "#4d5661"}
"""Right, left and what is in the middle, in every figure of a body with two sides."""


# After the first filter: Okabe and Ito's green, purple and sky blue, for further presets.
_FILTERS = (ESTIMATED, "#009E73", "#CC79A7", "#56B4E9")
_CLASSICAL = "#6A3D9A"
Dash = Literal["solid", "dashed", "dotted"]
_PATTERNS: dict[Dash, tuple[float, ...]] = {"solid": (), "dashed": (4, 1.6), "dotted": (1.2, 1.4)}


@dataclass(frozen=True)
class LineStyle:
    """How a method is drawn; ``band``: its spread is drawn too, of others it would hide what lies below."""

    label: str
    colour: str
    width: float
    dash: Dash = "solid"
    band: bool = False

    @property
    def css(self) -> str:
        """Of the line in a page's key."""
        return f"border-top: {max(2, round(1.7 * self.width))}px {self.dash} {self.colour}"

    @property
    def pattern(self) -> tuple[float, tuple[float, ...] | None]:
        """Of matplotlib's dashes."""
        return (0.0, _PATTERNS[self.dash] or None)

    @property
    def dashes(self) -> str:
        """Of an SVG path whose unit is a tenth of a point."""
        return " ".join(f"{10.0 * self.width * length:.0f}" for length in _PATTERNS[self.dash])


MEASURED_LINE, ESTIMATED_LINE = LineStyle("measured", MEASURED, 2.6), LineStyle("estimated", ESTIMATED, 1.2, band=True)
BOUND_LINE = LineStyle("bound", LIMIT, 1.0, "dashed")
BAND = "± 2 standard deviations"
DERIVED_LINE = LineStyle("derived from the motion", QUIET, 1.2, "dashed")
PRIOR_LINE = LineStyle("prior: load sharing assumed", QUIET, 1.2, "dotted")


def source_key(source: np.ndarray) -> tuple[LineStyle, ...]:
    """What a figure's key says of the values that it shows, by their codes of where they come from: nothing where all
    are measured."""
    lines = {DERIVED: DERIVED_LINE, PRIOR: PRIOR_LINE}
    return tuple(line for code, line in lines.items() if (source == code).any())


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


def method_styles(names: Iterable[str]) -> dict[str, LineStyle]:
    """Line of each method by its name: "measured", "EKF ...", "AT ...", "classical ..." and "IK + ID ..."."""
    found: dict[str, LineStyle] = {}
    filters = 0
    for name in names:
        if name == "measured":
            found[name] = MEASURED_LINE
        elif name.startswith("AT") or (name.startswith("IK") and not any(each.startswith("IK") for each in found)):
            found[name] = LineStyle(name, REFERENCE, 1.1, "dashed")
        elif name.startswith(("classical", "IK")):
            found[name] = LineStyle(name, _CLASSICAL, 1.2, "dotted")
        else:
            found[name] = LineStyle(name, _FILTERS[filters % len(_FILTERS)], 1.2, band=filters == 0)
            filters += 1
    return found
