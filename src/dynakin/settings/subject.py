"""Who is measured, and the known loads that are not theirs: carried, or on a plate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from dynakin.errors import ModelError
from dynakin.settings.strict import Name, Strict, validate
from dynakin.units import PERSON_HEIGHT_M, PERSON_MASS_KG, inertia_problem

Sex = Literal["male", "female"]


class _Fields(Strict):
    """The plain fields, so that ``Subject(...)`` can turn pydantic's error into a ModelError."""

    mass_kg: float | None = Field(default=None, gt=0.0, lt=PERSON_MASS_KG[1])
    height_m: float | None = Field(default=None, gt=PERSON_HEIGHT_M[0], lt=PERSON_HEIGHT_M[1])
    sex: Sex | None = None


class Subject(_Fields):
    """Mass (kg), height (m) and sex of the person; what is None is measured or estimated, and said.

    Raises:
        ModelError: an unknown key, or a value out of range; the message names the key (``mass_kg`` of 0, say).
    """

    def __init__(self, **fields: Any) -> None:
        """Keywords ``mass_kg``, ``height_m``, ``sex``."""
        try:
            checked = validate(_Fields, fields, "subject")
        except ModelError as error:
            raise error.reworded(error.message + _hint(fields)) from None
        super().__init__(**checked.model_dump())


def _hint(fields: dict[str, Any]) -> str:
    """The option, and what a number in another unit would be in ours."""
    mass, height = (fields.get(key) for key in ("mass_kg", "height_m"))
    if isinstance(mass, int | float) and not 0.0 < mass < PERSON_MASS_KG[1]:
        return "; expected kilograms (--mass)"
    low, high = PERSON_HEIGHT_M
    if isinstance(height, int | float) and not low < height < high:
        metres = next((height * unit for unit in (0.01, 0.001) if low < height * unit < high), None)
        return "; expected metres (--height)" if metres is None else f"; expected metres (--height), {metres:.2f}?"
    return ""


Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


FARTHEST_M = 2.0
"""From a segment's joint to a load's centre."""


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

    @field_validator("place_m")
    @classmethod
    def _near(cls, place: Vector3) -> Vector3:
        if (away := math.hypot(*place)) > FARTHEST_M:
            raise ValueError(
                f"found a place {away:.3g} m from the segment's joint, expected metres, {FARTHEST_M:g} at most"
            )
        return place

    @model_validator(mode="after")
    def _possible(self) -> CarriedLoad:
        if problem := inertia_problem(self.mass_kg, self.inertia_kg_m2):
            raise ValueError(f"inertia_kg_m2: {problem}")
        return self


@dataclass(frozen=True)
class PlateLoad:
    """A constant wrench that something else than the person leaves on a plate, laboratory frame.

    Attributes:
        plate: its name, as `dynakin check` shows it.
        force_n: as the plate reads it (its reaction: a weight of 50 N reads +50 N along the vertical).
        point_m: where the force acts.
        moment_nm: in addition to that, about the point.
    """

    plate: str
    force_n: Vector3
    point_m: Vector3
    moment_nm: Vector3 = (0.0, 0.0, 0.0)

    __pydantic_config__: ClassVar = {"extra": "forbid", "allow_inf_nan": False}  # of a configuration
