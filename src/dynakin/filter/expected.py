"""What is expected of each contact's wrench, and how surely: the plates where they bear it, else what a person can do.

A foot that no plate measures pushes, within its sole, roughly towards the pelvis, with a small free moment; how much
of the weight it bears rises and falls with its stance. That is a Gaussian about the middle of the sole, not a state:
the motion says the rest, and where it does not, the deviation says so.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.filter.contacts import RESIDUAL, ContactLoads, about_origin, carry
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet import loads as on_plates
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.recordings.feet.loads import FootLoads
from dynakin.settings.noise import Noise
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
import os, json
P = dict(pf=2.0, pm=0.5, gain=0.01, turn=0.005, shift=0.002, rf=15.0, rm=5.0, vs=0.4, v0=0.05, h=0.12, sole=0.5, nm=0.01, elsewhere=3.0, arm=0.5, wf=5.0, wm=2.0, rwf=3.0, rwm=1.0)
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
    C = F + 1
    wrench = np.zeros((T, C, 6))
    wrench[:, :F] = np.nan_to_num(np.where((contact == NO_CONTACT)[..., None], 0.0, loads.wrench))
    white = np.zeros((T, C, 6, C, 6))
    effects = np.zeros((T, 6, C, 6))
    push = np.maximum(np.abs(wrench[:, :F, 1]), on_plates.LOADED_N)
    pressure = np.stack([wrench[:, :F, 5] / push, np.zeros_like(push), -wrench[:, :F, 3] / push], axis=-1)
    plate = _plate_errors(push, pressure)
    mean, spread = _of_feet(loads, weight, root)
    for k in range(F):
        off = contact[:, k] == UNMEASURED
        white[:, k, :, k] = plate[:, k]
        white[off, k, :, k] = about_origin(np.diag([P["wf"] ** 2] * 3 + [P["wm"] ** 2] * 3), loads_sole(loads, root)[off, k])
        wrench[off, k] = mean[off, k]
        effects[off, :, k] = spread[off, k]
    frames = np.flatnonzero((contact == SHARED_PLATE).any(axis=1))
    if len(frames):
        each = spread @ np.swapaxes(spread, -1, -2)
        _divide(wrench, white, frames, contact, mean, each, plate)
    X = carry(root)
    size = np.where(undeclared[:, None], P["elsewhere"] * weight, [P["rf"]] * 3 + [P["rm"]] * 3)
    effects[:, :, F] = X * size[:, None, :]
    white[:, F, :, F] = X @ np.diag([P["rwf"] ** 2] * 3 + [P["rwm"] ** 2] * 3) @ np.swapaxes(X, -1, -2)
    names = (*loads.feet, RESIDUAL)
    pelvis = next(s.name for s in initial.spec.segments if s.parent == "ground")
    segments = (*(initial.feet[foot] for foot in loads.feet), pelvis)
    codes = np.column_stack([contact, np.full(T, ON_PLATE, dtype=np.uint8)])
    return ContactLoads(names, segments, wrench, white.reshape(T, 6 * C, 6 * C), effects.reshape(T, 6, 6 * C), codes, ~undeclared)


def loads_sole(loads: FootLoads, root: Array) -> Array:
    return np.where(np.isfinite(loads.sole), loads.sole, root[:, None] * [1.0, 0.0, 1.0])


def _plate_errors(push: Array, pressure: Array) -> Array:
    f_h = np.hypot(P["pf"], P["turn"] * push)
    f_v = np.hypot(P["pf"], P["gain"] * push)
    n = np.hypot(P["pm"], P["shift"] * push)
    variance = np.stack([f_h, f_v, f_h, n, n, n], axis=-1) ** 2
    return about_origin(variance[..., None] * np.eye(6), pressure)


def _of_feet(loads: FootLoads, weight: float, root: Array) -> tuple[Array, Array]:
    sole = loads_sole(loads, root)
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
    spread = np.zeros((*push.shape, 6, 6))
    spread[..., 1] = v[..., None] * direction
    spread[..., 0, 0] = spread[..., 2, 2] = h
    L = np.linalg.cholesky(loads.cov)
    spread[..., 3, 3], spread[..., 5, 3] = -load * L[..., 1, 0], load * L[..., 0, 0]
    spread[..., 3, 5], spread[..., 5, 5] = -load * L[..., 1, 1], load * L[..., 0, 1]
    spread[..., 4, 4] = free
    mean = push[..., None] * direction
    mean[..., 3:] += np.cross(sole, mean[..., :3])
    return mean, carry(sole) @ spread


def _divide(wrench: Array, white: Array, frames: npt.NDArray[np.intp], contact: npt.NDArray[np.uint8], mean: Array, each: Array, plate: Array) -> None:
    for t in frames:
        own = np.flatnonzero(contact[t] == SHARED_PLATE)
        S = each[t, own].sum(axis=0) + plate[t, own].max(axis=0)
        lack = wrench[t, own].sum(axis=0) - mean[t, own].sum(axis=0)
        for i in own:
            wrench[t, i] = mean[t, i] + each[t, i] @ np.linalg.solve(S, lack)
            for j in own:
                white[t, i, :, j] = (each[t, i] if i == j else 0.0) - each[t, i] @ np.linalg.solve(S, each[t, j])


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
