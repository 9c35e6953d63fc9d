"""Measures a model on a recording, as the paper does: lengths and marker places from the first (or standing)
frames, inertia from the table, coordinates from the landmarks."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.model.calibration.initial import InitialModel
from dynakin.model.calibration.measure import measure
from dynakin.model.definition import Definition
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.schema import ModelFile
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Recording
from dynakin.settings.model import Bounds, Priors

Array = npt.NDArray[np.float64]

_LOADED_N = 20.0  # a lesser load has no centre of pressure worth the name


def initialise(
    definition: Definition,
    recording: Recording,
    ground: GroundFrame | None = None,
    *,
    static: Recording | None = None,
    side: str = "auto",
    vertical: str = "auto",
    forward: str | tuple[float, float, float] = "auto",
    priors: Priors | None = None,
    bounds: Bounds | None = None,
) -> InitialModel:
    """Fill a model with what a recording tells of the person; an OpenSim model brings its own lengths and places.

    Args:
        ground: directions of the ground frame; found in the recording (``vertical``, ``forward``) where not
            given. Its origin is replaced by the model's ground landmark.
        static: a recording of the same person and markers, standing; lengths and marker places come from it.
        side: limb markers of a lumped model: "right", "left", "both" (separate sites), "auto" (fewest gaps,
            right on a tie).
        priors, bounds: other numbers than the defaults of ``dynakin.settings.model``.

    Raises:
        ModelError: the model, the markers and the recording do not fit; one line says what was found and
            expected.
    """
    if isinstance(definition, OpenSimDefinition):
        from dynakin.model.opensim.initial import lay_on

        return lay_on(
            definition,
            recording,
            ground,
            static=static,
            vertical=vertical,
            forward=forward,
            priors=priors,
            bounds=bounds,
        )
    plan, rest = measure(definition, recording, ground, static=static, side=side, vertical=vertical, forward=forward)
    import dynakin._core as _core
    from dynakin.model.spec import in_layout, to_core

    messages, speeds = list(rest.messages), dict[str, float]()
    if plan.model.sided:
        from dynakin.model.calibration.in_space import started

        begun = started(plan, rest.trial, rest.unplaced, rest.still)
        plan, speeds = begun.plan, begun.speeds
        messages += begun.messages
    spec = to_core(plan)
    core = _core.Model(spec)
    names = list(core.layout.names)
    limits = plan.bounds(bounds or Bounds())
    x0 = np.array(core.initial_state(), dtype=float)
    for at, name in enumerate(names):
        if name.endswith("/speed"):
            x0[at] = speeds.get(name.removesuffix("/speed"), x0[at])
    lower = in_layout(names, {name: pair[0] for name, pair in limits.items()}, -np.inf)
    upper = in_layout(names, {name: pair[1] for name, pair in limits.items()}, np.inf)
    outside = (x0 < lower) | (x0 > upper)
    for k in np.flatnonzero(outside):
        messages.append(
            f"Start of {names[k]} ({x0[k]:.3f}) lies beyond its bounds {lower[k]:.3f} to {upper[k]:.3f}: "
            "put on the bound."
        )
    return InitialModel(
        spec=spec,
        names=tuple(names),
        x0=np.clip(x0, lower, upper),
        sd0=in_layout(names, plan.prior(priors or Priors()), np.nan),
        lower=lower,
        upper=upper,
        table=in_layout(names, plan.table_values(), np.nan),
        marker_variance=np.array([site.variance for site in plan.sites]),
        soft_tissue_m=np.array([site.soft_tissue_m for site in plan.sites]),
        ground=rest.ground,
        plate_centre=first_centre_of_pressure(recording, rest.ground),
        recorded_markers=tuple(site.recorded for site in plan.sites),
        side=rest.side,
        mass_kg=rest.mass_kg,
        height_m=rest.height_m,
        parts=rest.parts,
        messages=tuple(messages),
        plan=plan,
        feet=feet_of(plan.model),
    )


def feet_of(model: ModelFile) -> dict[str, str]:
    """Foot -> segment that carries it, of a model whose sides are apart."""
    return {s.side: s.name for s in model.segments if s.side is not None and "foot" in s.parts}


def first_centre_of_pressure(recording: Recording, ground: GroundFrame) -> Array:
    """Mean centre of pressure (3,) m of the first second, on the ground (y = 0), ground frame; 0 without plates."""
    if not recording.plates:
        return np.zeros(3)
    wrench = ground.wrench_to_ground(recording.total_wrench())
    wrench = wrench[recording.time < recording.time[0] + 1.0]
    loaded = wrench[np.isfinite(wrench).all(axis=1) & (wrench[:, 1] > _LOADED_N)]
    if not len(loaded):
        return np.zeros(3)
    force, moment = loaded[:, 1].mean(), loaded[:, 3:].mean(axis=0)
    return np.array([moment[2] / force, 0.0, -moment[0] / force])
