"""A body with a right and a left: which coordinates belong together, and in what order a reader looks for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.report.colours import side_of
from dynakin.report.labels import sentence, words
from dynakin.results import Estimate
from dynakin.results.power import root_coordinates
from dynakin.results.symmetry import paired

REGIONS = ("Legs", "Trunk and head", "Arms", "Whole body")


@dataclass(frozen=True)
class Joint:
    """One coordinate, or the right and the left one of a pair: ``columns`` by side ("right", "left", or "")."""

    stem: str
    columns: dict[str, int]
    region: str
    rotation: bool

    @property
    def title(self) -> str:
        """`Knee angle`; of one side alone with the side."""
        side = next(iter(self.columns)) if len(self.columns) == 1 else ""
        return sentence(words(self.stem)) + (f", {side}" if side else "")

    @property
    def name(self) -> str:
        """The title of what is no angle: `Knee`."""
        return self.title.replace(" angle", "")


def joints_of(estimate: Estimate) -> list[Joint]:
    """All coordinates that move, right and left together, legs first and what places the whole body last."""
    names, rotation = estimate.coordinate_names, estimate.is_rotation()
    pairs = {k: (stem, right, left) for stem, right, left in paired(names) for k in (right, left)}
    root, legs = root_coordinates(estimate), _leg_segments(estimate)
    moving = _moving(estimate)
    found: list[Joint] = []
    taken: set[int] = set()
    for k, name in enumerate(names):
        if k in taken:
            continue
        if k in pairs:
            stem, right, left = pairs[k]
            columns = {"right": right, "left": left}
        else:
            side = side_of(name)
            stem, columns = (name[:-2] if side and name[-2:] in ("_r", "_l") else name), {side: k}
        taken.update(columns.values())
        columns = {side: column for side, column in columns.items() if moving[column]}
        if columns:
            region = _region(estimate, k, bool(side_of(name)), name in root, legs)
            found.append(Joint(stem, columns, region, bool(rotation[k])))
    return sorted(found, key=lambda joint: REGIONS.index(joint.region))


def _moving(estimate: Estimate) -> np.ndarray:
    """(C,) bool: not locked."""
    sd = estimate.data["coordinates_sd"].transpose("time", "coordinate").values
    values = estimate.data["coordinates"].transpose("time", "coordinate").values
    return np.asarray((np.nan_to_num(sd) > 0.0).any(axis=0) | (np.ptp(np.nan_to_num(values), axis=0) > 0.0))


def _region(estimate: Estimate, k: int, sided: bool, is_root: bool, legs: set[str]) -> str:
    if is_root:
        return "Whole body"
    if not sided:
        return "Trunk and head"
    if "coordinate_segment" not in estimate.data.coords or not legs:
        return "Legs"
    return "Legs" if str(estimate.data["coordinate_segment"].values[k]) in legs else "Arms"


def _leg_segments(estimate: Estimate) -> set[str]:
    """Segments from the feet up to, but without, the first that both share, and all that hangs on the feet."""
    data = estimate.data
    if "foot_segment" not in data.coords or "joint_segment" not in data.coords:
        return set()
    segments = [str(name) for name in data["joint_segment"].values]
    parents = [int(parent) for parent in data["joint_parent"].values]
    found: set[str] = set()
    for foot in data["foot_segment"].values:
        at = segments.index(str(foot))
        while at >= 0 and side_of(segments[at]):
            found.add(segments[at])
            at = parents[at]
    for k, parent in enumerate(parents):  # parents stand before their children
        if parent >= 0 and segments[parent] in found:
            found.add(segments[k])
    return found
