"""White noise of plates, by their own signals: found where there is more than usual, and held by the deviations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.signal

from dynakin import Estimate
from dynakin.arrays import Array, wrench_about
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.ground.delay import Delay, brought_into_step, noise_in_step
from dynakin.filter.ground.plate_errors import NOISE_N, NOISE_NM
from dynakin.filter.ground.plate_noise import EVERY, LOUD, LiveNoise, found_noise, plate_noise
from dynakin.filter.prepared import Prepared
from dynakin.filter.samples import Sample
from dynakin.messages import about
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, UNMEASURED
from dynakin.recordings.recording import Plate, Recording
from support.plates import person, prepared, trial, with_plate


def noisy(force_n: float, moment_nm: float, seed: int) -> Callable[[Plate], Plate]:
    """White noise in each component of a plate while it is loaded, moments about its middle."""
    rng = np.random.default_rng(seed)

    def of(plate: Plate) -> Plate:
        assert plate.corners is not None
        on = np.isfinite(plate.cop).all(axis=1)[:, None]
        force, about = (np.where(on, sd * rng.standard_normal(plate.force.shape), 0.0) for sd in (force_n, moment_nm))
        moment = plate.moment + about + np.cross(plate.corners.mean(axis=0), force)
        return replace(plate, force=plate.force + force, moment=moment)

    return of


def moved(plate: Plate, frames: int) -> Plate:
    """What it says so many frames later."""
    at = np.maximum(np.arange(len(plate.force)) - frames, 0)
    return plate.frames(at)


@cache
def with_noise(motion: str, force_n: float, moment_nm: float) -> Recording:
    return with_plate(trial(motion), None, noisy(force_n, moment_nm, 3))


def beyond_usual(wrenches: Array) -> Array | None:
    return found_noise(wrenches, [f"plate {p + 1}" for p in range(len(wrenches))]).noise


def wrenches(ready: Prepared) -> Array:
    """(P, T, 6), ground frame."""
    return np.stack([ready.calibrated.ground.wrench_to_ground(plate.wrench) for plate in ready.recording.plates])


@pytest.mark.parametrize("motion", ["gait", "squat"])
def test_usual_plates_have_no_more_noise_than_usual(motion: str) -> None:
    """Heel strikes and all: a recording's filter and its deviations stay as they were."""
    ready = prepared(motion)
    assert beyond_usual(wrenches(ready)) is None and ready.ground.errors.noise is None
    assert ready.measured.contacts is not None and ready.measured.contacts.noise_left() is None


def test_a_plate_with_far_more_noise_than_plates_have_is_named() -> None:
    """That of the other, and as much as deviations hold without a word, is not."""
    (said,) = about(person().prepare(with_plate(trial("squat"), 1, noisy(12.0, 1.0, 5))).messages, "plate noise")
    assert said.level == "warning" and said.text.startswith("plate 2 has white noise of up to 1") and LOUD == 4.0
    ready = person().prepare(with_plate(trial("squat"), 1, noisy(5.0, 1.0, 5)))
    assert not about(ready.messages, "plate noise") and ready.ground.errors.noise is not None


@pytest.mark.parametrize("motion", ["gait", "squat"])
def test_noise_is_found_as_large_as_it_is(motion: str) -> None:
    """And how surely: a single stance shows a fifth too much or too little of it."""
    known = [plate_noise(each) for each in wrenches(person().prepare(with_noise(motion, 8.0, 1.6)))]
    found = [each for each in known if each is not None]
    assert len(found) > 1
    off = np.array([(each.sd / ([8.0] * 3 + [1.6] * 3) - 1.0) / each.unsure for each in found])
    assert np.abs(off).max() < 3.0 and np.sqrt(np.mean(off**2)) < 1.5
    assert max(each.unsure for each in found) < 0.25


@pytest.mark.parametrize(("late_s", "left"), [(0.0, 1.0), (0.0025, 0.625), (0.005, 0.5), (0.01, 1.0), (0.0325, 0.625)])
def test_noise_between_two_samples_is_a_mean_of_both(late_s: float, left: float) -> None:
    """Plates that are brought into step hide their noise from differences (a tenth of it is left at half a sample)."""
    recording = with_noise("squat", 8.0, 1.6)
    delay = Delay(late_s, 1e-4)
    assert delay.worth_it(whole=True) == (late_s > 0.0)
    np.testing.assert_allclose(noise_in_step(recording, delay), left, rtol=1e-9)
    quiet = brought_into_step(trial("squat"), delay)
    for plate, usual in zip(brought_into_step(recording, delay).plates, quiet.plates, strict=True):
        off = (plate.force - usual.force)[100:-100]
        assert np.mean(off**2) == pytest.approx(64.0 * left, rel=0.1)


def test_noise_of_plates_out_of_step_is_that_before_they_are_brought_into_it() -> None:
    late = with_plate(with_noise("squat", 8.0, 1.6), None, lambda plate: moved(plate, 2))
    ready, in_time = person().prepare(late), person().prepare(with_noise("squat", 8.0, 1.6))
    assert ready.ground.behind_s > 0.01
    found, expected = ready.ground.errors.noise, in_time.ground.errors.noise
    assert found is not None and expected is not None
    ratio = np.diagonal(found, axis1=1, axis2=2)[:, :3] / np.diagonal(expected, axis1=1, axis2=2)[:, :3]
    assert ((ratio > 0.45) & (ratio < 1.15)).all()


def test_noise_of_a_plate_that_was_low_passed_is_not_seen() -> None:
    """What stands in the docs: nothing tells it from movement."""
    b, a = scipy.signal.butter(2, 15.0, fs=100.0)
    white = np.random.default_rng(2).standard_normal((800, 6)) * ([8.0] * 3 + [1.6] * 3)
    wrench = np.array([0.0, 400.0, 0.0, 0.0, 0.0, 0.0]) + scipy.signal.filtfilt(b, a, white, axis=0)
    found = plate_noise(wrench)
    assert found is not None and wrench[:, 0].std() > 3.0 and found.sd[0] < 1.0


def test_too_few_loaded_frames_say_nothing() -> None:
    wrench = np.zeros((100, 6))
    wrench[40:60, 1] = 500.0
    wrench[:, :] += np.random.default_rng(1).standard_normal(wrench.shape)
    assert plate_noise(wrench) is None and plate_noise(wrench[:10]) is None
    assert plate_noise(np.full((100, 6), np.nan)) is None


def test_noise_is_about_the_middle_of_where_a_plate_is_pressed() -> None:
    """Three metres from the origin moments about it would have 24 N m of it."""
    at = np.array([3.0, 0.0, -2.0])
    rng = np.random.default_rng(4)
    wrench = np.zeros((2000, 6))
    wrench[:, 1] = 500.0
    wrench += rng.standard_normal(wrench.shape) * ([8.0] * 3 + [1.6] * 3)
    noise = beyond_usual(wrench_about(wrench, -at)[None])
    assert noise is not None
    usual = np.array([NOISE_N] * 3 + [NOISE_NM] * 3)
    turned = np.eye(6)
    turned[3:] -= wrench_about(np.eye(6), -at).T[3:] - np.eye(6)[3:]
    there = turned @ noise[0] @ turned.T
    np.testing.assert_allclose(np.sqrt(np.diag(there) + usual**2), [8.0] * 3 + [1.6] * 3, rtol=0.1)
    np.testing.assert_allclose(there - np.diag(np.diag(there)), 0.0, atol=2.0)


def test_what_noise_leaves_in_the_contacts_is_what_conditioning_on_their_sum_leaves() -> None:
    """By draws: a foot's wrench is changed by its share of what the sum lacks, and that has the noise in it."""
    rng = np.random.default_rng(6)
    covariance = np.zeros((3, 18, 18))
    for t in range(3):
        for k in range(3):
            A = rng.standard_normal((6, 6))
            covariance[t, 6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = A @ A.T + 2.0 * np.eye(6)
    each = rng.standard_normal((3, 2, 6, 6))
    noise = each @ np.swapaxes(each, -1, -2)
    contact = np.array([[ON_PLATE] * 3, [ON_PLATE, NO_CONTACT, ON_PLATE], [NO_CONTACT] * 3], dtype=np.uint8)
    noise[contact[:, :2] != ON_PLATE] = 0.0
    zero = np.zeros((3, 3, 6))
    loads = ContactLoads(
        ("right", "left", "residual"), ("a", "b", "c"), zero, covariance, np.zeros((3, 6, 12)), contact,
        np.ones(3, dtype=bool), noise,
    )  # fmt: skip
    left = loads.noise_left()
    assert left is not None
    for t in range(3):
        drawn = np.zeros((40_000, 2, 6))
        for k in np.flatnonzero(contact[t, :2] == ON_PLATE):
            drawn[:, k] = rng.multivariate_normal(np.zeros(6), noise[t, k], 40_000)
        lacks = -drawn.sum(axis=1)
        own = [covariance[t, 6 * k : 6 * k + 6, 6 * k : 6 * k + 6] for k in range(3)]
        S = sum((own[k] for k in range(3) if contact[t, k] != NO_CONTACT), np.zeros((6, 6)))
        for k in np.flatnonzero(contact[t, :2] == ON_PLATE):
            drawn[:, k] += lacks @ np.linalg.solve(S, own[k])
        scale = max(float(np.abs(noise[t]).max()), 1.0)
        np.testing.assert_allclose(left[t], np.cov(drawn.reshape(-1, 12).T), atol=0.06 * scale)
    later = loads.in_step(np.arange(3.0), 1.0).noise_left()
    assert later is not None
    np.testing.assert_allclose(later[0], left[1])
    first = loads.first(2).noise_left()
    assert first is not None and len(first) == 2


@cache
def estimated(force_n: float, moment_nm: float) -> Estimate:
    recording = with_noise("squat", force_n, moment_nm) if force_n else trial("squat")
    return person().run(recording.window(1.0, 5.0))


LEGS = [f"{joint}_{side}" for joint in ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle") for side in "rl"]


def test_deviations_hold_what_noise_does() -> None:
    """Moments of legs and feet's wrenches beside those of quiet plates: 93 to 97 % within what is said."""
    quiet, found = estimated(0.0, 0.0).data, estimated(10.0, 2.0).data
    off = (found["moments"] - quiet["moments"]).sel(coordinate=LEGS).values
    sd = found["moments_sd"].sel(coordinate=LEGS).values
    assert np.sqrt(np.mean(off**2)) > 2.5
    more = np.sqrt(np.maximum(sd**2 - quiet["moments_sd"].sel(coordinate=LEGS).values ** 2, 0.0))
    ratio = np.sqrt(np.mean(more**2, axis=0) / np.mean(off**2, axis=0))
    assert ((ratio > 0.7) & (ratio < 1.4)).all()
    assert ((np.abs(off) < 1.96 * sd).mean(axis=0) > 0.9).all()
    off, sd = (found["foot_wrench"] - quiet["foot_wrench"]).values, found["foot_wrench_sd"].values
    ratio = np.sqrt(np.mean(sd**2, axis=(0, 1)) / np.mean(off**2, axis=(0, 1)))
    assert ((ratio[:3] > 0.8) & (ratio[:3] < 1.5)).all()


def test_noise_is_taken_for_noise_by_the_filter() -> None:
    """Less of it gets into the movement, and so into moments of the trunk, which no plate bears, than without."""
    ready = person().prepare(with_noise("squat", 10.0, 2.0).window(1.0, 5.0))
    contacts = ready.measured.contacts
    assert contacts is not None and contacts.noise is not None
    as_usual = contacts.covariance.copy()
    for k in range(2):
        own = slice(6 * k, 6 * k + 6)
        as_usual[:, own, own] -= contacts.noise[:, k]
    contacts = replace(contacts, covariance=as_usual, noise=None)
    believed = person().follow(replace(ready, measured=ready.measured._replace(contacts=contacts))).estimate.data
    quiet, found = estimated(0.0, 0.0).data, estimated(10.0, 2.0).data
    trunk = [name for name in quiet["coordinate"].values if "lumbar" in name]
    off = [(data["moments"] - quiet["moments"]).sel(coordinate=trunk).values for data in (found, believed)]
    now, before = (np.sqrt(np.mean(np.square(each))) for each in off)
    assert now < 0.9 * before and before > 2.0


def test_live_noise_is_that_of_the_last_samples() -> None:
    ready = person().prepare(with_noise("squat", 8.0, 1.6))
    all_of_it, live = wrenches(ready), LiveNoise(["a", "b"])
    found = [live.look(all_of_it[:, t]).noise for t in range(8 * EVERY)]
    assert found[EVERY - 2] is None
    expected = beyond_usual(all_of_it[:, : 8 * EVERY])
    assert expected is not None and found[-1] is not None
    np.testing.assert_array_equal(found[-1], expected)
    usual = prepared("squat")
    live = LiveNoise(["a", "b"])
    assert all(live.look(wrench).noise is None for wrench in wrenches(usual).swapaxes(0, 1)[: 8 * EVERY])


def test_deviations_of_a_session_hold_noise() -> None:
    sds = []
    for recording in (trial("squat"), with_noise("squat", 10.0, 2.0)):
        part = recording.window(1.0, 2.0)
        live = person().start(part)
        for t in range(part.n_frames):
            markers = {name: part.markers[t, m] for m, name in enumerate(part.marker_names)}
            plates = {plate.name: plate.wrench[t] for plate in part.plates}
            live.step(Sample(float(part.time[t]), markers, plates))
        sd = live.deviations()["moments"]
        sds.append([sd[name] for name in LEGS])
        step = live.step(Sample(float(part.time[-1]) + 0.01, markers, {}))  # plates that are gone have none
        assert np.isfinite(step.coordinates.values).all()
    usual, found = np.array(sds)
    more = np.sqrt(found**2 - usual**2)
    assert (more[:6] > 3.0).all() and (more[6:] > 1.5).all()


def test_a_contact_off_the_plates_has_no_plates_noise() -> None:
    ready = person().prepare(with_noise("gait", 8.0, 1.6))
    contacts = ready.measured.contacts
    assert contacts is not None and contacts.noise is not None
    feet = contacts.contact[:, :2]
    assert contacts.noise[feet == ON_PLATE].any() and not contacts.noise[feet == NO_CONTACT].any()
    assert not contacts.noise[feet == UNMEASURED].any()
