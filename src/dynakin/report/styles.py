"""What all figures share, however they are drawn: one colour for each segment and side, one line for each method,
and lines of no more points than are seen."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dynakin.results.measures import sources
from dynakin.results.measures.sources import DERIVED, PRIOR

# Okabe and Ito's colours, distinguished by people with any kind of colour vision; measured and estimated differ in
# lightness and width too.
MEASURED = "#9a9a9a"
ESTIMATED = "#0072B2"
LIMIT = "#D55E00"
REFERENCE = "#B34700"  # the classical method, always dashed
INK, QUIET, GRID = "#1d2530", "#5c6773", "#e4e8ec"

DASHES: dict[int, tuple[float, ...]] = {sources.MEASURED: (), sources.DERIVED: (3.6, 2.6), sources.PRIOR: (1.0, 2.2)}
"""By where a value comes from: solid, dashed, dotted; what is absent is a gap."""
_MOST_POINTS = 700


def thin(time: np.ndarray, values: np.ndarray, most: int = _MOST_POINTS) -> tuple[np.ndarray, np.ndarray]:
    """At most about ``most`` points of a line: the smallest and the largest of each stretch, so that no peak gets
    lost."""
    if len(time) <= most:
        return time, values
    size, more = divmod(len(time), most // 2)  # the first parts are one longer
    sizes = np.full(most // 2, size)
    sizes[:more] += 1
    starts, part_of = np.cumsum(sizes) - sizes, np.repeat(np.arange(most // 2), sizes)
    finite = np.isfinite(values)
    lowest = np.minimum.reduceat(np.where(finite, values, np.inf), starts)
    highest = np.maximum.reduceat(np.where(finite, values, -np.inf), starts)
    kept = []
    for wanted in (values == lowest[part_of], values == highest[part_of], ~finite):  # a gap stays a gap
        found = np.flatnonzero(wanted)
        kept.append(found[np.unique(part_of[found], return_index=True)[1]])
    shown = np.unique(np.concatenate(kept))
    return time[shown], values[shown]


def with_next(part: np.ndarray) -> np.ndarray:
    """Frames (T,) bool with the one after each stretch, so that solid and dashed stretches of a line meet."""
    grown = part.copy()
    grown[1:] |= part[:-1]
    return grown


def by_source(values: np.ndarray, source: np.ndarray | None) -> list[tuple[np.ndarray, tuple[float, ...]]]:
    """Values (T,) in parts (T,), NaN elsewhere, each with its `DASHES`: by where they come from (T,), codes of
    `results.measures.sources`; None: all are of one kind."""
    if source is None:
        return [(values, ())]
    drawn = [(np.where(with_next(source == code), values, np.nan), pattern) for code, pattern in DASHES.items()]
    return [(part, pattern) for part, pattern in drawn if np.isfinite(part).any()]


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
