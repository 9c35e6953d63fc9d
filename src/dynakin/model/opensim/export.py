"""`dynakin model ... --export`: a model, with what a run found where asked, as an .osim file."""

from __future__ import annotations

from pathlib import Path

from dynakin.elements import element
from dynakin.errors import ModelError
from dynakin.files import is_file
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.opensim.description import OpenSimModel
from dynakin.model.opensim.from_core import from_core
from dynakin.model.opensim.identified import identified
from dynakin.model.opensim.sites import with_mass
from dynakin.settings.strict import read_toml


def mass_of_run(parameters: Path) -> float | None:
    """The mass (kg) in the run's ``config.toml`` next to its parameters, None where there is none.

    Raises:
        ModelError: that file is damaged.
    """
    path = parameters.with_name("config.toml")
    if not is_file(path):
        return None
    mass = read_toml(path).get("mass_kg")
    if mass is not None and not (isinstance(mass, int | float) and 0.0 < mass < float("inf")):
        raise ModelError(f"{path}: mass_kg is {mass!r}, expected a number above 0")
    return None if mass is None else float(mass)


def of_definition(definition: OpenSimDefinition, values: dict[str, float], mass_kg: float | None) -> OpenSimModel:
    """The OpenSim model with masses that sum to ``mass_kg`` first, where given, and then these values.

    Raises:
        ModelError: a value of something that the model does not have: it was found with another model.
    """
    source = definition.source
    known = {f"length/{name}" for name in definition.scales.values()}
    known |= {f"marker/{marker.name}" for marker in source.markers}
    known |= {f"inertia/{body.name}" for body in source.bodies}
    for name in values:
        kind, owner, _ = element(name)
        if kind in ("length", "marker", "inertia") and f"{kind}/{owner}" not in known:
            raise ModelError(f"{source.path}: has no {name}, which the parameters hold: they are another model's")
    if mass_kg is not None:
        source = with_mass(source, mass_kg)
    return identified(source, definition.scales, values)


def of_initial(initial: CalibratedModel, values: dict[str, float]) -> OpenSimModel:
    """A model that was measured on a recording."""
    bounds = zip(initial.names, initial.lower, initial.upper, strict=True)
    limits = {name: (float(low), float(high)) for name, low, high in bounds if "/" not in name}
    return from_core(initial.spec, values, limits)
