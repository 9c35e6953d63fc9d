"""Errors of joints and skin that the filter does not know: their effects against models that are really changed."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from dynakin.bindings import _core
from dynakin.filter.uncertainty.arms import Arms
from dynakin.filter.uncertainty.frames import _STEP_S, Frame, Frames, any_off_plates
from dynakin.filter.uncertainty.geometry import BLOCKS, Blocks, Geometry, Parts
from dynakin.filter.uncertainty.joint_errors import OF_ROOT, JointErrors
from dynakin.filter.uncertainty.loads import HANDS
from dynakin.filter.uncertainty.locked import with_locked
from dynakin.filter.uncertainty.mass_centres import unseen_limbs
from dynakin.filter.uncertainty.reported import (
    OWN_AT_ONCE,
    OWN_LATE,
    STILL,
    VIGOROUS_GROWS,
    Own,
    beyond_vigorous,
    movement_intensity,
    reported,
)
from dynakin.filter.uncertainty.sizes import KINDS, LANDMARKS, OF_JOINTS, SCALED, SHOWS_HIPS_RAD, Sizes, usual_sizes
from dynakin.filter.uncertainty.skin import ROOT_SKIN
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.filter.uncertainty.upright import hips_turned, neutral, trunks_of
from dynakin.model.calibration.calibrated import Provenance
from dynakin.model.calibration.declared import with_loads
from dynakin.model.calibration.joint_motion import SKIN_ANGLE_RAD
from dynakin.model.spec import free_coordinates, free_names
from dynakin.model.state_priors import COMMON_SKIN
from dynakin.recordings.feet.contact import UNMEASURED
from dynakin.results.measures.sources import DERIVED, MEASURED, PRIOR, in_use
from dynakin.settings.noise import Noise
from dynakin.settings.subject import CarriedLoad
from dynakin.tree import Tree
from support.made_in_space import measured

Array = npt.NDArray[np.float64]

X, Y, Z = np.eye(3)
NOT, AS_IT_IS = np.zeros(3), np.eye(3)
REFERENCE = np.zeros(10)
Q = np.array([0.1, 0.9, -0.2, 0.2, 0.1, 0.3, 0.6, -0.2, 0.25, -0.9])
QD = np.array([0.4, -0.1, 0.2, 0.5, -0.3, 0.6, 1.2, 0.4, -0.7, -1.5])
QDD = np.array([1.0, 0.5, -1.0, 2.0, 1.0, -2.0, 5.0, -3.0, 2.0, 6.0])
CONTACT = np.array([40.0, 500.0, -60.0, 30.0, -20.0, 90.0])
"""N, N m about the ground's origin, on the shank."""
RATE = np.array([-900.0, 4000.0, 300.0, 200.0, 100.0, 700.0])
"""By how much the contact changes, N and N m a second."""
SIZES = (0.01, 0.02, 0.025, 0.03, 0.05, 0.04, 0.06, 0.07, 0.09, 0.008, 0.3, 0.015, 0.5, 0.004, 2.0, 0.7)
MOVING, MOMENTS_MOVING, OFF_PLATES = 0.1, 0.05, 0.2
NONE = Sizes(
    *np.zeros(len(SIZES) - 2),
    skin_found=1.0,
    placed=np.inf,
    own_speeds=MOVING,
    own_moments=MOMENTS_MOVING,
    vigorous=np.inf,
    own_off_plates=OFF_PLATES,
)
DECLARED = np.repeat([0.014, 0.018, 0.010], 4)


def spec(hip: Array = NOT, knee: Array = NOT, turned: Array = AS_IT_IS, roll: float | None = None) -> _core.ModelSpec:
    """Pelvis, thigh and shank; the hip and the knee misplaced on all their bones, the knee's axis turned on both; the
    knee's centre moves forward by ``roll`` m a radian, where it does."""
    names = ["tx", "ty", "tz", "tilt", "list", "rotation", "flexion", "adduction", "turn", "knee"]
    root = [_core.AxisSpec(n, "translation", e) for n, e in zip(names[:3], (X, Y, Z), strict=True)]
    root += [_core.AxisSpec(n, "rotation", e) for n, e in zip(names[3:6], (Z, X, Y), strict=True)]
    ball = [_core.AxisSpec(n, "rotation", e) for n, e in zip(names[6:9], (Z, X, Y), strict=True)]
    inertia = {
        "pelvis": np.array([10.0, 0.1, 0.2, 0.0, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0]),
        "thigh": np.array([8.0, 0.1, -1.6, 0.1, 0.5, 0.05, 0.5, 0.0, 0.0, 0.0]),
        "shank": np.array([4.0, 0.0, -0.8, 0.0, 0.3, 0.02, 0.3, 0.0, 0.0, 0.0]),
    }
    rolls = [] if roll is None else [_core.AxisSpec("knee", "translation", X, scale="roll")]
    segments = [
        _core.SegmentSpec("pelvis", axes=root, inertia=inertia["pelvis"]),
        _core.SegmentSpec(
            "thigh", "pelvis", translation=np.array([-0.05, -0.08, 0.08]) + hip, axes=ball, inertia=inertia["thigh"]
        ),
        _core.SegmentSpec(
            "shank",
            "thigh",
            translation=np.array([0.0, -0.4, 0.0]) - hip + knee,
            axes=[*rolls, _core.AxisSpec("knee", "rotation", turned @ Z)],
            inertia=inertia["shank"],
        ),
    ]
    rng = np.random.default_rng(1)
    markers = [
        _core.MarkerSpec(f"{s}{k}", s, rng.normal(0.0, 0.1, 3) + centre, estimated=[False] * 3)
        for s, centre in (("pelvis", np.zeros(3)), ("thigh", -0.2 * Y), ("shank", -0.2 * Y))
        for k in range(4)
    ]
    lengths = [] if roll is None else [_core.ParameterSpec("roll", roll, False)]
    return _core.ModelSpec("leg", [_core.CoordinateSpec(n) for n in names], lengths, segments, markers)


def changed(**errors: Array) -> _core.Model:
    """A misplaced model whose markers lie on its bones where the reference posture shows them."""
    right, wrong = _core.Model(spec()), spec(**errors)
    places = _core.marker_positions(right, np.zeros(30))
    R, p = _core.segment_poses(_core.Model(wrong), np.zeros(30))
    markers = wrong.markers
    for marker, place in zip(markers, places, strict=True):
        k = ["pelvis", "thigh", "shank"].index(marker.segment)
        marker.position = R[k].T @ (place - p[k])
    wrong.markers = markers
    return _core.Model(wrong)


def calibrated() -> Any:
    model = spec()
    return SimpleNamespace(
        provenance=Provenance(),
        heavy=False,
        own_inertia=False,
        spec=model,
        tree=Tree.of(model.segments),
        names=tuple(_core.Model(model).layout.names),
        x0=_core.Model(model).initial_state(),
        sd0=np.zeros(_core.Model(model).layout.size),
        plan=None,
        feet={"right": "shank"},
        soft_tissue_m=DECLARED,
        marker_variance=np.zeros(12),
        unmodelled_m=0.0,
        recorded_markers=tuple(m.name for m in model.markers),
        lower=np.full(30, -np.inf),
        upper=np.full(30, np.inf),
        held={},
    )


def systematic() -> Systematic:
    return Systematic(calibrated(), Noise())


def parts_of(
    subject: Systematic, q: Array, qd: Array, qdd: Array, external: Array | None = None, used: Any = None
) -> Parts:
    """Of one frame in which nothing else is unsure."""
    x = np.concatenate([q, qd, qdd, subject.geometry.x0[3 * len(q) :]])
    loads = np.zeros((len(subject.geometry.model.segment_names), 6)) if external is None else external
    known = np.zeros(len(x)), np.zeros((len(x),) * 2)
    return subject.parts_at(Frame(subject.geometry, x, loads, np.zeros_like(loads), used, known))


def one_frame(own: Blocks, x: Array, P: Array, *, late: bool, rate: Array | None = None, scale: float = 1.0) -> Frames:
    """A session's frame of covariance P by noise of this scale, with the contact on the shank."""
    return Frames(
        time=np.zeros(1),
        step_s=np.nan,
        states=x[None],
        sd={block: sd[None] for block, sd in own.items()},
        known_sd=np.ones((1, len(x))),
        known=P / scale,
        wrench=CONTACT[None, None],
        wrench_rate=np.zeros((1, 1, 6)) if rate is None else rate[None, None],
        segments=["shank"],
        used=np.ones((1, 12), dtype=bool),
        sources=np.full((1, len(Q)), MEASURED, dtype=np.uint8),
        off_plates=False,
        late=late,
        variance_scale=scale,
    )


def with_errors(subject: Systematic, *given: Any, **how: Any) -> Blocks:
    """With the errors of `one_frame`."""
    frames = one_frame(*given, scale=subject._variance_scale, **how)
    return {block: sd[0] for block, sd in subject.added(frames).items()}


def over_time(data: xr.Dataset) -> Frames:
    """Of a recording with or without estimates and deviations."""
    shape = (len(data["time"]), len(Q))
    blocks = {f"{block}{end}": (("time", "coordinate"), np.zeros(shape)) for block in BLOCKS for end in ("", "_sd")}
    return Frames.of(data.assign(blocks), 1, 1.0, late=False)


def own_of(sd: Blocks, intensity: Array, **how: Any) -> Own:
    """The filter's own of frames of this intensity, whose markers lie where the model has them."""
    sources = np.full(next(iter(sd.values())).shape, MEASURED, dtype=np.uint8)
    usual = {"variance_scale": 1.0, "moved_m": np.zeros(len(intensity)), "sources": sources}
    return Own(sd=sd, intensity=intensity, **usual | how)


def with_motion(x: Array) -> Array:
    """The state in the movement of Q, QD and QDD."""
    moving = x.copy()
    moving[: 3 * len(Q)] = np.concatenate([Q, QD, QDD])
    return moving


def found(wrong: _core.Model, q: Array) -> Array:
    """The posture in which the wrong model fits the right one's markers best, with the filter's weights."""
    places = _core.marker_positions(_core.Model(spec()), np.r_[q, np.zeros(20)])
    sd = np.hypot(np.hypot(0.0007, 0.0), 0.5 * DECLARED)[:, None]

    def misfit(x: Array) -> Array:
        return np.r_[((_core.marker_positions(wrong, np.r_[x, np.zeros(20)]) - places) / sd).ravel(), (x - q) / 0.5]

    return np.asarray(least_squares(misfit, q, xtol=1e-14, ftol=1e-14, gtol=1e-14).x)


def effects(wrong: _core.Model) -> tuple[Array, Array, Array, Array]:
    """Errors of angles, speeds, accelerations, moments of a wrong model."""
    times = (-_STEP_S, 0.0, _STEP_S)
    before, now, after = (
        found(wrong, Q + h * QD + 0.5 * h * h * QDD) - (Q + h * QD + 0.5 * h * h * QDD) for h in times
    )
    speed, acceleration = (after - before) / (2.0 * _STEP_S), (after - 2.0 * now + before) / _STEP_S**2
    external = np.zeros((3, 6))
    external[2] = CONTACT
    right = _core.joint_moments(_core.Model(spec()), np.r_[Q, QD, QDD], external)
    moments = _core.joint_moments(wrong, np.r_[Q + now, QD + speed, QDD + acceleration], external) - right
    return now, speed, acceleration, moments


def rotation(vector: Array) -> Array:
    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


@pytest.mark.parametrize("kind", ["hinge_centre", "ball_centre", "ball_across", "hinge_axes"])
def test_effects_of_a_joint_are_those_of_a_model_that_is_changed(kind: str) -> None:
    external = np.zeros((3, 6))
    external[2] = CONTACT
    parts = parts_of(systematic(), Q, QD, QDD, external)[kind]
    size = 1e-5
    if kind != "hinge_axes":
        joint, along = {
            "hinge_centre": ("knee", (X, Y, Z)),
            "ball_centre": ("hip", (X, Y)),
            "ball_across": ("hip", (Z,)),
        }[kind]
        wrong = [changed(**{joint: size * e}) for e in along]
    else:
        wrong = [changed(turned=rotation(size * e)) for e in (X, Y, Z)]
    each = [effects(model) for model in wrong]
    for k, block in enumerate(("coordinates", "speeds", "accelerations", "moments")):
        expected = np.sqrt(sum(np.square(values[k] / size) for values in each))
        tolerance = 2e-3 * expected.max()
        np.testing.assert_allclose(np.sqrt(parts[block]), expected, rtol=0.02, atol=tolerance, err_msg=block)


def test_in_the_reference_posture_a_wrong_joint_changes_lever_arms_and_no_angle() -> None:
    still = np.zeros(10)
    external = np.zeros((3, 6))
    external[2, 1] = 500.0
    parts = parts_of(systematic(), REFERENCE, still, still, external)["hinge_centre"]
    np.testing.assert_allclose(parts["coordinates"], 0.0, atol=1e-12)
    np.testing.assert_allclose(parts["speeds"], 0.0, atol=1e-9)
    # the knee's moment: 500 N up less the shank's weight, which stays with the foot, times the place forward
    np.testing.assert_allclose(np.sqrt(parts["moments"][9]), 500.0, rtol=0.1)


def test_skin_that_follows_the_knee_is_that_of_displaced_markers() -> None:
    """One marker's own displacement and one segment's common one, drawn: the variances are those of the fits."""
    rng = np.random.default_rng(2)
    model, right = _core.Model(spec()), np.r_[Q, np.zeros(20)]
    sd = 0.5 * np.repeat([0.014, 0.018, 0.010], 4)
    weight = 1.0 / np.hypot(0.0007, sd)[:, None]
    J = (_core.marker_jacobian(model, right)[:, :10].reshape(12, 3, 10) * weight[..., None]).reshape(36, 10)
    drives = {"pelvis": [6, 7, 8], "thigh": [6, 7, 8, 9], "shank": [9]}
    s = np.tanh(Q / SKIN_ANGLE_RAD)
    draws = []
    for _ in range(4000):
        d = np.zeros((12, 3))
        for k, (_, coordinates) in enumerate(drives.items()):
            for c in coordinates:
                own, common = rng.standard_normal((4, 3)), rng.standard_normal(3)
                d[4 * k : 4 * k + 4] += s[c] * (np.sqrt(1.0 - COMMON_SKIN) * own + np.sqrt(COMMON_SKIN) * common)
        d[:4] *= ROOT_SKIN
        d *= DECLARED[:, None] * weight
        draws.append(np.linalg.solve(J.T @ J + 4.0 * np.eye(10), J.T @ d.ravel()))
    parts = parts_of(systematic(), Q, QD, QDD)["skin"]
    np.testing.assert_allclose(np.sqrt(parts["coordinates"]), np.std(draws, axis=0), rtol=0.06)


def test_markers_that_nobody_sees_show_nothing() -> None:
    """Two markers of four on the segment that floats: what the skin of the others does counts for more."""
    unsure, used = systematic(), np.ones(12, dtype=bool)
    seen = parts_of(unsure, Q, QD, QDD, used=used)
    np.testing.assert_array_equal(seen["skin"]["moments"], parts_of(unsure, Q, QD, QDD)["skin"]["moments"])
    used[:2] = False
    gone = parts_of(unsure, Q, QD, QDD, used=used)
    assert gone["skin"]["coordinates"][:6].sum() > 1.5 * seen["skin"]["coordinates"][:6].sum()
    gain, _ = unsure.geometry.gain(unsure.geometry.errors.state(Q, QD, QDD), used)
    assert not gain[:, np.repeat(~used, 3)].any() and np.isfinite(gain).all()


def test_a_marker_shows_the_posture_until_a_fifth_of_a_second_after_it_was_seen() -> None:
    time, seen = np.arange(100) / 100.0, np.ones((100, 3), dtype=bool)
    seen[20:35, 0] = seen[50:90, 0] = seen[:, 1] = False
    used = in_use(seen, time)
    assert used[:50, 0].all() and not used[50:90, 0].any() and used[90:, 0].all()
    assert not used[:, 1].any() and used[:, 2].all()


def test_speeds_of_skin_are_the_rates_of_its_angles() -> None:
    """The same random displacement along the motion: its variance of speed, by differences of its effect in time."""
    subject = systematic()
    parts = parts_of(subject, Q, QD, np.zeros(10))["skin"]
    h = 1e-3
    ahead, back = (parts_of(subject, Q + t * QD, QD, np.zeros(10))["skin"]["coordinates"] for t in (h, -h))
    # d/dt sd^2 = 2 cov(angle, speed), at most 2 sd(angle) sd(speed)
    slope = np.abs(ahead - back) / (2.0 * h)
    assert (slope <= 2.0 * np.sqrt(parts["coordinates"] * parts["speeds"]) * 1.001).all()
    still = parts_of(subject, Q, np.zeros(10), np.zeros(10))["skin"]
    np.testing.assert_allclose(still["speeds"], 0.0, atol=1e-12)


def test_a_pelvis_frame_that_is_turned_mixes_its_angles_and_leaves_the_moments_of_the_knee() -> None:
    still = np.zeros(10)
    q = np.zeros(10)
    q[5] = 0.3  # rotation
    external = np.zeros((3, 6))
    external[2, 1] = 500.0
    parts = parts_of(systematic(), q, still, still, external)
    R = rotation(0.3 * Y)
    for kind, axes in (("root", (X, Y)), ("root_tilt", (Z,))):
        expected = np.zeros(3)
        for e in axes:
            turned = Rotation.from_matrix(R @ rotation(1e-6 * e)).as_euler("ZXY") - np.array([0.0, 0.0, 0.3])
            at_zero = np.array([e[2], e[0], e[1]]) * 1e-6
            expected += ((turned - at_zero) / 1e-6) ** 2
        np.testing.assert_allclose(np.sqrt(parts[kind]["coordinates"][3:6]), np.sqrt(expected), rtol=0.03, atol=2e-3)
        assert np.sqrt(parts[kind]["moments"][9]) < 1.0


def test_a_centre_of_mass_off_its_place_is_that_of_segments_that_are_changed() -> None:
    external = np.zeros((3, 6))
    external[2] = CONTACT
    x = np.r_[Q, QD, QDD]
    as_it_is = _core.joint_moments(_core.Model(spec()), x, external)
    expected = np.zeros(10)
    for k in range(3):
        for axis in range(3):
            model = spec()
            segments = model.segments
            inertia = np.array(segments[k].inertia)
            inertia[1 + axis] += 1e-3 * inertia[0]  # m times m: the first moment of a centre 1 mm off
            segments[k].inertia = inertia
            model.segments = segments
            expected += np.square((_core.joint_moments(_core.Model(model), x, external) - as_it_is) / 1e-3)
    parts = parts_of(systematic(), Q, QD, QDD, external)["mass_centre"]
    np.testing.assert_allclose(np.sqrt(parts["moments"]), np.sqrt(expected), rtol=1e-6)
    assert not any(parts[block].any() for block in ("coordinates", "speeds", "accelerations"))


def test_a_knee_that_rolls_otherwise_errs_as_one_that_is_changed() -> None:
    """No angle errs where it is straight."""
    person = calibrated()
    person.spec = spec(roll=0.0)
    person.spec.parameters = [_core.ParameterSpec("roll", 0.0, True)]
    person.names, person.x0 = tuple(_core.Model(person.spec).layout.names), _core.Model(person.spec).initial_state()
    external = np.zeros((3, 6))
    external[2] = CONTACT
    subject = Systematic(person, Noise())
    parts = parts_of(subject, Q, QD, QDD, external)["roll"]
    size = 1e-5
    for values, block in zip(effects(_core.Model(spec(roll=size))), BLOCKS, strict=True):
        expected = np.abs(values / size)
        np.testing.assert_allclose(
            np.sqrt(parts[block]), expected, rtol=0.02, atol=2e-3 * expected.max(), err_msg=block
        )
    still = np.zeros(10)
    straight = parts_of(subject, REFERENCE, still, still, external)["roll"]
    assert straight["coordinates"].max() < 1e-18


def by_rate() -> Array:
    """(C,) what moments change by a second, where the motion stays and the contact goes on changing."""
    now, then = np.zeros((2, 3, 6))
    now[2], then[2] = CONTACT, CONTACT + RATE
    x = np.r_[Q, QD, QDD]
    return np.asarray(_core.joint_moments(_core.Model(spec()), x, then)) - _core.joint_moments(
        _core.Model(spec()), x, now
    )


def test_a_clock_that_is_off_moves_moments_by_how_fast_loads_change() -> None:
    """Over time as live, and in each frame: a load passes faster than frames are sampled."""
    subject, x = Systematic(calibrated(), Noise(), replace(NONE, clock=0.004, inertia=False)), np.r_[Q, QD, QDD]
    time = 0.01 * np.arange(5)
    data = xr.Dataset(
        {
            "state": (("time", "element"), np.tile(x, (5, 1))),
            "state_sd": (("time", "element"), np.zeros((5, 30))),
            "final_covariance": (("element", "element_"), np.zeros((30, 30))),
            "foot_wrench": (("time", "foot", "component"), (CONTACT + time[:, None] * RATE)[:, None]),
            "markers_measured": (("time", "marker", "axis"), np.zeros((5, 12, 3))),
        }
        | {f"{block}{end}": (("time", "coordinate"), np.zeros((5, 10))) for block in BLOCKS for end in ("", "_sd")},
        coords={"time": time, "foot_segment": ("foot", ["shank"])},
    )
    recorded = subject.added_over_time(data, late=True)
    np.testing.assert_allclose(recorded["moments_sd"], np.tile(0.004 * np.abs(by_rate()), (5, 1)), rtol=1e-9)
    assert not recorded["speeds_sd"].any()
    own = {block: np.zeros(10) for block in BLOCKS}
    live = with_errors(subject, own, x, np.zeros((30, 30)), late=True, rate=RATE)
    np.testing.assert_allclose(live["moments"], recorded["moments_sd"][2], rtol=1e-9)


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
    late, soon = (reported(own_of(own, moving, late=each, step_s=0.01), sizes, parts) for each in (True, False))
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
        seen = own_of(own, np.zeros(2), variance_scale=scale, sources=source, off_plates=off_plates, late=late)
        found = reported(seen, NONE, parts)
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
    found = reported(own_of(own, np.zeros(1), late=True, step_s=1.0 / hz), NONE, parts)
    np.testing.assert_allclose([found["moments"] ** 2, found["speeds"] ** 2], [[[left]], [[STILL]]])
    at_once = reported(own_of(own, np.zeros(1), late=False, step_s=1.0 / hz), NONE, parts)
    np.testing.assert_allclose(at_once["moments"] ** 2, OWN_AT_ONCE["moments"][0])


def with_inertia() -> tuple[Any, Array]:
    """The model whose shank's mass and first moments are estimated, and its state."""
    model = spec()
    segments = model.segments
    segments[2].inertia_estimated = [True] * 4 + [False] * 6
    model.segments = segments
    subject, core = calibrated(), _core.Model(model)
    subject.spec, subject.names, subject.sd0 = model, tuple(core.layout.names), np.zeros(core.layout.size)
    subject.lower, subject.upper = np.full(34, -np.inf), np.full(34, np.inf)
    return subject, np.r_[Q, QD, QDD, core.initial_state()[30:]]


def by_inertia(subject: Any, x: Array, root: Array) -> Array:
    """(10,) variances of moments of bodies drawn with a covariance root root'."""
    core, external, h = _core.Model(subject.spec), np.zeros((3, 6)), 1e-3
    external[2] = CONTACT
    as_it_is = _core.joint_moments(core, x, external)
    change = [  # moments are linear in inertia
        (_core.joint_moments(core, x + h * np.r_[np.zeros(30), a], external) - as_it_is) / h for a in root.T
    ]
    return np.asarray(np.square(change).sum(axis=0))


def test_inertia_that_small_innovations_leave_open_is_known_by_the_declared_noise() -> None:
    """A shank's mass and first moments of some covariance, against moments of bodies drawn from it."""
    subject, x = with_inertia()
    root = 0.1 * np.random.default_rng(4).normal(size=(4, 4))
    P = np.zeros((34, 34))
    P[30:, 30:] = root @ root.T
    variance = by_inertia(subject, x, root)
    own = {block: np.zeros(10) for block in ("coordinates", "speeds", "accelerations")} | {"moments": np.sqrt(variance)}
    found = Systematic(subject, Noise(variance_scale=0.2), NONE)
    for late in (True, False):  # the factor on the filter's own counts nothing twice
        seen = with_errors(found, own, x, P, late=late)
        np.testing.assert_allclose(seen["moments"], np.sqrt(variance / 0.2), rtol=1e-6)
        np.testing.assert_array_equal(seen["speeds"], 0.0)
    for late, factor in ((True, STILL), (False, OWN_AT_ONCE["moments"][0])):
        wide = Systematic(subject, Noise(variance_scale=1.5 / factor), NONE)  # the filter's own part has more of it
        seen = with_errors(wide, own, x, P, late=late)
        np.testing.assert_allclose(seen["moments"], np.sqrt(factor * variance), rtol=1e-6)
        scaled = Systematic(subject, Noise(variance_scale=0.2), replace(NONE, inertia=False))
        seen = with_errors(scaled, own, x, P, late=late)
        np.testing.assert_allclose(seen["moments"], np.sqrt(factor * variance), rtol=1e-6)


def test_the_scale_of_systematic_errors_is_that_of_joints_and_skin() -> None:
    """What is not known of inertia has no usual size: another scale leaves it."""
    subject, x = with_inertia()
    subject.plan = SimpleNamespace(sites=())  # joints found from markers
    P = np.zeros((34, 34))
    P[30:, 30:] = 0.01 * np.eye(4)
    own = {block: np.zeros(10) for block in ("coordinates", "speeds", "accelerations", "moments")}
    said = [
        with_errors(Systematic(subject, Noise(variance_scale=0.2, systematic_scale=scale)), own, x, P, late=False)
        for scale in (1e-9, 1.0, 2.0)
    ]
    expected = (1.0 / 0.2 - OWN_AT_ONCE["moments"][0]) * by_inertia(subject, x, 0.1 * np.eye(4))
    np.testing.assert_allclose(said[0]["moments"], np.sqrt(expected), rtol=1e-6)
    np.testing.assert_allclose(said[2]["speeds"], 2.0 * said[1]["speeds"], rtol=1e-9)
    one, two = (np.square(each["moments"]) - expected for each in said[1:])
    np.testing.assert_allclose(two, 4.0 * one, rtol=1e-6)


def test_over_time_inertia_is_known_as_well_as_in_each_frame() -> None:
    """Deviations that a recording halves from frame to frame: moments' are those of a session at that moment."""
    subject, x = with_inertia()
    A = 0.1 * np.random.default_rng(4).normal(size=(4, 4))
    root = np.eye(34)
    root[30:, 30:] = A
    last, s = root @ root.T, 0.2
    time = 0.2 * np.arange(4)
    wider = 2.0 ** np.arange(4)[::-1]
    sd = np.sqrt(np.diag(last)) * np.array([np.r_[np.ones(30), np.full(4, w / np.sqrt(s))] for w in wider])
    data = xr.Dataset(
        {
            "state": (("time", "element"), np.tile(x, (4, 1))),
            "state_sd": (("time", "element"), sd),  # constants' by the declared noise
            "final_covariance": (("element", "element_"), last),
            "foot_wrench": (("time", "foot", "component"), np.tile(CONTACT, (4, 1, 1))),
            "markers_measured": (("time", "marker", "axis"), np.zeros((4, 12, 3))),
        },
        coords={"time": time, "foot_segment": ("foot", ["shank"])},
    )
    found = Systematic(subject, Noise(variance_scale=s), NONE)
    variance = by_inertia(subject, x, A)
    expected = wider[:, None] ** 2 * variance / s
    np.testing.assert_allclose(found.parts(over_time(data))["inertia"]["moments"], expected, rtol=1e-6)
    blocks = ("coordinates", "speeds", "accelerations", "moments")
    data = data.assign(
        {f"{b}{end}": (("time", "coordinate"), np.zeros((4, 10))) for b in blocks for end in ("", "_sd")}
    )
    recorded = found.added_over_time(data, late=False)["moments_sd"].values
    own = {block: np.zeros(10) for block in blocks}
    for k, w in enumerate(wider):
        scales = np.r_[np.ones(30), np.full(4, w)]
        live = with_errors(found, own, x, np.outer(scales, scales) * last, late=False)
        np.testing.assert_allclose(recorded[k], live["moments"], rtol=1e-9)


def test_a_skeleton_whose_markers_lie_elsewhere_has_centres_of_joints_that_are_as_much_less_sure() -> None:
    person = calibrated()
    markers = person.spec.markers
    for marker in markers:
        marker.estimated = [True] * 3
    person.spec.markers = markers
    core = _core.Model(person.spec)
    person.names, person.x0 = tuple(core.layout.names), core.initial_state()
    x = person.x0
    subject, moved = Systematic(person, Noise()), x.copy()
    moved[-3 * len(person.spec.markers) + 1 :: 3] += 0.012
    assert subject.moved_m(x) == 0.0
    assert subject.moved_m(moved) == pytest.approx(0.012)
    assert systematic().moved_m(x) == 0.0  # no marker is looked for
    own = dict.fromkeys(BLOCKS, np.full(len(Q), 0.01)) | {"speeds": np.full(len(Q), 0.1)}
    own |= {"accelerations": np.full(len(Q), 10.0)}
    said = [
        with_errors(subject, own | {"moments": np.ones(len(Q))}, state, np.eye(len(x)), late=True)
        for state in (with_motion(x), with_motion(moved))
    ]
    assert (said[1]["moments"] >= said[0]["moments"]).all() and said[1]["moments"][-1] > 1.1 * said[0]["moments"][-1]
    assert (
        subject.misfit(x) == []
        and "12 mm" in subject.misfit(moved)[0].text
        and "4.0 times" in subject.misfit(moved)[0].text
    )
    none = {kind: dict.fromkeys(BLOCKS, np.zeros((3, 1))) for kind in (*KINDS, "inertia")}
    centres = none | dict.fromkeys(("hinge_centre", "ball_centre"), dict.fromkeys(BLOCKS, np.ones((3, 1))))
    still, moved_m = dict.fromkeys(BLOCKS, np.zeros((3, 1))), SCALED.placed * np.array([0.5, 1.0, 3.0])
    by_frame = reported(own_of(still, np.zeros(3), moved_m=moved_m, late=True), SCALED, centres)["moments"][:, 0]
    np.testing.assert_allclose(by_frame / np.hypot(SCALED.hinge_centre, SCALED.ball_centre), [1.0, 1.0, 3.0])
    measured = reported(own_of(still, np.zeros(3), moved_m=np.full(3, 0.1), late=True), LANDMARKS, centres)["moments"]
    np.testing.assert_allclose(measured, np.hypot(LANDMARKS.hinge_centre, LANDMARKS.ball_centre))


def test_a_joint_of_which_a_rotation_is_held_is_the_joint_that_it_was() -> None:
    model = spec()
    coordinates = model.coordinates
    coordinates[8].locked = True  # the hip's turn about the thigh
    model.coordinates = coordinates
    seen = [set(JointErrors.of(model, np.zeros(10), held).kinds) for held in ((), ("turn",))]
    assert "pair_axes" in seen[0] and "pair_axes" not in seen[1]
    assert {"ball_axes", "ball_centre"} <= seen[1] and not {"ball_axes", "ball_centre"} & seen[0]


def test_a_pelvis_is_as_sure_whichever_way_the_person_faces() -> None:
    """Its tilt and list are about axes of the laboratory: of who faces backwards both change sign, with their zero.
    Its frame's own third axis is the one about which it is less sure."""
    standing = measured()
    heading = standing.names.index("pelvis_rotation")
    said = []
    for turn in (0.0, np.pi, 0.5 * np.pi):
        x0 = standing.x0.copy()
        x0[heading] += turn
        found = Systematic(replace(standing, x0=x0), Noise())
        q = found.geometry.reference + 0.05 * np.sin(np.arange(len(found.geometry.reference)))
        still = np.zeros_like(q)
        parts = parts_of(found, q, still, still)
        places = [standing.names.index(name) for name in ("hip_flexion_r", "hip_adduction_r", "hip_rotation_r")]
        said.append(np.concatenate([parts[kind]["coordinates"][places] for kind in OF_ROOT]))
        assert all((parts[kind]["coordinates"] < 0.3).all() for kind in OF_ROOT)
    np.testing.assert_allclose(said[1:], [said[0]] * 2, rtol=0.1, atol=1e-6)


def test_of_a_heavy_person_the_tables_are_not_believed_and_that_is_said() -> None:
    """Unless identified parameters take the tables' place; an .osim has bodies of its own."""
    usual, heavy = measured(), replace(measured(), mass_kg=100.0, height_m=1.7, height_stated=True)
    assert usual_sizes(usual) == LANDMARKS and usual.unlike_the_tables() == []
    wide = usual_sizes(heavy)
    assert wide.mass_centre >= 2.0 * LANDMARKS.mass_centre and wide.skin >= 1.5 * LANDMARKS.skin
    (said,) = heavy.unlike_the_tables()
    assert said.level == "warning" and "100 kg at 1.70 m (35 kg/m2)" in said.text
    identified = replace(heavy, own_inertia=True)
    assert identified.unlike_the_tables() == []
    assert usual_sizes(identified) == replace(LANDMARKS, skin=wide.skin, skin_found=wide.skin_found)
    for other in (replace(heavy, height_stated=False), replace(heavy, height_m=None), replace(heavy, plan=None)):
        assert not other.heavy and other.unlike_the_tables() == []


def test_a_clock_that_is_known_worse_counts_for_more() -> None:
    subject = Systematic(calibrated(), Noise())
    assert subject.with_found(0.5 * subject.sizes.clock).sizes == subject.sizes
    coarse = subject.with_found(0.01)
    assert coarse.sizes == replace(subject.sizes, clock=0.01) and subject.sizes.clock < 0.01
    own = dict.fromkeys(BLOCKS, np.zeros(10))
    state = (own, np.r_[Q, QD, QDD], np.zeros((30, 30)))
    surer, less = (with_errors(each, *state, late=True, rate=RATE)["moments"] for each in (subject, coarse))
    still = with_errors(subject, *state, late=True)["moments"]
    by_clock = (less**2 - still**2) / (surer**2 - still**2)
    np.testing.assert_allclose(by_clock[surer > 1.001 * still], (0.01 / subject.sizes.clock) ** 2)


def test_a_load_in_the_hands_counts_in_the_moments_that_bear_it() -> None:
    """As much as bodies do that are welded to both hands of a model that stands still, bent at the elbows."""
    person = measured()
    names = list(person.names)
    x = np.array(person.x0)
    x[[names.index(f"elbow_flex_{side}") for side in "rl"]] += 1.2
    own = {segment.name: np.asarray(segment.inertia) for segment in person.spec.segments}
    free = _core.joint_moments(_core.Model(person.spec), x, np.zeros((len(own), 6)))
    square = np.zeros(len(free))
    for hand in HANDS:
        place = tuple(own[hand][1:4] / own[hand][0])
        laden = with_loads(person, [CarriedLoad(segment=hand, mass_kg=1.0, place_m=place)])
        square += 0.5 * np.square(_core.joint_moments(_core.Model(laden.spec), x, np.zeros((len(own) + 1, 6))) - free)
    coordinates = [c.name for c in person.spec.coordinates]
    subject = Systematic(person, Noise())
    motion = x[: 3 * len(subject.geometry.free)].reshape(3, -1)
    borne = parts_of(subject, *motion)["hands"]["moments"]
    inner = [k for k, name in enumerate(coordinates) if not name.startswith("pelvis")]
    np.testing.assert_allclose(borne[inner], square[inner], atol=1e-9)
    elbow, knee = (coordinates.index(name) for name in ("elbow_flex_r", "knee_angle_r"))
    assert 1.0 < np.sqrt(borne[elbow]) < 3.0 and borne[knee] == 0.0
    with_it = subject.with_found(0.0, 3.0)
    assert with_it.sizes == replace(subject.sizes, hands=3.0)
    own_sd = {block: np.zeros(len(coordinates)) for block in BLOCKS}
    frames = replace(
        one_frame(own_sd, x, np.zeros((len(x), len(x))), late=True),
        wrench=np.zeros((1, 0, 6)),
        wrench_rate=np.zeros((1, 0, 6)),
        segments=[],
        used=np.ones((1, len(person.spec.markers)), dtype=bool),
        sources=np.full((1, len(coordinates)), MEASURED, dtype=np.uint8),
    )
    without, held = (each.added(frames)["moments"][0] for each in (subject, with_it))
    np.testing.assert_allclose(held[inner] ** 2 - without[inner] ** 2, 9.0 * borne[inner], atol=1e-9)


def test_a_clock_that_is_off_counts_in_what_contacts_give_as_in_moments() -> None:
    """A load that comes on 8 ms later than it did is off by 8 ms of its change, in the foot's wrench and in the sum."""
    time = 0.01 * np.arange(4.0)
    wrench = CONTACT + time[:, None, None] * RATE
    wrench = np.concatenate([wrench, 0.5 * wrench], axis=1)
    per_coordinate, per_contact = ("time", "coordinate"), ("time", "foot", "component")
    state = np.tile(with_motion(calibrated().x0), (4, 1))
    data = xr.Dataset(
        {f"{block}_sd": (per_coordinate, np.full((4, 10), 0.1)) for block in BLOCKS}
        | {
            "moments": (per_coordinate, np.zeros((4, 10))),
            "state": (("time", "element"), state),
            "state_sd": (("time", "element"), np.zeros_like(state)),
            "final_covariance": (("element", "element_"), np.zeros((state.shape[1],) * 2)),
            "markers_measured": (("time", "marker", "axis"), np.zeros((4, 12, 3))),
            "foot_contact": (("time", "foot"), np.ones((4, 2), np.uint8)),
            "foot_wrench": (per_contact, wrench),
            "foot_wrench_sd": (per_contact, np.full((4, 2, 6), 3.0)),
            "wrench_measured": (("time", "component"), np.where(time[:, None] < 0.03, wrench.sum(axis=1), np.nan)),
            "wrench_estimated": (("time", "component"), wrench.sum(axis=1)),
            "wrench_sd": (("time", "component"), np.full((4, 6), 4.0)),
        },
        coords={"time": time, "foot_segment": ("foot", ["shank", "pelvis"])},
    )
    before, after = (systematic().with_found(clock_s).added_over_time(data, late=True) for clock_s in (0.0, 0.008))
    for found, clock_s in ((before, LANDMARKS.clock), (after, 0.008)):
        each = np.hypot(3.0, clock_s * np.stack([RATE, 0.5 * RATE]))
        np.testing.assert_allclose(found["foot_wrench_sd"], np.broadcast_to(each, (4, 2, 6)))
        np.testing.assert_allclose(found["wrench_sd"][:3], np.tile(np.hypot(4.0, clock_s * 1.5 * RATE), (3, 1)))
        np.testing.assert_array_equal(found["wrench_sd"][3], np.full(6, 4.0))  # derived: no plate's clock is in it
    assert (after["moments_sd"][:, 9] > before["moments_sd"][:, 9]).all()
    beside = data.assign(foot_contact=(("time", "foot"), np.array([[1, UNMEASURED]] * 4, np.uint8)))
    found = systematic().with_found(0.008).added_over_time(beside, late=True)["foot_wrench_sd"]
    np.testing.assert_array_equal(found[:, 0], after["foot_wrench_sd"][:, 0])
    np.testing.assert_array_equal(found[:, 1], np.full((4, 6), 3.0))


def test_arms_have_their_zero_where_they_hang() -> None:
    """Palms lie a quarter turn and more from an angle of 0: a tilted axis of elbows was said to move the forearm all
    of that way. Trunk and legs stand straight."""
    person = measured()
    names = list(person.names)
    arms = [
        k for k, name in enumerate(names) if name.endswith(("_r", "_l")) and name.startswith(("arm", "elbow", "pro"))
    ]
    x0 = person.x0.copy()
    for name, angle in (("pro_sup", 2.0), ("elbow_flex", 0.6), ("arm_flex", 0.4), ("hip_flexion", 0.5)):
        x0[[names.index(f"{name}_{side}") for side in "rl"]] = angle
    x0[names.index("lumbar_extension")] = -0.2
    person = replace(person, x0=x0)
    upright = dict(zip([c.name for c in person.spec.coordinates], neutral(person), strict=True))
    assert [upright[name] for name in ("pro_sup_r", "elbow_flex_l", "arm_flex_r")] == [2.0, 0.6, 0.4]
    assert upright["hip_flexion_r"] == upright["lumbar_extension"] == 0.0
    found = Systematic(person, Noise())
    q = found.geometry.reference.copy()
    still = np.zeros_like(q)
    hanging = parts_of(found, q, still, still)
    assert all(hanging[kind]["coordinates"][arms].max() < 1e-12 for kind in OF_JOINTS)
    q[arms] += 0.2
    moved = sum(LANDMARKS.pair_axes**2 * parts_of(found, q, still, still)["pair_axes"]["coordinates"][arms])
    assert 0.0 < np.degrees(np.sqrt(moved)) < 3.0


def test_the_spine_is_no_joint_of_one_centre() -> None:
    """What hangs on the pelvis and bears no foot is less sure of its centre in the sagittal plane, by size and kind."""
    person = measured()
    assert trunks_of(person) == {"torso"}
    found = Systematic(person, Noise())
    q = found.geometry.reference.copy()
    q[person.names.index("lumbar_bending")] += 0.3
    still = np.zeros_like(q)
    parts = parts_of(found, q, still, still)
    bending = person.names.index("lumbar_bending")
    spine, hips = (parts[kind]["coordinates"][bending] for kind in ("spine_centre", "ball_centre"))
    assert spine > 10.0 * hips and LANDMARKS.spine_centre > 10.0 * LANDMARKS.ball_centre


def test_hips_that_do_not_turn_stay_where_a_regression_has_them() -> None:
    standing = measured()
    subject, spec = Systematic(standing, Noise()), standing.spec
    K = len(free_names(spec))
    q, still = standing.x0[:K], np.zeros(K)
    external = np.zeros((len(spec.segments), 6))
    external[[s.name for s in spec.segments].index(standing.feet["right"])] = [0.0, 700.0, 0.0, 0.0, 0.0, 0.0]
    names = [c.name for c in spec.coordinates]
    flexion, knee, other = (names.index(n) for n in ("hip_flexion_r", "knee_angle_r", "hip_flexion_l"))
    sd = np.sqrt(parts_of(subject, q, still, still, external)["hips"]["moments"])
    assert sd[flexion] == pytest.approx(700.0 * standing.sd0[standing.names.index("length/hip_forward")], rel=0.15)
    assert sd[knee] < 0.3 * sd[flexion] and sd[other] < 0.3 * sd[flexion]
    turns = [0.0, SHOWS_HIPS_RAD, np.inf]
    found = [subject.with_found(0.0, hips_turned=turned).sizes.hips for turned in turns]
    np.testing.assert_allclose(found, [1.0, np.sqrt(0.5), 0.0])
    moving = np.zeros((3, K))
    moving[:, names.index("hip_flexion_r")] = [-0.1, 0.0, 0.1]  # both legs: rms of one alone over root 2
    assert hips_turned(standing, moving) == pytest.approx(np.sqrt(0.02 / 3.0 / 2.0))
    assert hips_turned(calibrated(), np.zeros((0, 10))) == np.inf
    functional = replace(standing.provenance, hips="functional")
    for other in (replace(standing, plan=None), replace(standing, provenance=functional)):  # no regression
        assert not parts_of(Systematic(other, Noise()), q, still, still, external)["hips"]["moments"].any()


def test_more_skin_than_usual_counts_for_more_and_less_for_no_less() -> None:
    subject = Systematic(calibrated(), Noise())
    usual = subject.sizes.skin_found
    assert subject.with_found(0.0, skin=0.5 * usual).sizes == subject.with_found(0.0).sizes == subject.sizes
    assert subject.with_found(0.0, skin=2.0 * usual).sizes == replace(subject.sizes, skin=2.0 * subject.sizes.skin)


def locked_leg(turning_rad: Array) -> tuple[Any, xr.Dataset]:
    """The leg with a hip that its file does not let rotate, and a run over markers of a person who does so: the filter
    has everything else right."""
    subject, open_model = calibrated(), _core.Model(spec())
    subject.spec.coordinates = [_core.CoordinateSpec(c.name, c.value, c.name == "turn") for c in spec().coordinates]
    model = _core.Model(subject.spec)
    subject.names, subject.x0 = tuple(model.layout.names), model.initial_state()
    subject.sd0 = np.zeros(len(subject.names))
    subject.lower, subject.upper = np.full(27, -np.inf), np.full(27, np.inf)
    free, time = free_coordinates(subject.spec), np.arange(len(turning_rad)) / 100.0
    frames, posture = len(time), np.where(np.arange(10) == 8, 0.0, Q)
    state = np.tile(np.r_[posture[free], np.zeros(18)], (frames, 1))
    seen = np.array(
        [_core.marker_positions(open_model, np.r_[posture + a * np.eye(10)[8], np.zeros(20)]) for a in turning_rad]
    )
    has = np.array([_core.marker_positions(model, x) for x in state])
    each = {"coordinate": [c.name for c in subject.spec.coordinates]}
    data = xr.Dataset(
        {
            "state": (("time", "element"), state),
            "markers_measured": (("time", "marker", "axis"), seen),
            "markers_estimated": (("time", "marker", "axis"), has),
            "verdict": (("time", "sensor"), np.zeros((frames, 13), dtype=np.uint8)),
            "lost": ("time", np.zeros(frames, dtype=bool)),
            "foot_wrench": (("time", "foot", "component"), np.tile(CONTACT, (frames, 1, 1))),
            **{f"{b}_sd": (("time", "coordinate"), np.tile(0.01 * (np.arange(10) != 8), (frames, 1))) for b in BLOCKS},
        },
        coords=each
        | {
            "time": time,
            "coordinate_type": ("coordinate", ["translation"] * 3 + ["rotation"] * 7),
            "foot_segment": ("foot", ["shank"]),
        },
    )
    return subject, data


def test_what_a_person_moves_of_a_locked_coordinate_is_found_said_and_in_the_deviations() -> None:
    turning = np.radians(8.0) * np.sin(2.0 * np.pi * np.arange(150) / 100.0)
    subject, data = locked_leg(turning)
    found, (said,) = with_locked(data, subject, Systematic(subject, Noise()), "person.osim")
    assert said.level == "warning" and said.topic == "scaling"
    assert "person.osim locks turn, " in said.text and " 5 deg (root mean square)" in said.text
    sd = found["coordinates_sd"].sel(coordinate="turn").values
    assert np.abs(sd - turning.std()).mean() < 0.4 * turning.std()
    on_neighbours = found["coordinates_sd"].sel(coordinate=["flexion", "adduction", "knee"])
    assert on_neighbours.max() > 0.02 and (found["moments_sd"] >= data["moments_sd"]).all()


def test_a_locked_coordinate_that_stands_still_is_not_accused() -> None:
    """Skin moves a thigh's markers against the pelvis by as much."""
    subject, data = locked_leg(np.radians(1.0) * np.sin(2.0 * np.pi * np.arange(150) / 100.0))
    found, said = with_locked(data, subject, Systematic(subject, Noise()), "person.osim")
    assert not said
    others = [name for name in data["coordinate"].values if name != "turn"]
    for block in BLOCKS:
        xr.testing.assert_allclose(*(each[f"{block}_sd"].sel(coordinate=others) for each in (found, data)))
    turned = found["coordinates_sd"].sel(coordinate="turn")
    assert turned.min() > 0.003 and turned.max() < 0.02  # but what its markers show is no more than that


def test_a_coordinate_that_is_locked_at_a_wrong_value_is_said() -> None:
    """It does not move, but the file's places of markers tell."""
    subject, data = locked_leg(np.full(60, 0.2))
    found, (said,) = with_locked(data, subject, Systematic(subject, Noise()), "person.osim")
    assert said.level == "warning" and "person.osim locks turn 11 deg from where the markers show" in said.text
    others = found["coordinates_sd"].sel(coordinate=["flexion", "adduction", "knee"])
    assert (others < 0.011).all()  # an angle's deviation is without its zero


def test_a_model_that_locks_nothing_is_left_alone() -> None:
    _, data = locked_leg(np.zeros(50))
    whole = calibrated()
    assert with_locked(data, whole, Systematic(whole, Noise()), "person.osim") == (data, [])


def test_arms_that_a_file_does_not_have_swing_at_the_joint_below_the_trunk() -> None:
    person = replace(measured(), plan=None)
    assert Arms.of(person) is None and Arms.of(measured()) is None
    gone = set(person.tree.below(*trunks_of(person))) - trunks_of(person)
    bare = copy(person.spec)
    bare.segments = [segment for segment in bare.segments if segment.name not in gone]
    bare.markers = [marker for marker in bare.markers if marker.segment not in gone]
    kept = {axis.coordinate for segment in bare.segments for axis in segment.axes}
    bare.coordinates = [c for c in bare.coordinates if c.name in kept]
    model = _core.Model(bare)
    armless = replace(person, spec=bare)
    arms = Arms.of(armless)
    assert arms is not None and arms.trunk in trunks_of(person)
    assert 2.0 < arms.mass_kg < 4.0 and 0.2 < arms.reach_m < 0.6
    assert not unseen_limbs(armless)  # nothing of the model is: plates are looked for as of any other
    assert arms.raised == {arms.trunk: arms.mass_kg * arms.reach_m}
    names = [c.name for c in bare.coordinates]
    free = free_names(bare)
    still, walking = np.zeros(len(free)), np.zeros(len(free))
    walking[[free.index("hip_flexion_r"), free.index("hip_flexion_l")]] = 10.0, -10.0
    x = np.array(model.initial_state())
    geometry: Any = SimpleNamespace(model=model, x0=x, count=len(names))
    geometry.moments_by = partial(Geometry.moments_by, geometry)
    found = np.sqrt(arms.variances(geometry, (x[: len(free)], still, walking)))
    spine = [names.index(name) for name in ("lumbar_extension", "lumbar_bending", "lumbar_rotation")]
    legs = [k for k, name in enumerate(names) if name.startswith(("hip", "knee", "ankle"))]
    assert found[spine[0]] > 1.5 and found[spine[2]] > 1.5 and not found[legs].any()
    assert not arms.variances(geometry, (x[: len(free)], still, still)).any()
