"""`dynakin model ... --export`: a model, with what a run found where asked, as an .osim file."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynakin.elements import element
from dynakin.errors import ConfigError, ModelError
from dynakin.files import LARGEST_TEXT, is_file, read_bytes
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.opensim.description import OpenSimModel
from dynakin.model.opensim.from_core import from_core
from dynakin.model.opensim.identified import identified
from dynakin.model.opensim.sites import with_mass
from dynakin.settings.model import Bounds
from dynakin.settings.settings import Settings, option_names
from dynakin.settings.strict import read_toml
from dynakin.settings.subject import Subject

MASS_APART = 0.05
"""Part by which the mass of the parameters' segments may miss the person's: the total mass is a prior of the run."""


@dataclass(frozen=True)
class FoundParameters:
    """What a run's ``parameters.json`` holds.

    Attributes:
        path: the file. model: of which model; None: it does not say.
        values: by the core's names. bounds: of those that have any, as that run had them.
    """

    path: Path
    model: str | None
    values: dict[str, float]
    bounds: dict[str, tuple[float, float]]

    def check(self, model: str, known: Iterable[str], bounds: Mapping[str, tuple[float, float]]) -> None:
        """That the values are of this model.

        Args:
            model: its name. known: all that it has, ``length/thigh``, ``marker/RKNE``, ``inertia/pelvis``.
            bounds: of values of which the file states none.

        Raises:
            ModelError: another model's, or a value outside its bounds.
        """
        if self.model not in (None, model):
            raise ModelError(f"{self.path}: found parameters of model {self.model}, another model's; expected {model}")
        names = set(known)
        for name, value in self.values.items():
            kind, owner, _ = element(name)
            if kind != "plates" and f"{kind}/{owner}" not in names:
                raise ModelError(
                    f"{self.path}: model {model} has no {name} as measured here: the parameters are another model's, "
                    "or of other markers"
                )
            low, high = self.bounds.get(name) or bounds.get(name, (-np.inf, np.inf))
            slack = 1e-6 * (high - low) if np.isfinite(high - low) else 0.0
            if not low - slack <= value <= high + slack:
                raise ModelError(f"{self.path}: {name} is {value:g}, expected {low:.4g} to {high:.4g}")

    def check_mass(self, found_kg: float, expected_kg: float) -> None:
        """That the segments with these values weigh what they weigh without them.

        Raises:
            ModelError: they are more than 5 % apart.
        """
        if abs(found_kg - expected_kg) > MASS_APART * expected_kg:
            raise ModelError(
                f"{self.path}: the segments hold {found_kg:.1f} kg together, expected {expected_kg:.1f} kg within "
                f"{100.0 * MASS_APART:.0f} %: the parameters are another person's, or --mass is not that of the run"
            )


def read_values(path: Path) -> FoundParameters:
    """A run's ``parameters.json``.

    Raises:
        ModelError: the file cannot be read, is none of that kind, or holds no parameters.
    """
    try:
        content = json.loads(read_bytes(path, ModelError, LARGEST_TEXT))
        entries = content["parameters"]
        values = {str(entry["name"]): float(entry["value"]) for entry in entries}
        bounds = {
            str(entry["name"]): (float(entry["lower"]), float(entry["upper"]))
            for entry in entries
            if None not in (entry.get("lower"), entry.get("upper"))
        }
        if not np.isfinite(list(values.values())).all():
            raise ValueError("a number is not finite")
        model = content.get("model")
    except (ValueError, KeyError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise ModelError(f"{path}: no parameters.json of a run ({error})") from None
    if not values:
        raise ModelError(f"{path}: holds no parameters, expected those of a run")
    return FoundParameters(path, None if model is None else str(model), values, bounds)


def settings_of_run(settings: Settings, parameters: Path) -> Settings:
    """The settings with mass, height and sex of the run's ``config.toml`` next to its parameters, where there is one.

    Raises:
        ModelError: that file is damaged. ConfigError: height or sex are given, and that run had others.
    """
    path = parameters.with_name("config.toml")
    if not is_file(path):
        return settings
    content = read_toml(path)
    run = Subject(**{key: content.get(key) for key in ("mass_kg", "height_m", "sex")})
    for key in ("height_m", "sex"):
        here, there = getattr(settings, key), getattr(run, key)
        if here is not None and here != there:
            had = f"had {there}" if there is not None else "had none given"
            raise ConfigError(
                f"{option_names(key)[0]} is {here}, but the run of {parameters} {had} ({path}); expected the same, or "
                "nothing"
            )
    known = run.model_dump(exclude_none=True)
    return settings.changed(**(known | settings.subject().model_dump(exclude_none=True)))


def of_definition(definition: OpenSimDefinition, found: FoundParameters | None, mass_kg: float | None) -> OpenSimModel:
    """The OpenSim model with masses that sum to ``mass_kg`` first, where given, and then these values.

    Raises:
        ModelError: the values are another model's or another person's.
    """
    source = definition.source if mass_kg is None else with_mass(definition.source, mass_kg)
    if found is None:
        return source
    known = {f"length/{name}" for name in definition.scales.values()}
    scale = Bounds().length_fraction
    bounds = dict.fromkeys(known, (1.0 - scale, 1.0 + scale))
    known |= {f"marker/{marker.name}" for marker in source.markers}
    known |= {f"inertia/{body.name}" for body in source.bodies}
    found.check(definition.name, known, bounds)
    model = identified(source, definition.scales, found.values)
    found.check_mass(model.mass, source.mass)
    return model


def of_initial(initial: CalibratedModel, found: FoundParameters | None) -> OpenSimModel:
    """A model that was measured on a recording, with these values.

    Raises:
        ModelError: the values are another model's or another person's.
    """
    spec = initial.spec
    bounds = {
        name: (float(low), float(high))
        for name, low, high in zip(initial.names, initial.lower, initial.upper, strict=True)
    }
    limits = {name: pair for name, pair in bounds.items() if "/" not in name}
    if found is None:
        return from_core(spec, None, limits)
    known = {f"length/{parameter.name}" for parameter in spec.parameters}
    known |= {f"marker/{marker.name}" for marker in spec.markers}
    known |= {f"inertia/{segment.name}" for segment in spec.segments}
    found.check(spec.name, known, bounds)
    model = from_core(spec, found.values, limits)
    found.check_mass(model.mass, sum(float(segment.inertia[0]) for segment in spec.segments))
    return model
