"""What a model in space needs of the core when it is measured: its posture in the trial, markers seen later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from dynakin import _core
from dynakin.errors import ModelError
from dynakin.model.frames import Trial
from dynakin.model.plan import ModelPlan, Site
from dynakin.model.pose_start import start_posture
from dynakin.model.sites import Candidate, site_of
from dynakin.model.spec import to_core

Array = npt.NDArray[np.float64]

_SEEN = 0.6
"""Share of the markers that a frame must show to start from it."""
_FRAMES = 5
"""Frames on which a marker is placed that the calibration does not show."""


def started(plan: ModelPlan, trial: Trial, unplaced: tuple[Candidate, ...]) -> tuple[ModelPlan, list[str]]:
    """The plan with its coordinates fitted to the trial's first frame, and with the markers seen only later.

    Raises:
        ModelError: no frame shows enough markers, or they do not fit the model.
    """
    limits = {c.name: c.limits for c in plan.model.coordinates if np.isfinite(c.limits).any()}
    messages: list[str] = []
    paths = _paths(trial, plan.sites)
    model = _core.Model(to_core(plan))
    extra: list[Site] = []
    for candidate in unplaced:
        path = trial.ground.points_to_ground(trial.recording.marker(candidate.recorded))
        both = np.flatnonzero(np.isfinite(path).all(axis=1) & _enough(paths))
        if not len(both):
            messages.append(f"Marker {candidate.recorded} left out: never seen together with most of the others.")
            continue
        chosen = both[np.unique(np.linspace(0, len(both) - 1, _FRAMES).astype(int))]
        k = model.segment_names.index(candidate.segment)
        found = []
        for frame in chosen:
            fit = start_posture(model, paths[frame], limits=limits, where=trial.match.where)
            R, p = _core.segment_poses(model, fit.x)
            found.append(R[k].T @ (path[frame] - p[k]))
        extra.append(site_of(candidate, np.median(found, axis=0)))
        messages.append(f"Marker {candidate.recorded} is not seen in the calibration frames: placed from later ones.")
    if extra:
        plan = replace(plan, sites=(*plan.sites, *extra))
        model, paths = _core.Model(to_core(plan)), _paths(trial, plan.sites)
    usable = np.flatnonzero(_enough(paths))
    if not len(usable):
        raise ModelError(f"{trial.match.where}: no frame shows {100 * _SEEN:.0f} % of the {len(plan.sites)} markers")
    first = int(usable[0])
    if first > 0:
        messages.append(f"Start from frame {first} ({trial.recording.time[first]:.2f} s): markers are missing before.")
    fit = start_posture(model, paths[first], limits=limits, where=trial.match.where)
    messages.append(f"Start: all coordinates fitted to the markers, {1000.0 * fit.rms_m:.1f} mm (root mean square).")
    return replace(plan, start=fit.coordinates), messages


def _paths(trial: Trial, sites: tuple[Site, ...]) -> Array:
    recorded = [trial.recording.marker(site.recorded) for site in sites]
    return trial.ground.points_to_ground(np.stack(recorded, axis=1))


def _enough(paths: Array) -> npt.NDArray[np.bool_]:
    seen = np.isfinite(paths).all(axis=2)
    return np.asarray(np.count_nonzero(seen, axis=1) >= max(3, _SEEN * paths.shape[1]))
