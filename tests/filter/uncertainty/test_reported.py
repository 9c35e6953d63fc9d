"""How much of the filter's own variance counts, and what is added to it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from dynakin.filter.uncertainty.frames import any_off_plates
from dynakin.filter.uncertainty.geometry import BLOCKS, Blocks, Parts
from dynakin.filter.uncertainty.reported import (
    OWN_AT_ENDS,
    OWN_AT_ONCE,
    OWN_LATE,
    STILL,
    VIGOROUS_GROWS,
    beyond_vigorous,
    movement_intensity,
    reported,
)
from dynakin.filter.uncertainty.sizes import KINDS, LANDMARKS, SCALED, Sizes
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.recordings.times import at_the_ends
from dynakin.results.measures.sources import DERIVED, MEASURED, PRIOR
from dynakin.settings.noise import Noise
from support.systematic_leg import (
    CONTACT,
    MOMENTS_MOVING,
    MOVING,
    NONE,
    OFF_PLATES,
    QD,
    QDD,
    RATE,
    SIZES,
    Q,
    by_rate,
    calibrated,
    one_frame,
    over_time,
    parts_of,
    systematic,
    with_errors,
)

Array = npt.NDArray[np.float64]


def reported_of(own: Blocks, intensity: Array, sizes: Sizes, parts: Parts, **how: Any) -> Blocks:
    """Of frames with these deviations and this intensity, whose markers lie where the model has them."""
    sources = np.full(next(iter(own.values())).shape, MEASURED, dtype=np.uint8)
    moved_m = how.pop("moved_m", np.zeros(len(intensity)))
    frames = replace(
        one_frame({}, np.zeros(30), np.zeros((30, 30)), late=False), **{"sd": own, "sources": sources} | how
    )
    return reported(frames, sizes, parts, intensity, moved_m)


def test_a_recording_without_a_state_that_is_known_has_no_deviations() -> None:
    data = xr.Dataset(
        {
            "state": (("time", "element"), np.full((3, 30), np.nan)),
            "state_sd": (("time", "element"), np.zeros((3, 30))),
            "final_covariance": (("element", "element_"), np.zeros((30, 30))),
            "foot_wrench": (("time", "foot", "component"), np.zeros((3, 1, 6))),
            "markers_measured": (("time", "marker", "axis"), np.full((3, 12, 3), np.nan)),
        },
        coords={"time": 0.01 * np.arange(3), "foot_segment": ("foot", ["shank"])},
    )
    parts = systematic().parts(over_time(data))
    assert all(np.isnan(values).all() for kind in parts.values() for values in kind.values())


def test_intensity_is_the_mean_square_of_accelerations_over_their_deviations_of_what_moves() -> None:
    acceleration, sd = np.array([[2.0, 3.0, 5.0], [0.0, 0.0, 1.0]]), np.array([[1.0, 3.0, 0.0], [1.0, 1.0, 0.0]])
    np.testing.assert_allclose(movement_intensity(acceleration, sd), [(4.0 + 1.0) / 2.0, 0.0])
    assert movement_intensity(np.ones(3), np.zeros(3)) == 0.0


def test_smoothed_frames_at_the_ends_are_no_surer_than_frames_on_one_side_make_them() -> None:
    own = {block: np.ones((10, 1)) for block in ("coordinates", "speeds", "moments")}
    parts = {kind: {block: np.zeros((10, 1)) for block in own} for kind in KINDS}
    calm, ends = np.zeros(10), at_the_ends(0.01 * np.arange(10))
    late, soon = (
        reported_of(own, calm, replace(NONE, inertia=False), parts, late=each, step_s=0.01, ends=ends)
        for each in (True, False)
    )
    for block, within in (("coordinates", 1.0), ("speeds", STILL), ("moments", STILL)):
        there = within if block == "coordinates" else OWN_AT_ENDS
        np.testing.assert_allclose(late[block][:, 0] ** 2, [there] * 3 + [within] * 4 + [there] * 3)
        assert np.ptp(soon[block]) == 0.0


def test_an_impact_counts_for_the_smoothed_moments_around_it() -> None:
    intensity = np.array([10.0, 10.0, 10.0, np.nan, 10.0, 150.0, 10.0, 10.0, 10.0, 60.0])
    found = beyond_vigorous(intensity, 50.0, 0.01)
    np.testing.assert_allclose(found, [0.0, 0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 0.2])
    np.testing.assert_allclose(beyond_vigorous(np.array(150.0), 50.0, 0.01), 2.0)
    assert (beyond_vigorous(intensity[:2], 50.0, np.nan) == 0.0).all()
    own = {"moments": np.ones((10, 1)), "speeds": np.ones((10, 1))}
    parts = {kind: {block: np.zeros((10, 1)) for block in own} for kind in KINDS}
    sizes = replace(NONE, vigorous=50.0, inertia=False)
    moving = np.nan_to_num(intensity, nan=10.0)
    late, soon = (reported_of(own, moving, sizes, parts, late=each, step_s=0.01) for each in (True, False))
    calm = STILL + MOMENTS_MOVING * 10.0
    np.testing.assert_allclose(late["moments"][[0, 2], 0] ** 2, [calm, calm + VIGOROUS_GROWS * 2.0])
    assert soon["moments"][2] == soon["moments"][0] and late["speeds"][2] == late["speeds"][0]


def test_reported_deviations_hold_both_parts_and_a_scale_of_zero_leaves_the_filters_own() -> None:
    """Its own part times what the movement makes of it."""
    subject = Systematic(calibrated(), Noise(), replace(NONE, **dict(zip(KINDS, SIZES, strict=True))))
    x = np.r_[Q, QD, QDD]
    P = np.zeros((30, 30))
    own = {block: np.full(10, 0.02) for block in BLOCKS} | {"accelerations": np.full(10, 2.0)}
    external = np.zeros((3, 6))
    external[2] = CONTACT
    parts = parts_of(subject, Q, QD, QDD, external)
    parts["clock"] = {block: np.zeros(10) for block in BLOCKS} | {"moments": np.square(by_rate())}
    parts["hands"] = {block: np.zeros(10) for block in BLOCKS}  # a leg has none
    sizes = dict(zip(KINDS, SIZES, strict=True))
    intense = np.mean(QDD**2) / 4.0
    nothing = Systematic(calibrated(), Noise(), subject.sizes.scaled(0.0))
    by_sizes = {"speeds": (STILL, MOVING), "moments": (STILL, MOMENTS_MOVING)}
    for late, laws in ((True, OWN_LATE | by_sizes), (False, OWN_AT_ONCE)):
        both = with_errors(subject, own, x, P, late=late, rate=RATE)
        alone = with_errors(nothing, own, x, P, late=late, rate=RATE)
        for block, (still, moving) in laws.items():
            factor = still + moving * intense
            added = sum(sizes[kind] ** 2 * parts[kind][block] for kind in KINDS)
            np.testing.assert_allclose(alone[block], np.sqrt(factor) * own[block])
            np.testing.assert_allclose(both[block], np.sqrt(factor * own[block] ** 2 + added))


def test_a_calm_movement_is_known_better_than_an_intense_one() -> None:
    own = {block: np.ones(10) for block in BLOCKS}
    subject = Systematic(calibrated(), Noise(), NONE)
    for late in (True, False):
        calm, intense = (
            with_errors(subject, own, np.r_[Q, QD, scale * QDD], np.zeros((30, 30)), late=late) for scale in (0.0, 10.0)
        )
        assert (calm["speeds"] < 1.0).all() and (intense["speeds"] > 1.0).all()
        np.testing.assert_allclose(calm["coordinates"], 1.0)


def test_a_foot_stands_off_the_plates_in_some_frame() -> None:
    data = xr.Dataset({"foot_contact": (("time", "foot"), np.array([[1, 1], [1, 2]]))})
    assert any_off_plates(data, 2)
    assert not any_off_plates(data.isel(time=[0]), 2)
    assert not any_off_plates(data, 1)  # the second is a rail, say
    assert not any_off_plates(xr.Dataset(), 2)


def test_measured_moments_count_more_where_some_foot_stands_off_the_plates_and_priors_in_full() -> None:
    """Measured ones late alone; derived ones as the movement has it."""
    source = np.array([[MEASURED, MEASURED], [DERIVED, PRIOR]])
    own = {"speeds": np.ones((2, 2)), "moments": np.ones((2, 2))}
    parts = {kind: {block: np.zeros((2, 2)) for block in own} for kind in (*KINDS, "inertia")}
    scale = 0.1  # of the noise that was found

    def variances(scale: float, *, off_plates: bool, late: bool) -> dict[str, Array]:
        how = {"variance_scale": scale, "sources": source, "off_plates": off_plates, "late": late}
        found = reported_of(own, np.zeros(2), NONE, parts, **how)
        return {block: sd**2 for block, sd in found.items()}

    still, more, now = STILL, OFF_PLATES / scale, OWN_AT_ONCE["moments"][0]
    late = variances(scale, off_plates=True, late=True)
    np.testing.assert_allclose(late["moments"], [[more, more], [still, 1.0]])
    np.testing.assert_allclose(late["speeds"], STILL)
    for noise_scale, off_plates in ((1.0, True), (scale, False)):  # holds as much already; none stands off the plates
        found = variances(noise_scale, off_plates=off_plates, late=True)["moments"]
        np.testing.assert_allclose(found, [[still, still], [still, 1.0]])
    at_once = variances(scale, off_plates=True, late=False)["moments"]
    np.testing.assert_allclose(at_once, [[now, now], [now, 1.0]])


@pytest.mark.parametrize(("hz", "left"), [(200.0, STILL), (100.0, STILL), (50.0, 1.0), (25.0, 1.0), (80.0, 0.390625)])
def test_of_smoothed_moments_more_is_unseen_the_further_frames_are_apart(hz: float, left: float) -> None:
    own = {"speeds": np.ones((1, 1)), "moments": np.ones((1, 1))}
    parts = {kind: {block: np.zeros((1, 1)) for block in own} for kind in (*KINDS, "inertia")}
    found = reported_of(own, np.zeros(1), NONE, parts, late=True, step_s=1.0 / hz)
    np.testing.assert_allclose([found["moments"] ** 2, found["speeds"] ** 2], [[[left]], [[STILL]]])
    at_once = reported_of(own, np.zeros(1), NONE, parts, late=False, step_s=1.0 / hz)
    np.testing.assert_allclose(at_once["moments"] ** 2, OWN_AT_ONCE["moments"][0])


def test_centres_of_joints_are_as_much_less_sure_as_markers_lie_elsewhere_than_a_scaled_model_has_them() -> None:
    none = {kind: dict.fromkeys(BLOCKS, np.zeros((3, 1))) for kind in (*KINDS, "inertia")}
    kinds = ("hinge_centre", "hinge_across", "ball_centre")
    centres = none | dict.fromkeys(kinds, dict.fromkeys(BLOCKS, np.ones((3, 1))))
    still, moved_m = dict.fromkeys(BLOCKS, np.zeros((3, 1))), SCALED.placed * np.array([0.5, 1.0, 3.0])
    by_frame = reported_of(still, np.zeros(3), SCALED, centres, moved_m=moved_m, late=True)["moments"][:, 0]
    own, of_landmarks = (np.linalg.norm([getattr(sizes, kind) for kind in kinds]) for sizes in (SCALED, LANDMARKS))
    np.testing.assert_allclose(by_frame / own, [1.0, 1.0, 3.0])
    measured = reported_of(still, np.zeros(3), LANDMARKS, centres, moved_m=np.full(3, 0.1), late=True)["moments"]
    np.testing.assert_allclose(measured, of_landmarks)
