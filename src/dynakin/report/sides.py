"""Which coordinates belong together, how each side is drawn, and in what order a reader looks for them.

In a plane there are no sides: each coordinate stands alone, in the model's order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.report.styles import ESTIMATED_LINE, SIDE_COLOURS, LineStyle, side_of
from dynakin.results.estimate import Estimate
from dynakin.results.measures.power import root_coordinates
from dynakin.results.measures.sources import legs_of
from dynakin.results.measures.symmetry import paired
from dynakin.results.naming import sentence, words

REGIONS = ("Legs", "Trunk and head", "Arms", "Whole body")
"""Of a body in space; a planar one has "" only."""


def side_lines(estimate: Estimate) -> dict[str, LineStyle]:
    """Line of the right, the left and the middle; in a plane that of the estimate."""
    if estimate.planar:
        return {"": ESTIMATED_LINE}
    return {side: LineStyle(side, colour, 1.2, band=True) for side, colour in SIDE_COLOURS.items()}


def side_key(estimate: Estimate) -> tuple[LineStyle, ...]:
    """`side_lines` in a key; what stands in the middle needs no name."""
    return tuple(line for line in side_lines(estimate).values() if line.label)


def normalising_mass(estimate: Estimate) -> float | None:
    """Body mass, kg, that the page divides moments and powers by; None in a plane, whose limbs are both sides'."""
    return None if estimate.planar else estimate.mass_kg


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
    """All coordinates that move, right and left together, legs first and what places the whole body last.

    In a plane the locked ones as well, and each by itself.
    """
    names, rotation = estimate.coordinate_names, estimate.is_rotation()
    if estimate.planar:
        return [Joint(name, {"": k}, "", bool(rotation[k])) for k, name in enumerate(names)]
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
    values, sd = estimate.values("coordinates"), estimate.values("coordinates_sd")
    return np.asarray((np.nan_to_num(sd) > 0.0).any(axis=0) | (np.ptp(np.nan_to_num(values), axis=0) > 0.0))


def _region(name: str, is_root: bool, leg: str, legs_known: bool) -> str:
    if is_root:
        return "Whole body"
    if not side_of(name):
        return "Trunk and head"
    return "Legs" if leg or not legs_known else "Arms"
