"""Pairs of markers that show which way is up and which way the person faces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dynakin.arrays import Array
from dynakin.recordings.recording import Recording


@dataclass(frozen=True)
class FacingPairs:
    """Marker names, case, dots, underscores and subject prefixes aside.

    Attributes:
        heel_toe: (back, front) of each foot.
        pelvis: (back, front), posterior and anterior iliac spine of each side.
        across: (right, left) of places that lie side by side on the body, such as both hips.
        above, below: markers of pelvis and trunk, and of the feet; where none are given, those of the pairs.
    """

    heel_toe: tuple[tuple[str, str], ...]
    pelvis: tuple[tuple[str, str], ...]
    across: tuple[tuple[str, str], ...] = ()
    above: tuple[str, ...] = ()
    below: tuple[str, ...] = ()


DEFAULT_PAIRS = FacingPairs(
    heel_toe=(
        ("LHEE", "LTOE"), ("RHEE", "RTOE"), ("L_calc", "L_toe"), ("r_calc", "r_toe"),
        ("LCAL", "LTOE"), ("RCAL", "RTOE"), ("LCAL", "LTT2"), ("RCAL", "RTT2"),
        ("L.Heel", "L.Toe"), ("R.Heel", "R.Toe"), ("L.Heel", "L.Toe.Tip"), ("R.Heel", "R.Toe.Tip"),
    ),
    pelvis=(
        ("LPSI", "LASI"), ("RPSI", "RASI"), ("L.PSIS", "L.ASIS"), ("r.PSIS", "r.ASIS"),
        ("V.Sacral", "L.ASIS"), ("V.Sacral", "R.ASIS"),
    ),
)  # fmt: skip
"""Plug-in-Gait, the marker set of OpenCap's laboratory recordings, OpenSim's examples, Qualisys' full body. What a
recording does not have in pairs is not used; a middle marker behind both sides of the front is one of each pair."""


@lru_cache(maxsize=4096)
def plain_name(name: str) -> str:
    """A marker's name without subject prefix ("S1:"), case, dots, underscores, hyphens and blanks."""
    kept = name.rsplit(":", 1)[-1].casefold()
    return "".join(c for c in kept if c not in "._- ")


def find_marker(recording: Recording, name: str) -> str | None:
    """The recording's name for a marker: the exact one, else the first that is the same but for its
    spelling."""
    if name in recording.marker_names:
        return name
    plain = plain_name(name)
    return next((own for own in recording.marker_names if plain_name(own) == plain), None)


def present_pairs(recording: Recording, pairs: tuple[tuple[str, str], ...]) -> list[tuple[str, str]]:
    """Those pairs whose markers the recording both has, seen at the same time at least once, in its own
    spelling."""
    found = []
    for back, front in pairs:
        a, b = find_marker(recording, back), find_marker(recording, front)
        if a and b and np.isfinite(recording.marker(a) + recording.marker(b)).all(axis=1).any():
            found.append((a, b))
    return found


def mean_position(recording: Recording, names: list[str], frames: slice) -> Array | None:
    """Mean position (3,) m of some markers over some frames, None where none is seen."""
    points = np.concatenate([recording.marker(name)[frames] for name in names]) if names else np.empty((0, 3))
    points = points[np.isfinite(points).all(axis=1)]
    return points.mean(axis=0) if len(points) else None
