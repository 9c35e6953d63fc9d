"""The outcome of an initialisation: what the filter starts from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from dynakin.model.lumping import PlacedPart
from dynakin.model.plan import ModelPlan
from dynakin.recordings import GroundFrame

if TYPE_CHECKING:
    from dynakin import _core

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class InitialModel:
    """A model measured on one person, and the state from which the filter starts; order of n: the core's
    layout.

    Attributes:
        spec: the core's specification.
        names: (n,) names of the state's elements.
        x0: (n,) state at the first usable frame; speeds and accelerations 0.
        sd0: (n,) prior standard deviations.
        lower, upper: (n,) bounds of (9), infinite where there are none.
        table: (n,) values of the inertia table, NaN for elements that it does not hold.
        marker_variance: (M,) m^2, R of each marker as its set gives it.
        soft_tissue_m: (M,) declared size of the displacement of skin and flesh under each marker.
        ground: ground frame whose origin is the model's ground landmark (the toe).
        plate_centre: (3,) m, ground frame: mean centre of pressure of the first second, the ground's origin where
            nothing was measured.
        recorded_markers: names in the recording, in the order of spec.markers.
        side: "right", "left" or "both".
        mass_kg, height_m: as used; height None where nothing needed it.
        parts: the table's parts in each segment, as placed.
        messages: sentences on what was found, left out, locked or assumed.
        plan: the same as plain data.
        carried_kg: mass of the known loads (`model.loads`), not in ``mass_kg``.
    """

    spec: _core.ModelSpec
    names: tuple[str, ...]
    x0: Array
    sd0: Array
    lower: Array
    upper: Array
    table: Array
    marker_variance: Array
    soft_tissue_m: Array
    ground: GroundFrame
    plate_centre: Array
    recorded_markers: tuple[str, ...]
    side: str
    mass_kg: float
    height_m: float | None
    parts: dict[str, list[PlacedPart]]
    messages: tuple[str, ...]
    plan: ModelPlan
    carried_kg: float = 0.0

    @property
    def weighed_kg(self) -> float:
        """What the plates carry: the person and the known loads, kg."""
        return self.mass_kg + self.carried_kg
