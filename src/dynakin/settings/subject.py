"""Who is measured."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from dynakin.errors import ModelError
from dynakin.settings.strict import Strict, validate

Sex = Literal["male", "female"]


class _Fields(Strict):
    """The plain fields, so that ``Subject(...)`` can turn pydantic's error into a ModelError."""

    mass_kg: float | None = Field(default=None, gt=0.0, lt=500.0)
    height_m: float | None = Field(default=None, gt=0.3, lt=2.8)
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
            raise ModelError(error.message + _hint(fields)) from None
        super().__init__(**checked.model_dump())


def _hint(fields: dict[str, Any]) -> str:
    """The option, and what a number in another unit would be in ours."""
    mass, height = (fields.get(key) for key in ("mass_kg", "height_m"))
    if isinstance(mass, int | float) and not 0.0 < mass < 500.0:
        return "; expected kilograms (--mass)"
    if isinstance(height, int | float) and not 0.3 < height < 2.8:
        metres = next((height * unit for unit in (0.01, 0.001) if 0.3 < height * unit < 2.8), None)
        return "; expected metres (--height)" if metres is None else f"; expected metres (--height), {metres:.2f}?"
    return ""
