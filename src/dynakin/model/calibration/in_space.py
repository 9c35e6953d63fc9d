"""What a model in space needs of the core when it is measured: its posture in the trial, markers seen later, and which
coordinates the markers show at all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.linalg

from dynakin.arrays import Array, rms
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.messages import Message, note
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.pose_start import PoseFit, near, start_posture
from dynakin.model.calibration.sites import Candidate, site_of
from dynakin.model.plan import Geometry, ModelPlan, Site
from dynakin.model.schema import Interval, kinds_of
from dynakin.model.spec import free_names, to_core

_SEEN = 0.6
"""Share of the markers that a frame must show to start from it."""
_SPEED_FRAMES, _SPEED_S = 9, 0.1
"""Frames from which the first speeds are taken, and the time that they may span."""
_AVERAGED, _TURNS = 20, 3
"""Frames over which marker places are averaged, and how often: the third turn gains 1 to 3 % more."""
_FAIR_M = 0.03
"""Skin moves so far in a deep squat: a fit as good as that has not gone astray."""
_FRAMES = 5
"""Frames on which a marker is placed that the calibration does not show, and by which it is judged what they show."""


@dataclass(frozen=True)
class Started:
    """A plan that stands where the trial begins, and the speeds (rad/s, m/s) of its coordinates there."""

    plan: ModelPlan
    speeds: dict[str, float]
    messages: list[Message]
    held: dict[str, str]  # coordinates that are locked because the markers do not show them, and why


def started(plan: ModelPlan, trial: MarkedTrial, unplaced: tuple[Candidate, ...], still: bool) -> Started:
    """The plan with its coordinates fitted to the trial's first frame, and with the markers seen only later.

    Args:
        still: the marker places were measured on a person who stood still. Where not, they are averaged over the trial:
            the first frames of a step show skin and feet as they are at that instant only.

    Raises:
        ModelError: no frame shows enough markers, or they do not fit the model.
    """
    limits = {c.name: c.limits for c in plan.model.coordinates if np.isfinite(c.limits).any()}
    messages: list[Message] = []
    paths = _paths(trial, plan.sites)
    model = _core.Model(to_core(plan))
    extra: list[Site] = []
    for candidate in unplaced:
        path = trial.ground.points_to_ground(trial.recording.marker(candidate.recorded))
        both = np.flatnonzero(np.isfinite(path).all(axis=1) & _enough(paths))
        if not len(both):
            messages.append(
                note(
                    "calibration", f"Marker {candidate.recorded} left out: never seen together with most of the others."
                )
            )
            continue
        k = model.segment_names.index(candidate.segment)
        found = []
        for frame in _spread(both, _FRAMES):
            fit = start_posture(model, paths[frame], limits=limits, good_m=_FAIR_M, where=trial.match.where)
            R, p = _core.segment_poses(model, fit.x)
            found.append(R[k].T @ (path[frame] - p[k]))
        extra.append(site_of(candidate, np.median(found, axis=0), in_space=True))
        messages.append(
            note(
                "calibration",
                f"Marker {candidate.recorded} is not seen in the calibration frames: placed from later ones.",
            )
        )
    if extra:
        plan = replace(plan, sites=(*plan.sites, *extra))
        model, paths = _core.Model(to_core(plan)), _paths(trial, plan.sites)
    usable = np.flatnonzero(_enough(paths))
    if not len(usable):
        raise ModelError(f"{trial.match.where}: no frame shows {100 * _SEEN:.0f} % of the {len(plan.sites)} markers")
    plan, held = hold_unseen(plan, _postures(model, paths, limits))
    if held:
        names = ", ".join(held)
        messages.append(note("calibration", f"Held where they stand, because the markers do not show them: {names}."))
        model = _core.Model(to_core(plan))
    if not still:
        plan, how = _averaged(plan, paths, limits)
        model = _core.Model(to_core(plan))
        messages += how
    first = int(usable[0])
    messages += trial.late_start(first)
    fit = start_posture(model, paths[first], limits=limits, where=trial.match.where)
    messages.append(
        note(
            "details",
            f"Start: all coordinates fitted to the markers, {1000.0 * fit.rms_m:.1f} mm (root mean square).",
        )
    )
    speeds = _speeds(model, paths, trial, first, fit, limits)
    return Started(replace(plan, start=fit.coordinates), speeds, messages, held)


def _postures(model: _core.Model, paths: Array, limits: dict[str, Interval]) -> list[Array]:
    """States fitted to some frames that show enough markers."""
    found: list[Array] = []
    for frame in _spread(np.flatnonzero(_enough(paths)), _FRAMES):
        guess = found[-1] if found else None
        fit = start_posture(model, paths[frame], guess=guess, limits=limits, good_m=_FAIR_M, bad_m=np.inf, where="")
        found.append(fit.x)
    return found


def _averaged(plan: ModelPlan, paths: Array, limits: dict[str, Interval]) -> tuple[ModelPlan, list[Message]]:
    """Marker places as their mean over frames of the trial, postures fitted and places averaged by turns."""
    frames = _spread(np.flatnonzero(_enough(paths)), _AVERAGED)
    fit_mm: list[float] = []
    states: dict[int, Array] = {}
    for _ in range(_TURNS):
        model = _core.Model(to_core(plan))
        fits, found, last = [], [], None
        for frame in frames.tolist():
            if frame in states:  # places move by millimetres from turn to turn
                fit = near(model, states[frame], paths[frame], limits)
            else:
                fit = start_posture(
                    model, paths[frame], guess=last, limits=limits, good_m=_FAIR_M, bad_m=np.inf, where=""
                )
            states[frame] = last = fit.x
            R, p = _core.segment_poses(model, fit.x)
            on = [model.segment_names.index(site.segment) for site in plan.sites]
            found.append([R[s].T @ (paths[frame, k] - p[s]) for k, s in enumerate(on)])
            fits.append(fit.rms_m)
        fit_mm.append(1000.0 * float(rms(fits)))
        places = np.array(found)
        seen = [places[np.isfinite(places[:, k]).all(axis=1), k] for k in range(len(plan.sites))]
        means = [own.mean(axis=0) if len(own) else None for own in seen]
        plan = replace(
            plan,
            sites=tuple(
                site if mean is None else replace(site, position=mean)
                for site, mean in zip(plan.sites, means, strict=True)
            ),
        )
    text = (
        f"Marker places: averaged over {len(frames)} frames of the trial, in {_TURNS} turns (rigid fit "
        f"{fit_mm[0]:.1f} mm before, {fit_mm[-1]:.1f} mm in the last turn)."
    )
    return plan, [note("details", text)]


def _speeds(
    model: _core.Model, paths: Array, trial: MarkedTrial, first: int, fit: PoseFit, limits: dict[str, Interval]
) -> dict[str, float]:
    """Rates of the coordinates at the first frame, by a parabola through the next ones; people start in mid-stride."""
    time = trial.recording.time
    frames = [k for k in range(first, min(first + _SPEED_FRAMES, len(time))) if np.isfinite(paths[k]).any()]
    frames = [k for k in frames if time[k] - time[first] <= _SPEED_S]
    if len(frames) < 4:
        return {}
    values = [fit.coordinates]
    for frame in frames[1:]:
        fit = near(model, fit.x, paths[frame], limits)
        values.append(fit.coordinates)
    t = time[frames] - time[first]
    powers = np.stack([np.ones_like(t), t, t**2], axis=1)
    table = np.array([[value[name] for name in fit.coordinates] for value in values])
    slopes = np.linalg.lstsq(powers, table, rcond=None)[0][1]
    return dict(zip(fit.coordinates, map(float, slopes), strict=True))


def _spread(frames: npt.NDArray[np.intp], most: int) -> npt.NDArray[np.intp]:
    """At most so many of the frames, evenly from the first to the last."""
    return frames[np.unique(np.linspace(0, len(frames) - 1, most).astype(int))] if len(frames) else frames


def _paths(trial: MarkedTrial, sites: tuple[Site, ...]) -> Array:
    recorded = [trial.recording.marker(site.recorded) for site in sites]
    return trial.ground.points_to_ground(np.stack(recorded, axis=1))


def _enough(paths: Array) -> npt.NDArray[np.bool_]:
    seen = np.isfinite(paths).all(axis=2)
    return np.asarray(np.count_nonzero(seen, axis=1) >= max(3, _SEEN * paths.shape[1]))


MARKER_SD_M, LOOSE_SD_M, LOOSE_FROM_M = 0.005, 0.015, 0.020
"""Skin with noise; and of what moves by 20 mm or more, such as joint centres that cameras guess."""
PRIOR_SD_RAD, PRIOR_SD_M = np.deg2rad(60.0), 1.0
"""Of each coordinate, before any marker."""
HELD_SD_RAD = 0.2
"""From this deviation on, of the median frame, a coordinate is held: a lever of 25 mm. The least that sets of the field
show is a forearm by two markers at its wrist (0.14); by joint centres alone the trunk on the pelvis has 0.22 to 0.3."""
_ALIKE_RAD = np.deg2rad(5.0)


def hold_unseen(plan: ModelPlan, postures: list[Array]) -> tuple[ModelPlan, dict[str, str]]:
    """The plan with the coordinates locked where they stand that its markers do not show, and why, by coordinate.

    Of several that can stand for each other the one furthest from the root is held first. Coordinates of the root
    never are: something moves the body. All markers count, also those that some frames miss: what is not seen for a
    time is the filter's to hold.

    Args:
        postures: states (n,) of the plan's model at some frames.
    """
    held: dict[str, str] = {}
    depth = _depths(plan)
    kinds = kinds_of(plan.model.segments)
    model = _core.Model(to_core(plan))
    free = free_names(model.spec)
    loose = np.array([site.soft_tissue_m >= LOOSE_FROM_M for site in plan.sites])
    sd_m = np.repeat(np.where(loose, LOOSE_SD_M, MARKER_SD_M), 3)
    jacobians = [_core.marker_jacobian(model, x)[:, : len(free)] / sd_m[:, None] for x in postures]
    prior = np.array([PRIOR_SD_RAD if kinds[name] == "rotation" else PRIOR_SD_M for name in free])
    kept = np.ones(len(free), dtype=bool)
    while True:
        sd = np.median([_deviations(J[:, kept], prior[kept]) for J in jacobians], axis=0)
        names = [name for name, keep in zip(free, kept, strict=True) if keep]
        worst = [
            (round(value / _ALIKE_RAD), depth[name], name)
            for value, name in zip(sd, names, strict=True)
            if value > HELD_SD_RAD and depth[name] > 0 and kinds[name] == "rotation"
        ]
        if not worst:
            break
        name = max(worst)[2]
        kept[free.index(name)] = False
        held[name] = "the markers do not show it"
    if not held:
        return plan, held
    geometry = plan.geometry
    locked = {**geometry.locked, **{name: plan.start[name] for name in held}}
    return replace(plan, geometry=Geometry(geometry.lengths, geometry.directions, locked)), held


def _deviations(J: Array, prior: Array) -> Array:
    """Standard deviations (n,) of each coordinate with the others free, from rows that are in units of theirs."""
    root = np.linalg.cholesky(J.T @ J + np.diag(prior**-2.0))
    spread = scipy.linalg.solve_triangular(root, np.eye(len(root)), lower=True)  # its square is the inverse
    return np.asarray(np.linalg.norm(spread, axis=0))


def _depths(plan: ModelPlan) -> dict[str, int]:
    """How many joints each coordinate's first one is away from the root's."""
    deep = {"ground": -1}
    found: dict[str, int] = {}
    for segment in plan.model.segments:
        deep[segment.name] = deep[segment.parent] + 1
        for axis in segment.axes:
            found.setdefault(axis.coordinate, deep[segment.name])
    return found
