"""An OpenSim model laid on a recording: marker places, joints and inertia from the file, mass and posture measured."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

import dynakin._core as _core
from dynakin.errors import ModelError
from dynakin.model.calibration.body import find_mass
from dynakin.model.calibration.initial import InitialModel
from dynakin.model.calibration.pose_start import start_posture
from dynakin.model.inertia import INERTIA_NAMES
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.opensim.description import Marker, OpenSimModel
from dynakin.model.opensim.sites import sites, with_mass
from dynakin.model.opensim.skin import skin_of
from dynakin.model.opensim.spec import free_coordinates, to_spec, unseen
from dynakin.model.schema import Interval
from dynakin.model.spec import in_layout
from dynakin.model.state_priors import state_bounds, state_prior
from dynakin.recordings.frame import GroundFrame, find_ground_frame, find_laboratory_frame
from dynakin.recordings.landmarks import DEFAULT_PAIRS, FacingPairs
from dynakin.recordings.recording import Recording
from dynakin.settings.model import Bounds, Priors

Array = npt.NDArray[np.float64]

_MOST = 0.9  # a first frame shows at least this part of the markers of the fullest one
_A_TURN = 1e-3  # rad: files write pi with few digits
_MODEL_M = 0.003
"""Standard deviation of a marker for what a generic skeleton, scaled, gets wrong of a person's joints: on `squats1` the
normalised innovations are consistent with it (1.1), and far too large with the cameras' noise alone (1.9 to 18)."""
_APART_M, _LEVEL_M = 0.08, 0.03  # of markers that show which way a body points; of markers that lie beside each other
_FEET = ("calcn", "foot", "calc", "talus")  # bodies that stand on the ground, the first that a model has


def lay_on(
    definition: OpenSimDefinition,
    recording: Recording,
    ground: GroundFrame | None = None,
    *,
    static: Recording | None = None,
    vertical: str = "auto",
    forward: str | tuple[float, float, float] = "auto",
    priors: Priors | None = None,
    bounds: Bounds | None = None,
) -> InitialModel:
    """`dynakin.initialise` of an OpenSim model; arguments and errors as there. The ground is the laboratory, Y up; X is
    forward where it is asked for, or where the file holds the body so that it cannot head anywhere."""
    from dynakin.model.calibration.initialise import first_centre_of_pressure

    source, options, messages = definition.source, definition.options, list(definition.source.left_out)
    _refuse_other_gravity(source)
    find = find_laboratory_frame if source.floating else find_ground_frame
    frame = ground or find(
        recording, vertical=vertical, forward=forward, pairs=_facing_pairs(source, sites(definition, recording)[0])
    )
    messages += frame.how
    source = _of_subject(definition, [r for r in (static, recording) if r is not None], frame, messages)
    chosen, said = sites(definition, recording)
    messages += said
    if static is not None:
        messages.append("The standing trial gives the mass only: marker places are those of the OpenSim file.")
    lock = unseen(source, {marker.body for marker, _ in chosen}) if options.lock_unseen else []
    if lock:
        messages.append(f"Coordinates that move no measured marker, locked at the file's value: {', '.join(lock)}.")
    carried = _estimated_bodies(source, definition, messages)

    def spec_at(values: dict[str, float]) -> _core.ModelSpec:
        return to_spec(
            source,
            definition.scales,
            markers=[marker for marker, _ in chosen],
            estimate_inertia=carried,
            values=values,
            lock=lock,
        )

    limits = limits_of(source)
    measured = frame.points_to_ground(np.stack([recording.marker(name) for _, name in chosen], axis=1))
    first = _first_frame(measured)
    fit = start_posture(
        _core.Model(spec_at({})), measured[first], limits=limits, where=str(recording.path or recording.name)
    )
    messages.append(
        f"Start: frame {first + 1} ({recording.time[first]:.2f} s), where the model of {source.path.name} fits the "
        f"markers to {1000.0 * fit.rms_m:.0f} mm (root mean square)."
    )
    messages += _beyond_range(source, fit.coordinates)
    spec = spec_at(fit.coordinates)
    _refuse_too_few(source, spec, [name for _, name in chosen], recording)
    core = _core.Model(spec)
    names = list(core.layout.names)
    bodies = {body.name: body.rigid for body in source.bodies}
    reach = _reach(source)
    lengths = {parameter.name: 1.0 for parameter in spec.parameters}
    places = {marker.name: np.array(marker.location) for marker, _ in chosen}
    kinds = {axis.coordinate: axis.kind for s in reversed(spec.segments) for axis in reversed(s.axes)}
    intervals = state_bounds(limits, lengths, places, bodies, reach, bounds or Bounds())
    lower = in_layout(names, {name: pair[0] for name, pair in intervals.items()}, -np.inf)
    upper = in_layout(names, {name: pair[1] for name, pair in intervals.items()}, np.inf)
    x0 = np.array(core.initial_state(), dtype=float)
    table = {f"inertia/{s.name}/{k}": v for s in spec.segments for k, v in zip(INERTIA_NAMES, s.inertia, strict=True)}
    skin = np.array([skin_of(marker.name, marker.body) for marker, _ in chosen])
    known = priors or Priors()
    known = known.changed(marker_sd_m=float(np.hypot(known.marker_sd_m, fit.rms_m / np.sqrt(3.0))))
    return InitialModel(
        spec=spec,
        names=tuple(names),
        x0=np.clip(x0, lower, upper),
        sd0=in_layout(names, state_prior(kinds, lengths, places, bodies, reach, known), np.nan),
        lower=lower,
        upper=upper,
        table=in_layout(names, table, np.nan),
        marker_variance=skin[:, 0],
        soft_tissue_m=skin[:, 1],
        ground=frame,
        plate_centre=first_centre_of_pressure(recording, frame),
        recorded_markers=tuple(name for _, name in chosen),
        side="both",
        mass_kg=source.mass,
        height_m=definition.subject.height_m,
        parts={},
        messages=tuple(messages),
        plan=None,
        feet=feet_of(source),
        unmodelled_m=np.full(len(skin), _MODEL_M),
        dimensionless=frozenset(lengths),
    )


def limits_of(source: OpenSimModel) -> dict[str, Interval]:
    """Limits (rad or m) of the free coordinates; a turn that is clamped to a whole one or more has none, nor has the
    root of a body that is fixed nowhere: its ranges are those of the laboratory that the file was made in."""
    turns = {axis.coordinate for joint in source.joints for axis in joint.axes if axis.kind == "rotation"}
    found = {}
    for c in free_coordinates(source):
        low, high = (-np.inf, np.inf) if c.name in source.floating else c.limits
        found[c.name] = (-np.inf, np.inf) if c.name in turns and high - low > 2.0 * np.pi - _A_TURN else (low, high)
    return found


def _beyond_range(source: OpenSimModel, start: dict[str, float]) -> list[str]:
    """Says where the root starts beyond what the file clamps it to: OpenSim would draw it at the end of that range."""
    clamped = [c for c in free_coordinates(source) if c.name in source.floating]
    names = [c.name for c in clamped if not c.limits[0] <= start[c.name] <= c.limits[1]]
    if not names:
        return []
    return [
        f"Warning: {', '.join(names)} begin beyond the range to which {source.path.name} clamps them; OpenSim may not "
        "follow coordinates.mot there. Widen the range in the file, or give --forward: X is then the way the person "
        "faces."
    ]


def _refuse_other_gravity(source: OpenSimModel) -> None:
    x, y, z = source.gravity
    if y >= 0.0 or abs(x) + abs(z) > 1e-9:
        raise ModelError(
            f"{source.path}: gravity is {x:g} {y:g} {z:g}, expected it along -Y (the ground frame of models)"
        )


def _of_subject(
    definition: OpenSimDefinition, recordings: list[Recording], ground: GroundFrame, messages: list[str]
) -> OpenSimModel:
    """The model with the subject's mass: as told, or as the plates say, or as it stands in the file."""
    source = definition.source
    if not definition.options.scale_masses:
        messages.append(f"Mass {source.mass:.2f} kg: the OpenSim file's.")
        return source
    try:
        mass, how = find_mass(definition.subject, [SimpleNamespace(recording=r, ground=ground) for r in recordings])
    except ModelError:
        messages.append(f"Mass {source.mass:.2f} kg: the OpenSim file's, as neither told nor measured.")
        return source
    messages.append(how)
    messages.append(f"Masses and inertias of the OpenSim file ({source.mass:.2f} kg) times {mass / source.mass:.3f}.")
    return with_mass(source, mass)


def _estimated_bodies(source: OpenSimModel, definition: OpenSimDefinition, messages: list[str]) -> list[str]:
    """Bodies whose ten numbers are estimated; says which are not."""
    heavy = [b for b in source.bodies if b.mass > 0.0 and b.mass >= definition.options.lightest_share * source.mass]
    impossible = [body.name for body in heavy if not body.rigid.possible()]
    if impossible:
        messages.append(f"Inertia of {', '.join(impossible)} belongs to no real body in the file: not estimated.")
    chosen = [body.name for body in heavy if body.name not in impossible]
    kept = [body.name for body in source.bodies if body.name not in (*chosen, *impossible)]
    if kept:
        share = 100.0 * definition.options.lightest_share
        messages.append(f"Inertia of bodies below {share:g} % of the mass is the file's: {', '.join(kept)}.")
    return chosen


def _refuse_too_few(source: OpenSimModel, spec: _core.ModelSpec, names: list[str], recording: Recording) -> None:
    """Markers that measure less than the coordinates say nothing of a posture."""
    free = sum(not coordinate.locked for coordinate in spec.coordinates)
    if 3 * len(names) < free:
        raise ModelError(
            f"{recording.path or recording.name}: {len(names)} of the {len(source.markers)} markers of "
            f"{source.path.name} are there ({', '.join(names)}), expected at least {-(-free // 3)} for its {free} free "
            "coordinates: name them alike"
        )


def _first_frame(measured: Array) -> int:
    """The first frame that shows nearly as many markers as the fullest."""
    seen = np.isfinite(measured).all(axis=2).sum(axis=1)
    return int(np.flatnonzero(seen >= _MOST * seen.max())[0])


def _reach(source: OpenSimModel) -> dict[str, float]:
    """Length that a body's first moments are compared with: to the furthest joint on it, else twice to its centre."""
    found = {body.name: 2.0 * float(np.linalg.norm(body.centre)) for body in source.bodies}
    for name in found:
        joints = [
            float(np.linalg.norm(np.array(joint.parent_offset.translation)))
            for joint in source.joints
            if joint.parent == name
        ]
        found[name] = max([found[name], *joints])
    return found


def _facing_pairs(source: OpenSimModel, chosen: Sequence[tuple[Marker, str]]) -> FacingPairs:
    """Recorded markers that lie behind each other on feet and pelvis: bodies of OpenSim's models have X forward."""

    def on(body: str) -> list[tuple[float, float, str]]:
        return sorted((m.location[0], m.location[2], name) for m, name in chosen if m.body == body)

    def ends(body: str) -> list[tuple[str, str]]:
        """Backmost and foremost; of each side, where there are several."""
        places = on(body)
        if not places or places[-1][0] - places[0][0] < _APART_M:
            return []
        back = sorted((z, name) for x, z, name in places if x - places[0][0] < _LEVEL_M)
        front = sorted((z, name) for x, z, name in places if places[-1][0] - x < _LEVEL_M)
        return [(back[0][1], front[0][1]), (back[-1][1], front[-1][1])]

    feet = [pair for body in feet_of(source).values() for pair in ends(body)]
    pelvis = [pair for body in source.bodies if "pelvis" in body.name.casefold() for pair in ends(body.name)]
    return FacingPairs((*feet, *DEFAULT_PAIRS.heel_toe), (*pelvis, *DEFAULT_PAIRS.pelvis))


def feet_of(source: OpenSimModel) -> dict[str, str]:
    """ "right" and "left" -> the body that stands on the ground, where the names tell."""
    names = [body.name for body in source.bodies]
    for word in _FEET:
        pair = {
            side: name
            for side, ends in (("right", ("_r", "r_", "right")), ("left", ("_l", "l_", "left")))
            for name in names
            if word in name.casefold()
            and any(name.casefold().endswith(e) or name.casefold().startswith(e) for e in ends)
        }
        if len(pair) == 2:
            return pair
    return {}
