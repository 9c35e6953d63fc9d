"""A model as an .osim file, with what a run found where asked: scales, marker places, masses, inertias."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from dynakin.errors import ConfigError
from dynakin.files import is_file
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.identified import RunConstants
from dynakin.model.inertia import INERTIA_NAMES, RigidBody, inertia_from
from dynakin.model.opensim.chains import grows
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.opensim.description import Body, Joint, JointAxis, Marker, Offset, OpenSimModel, Vector
from dynakin.model.opensim.from_core import from_core
from dynakin.model.opensim.functions import joined, polynomial
from dynakin.model.opensim.sites import with_mass
from dynakin.settings.model import Bounds
from dynakin.settings.settings import Settings, option_names
from dynakin.settings.strict import read_toml
from dynakin.settings.subject import Subject

_HEIGHT_M = 0.006
"""A height that a run measured is shown in centimetres."""


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
        same = here == there or (key == "height_m" and None not in (here, there) and abs(here - there) < _HEIGHT_M)
        if here is not None and not same:
            words = f"{there:.3f}" if isinstance(there, float) else there
            had = f"had {words}" if there is not None else "had none given"
            raise ConfigError(
                f"{option_names(key)[0]} is {here}, but the run of {parameters} {had} ({path}); expected the same, or "
                "nothing"
            )
    known = run.model_dump(exclude_none=True)
    return settings.changed(**(known | settings.subject().model_dump(exclude_none=True)))


def of_definition(definition: OpenSimDefinition, found: RunConstants | None, mass_kg: float | None) -> OpenSimModel:
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


def of_initial(initial: CalibratedModel, found: RunConstants | None) -> OpenSimModel:
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


def identified(model: OpenSimModel, scales: Mapping[str, str], values: Mapping[str, float]) -> OpenSimModel:
    """The same model with values by the core's names (``length/scale_femur``, ``marker/r_knee/x``,
    ``inertia/femur_r/mass``); what is not among them stays.

    Args:
        scales: scale parameter of each body that has one, as when the values were found.
    """

    def scale(body: str) -> float:
        return float(values.get(f"length/{scales[body]}", 1.0)) if body in scales else 1.0

    return replace(
        model,
        bodies=tuple(_body(body, values) for body in model.bodies),
        joints=tuple(_joint(joint, scale(joint.parent), scale(joint.child)) for joint in model.joints),
        markers=tuple(_marker(marker, values) for marker in model.markers),
    )


def _body(body: Body, values: Mapping[str, float]) -> Body:
    names = [f"inertia/{body.name}/{name}" for name in INERTIA_NAMES]
    if not any(name in values for name in names):
        return body
    return Body.of(body.name, RigidBody.from_vector(inertia_from(values, body.name, body.rigid.vector)))


def _joint(joint: Joint, parent: float, child: float) -> Joint:
    if parent == 1.0 and child == 1.0:
        return joint
    return replace(
        joint,
        parent_offset=_offset(joint.parent_offset, parent),
        child_offset=_offset(joint.child_offset, child),
        axes=tuple(_axis(axis, parent) for axis in joint.axes),
    )


def _offset(offset: Offset, factor: float) -> Offset:
    x, y, z = offset.translation
    return replace(offset, translation=(factor * x, factor * y, factor * z))


def _axis(axis: JointAxis, factor: float) -> JointAxis:
    if not grows(axis):
        return axis
    return replace(axis, functions=joined([*axis.functions, polynomial(0.0, factor)]))


def _marker(marker: Marker, values: Mapping[str, float]) -> Marker:
    place: Vector = (
        float(values.get(f"marker/{marker.name}/x", marker.location[0])),
        float(values.get(f"marker/{marker.name}/y", marker.location[1])),
        float(values.get(f"marker/{marker.name}/z", marker.location[2])),
    )
    return replace(marker, location=place)
