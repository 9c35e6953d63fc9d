"""Known loads: what the person carries, and what bears on a plate without being the person's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pydantic import Field

from dynakin.settings.strict import Name, Strict

Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


class CarriedLoad(Strict):
    """A rigid body of known mass that moves with a segment."""

    segment: str
    """The segment that it is fixed to."""
    mass_kg: Positive
    """Its mass, kg; `mass_kg` of the person does not hold it."""
    place_m: Vector3
    """Its centre of mass in the segment's frame, m."""
    inertia_kg_m2: tuple[NotNegative, NotNegative, NotNegative] = (0.0, 0.0, 0.0)
    """Moments of inertia about its own centre, along the segment's axes; not given: all of it in one point."""
    name: Name = "load"
    """Its own name among the segments."""


@dataclass(frozen=True)
class PlateLoad:
    """A constant wrench that something else than the person leaves on a plate, laboratory frame.

    Attributes:
        plate: its name, as `dynakin check` shows it.
        force_n: as the plate reads it (its reaction: a weight of 50 N reads +50 N along the vertical).
        point_m: where the force acts.
        moment_nm: beside that, about the point.
    """

    plate: str
    force_n: Vector3
    point_m: Vector3
    moment_nm: Vector3 = (0.0, 0.0, 0.0)

    __pydantic_config__: ClassVar = {"extra": "forbid", "allow_inf_nan": False}  # of a configuration
