"""What all figures share, however they are drawn: colours, dashes, and lines of no more points than are seen."""

from __future__ import annotations

import numpy as np

from dynakin.results.measures import sources

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
