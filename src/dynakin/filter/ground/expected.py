"""What is expected of each contact's wrench, and how surely: by the plates where they bear it, else by what people do.

A foot that no plate measures pushes, from within its sole, roughly towards the trunk, with a small free moment; how
much of the weight it bears rises and falls with its stance. What is not known of that are six numbers of unit variance
which last for some tenths of a second: states of the filter, so that the motion decides them where it can, smoothly,
and their deviations say how far it does (docs/derivations.md, section 15).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.linalg

from dynakin.arrays import Array, Flags, filled, mean_seen
from dynakin.filter.contacts import RESIDUAL, ContactLoads, carry
from dynakin.filter.ground.gain import SENSOR_M
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.plate_errors import NO_ERRORS, NOISE_N, NOISE_NM, PlateErrors
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet import loads as on_plates
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.plates.pressure import free_moments, pressed_at
from dynakin.recordings.pushes import LOADED_N
from dynakin.settings.contacts import SEAT
from dynakin.settings.noise import Noise
from dynakin.units import GRAVITY_M_S2

PLATE_GAIN, PLATE_TURN_RAD, PLATE_PLACE_M = 0.01, 0.005, 0.002
"""Errors that grow with the load: of a plate's gain, how it lies turned, and where it lies."""
PUSH_SD, PUSH_LEAST_SD = 0.4, 0.05
"""Part of the weight by which a foot's push may differ from its share of it, in full stance and at its ends."""
ALONE_SD, ALONE_LOAD = 1.5, 1.5
"""The same push in full stance, and the load by which shear and moments go, of a foot that is the only contact without
a plate: the motion says what it bears, in running up to 3 times the weight, and a prior would be in its way."""
HANDED_OVER_S = 0.05
"""By how much later or earlier than expected the load may pass from foot to foot, which lasts some 0.13 s."""
PIVOT_M = 0.2
"""How far over the middle of the pelvis' markers the line of the push passes in walking (Maus et al. 2010, Nat Commun
1:70; Gruben & Boehm 2012, Hum Mov Sci 31:649-659). By the plates of the walks at hand 0.15 to 0.33 m, across 0.24 to
0.85 m; in squats it is steeper still, in running it points to the pelvis."""
SHEAR_SD = 0.08
"""The same of its force across that line: three times what walks have, twice squats."""
FREE_MOMENT_M = 0.01
"""Free moment over push: 5 to 10 N m of a grown person's foot."""
UNDECLARED_SD = 3.0
"""Part of the weight, and as many metres of it, that something undeclared may bear: as good as anything."""
SEAT_MEAN, SEAT_SD = np.array([0.0, 0.4, 0.0]), np.array([0.1, 0.4, 0.1])
"""Parts of the weight: forwards, upwards, to the right."""
SEAT_MOMENT_M = np.array([0.06, 0.02, 0.06])
"""Moment over the weight: a centre of pressure within 0.12 m of half of it."""
BELOW_PELVIS_M = 0.2
"""How far below the middle of the pelvis' markers it acts: those are a hand's breadth above the hips."""
HAND_SD, HAND_MOMENT_M = np.full(3, 0.2), np.full(3, 0.02)
"""The same of anything else, at its segment's markers: a decimetre of a fifth of the weight."""
UNMARKED_M_S2, UNMARKED_M2_S2 = 0.5, 0.5
"""Residual force and moment for each further kilogram: a trunk that leans and turns on the pelvis, and arms that swing
(squats and a walk without the upper body's markers; `benchmarks`)."""
_WHITE_N, _WHITE_NM = 5.0, 2.0  # of a wrench that is a state
_LEAST_HEIGHT_M = 0.3  # of the pelvis over the sole, for the direction

_CONTACT = np.zeros(len(on_plates.REASONS), dtype=np.uint8)  # of a foot, by the number of its reason
_CONTACT[[on_plates.SWING, on_plates.MEASURED, on_plates.SHARED]] = NO_CONTACT, ON_PLATE, SHARED_PLATE
_CONTACT[[on_plates.OFF_PLATE, on_plates.UNKNOWN]] = UNMEASURED


class Prior(NamedTuple):
    """Of one contact: its expected wrench (T, 6), about the ground's origin, and what each of six numbers of unit
    variance adds to it (T, 6, 6)."""

    mean: Array
    spread: Array


def expected_loads(ground: Ground, initial: CalibratedModel, noise: Noise, paths: Array) -> ContactLoads:
    """The feet's wrenches, those of the declared contacts and, last, the residual: what neither they nor the model
    explain, on the root.

    Args:
        ground: of a model with feet; declared contacts may bear, and where plates measure them, these say.
        paths: (T, 1 + C, 3) m, where the root is and where the declared contacts act (`ContactPaths`).
    """
    assert ground.loads is not None
    loads, undeclared, bears, plates = ground.loads, ground.undeclared, ground.bears, ground.errors
    weight, root, C = initial.weighed_kg * GRAVITY_M_S2, paths[:, 0], len(initial.contacts)
    feet = _CONTACT[loads.reason]
    frames, F = feet.shape
    K = F + C
    contact = np.concatenate([feet, np.where(bears, UNMEASURED, NO_CONTACT).astype(np.uint8)], axis=1)
    wrench = np.zeros((frames, K + 1, 6))
    wrench[:, :F] = np.where((feet == ON_PLATE)[..., None], loads.wrench, filled(loads.wrench))
    for k, name in enumerate(initial.contacts, start=F):
        if (measured := loads.others.get(name)) is not None:
            on = SHARED_PLATE if any(name in group for group in loads.sharing) else ON_PLATE
            contact[:, k] = np.where(measured.any(axis=1), on, NO_CONTACT)
            contact[np.isnan(measured).any(axis=1), k] = UNMEASURED
            wrench[:, k] = filled(measured)
    wrench[:, :K][contact == NO_CONTACT] = 0.0
    errors, effects = np.zeros((frames, K + 1, 6, K + 1, 6)), np.zeros((frames, 6, K, 6))
    partly = (contact == ON_PLATE) & plates.unmeasured  # the rest of such a wrench is as little known as off the plates
    contact[partly] = UNMEASURED
    unmeasured = contact == UNMEASURED
    alone = unmeasured.sum(axis=1) == 1
    priors: dict[int, Prior] = {}
    each = np.arange(K)
    places = np.concatenate([loads.soles.middle, paths[:, 1:]], axis=1)
    places = np.where(np.isfinite(places), places, (root * [1.0, 0.0, 1.0])[:, None])
    gain_errors = np.zeros((frames, K))
    gain_errors[:, :F] = plates.gain_error_of_feet(loads)
    turn_errors = np.zeros((frames, K))
    turn_errors[:, :F] = plates.turn_error_of_feet(loads)
    by_plates = plate_covariances(
        wrench[:, :K].reshape(-1, 6), places.reshape(-1, 3), plates, gain_errors.reshape(-1), turn_errors.reshape(-1)
    )
    white = plates.noise_of(loads, list(initial.contacts))
    errors[:, each, :, each] = (by_plates.reshape(frames, K, 6, 6) + white).swapaxes(0, 1)
    for k in range(K):
        off = unmeasured[:, k]
        if not (off | (contact[:, k] == SHARED_PLATE)).any():
            continue  # nobody asks for its prior
        if k < F:
            prior = foot_prior(loads, k, weight, root, alone, np.where(partly[:, k], wrench[:, k, 1], 0.0))
        else:
            prior = declared_prior(list(initial.contacts)[k - F], weight, paths[:, 1 + k - F])
        priors[k] = prior
        wrench[off & ~partly[:, k], k] = prior.mean[off & ~partly[:, k]]
        effects[off, :, k] = prior.spread[off]
        if partly[:, k].any():
            on = partly[:, k]
            wrench[on, k], effects[on, :, k] = _given_plate(
                Prior(prior.mean[on], prior.spread[on]), wrench[on, k], errors[on, k, :, k]
            )
        errors[off, k, :, k] = _about(root[off], np.array([_WHITE_N] * 3 + [_WHITE_NM] * 3))
    own = list(initial.contacts)
    for group in (range(F), *([F + own.index(name) for name in names] for names in loads.sharing)):
        shares = contact[:, group] == SHARED_PLATE
        for t in np.flatnonzero(shares.any(axis=1)):
            feet_on = np.asarray(group)[shares[t]]
            plate = plate_covariances(
                wrench[t, feet_on].sum(axis=0)[None],
                places[t, feet_on[:1]],
                plates,
                gain_errors[t, feet_on[:1]],
                turn_errors[t, feet_on[:1]],
            )
            _divide(int(t), feet_on, priors, wrench, errors, plate[0] + white[t, feet_on[0]])
    size = residual_sd(noise, initial)
    errors[:, K, :, K] = _about(root, np.where(undeclared[:, None], UNDECLARED_SD * weight, size))
    residual = np.where(undeclared, UNMEASURED, ON_PLATE if all(size) else NO_CONTACT)
    pelvis = initial.tree.roots[0]
    return ContactLoads(
        names=(*loads.feet, *initial.contacts, RESIDUAL),
        segments=(*(initial.feet[foot] for foot in loads.feet), *initial.contacts.values(), pelvis),
        wrench=wrench,
        covariance=errors.reshape(frames, 6 * K + 6, 6 * K + 6),
        effects=effects.reshape(frames, 6, 6 * K),
        contact=np.column_stack([contact, residual]).astype(np.uint8),
        known=~undeclared & ((contact != NO_CONTACT).any(axis=1) | (residual != NO_CONTACT)),
        noise=None if plates.noise is None else np.where((contact == ON_PLATE)[..., None, None], white, 0.0),
    )


def residual_sd(noise: Noise, initial: CalibratedModel) -> Array:
    """(6,) N and N m: the declared residual, with what the parts of the body do that no marker shows; zeros where none
    is declared."""
    size = np.array([noise.residual_force_sd_n] * 3 + [noise.residual_moment_sd_nm] * 3)
    more = initial.unseen_kg * np.array([UNMARKED_M_S2] * 3 + [UNMARKED_M2_S2] * 3)
    return np.where(size.all(), np.hypot(size, more), size)


def plate_covariances(
    wrench: Array,
    contact: Array,
    off: PlateErrors = NO_ERRORS,
    gain_error: Array | float = 0.0,
    turn_error_nm: Array | float = 0.0,
) -> Array:
    """Covariances (T, 6, 6) about the ground's origin of what a plate says, (T, 6) about it too: at its centre of
    pressure on the level of the contact (T, 3) m, at that itself where the plate is hardly loaded.

    Args:
        gain_error: (T,) part of its load by which the plate may be off, all of it or a sensor's `SENSOR_M` away.
        turn_error_nm: (T,) N m, of its moment about the vertical.
    """
    push, pressure = np.maximum(np.abs(wrench[:, 1]), LOADED_N), contact.copy()
    at = pressed_at(wrench, contact[:, 1])
    pressure[:, [0, 2]] = np.where(np.isnan(at), contact[:, [0, 2]], at)
    shear = np.hypot(np.hypot(NOISE_N, PLATE_TURN_RAD * push), off.shear_sd(wrench))
    shear = np.hypot(shear, gain_error * np.hypot(wrench[:, 0], wrench[:, 2]))
    lift = np.hypot(NOISE_N, np.hypot(PLATE_GAIN, gain_error) * push)
    moment = np.hypot(NOISE_NM, np.hypot(PLATE_PLACE_M, SENSOR_M * gain_error) * push)
    turning = np.hypot(turn_error_nm, off.turn_gain_error * free_moments(wrench))
    twist = shear if off.unmeasured else np.hypot(moment, turning)
    return _about(pressure, np.stack([shear, lift, shear, moment, twist, moment], axis=1))


def _given_plate(prior: Prior, wrench: Array, errors: Array) -> Prior:
    """A prior (T,), given what a plate says of its wrench (T, 6) with errors of covariances (T, 6, 6). The six numbers
    stay those of the prior as far as the plate leaves them open, so that they last from frame to frame."""
    S = prior.spread
    seen = np.swapaxes(np.linalg.solve(errors, S), 1, 2)  # S' R^-1
    back = (np.eye(6) + seen @ S)[:, ::-1, ::-1]  # backwards, so that the root of its inverse is a lower one
    spread = np.swapaxes(np.linalg.solve(np.linalg.cholesky(back), np.swapaxes(S[..., ::-1], 1, 2)), 1, 2)[..., ::-1]
    told = np.linalg.solve(errors, (wrench - prior.mean)[..., None])
    return Prior(prior.mean + (spread @ (np.swapaxes(spread, 1, 2) @ told))[..., 0], spread)


def foot_prior(loads: FootLoads, k: int, weight: float, root: Array, alone: Flags, push: Array | float = 0.0) -> Prior:
    """Of foot number k, by its sole and its stance; alone (T,): it is the only contact that no plate measures; push
    (T,) N: what it is known to bear, by which shear and moments go where that is more than expected.

    The six numbers are, in order: shear along X; push, along the line from the centre of pressure to over the root;
    shear along Z; the two coordinates of the centre of pressure, with the free moment between them.
    """
    soles = loads.soles
    seen: Flags = np.asarray(np.isfinite(soles.pressure[:, k]).all(axis=1))
    place = np.where(seen[:, None], soles.pressure[:, k], root * [1.0, 0.0, 1.0])
    spread_m2 = np.where(seen[:, None, None], soles.pressure_covariance[:, k], np.eye(2))
    stance, share = soles.stance[:, k], soles.share[:, k]
    to_root = root + np.array([0.0, PIVOT_M, 0.0]) - place
    direction = np.concatenate([to_root / np.maximum(to_root[:, [1]], _LEAST_HEIGHT_M), np.zeros_like(root)], axis=1)
    direction[:, 1] = 1.0
    load = weight * (PUSH_LEAST_SD + PUSH_SD * stance) / (PUSH_LEAST_SD + PUSH_SD)  # the weight, in full stance
    load = np.maximum(load * np.where(alone, ALONE_LOAD, 1.0), push)
    push_sd = weight * (PUSH_LEAST_SD + np.where(alone, ALONE_SD, PUSH_SD) * stance)
    push_sd = np.hypot(push_sd, weight * HANDED_OVER_S * soles.passing[:, k])
    spread = np.zeros((len(root), 6, 6))
    spread[:, :, 1] = push_sd[:, None] * direction
    spread[:, 0, 0] = spread[:, 2, 2] = SHEAR_SD * load
    spread[:, 4, 4] = FREE_MOMENT_M * load
    L = load[:, None, None] * np.linalg.cholesky(spread_m2)
    for column, axis in ((3, 0), (5, 1)):  # a force upwards at (x, z) has moments (-z, 0, x)
        spread[:, 3, column], spread[:, 5, column] = -L[:, 1, axis], L[:, 0, axis]
    X = carry(place)
    return Prior((X @ (weight * share[:, None] * direction)[..., None])[..., 0], X @ spread)


def declared_prior(name: str, weight: float, place: Array) -> Prior:
    """Of a declared contact at (T, 3) m: a seat pushes upwards and bears up to nine tenths of the weight, others push
    or pull in any direction. The six numbers are those of `foot_prior`, about the place."""
    mean, force, moment = (SEAT_MEAN, SEAT_SD, SEAT_MOMENT_M) if name == SEAT else (np.zeros(3), HAND_SD, HAND_MOMENT_M)
    push = np.zeros((len(place), 6, 1))
    push[:, :3, 0] = weight * np.asarray(mean)
    X = carry(place)
    return Prior((X @ push)[..., 0], X @ np.diag(weight * np.concatenate([force, moment])))


def _about(point: Array, sd: Array) -> Array:
    """(T, 6, 6) about the ground's origin of independent errors sd, (6,) or (T, 6), about a point (T, 3)."""
    spread = carry(point) * np.broadcast_to(sd, (len(point), 6))[:, None]
    return np.asarray(spread @ np.swapaxes(spread, 1, 2))


def _divide(
    t: int,
    feet: npt.NDArray[np.int64],
    priors: dict[int, Prior],
    wrench: Array,
    errors: Array,
    plate: Array,
) -> None:
    """A frame's plate, of covariance (6, 6), among the feet on it, in place: their priors, given the sum that it
    measures."""
    each = {k: priors[k].spread[t] @ priors[k].spread[t].T for k in feet}
    S = np.sum(list(each.values()), axis=0) + plate
    lacks = np.sum([wrench[t, k] - priors[k].mean[t] for k in feet], axis=0)
    root = np.linalg.cholesky(S)
    parts = {k: scipy.linalg.solve_triangular(root, each[k], lower=True) for k in feet}  # S^-1 = R^-T R^-1
    lacking = scipy.linalg.solve_triangular(root, lacks, lower=True)
    for k in feet:
        wrench[t, k] = priors[k].mean[t] + parts[k].T @ lacking
        for j in feet:
            errors[t, k, :, j] = (each[k] if j == k else 0.0) - parts[k].T @ parts[j]


@dataclass(frozen=True)
class ContactPaths:
    """Where the root and the declared contacts are: by which markers of the model, and how far below them (m)."""

    markers: tuple[list[int], ...]
    below_m: tuple[float, ...]

    @classmethod
    def of(cls, initial: CalibratedModel) -> ContactPaths:
        """Those of a calibrated model."""
        own, root = marked_segments(initial), initial.tree.roots[0]
        below = [BELOW_PELVIS_M if name == SEAT else 0.0 for name in initial.contacts]
        return cls((own[root], *(own[segment] for segment in initial.contacts.values())), (0.0, *below))

    def at(self, markers: Array) -> Array:
        """(T, 1 + C, 3) m, of the model's markers (T, M, 3) m, drawn over gaps by straight lines."""
        paths = [
            _middle(markers[:, own]) - [0.0, below, 0.0] for own, below in zip(self.markers, self.below_m, strict=True)
        ]
        return np.stack(paths, axis=1)


def marked_segments(initial: CalibratedModel) -> dict[str, list[int]]:
    """Segment -> numbers of its markers, those of the nearest segment towards the root that has some where it has none;
    all markers where there is no such segment."""
    tree, own = initial.tree, dict[str, list[int]]()
    for k, marker in enumerate(initial.spec.markers):
        own.setdefault(marker.segment, []).append(k)
    every = list(range(len(initial.spec.markers)))
    return {name: own.get(tree.nearest(name, own), every) for name in tree.parents}


def _middle(places: Array) -> Array:
    """(T, 3) m of points (T, K, 3)."""
    path = mean_seen(places, axis=1)
    known = np.flatnonzero(np.isfinite(path).all(axis=1))
    if not len(known):
        return np.zeros_like(path)
    return np.stack([np.interp(np.arange(len(path)), known, path[known, axis]) for axis in range(3)], axis=1)
