"""What is expected of each contact: priors of feet that no plate measures, shared plates, the residual."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dynakin.filter.contacts import RESIDUAL, ContactLoads, carry
from dynakin.filter.ground.expected import (
    HANDED_OVER_S,
    PIVOT_M,
    SHEAR_SD,
    UNDECLARED_SD,
    expected_loads,
    foot_prior,
    plate_covariances,
)
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.plate_errors import PlateErrors
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.recordings.feet.loads import MEASURED, OFF_PLATE, SHARED, SWING, UNKNOWN, FootLoads
from dynakin.recordings.feet.soles import Soles
from dynakin.settings import presets
from dynakin.tree import Tree
from dynakin.units import GRAVITY_M_S2

MASS_KG = 70.0
WEIGHT = MASS_KG * GRAVITY_M_S2
REASONS = [  # a frame each: right, left
    (MEASURED, MEASURED),
    (MEASURED, OFF_PLATE),
    (OFF_PLATE, OFF_PLATE),
    (SHARED, SHARED),
    (SWING, MEASURED),
    (SWING, UNKNOWN),
    (SWING, SWING),
    (SHARED, SHARED),
]
PRESSURE = np.array([[0.10, 0.0, 0.12], [-0.25, 0.0, -0.11]])
PRESSURE_COVARIANCE = np.array([[[0.0016, 0.0003], [0.0003, 0.0004]], [[0.0025, -0.0004], [-0.0004, 0.0009]]])
ROOT = np.array([-0.05, 0.95, 0.02])
NOISE = presets.default()


def plate_wrench(push: float, place: np.ndarray, shear: tuple[float, float] = (20.0, -10.0)) -> np.ndarray:
    force = np.array([shear[0], push, shear[1]])
    return np.hstack([force, np.cross(place, force) + np.array([0.0, 2.0, 0.0])])


def make_believe(reasons: list[tuple[int, int]] = REASONS, shared_n: float = 700.0) -> FootLoads:
    n = len(reasons)
    reason = np.array(reasons, np.int8)
    wrench = np.zeros((n, 2, 6))
    for t in range(n):
        for k in range(2):
            if reason[t, k] == MEASURED:
                wrench[t, k] = plate_wrench(400.0 + 10.0 * t, PRESSURE[k] + [0.02, 0.0, -0.01])
            elif reason[t, k] == SHARED:  # as the plates' lever divides it
                wrench[t, k] = plate_wrench(shared_n * (0.6, 0.4)[k], PRESSURE[k])
    wrench[(reason == OFF_PLATE) | (reason == UNKNOWN)] = np.nan
    bears = reason != SWING
    soles = Soles(
        np.tile(PRESSURE, (n, 1, 1)),
        np.full((2, 2), [0.13, 0.05]),
        bears,
        np.where(bears, 1.0, 0.0),
        np.where(bears.any(axis=1), 1.0, 0.0),
        np.tile(PRESSURE, (n, 1, 1)),
        np.tile(PRESSURE_COVARIANCE, (n, 1, 1, 1)),
    )
    nothing = np.zeros(n, bool)
    return FootLoads(
        ("right", "left"), wrench, reason, ~nothing, nothing, nothing, ~bears, soles, np.zeros((n, 2, 1), bool)
    )


def person() -> Any:
    segments = [
        SimpleNamespace(name="pelvis", parent="ground"),
        SimpleNamespace(name="foot_r", parent="pelvis"),
        SimpleNamespace(name="foot_l", parent="pelvis"),
    ]
    return SimpleNamespace(
        weighed_kg=MASS_KG,
        feet={"right": "foot_r", "left": "foot_l"},
        contacts={},
        unseen_kg=0.0,
        spec=SimpleNamespace(segments=segments),
        tree=Tree.of(segments),
    )


def expected(loads: FootLoads, undeclared: np.ndarray | None = None, **noise: float) -> ContactLoads:
    n = len(loads.reason)
    asked = np.zeros(n, bool) if undeclared is None else undeclared
    chosen = NOISE.model_copy(update=noise) if noise else NOISE
    bearing = Ground(loads, asked, np.zeros((n, 0), bool), usable=True)
    return expected_loads(bearing, person(), chosen, np.tile(ROOT, (n, 1, 1)))


def drawn_prior(seed: int, frame: int = 1, foot: int = 1) -> np.ndarray:
    """(N, 6) wrenches of the prior of an unmeasured foot."""
    prior = foot_prior(make_believe(), foot, WEIGHT, np.tile(ROOT, (len(REASONS), 1)), np.zeros(len(REASONS), bool))
    states = np.random.default_rng(seed).normal(size=(200_000, 6))
    return prior.mean[frame] + states @ prior.spread[frame].T


def test_what_is_expected_is_about_the_expected_centre_of_pressure() -> None:
    """By the definition of a centre of pressure, from draws: its place and spread, the direction, the free moment."""
    wrench = drawn_prior(1)
    force, moment = wrench[:, :3], wrench[:, 3:]
    moment_there = moment - np.cross(PRESSURE[1], force)
    push = force[:, 1]
    assert push.mean() == pytest.approx(WEIGHT / 2, rel=0.01)  # of two feet that stand fully, half each
    assert push.std() == pytest.approx(0.45 * WEIGHT, rel=0.01)
    to_pivot = ROOT + np.array([0.0, PIVOT_M, 0.0]) - PRESSURE[1]
    direction = to_pivot / to_pivot[1]
    np.testing.assert_allclose(force.mean(axis=0), direction * WEIGHT / 2, atol=2.0)
    shear = force[:, [0, 2]] - push[:, None] * direction[[0, 2]]
    np.testing.assert_allclose(shear.std(axis=0), SHEAR_SD * WEIGHT, rtol=0.01)
    np.testing.assert_allclose(np.corrcoef(np.c_[shear, push].T), np.eye(3), atol=0.01)
    place = np.c_[moment_there[:, 2], -moment_there[:, 0]] / WEIGHT  # of a push of the weight, from what is expected
    np.testing.assert_allclose(place.mean(axis=0), 0.0, atol=3e-4)
    np.testing.assert_allclose(np.cov(place.T), PRESSURE_COVARIANCE[1], rtol=0.02, atol=2e-5)
    assert moment_there[:, 1].std() == pytest.approx(0.01 * WEIGHT, rel=0.01)


def test_the_weight_is_divided_by_stance_and_a_foot_that_sets_down_is_surer() -> None:
    loads = make_believe()
    stance = np.tile([0.25, 1.0], (len(REASONS), 1))
    loads = replace(loads, soles=replace(loads.soles, stance=stance))
    root = np.tile(ROOT, (len(REASONS), 1))
    first, second = (foot_prior(loads, k, WEIGHT, root, np.zeros(len(root), bool)) for k in range(2))
    assert first.mean[0, 1] == pytest.approx(0.2 * WEIGHT) and second.mean[0, 1] == pytest.approx(0.8 * WEIGHT)
    assert first.spread[0, 1, 1] == pytest.approx(0.15 * WEIGHT) and second.spread[0, 1, 1] == pytest.approx(
        0.45 * WEIGHT
    )


def test_a_foot_that_hands_over_may_do_so_earlier_or_later() -> None:
    """Its push is as unsure as a shift of its share by `HANDED_OVER_S` makes it, by differences."""
    loads, rate = make_believe([(OFF_PLATE, OFF_PLATE)] * 21), 100.0
    weight = np.linspace(1.0, 0.0, 21)
    soles = replace(loads.soles, stance=np.stack([weight, 1.0 - weight], axis=1), rate=rate)
    root, nothing = np.tile(ROOT, (21, 1)), np.zeros(21, bool)
    still, passes = (
        foot_prior(replace(loads, soles=own), 0, WEIGHT, root, nothing).spread[10, 1, 1]
        for own in (replace(soles, rate=0.0), soles)
    )
    later = soles.share[10 - round(HANDED_OVER_S * rate), 0] - soles.share[10, 0]
    assert passes == pytest.approx(np.hypot(still, WEIGHT * later), rel=1e-6)
    frame = replace(soles, stance=soles.stance[10:11], support=soles.support[10:11], share_before=soles.share[9:10])
    np.testing.assert_allclose(frame.passing, soles.passing[10:11])  # live, one at a time


def test_codes_names_and_what_does_not_touch() -> None:
    found = expected(make_believe())
    assert found.names == ("right", "left", RESIDUAL) and found.segments == ("foot_r", "foot_l", "pelvis")
    feet = [
        (ON_PLATE, ON_PLATE),
        (ON_PLATE, UNMEASURED),
        (UNMEASURED, UNMEASURED),
        (SHARED_PLATE, SHARED_PLATE),
        (NO_CONTACT, ON_PLATE),
        (NO_CONTACT, UNMEASURED),
        (NO_CONTACT, NO_CONTACT),
        (SHARED_PLATE, SHARED_PLATE),
    ]
    np.testing.assert_array_equal(found.contact[:, :2], feet)
    assert (found.contact[:, 2] == ON_PLATE).all() and not found.wrench[:, 2].any() and found.known.all()
    assert np.isfinite(found.wrench).all() and not found.wrench[found.contact == NO_CONTACT].any()
    per_foot = found.effects.reshape(-1, 6, 2, 6)
    acts = np.abs(per_foot).max(axis=(1, 3)) > 0.0
    np.testing.assert_array_equal(acts, found.contact[:, :2] == UNMEASURED)  # what a plate bears has no states


def test_covariances_are_symmetric_and_none_is_negative() -> None:
    for loads in (make_believe(), make_believe(shared_n=30.0), make_believe(shared_n=1500.0)):
        found = expected(loads)
        R = found.covariance
        np.testing.assert_allclose(R, np.swapaxes(R, 1, 2), atol=1e-9 * np.abs(R).max())
        size = np.sqrt(np.diagonal(R, axis1=1, axis2=2))
        scaled = R / np.maximum(size[:, :, None] * size[:, None], 1e-12)
        assert np.linalg.eigvalsh(scaled).min() > -1e-9
        total, covariance, _ = found.total()
        assert np.isfinite(total).all() and np.linalg.eigvalsh(covariance).min() > 0.0


def test_plates_err_at_their_centre_of_pressure() -> None:
    """A gain of 1 %, a turn of 5 mrad, 2 mm: of 800 N at a metre from the origin, on a step, pushed to one side."""
    place = np.array([1.0, 0.4, 0.3])
    there = carry(-place)
    wrench, foot = plate_wrench(800.0, place, (30.0, -50.0)), np.array([0.9, 0.4, 0.2])
    errors = there @ plate_covariances(wrench[None], foot[None])[0] @ there.T
    sd = np.sqrt(np.diag(errors))
    np.testing.assert_allclose(sd[:3], np.hypot(2.0, [4.0, 8.0, 4.0]), rtol=1e-6)
    np.testing.assert_allclose(sd[3:], np.hypot(0.5, 1.6), rtol=1e-2)


def test_a_hardly_loaded_plate_errs_at_the_foot() -> None:
    """Its centre of pressure says nothing: from 3 N and 0.4 N m of noise it would lie anywhere."""
    foot = np.array([10.0, 0.0, -5.0])
    errors = plate_covariances(np.array([[0.5, 3.0, 0.2, 0.1, -0.3, 0.4]]), foot[None])[0]
    there = carry(-foot)
    np.testing.assert_allclose(np.sqrt(np.diag(there @ errors @ there.T))[3:], np.hypot(0.5, 0.04), rtol=1e-6)


@pytest.mark.parametrize("shared_n", [30.0, 700.0, 1500.0])
def test_the_parts_of_a_shared_plate_are_the_prior_given_their_sum(shared_n: float) -> None:
    """Against dense conditioning of both feet's priors on what the plate measures, errors and all."""
    loads, t = make_believe(shared_n=shared_n), 3
    found = expected(loads)
    root = np.tile(ROOT, (len(REASONS), 1))
    priors = [foot_prior(loads, k, WEIGHT, root, np.zeros(len(root), bool)) for k in range(2)]
    mean = np.concatenate([p.mean[t] for p in priors])
    P = np.zeros((12, 12))
    for k, p in enumerate(priors):
        P[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = p.spread[t] @ p.spread[t].T
    measured = loads.wrench[t].sum(axis=0)
    H = np.hstack([np.eye(6), np.eye(6)])
    plate = plate_covariances(measured[None], loads.soles.middle[t, :1])[0]
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + plate)
    np.testing.assert_allclose(found.wrench[t, :2].ravel(), mean + K @ (measured - H @ mean), rtol=1e-8, atol=1e-6)
    spread = P - K @ H @ P
    size = np.sqrt(np.diag(spread))
    given = found.covariance[t, :12, :12]
    np.testing.assert_allclose(given / np.outer(size, size), spread / np.outer(size, size), atol=1e-6)
    # the sum is the plate's, as surely as the plate measures
    apart = found.wrench[t, :2].sum(axis=0) - measured
    assert (np.abs(apart) <= np.sqrt(np.diag(plate))).all()
    of_sum = H @ given @ H.T
    assert (np.diag(of_sum) <= np.diag(plate) * (1.0 + 1e-9)).all()
    assert np.sqrt(given[1, 1]) > 3.0 * np.sqrt(of_sum[1, 1])  # the division is not


def test_a_plate_of_the_vertical_force_alone_leaves_the_rest_to_the_prior() -> None:
    """Against dense conditioning of the foot's prior on push and centre of pressure alone."""
    loads, t = make_believe(), 1  # right on its plate, left off it
    place = PRESSURE[0] + [0.02, 0.0, -0.01]
    loads.wrench[t, 0] = plate_wrench(410.0, place, (0.0, 0.0)) - [0.0, 0.0, 0.0, 0.0, 2.0, 0.0]
    n = len(REASONS)
    bearing = Ground(loads, np.zeros(n, bool), np.zeros((n, 0), bool), True, PlateErrors(unmeasured=True))
    found = expected_loads(bearing, person(), NOISE, np.tile(ROOT, (n, 1, 1)))
    assert found.contact[t].tolist()[:2] == [UNMEASURED, UNMEASURED]
    prior = foot_prior(loads, 0, WEIGHT, np.tile(ROOT, (n, 1)), np.zeros(n, bool))
    P, there = prior.spread[t] @ prior.spread[t].T, carry(-place)
    H, R = there[[1, 3, 5]], np.diag(np.hypot([2.0, 0.5, 0.5], [4.1, 0.82, 0.82])) ** 2
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    mean = prior.mean[t] + K @ (H @ (loads.wrench[t, 0] - prior.mean[t]))
    np.testing.assert_allclose(found.wrench[t, 0], mean, atol=0.05)
    spread = found.effects[t][:, :6] @ found.effects[t][:, :6].T
    np.testing.assert_allclose(spread, P - K @ H @ P, atol=1e-3 * np.abs(P).max())
    said = np.sqrt(np.diag(there @ spread @ there.T))
    assert said[1] < 5.0 and (said[[0, 2]] > 40.0).all()  # the push is the plate's, shear is not
    assert found.contact[3, :2].tolist() == [SHARED_PLATE, SHARED_PLATE]
    assert np.isfinite(found.wrench).all() and np.linalg.eigvalsh(found.covariance).min() > -1e-3


def test_in_undeclared_frames_the_root_may_bear_anything_and_the_total_is_not_known() -> None:
    undeclared = np.zeros(len(REASONS), bool)
    undeclared[2:4] = True
    found = expected(make_believe(), undeclared)
    np.testing.assert_array_equal(found.contact[:, 2], np.where(undeclared, UNMEASURED, ON_PLATE))
    np.testing.assert_array_equal(found.known, ~undeclared)
    total, _, _ = found.total()
    np.testing.assert_array_equal(np.isnan(total).all(axis=1), undeclared)
    np.testing.assert_array_equal(np.isnan(total).any(axis=1), undeclared)
    back = carry(-ROOT)
    for t, sd in (
        (0, [NOISE.residual_force_sd_n] * 3 + [NOISE.residual_moment_sd_nm] * 3),
        (2, [UNDECLARED_SD * WEIGHT] * 6),
    ):
        own = back @ found.covariance[t, 12:, 12:] @ back.T
        np.testing.assert_allclose(own, np.diag(np.square(sd)), rtol=1e-9, atol=1e-6 * np.max(sd) ** 2)
    assert not found.covariance[:, 12:, :12].any()


def test_without_a_declared_residual_nothing_acts_on_the_root() -> None:
    found = expected(make_believe(), residual_force_sd_n=0.0, residual_moment_sd_nm=0.0)
    assert (found.contact[:, 2] == NO_CONTACT).all()


def test_the_total_takes_only_what_touches() -> None:
    found = expected(make_believe())
    total, covariance, effects = found.total()
    np.testing.assert_allclose(total, found.wrench.sum(axis=1))
    for t in range(len(REASONS)):
        on = [k for k in range(3) if found.contact[t, k] != NO_CONTACT]
        blocks = found.covariance[t].reshape(3, 6, 3, 6)
        np.testing.assert_allclose(covariance[t], sum(blocks[i, :, j] for i in on for j in on))
    np.testing.assert_array_equal(effects, found.effects)


def test_the_error_of_a_shared_plate_is_that_of_a_plate() -> None:
    """Of its whole load: of its parts' errors, number by number the larger, comes no covariance at all."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        right = np.array([rng.uniform(-1.0, 1.0), 0.0, rng.uniform(-1.0, 1.0)])
        left = right + np.array([rng.uniform(-0.4, 0.4), 0.0, rng.uniform(-0.3, 0.3)])
        loads = make_believe([(SHARED, SHARED)])
        parts = np.array([plate_wrench(rng.uniform(50.0, 900.0), place) for place in (right, left)])
        pressure = np.array([[right, left]])
        loads = replace(loads, wrench=parts[None], soles=replace(loads.soles, pressure=pressure))
        found = expected(loads)
        R = found.covariance[0, :12, :12]
        sd = np.sqrt(np.diag(R))
        assert np.linalg.eigvalsh(R / np.outer(sd, sd)).min() > -1e-9
        H = np.hstack([np.eye(6), np.eye(6)])
        plate, of_sum = plate_covariances(parts.sum(axis=0)[None], loads.soles.middle[0, :1])[0], H @ R @ H.T
        size = np.sqrt(np.diag(plate))
        assert (
            np.linalg.eigvalsh((plate - of_sum) / np.outer(size, size)).min() > -1e-9
        )  # as sure as the plate, or surer
        assert of_sum[1, 1] > 0.9 * plate[1, 1]  # and not surer of the load than it may be
