"""A body with a right and a left: which coordinates belong together, and in what order a reader looks for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.report.colours import side_of
from dynakin.results.estimate import Estimate
from dynakin.results.measures.power import root_coordinates
from dynakin.results.measures.sources import legs_of
from dynakin.results.measures.symmetry import paired
from dynakin.results.naming import sentence, words

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
    root, legs = root_coordinates(estimate), legs_of(estimate.data)
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
            region = _region(name, name in root, legs[k], any(legs))
            found.append(Joint(stem, columns, region, bool(rotation[k])))
    return sorted(found, key=lambda joint: REGIONS.index(joint.region))


def _moving(estimate: Estimate) -> np.ndarray:
    """(C,) bool: not locked."""
    sd = estimate.data["coordinates_sd"].transpose("time", "coordinate").values
    values = estimate.data["coordinates"].transpose("time", "coordinate").values
    return np.asarray((np.nan_to_num(sd) > 0.0).any(axis=0) | (np.ptp(np.nan_to_num(values), axis=0) > 0.0))


def _region(name: str, is_root: bool, leg: str, legs_known: bool) -> str:
    if is_root:
        return "Whole body"
    if not side_of(name):
        return "Trunk and head"
    return "Legs" if leg or not legs_known else "Arms"
