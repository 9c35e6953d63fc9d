"""What is expected of each contact's wrench, and how surely: the plates where they bear it, else what a person can do.

A foot that no plate measures pushes, within its sole, roughly towards the pelvis, with a small free moment; how much
of the weight it bears rises and falls with its stance. That is a Gaussian about the middle of the sole, not a state:
the motion says the rest, and where it does not, the deviation says so.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.filter.contacts import RESIDUAL, ContactLoads, about_origin
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet import loads as on_plates
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.recordings.feet.loads import FootLoads
from dynakin.settings.noise import Noise
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
import os, json
P = dict(pf=2.0, pm=0.5, gain=0.01, turn=0.005, shift=0.002, rf=15.0, rm=5.0, vs=0.4, v0=0.05, h=0.12, sole=0.5, nm=0.01, elsewhere=3.0, arm=0.5)
P.update(json.loads(os.environ.get("SPIKE", "{}")))

_CONTACT = {
    on_plates.SWING: NO_CONTACT,
    on_plates.MEASURED: ON_PLATE,
    on_plates.SHARED: SHARED_PLATE,
    on_plates.OFF_PLATE: UNMEASURED,
    on_plates.UNKNOWN: UNMEASURED,
}


def expected_loads(loads: FootLoads, initial: CalibratedModel, noise: Noise, root: Array, undeclared: Flags) -> ContactLoads:
    weight = initial.weighed_kg * GRAVITY_M_S2
    contact = np.vectorize(_CONTACT.get, otypes=[np.uint8])(loads.reason)
    T, F = contact.shape
    wrench = np.nan_to_num(np.where((contact == NO_CONTACT)[..., None], 0.0, loads.wrench))
    each = np.zeros((T, F, 6, 6))
    each[:] = np.eye(6)
    measured = contact == ON_PLATE
    push = np.maximum(np.abs(wrench[..., 1]), on_plates.LOADED_N)
    pressure = np.stack([wrench[..., 5] / push, np.zeros_like(push), -wrench[..., 3] / push], axis=-1)
    plate = _plate_errors(push, pressure)
    each[measured] = plate[measured]
    priors_used = P.get('use', 1)
    priors = (contact == UNMEASURED) | (contact == SHARED_PLATE)
    if priors.any() and hasattr(loads, "sole"):
        mean, covariance = _of_feet(loads, weight, root)
        mean_u = np.where((contact == UNMEASURED)[..., None], mean, wrench)
        wrench_prior = np.where(priors[..., None], mean, wrench)
        each[priors] = covariance[priors]
    joint = np.zeros((T, F + 1, 6, F + 1, 6))
    for k in range(F):
        joint[:, k, :, k] = each[:, k]
    total = np.concatenate([wrench, np.zeros((T, 1, 6))], axis=1)
    if priors.any() and hasattr(loads, "sole"):
        total[:, :F] = np.where((contact == UNMEASURED)[..., None], mean, wrench)
        frames = np.flatnonzero((contact == SHARED_PLATE).any(axis=1))
        if len(frames):
            _divide(total, joint, frames, contact, mean, plate)
    residual = np.diag([P["rf"] ** 2] * 3 + [P["rm"] ** 2] * 3)
    r = np.where(undeclared[:, None, None], np.diag([(P["elsewhere"] * weight) ** 2] * 6), residual)
    joint[:, F, :, F] = about_origin(r, root)
    names = (*loads.feet, RESIDUAL)
    pelvis = next(s.name for s in initial.spec.segments if s.parent == "ground")
    segments = (*(initial.feet[foot] for foot in loads.feet), pelvis)
    if not hasattr(loads,'sole'): each
    codes = np.column_stack([contact, np.full(T, ON_PLATE, dtype=np.uint8)])
    return ContactLoads(names, segments, total, joint.reshape(T, 6 * F + 6, 6 * F + 6), codes, ~undeclared & (True if priors_used else loads.total_known))


def _plate_errors(push: Array, pressure: Array) -> Array:
    f_h = np.hypot(P["pf"], P["turn"] * push)
    f_v = np.hypot(P["pf"], P["gain"] * push)
    n = np.hypot(P["pm"], P["shift"] * push)
    variance = np.stack([f_h, f_v, f_h, n, n, n], axis=-1) ** 2
    return about_origin(variance[..., None] * np.eye(6), pressure)


def _of_feet(loads: FootLoads, weight: float, root: Array) -> tuple[Array, Array]:
    sole = np.where(np.isfinite(loads.sole), loads.sole, root[:, None] * [1.0, 0.0, 1.0])
    to_root = root[:, None] - sole
    slope = to_root[..., [0, 2]] / np.maximum(to_root[..., [1]], 0.3)
    share = loads.stance / np.maximum(loads.stance.sum(axis=1, keepdims=True), 1.0)
    push = weight * share
    direction = np.zeros((*push.shape, 6))
    direction[..., 0], direction[..., 1], direction[..., 2] = slope[..., 0], 1.0, slope[..., 1]
    v = weight * (P["v0"] + P["vs"] * loads.stance)
    h = P["h"] * v / (P["vs"] + P["v0"])
    arm = P["sole"] * loads.sole_half_m.max(axis=1)
    load = v / (P["vs"] + P["v0"])
    n = arm * load
    free = P["nm"] * load
    own = np.stack([h, np.zeros_like(h), h, n, free, n], axis=-1) ** 2
    covariance = v[..., None, None] ** 2 * direction[..., :, None] * direction[..., None, :] + own[..., None] * np.eye(6)
    mean = push[..., None] * direction
    covariance = about_origin(covariance, sole)
    mean[..., 3:] += np.cross(sole, mean[..., :3])
    return mean, covariance


def _divide(total: Array, joint: Array, frames: npt.NDArray[np.intp], contact: npt.NDArray[np.uint8], mean: Array, plate: Array) -> None:
    F = contact.shape[1]
    for t in frames:
        own = np.flatnonzero(contact[t] == SHARED_PLATE)
        measured = total[t, own].sum(axis=0)
        S = joint[t, own, :, own].sum(axis=0) + plate[t, own].max(axis=0)
        lack = measured - mean[t, own].sum(axis=0)
        blocks = joint[t, own, :, own].copy()
        solved = np.linalg.solve(S, blocks.transpose(1, 0, 2).reshape(6, -1)).reshape(6, len(own), 6)
        for a, i in enumerate(own):
            total[t, i] = mean[t, i] + blocks[a] @ np.linalg.solve(S, lack)
            for b, j in enumerate(own):
                joint[t, i, :, j] -= blocks[a] @ solved[:, b]


def root_path(initial: CalibratedModel, markers: Array) -> Array:
    """(T, 3) m: middle of the root segment's markers, held or led over gaps."""
    root = next(s.name for s in initial.spec.segments if s.parent == "ground")
    own = [k for k, marker in enumerate(initial.spec.markers) if marker.segment == root]
    with np.errstate(invalid="ignore"):
        path = np.nanmean(markers[:, own or slice(None)], axis=1)
    for axis in range(3):
        seen = np.isfinite(path[:, axis])
        path[:, axis] = np.interp(np.arange(len(path)), np.flatnonzero(seen), path[seen, axis]) if seen.any() else 0.0
    return path
