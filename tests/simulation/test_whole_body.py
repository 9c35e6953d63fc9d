"""The whole body in space: its motions are exact, in balance over feet that stand still, and possible for a person."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from dynakin.errors import ConfigError, DynakinError
from dynakin.model.definition import load_model
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.subject import Spread, draw_subject
from dynakin.simulation.bodies.whole_body import Sole, build_body
from dynakin.simulation.jets import Jet
from dynakin.simulation.mechanics import kinematics
from dynakin.simulation.motions.posed import close_legs, knee_flexion
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.support import Support, split_between
from dynakin.simulation.trial import simulate
from support.trees import inverse_dynamics, motion_of, wrench_of_momentum

PERFECT = SensorNoise.none()
MOTIONS = ("squat", "gait")
SEEDS = (1, 2, 3)
HEIGHT_M = 1.75
BY_LANDMARKS = Spread(joint=0.0, axis=0.0)
"""A person whose joints are where landmarks have them."""
FEET = (("right foot", "foot_r"), ("left foot", "foot_l"))


@cache
def perfect(motion: str, seed: int, rate_hz: float = 100.0) -> SimulatedTrial:
    return simulate("fullbody", motion, seed, 6.0 if motion == "squat" else 3.0, rate_hz, noise=PERFECT)


def body_of(seed: int, spread: Spread) -> SimulatedBody:
    return build_body(
        draw_subject(np.random.default_rng(seed), 70.0, HEIGHT_M, "male", spread), np.random.default_rng(seed)
    )


def beside_landmarks(body: SimulatedBody, side: str) -> dict[str, np.ndarray]:
    """(3,) m to the knee from the middle of the epicondyles, to the ankle from below the malleoli, to the hip from the
    regressed one."""
    sites, tree = {site.name: site.place for site in body.sites}, {segment.name: segment for segment in body.tree}
    own, sign = ("r", 1.0) if side == "r" else ("L", -1.0)
    assert body.hips is not None
    knee, malleoli = (0.5 * (sites[f"{own}_{name}"] + sites[f"{own}_m{name}"]) for name in ("knee", "ankle"))
    return {
        "knee": tree[f"shank_{side}"].placement - knee,
        "ankle": tree[f"foot_{side}"].placement - 1.027 * malleoli,  # the ankle lies 2.7 % further down
        "hip": tree[f"thigh_{side}"].placement - body.hips.middle - [0.0, 0.0, sign * body.hips.half_width_m],
    }


def test_joints_lie_beside_their_landmarks_as_people_differ() -> None:
    """Over 60 persons by the spread's size, the left leg as the mirror image of the right."""
    drawn = [body_of(seed, Spread(joint=0.004, axis=0.05)) for seed in range(60)]
    for joint in ("hip", "knee", "ankle"):
        right, left = (np.stack([beside_landmarks(body, side)[joint] for body in drawn]) for side in "rl")
        np.testing.assert_allclose(left, right * [1.0, 1.0, -1.0], atol=1e-12)
        np.testing.assert_allclose(right.std(axis=0), 0.004 * HEIGHT_M, rtol=0.3)
    for coordinate in ("knee_angle_r", "ankle_angle_r", "subtalar_angle_r"):
        axes = np.array(
            [a.direction for body in drawn for s in body.tree for a in s.axes if a.coordinate == coordinate]
        )
        np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, rtol=1e-12)
        turns = np.linalg.norm(np.cross(axes, axes.mean(axis=0)), axis=1)
        assert np.sqrt(np.mean(turns**2)) == pytest.approx(0.05 * np.sqrt(2.0), rel=0.3)
    none = body_of(1, BY_LANDMARKS)
    assert all(np.abs(off).max() < 1e-9 for side in "rl" for off in beside_landmarks(none, side).values())


def test_stated_lengths_are_distances_of_joints() -> None:
    body = body_of(2, Spread())
    tree = {segment.name: segment for segment in body.tree}
    for length, segment in (("pelvis", "thigh_r"), ("thigh", "shank_r"), ("shank", "foot_l"), ("lumbar", "torso")):
        assert body.lengths[length] == pytest.approx(float(np.linalg.norm(tree[segment].placement)), rel=1e-12)


@pytest.mark.parametrize("motion", MOTIONS)
def test_speeds_and_accelerations_are_derivatives(motion: str) -> None:
    data = perfect(motion, 3, 1000.0).truth.data
    for value, rate in (("coordinates", "speeds"), ("speeds", "accelerations")):
        v = data[value].values
        central = (-v[4:] + 8.0 * v[3:-1] - 8.0 * v[1:-3] + v[:-4]) / 12e-3
        error = np.abs(central - data[rate].values[2:-2]).max(axis=1) / np.abs(data[rate].values).max()
        assert np.quantile(error, 0.95) < 2e-5, rate
        assert error.max() < 5e-3, rate  # where a foot leaves or lands its jerk jumps, and differences go over the edge


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_ground_gives_what_momentum_takes(motion: str) -> None:
    """Momentum from poses alone: neither velocities nor accelerations of the simulator go into it."""
    trial = perfect(motion, 2, 1000.0)
    moving = kinematics(trial.truth.tree, motion_of(trial))
    expected = wrench_of_momentum(trial.truth.tree, moving.segments, 1e-3)
    contacts = trial.truth.data["contact_wrench"].sum("contact").values
    assert np.abs(contacts - expected)[3:-3].max() < 2e-3 * np.abs(expected).max()


@pytest.mark.parametrize("motion", MOTIONS)
def test_joints_and_ground_do_the_work_that_the_energy_gains(motion: str) -> None:
    """Rolling feet turn about points at rest, but the centre of pressure moves under them: the ground works too."""
    trial = perfect(motion, 1, 1000.0)
    data = trial.truth.data
    moving = kinematics(trial.truth.tree, motion_of(trial))
    power = np.sum(data["moments"].values * data["speeds"].values, axis=1)
    for contact, segment in FEET:
        w, body = data["contact_wrench"].sel(contact=contact).values, moving.segments[segment]
        at_origin = body.velocity - np.cross(body.omega, body.origin)  # of the point of the foot at the ground origin
        power += np.sum(w[:, :3] * at_origin + w[:, 3:] * body.omega, axis=1)
    energy = (data["kinetic_energy"] + data["potential_energy"]).values
    gained = np.gradient(energy, 1e-3)
    assert np.abs(power - gained)[2:-2].max() < 3e-3 * np.abs(gained).max()


@pytest.mark.parametrize("motion", MOTIONS)
def test_moments_equal_pinocchios_with_each_foots_own_wrench(motion: str) -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed (it is in the dev extra)")
    trial = perfect(motion, 2)
    data = trial.truth.data.isel(time=slice(0, None, 25))
    outside = {segment: data["contact_wrench"].sel(contact=contact).values for contact, segment in FEET}
    expected = inverse_dynamics(pin, trial.truth.tree, motion_of(trial, 25), outside)
    assert np.abs(data["moments"].values - expected).max() < 1e-10 * np.abs(expected).max()
    root = [name for name in data["coordinate"].values if str(name).startswith("pelvis")]
    assert np.abs(data["moments"].sel(coordinate=root)).max() < 1e-8  # nothing but the ground carries the pelvis


@pytest.mark.parametrize("seed", SEEDS)
def test_squatting_feet_stay_flat_where_they_are(seed: int) -> None:
    trial = perfect("squat", seed)
    moving = kinematics(trial.truth.tree, motion_of(trial))
    for _, segment in FEET:
        foot = moving.segments[segment]
        assert np.ptp(foot.origin, axis=0).max() < 1e-11
        np.testing.assert_allclose(foot.rotation[:, 1, :], np.tile([0.0, 1.0, 0.0], (len(foot.origin), 1)), atol=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_walking_feet_roll_over_heel_and_ball_and_do_not_slip(seed: int) -> None:
    trial = perfect("gait", seed)
    sole = Sole.of(trial.truth.subject)
    moving = kinematics(trial.truth.tree, motion_of(trial))
    for contact, segment in FEET:
        foot = moving.segments[segment]
        load = trial.truth.data["contact_wrench"].sel(contact=contact, component="fy").values
        stands = load > 0.0
        speeds = np.stack([np.linalg.norm(foot.point_velocity(p), axis=1) for p in (sole.heel, sole.ball)], axis=1)
        assert stands.any()
        assert not stands.all()
        assert speeds.min(axis=1)[stands].max() < 1e-9  # one of them rests
        for place in (sole.heel, sole.ball):
            assert foot.point(place)[:, 1].min() > -0.01  # neither in stance nor in swing through the floor
        assert foot.point(sole.heel)[:, 1].max() > 0.05


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_each_foot_presses_within_its_sole(motion: str, seed: int) -> None:
    trial = perfect(motion, seed)
    sole, H = Sole.of(trial.truth.subject), trial.truth.subject.height_m
    moving = kinematics(trial.truth.tree, motion_of(trial))
    for contact, segment in FEET:
        w, foot = trial.truth.data["contact_wrench"].sel(contact=contact).values, moving.segments[segment]
        loaded = w[:, 1] > 5.0
        w = w[loaded]
        cop = np.stack([w[:, 5] / w[:, 1], np.zeros(len(w)), -w[:, 3] / w[:, 1]], axis=1)
        forward = foot.rotation[loaded][:, :, 0] * [1.0, 0.0, 1.0]
        forward /= np.linalg.norm(forward, axis=1, keepdims=True)
        # From the ankle of the flat foot: where the point rests about which the foot turns.
        rests = np.where(foot.rotation[loaded, 1, 0] > 0.0, 0, 1)
        pivots = np.stack([foot.point(p)[loaded] for p in (sole.heel, sole.ball)])[rests, np.arange(len(w))]
        along = np.sum((cop - pivots) * forward, axis=1) + np.array([sole.heel[0], sole.ball[0]])[rests]
        beside = np.abs(np.cross(forward, cop - pivots)[:, 1])
        assert along.min() > sole.back_x
        assert along.max() < sole.tip_x + 0.005
        assert beside.max() < 0.03 * H
        free = w[:, 4] - (cop[:, 2] * w[:, 0] - cop[:, 0] * w[:, 2])
        assert np.abs(free).max() < 25.0
        assert (np.hypot(w[:, 0], w[:, 2]) / w[:, 1]).max() < 0.6  # friction


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_people_move_like_that(motion: str, seed: int) -> None:
    data = trial_ranges(motion, seed)
    knee_r, knee_l = data["knee_angle_r"], data["knee_angle_l"]
    assert min(knee_r[0], knee_l[0]) > 5.0
    assert max(knee_r[1], knee_l[1]) < 120.0
    limits = {c.name: (c.minimum_deg, c.maximum_deg) for c in load_model("fullbody").model.coordinates}
    for name, (low, high) in data.items():
        least, most = limits[name]
        assert least is None or least < low, name
        assert most is None or high < most, name
    moved = ("pelvis_list", "pelvis_rotation", "hip_adduction_r", "hip_rotation_l", "lumbar_bending")
    assert all(np.ptp(data[name]) > 0.3 for name in moved)  # deg: it does leave the sagittal plane


def trial_ranges(motion: str, seed: int) -> dict[str, tuple[float, float]]:
    data = perfect(motion, seed).truth.data
    q = np.degrees(data["coordinates"].values)
    return {str(n): (q[:, k].min(), q[:, k].max()) for k, n in enumerate(data["coordinate"].values)}


@pytest.mark.parametrize("seed", SEEDS)
def test_one_foot_on_each_of_three_plates(seed: int) -> None:
    trial = perfect("gait", seed)
    carried = trial.truth.data["contact_wrench"]
    assert len(trial.recording.plates) == 3
    for plate, contact in zip(trial.recording.plates, _turns(trial), strict=True):
        loaded = plate.force[:, 1] > 0.0
        both = np.hstack([plate.force, plate.moment])[loaded]
        np.testing.assert_allclose(both, carried.sel(contact=contact).values[loaded], atol=1e-9)
        assert 0.55 < loaded.sum() / 100.0 < 0.75  # a stance, s
    data = trial.truth.data
    assert np.abs(carried.sum("contact") - data["wrench"]).max() < 1e-9
    speed = np.gradient(data["coordinates"].sel(coordinate="pelvis_tx").values, 0.01)
    assert 0.7 < speed.min() < speed.max() < 1.4


def _turns(trial: SimulatedTrial) -> list[str]:
    carried = trial.truth.data["contact_wrench"].sel(component="fy")
    return [
        max(("right foot", "left foot"), key=lambda foot: float(carried.sel(contact=foot).values @ plate.force[:, 1]))
        for plate in trial.recording.plates
    ]


@pytest.mark.parametrize("markers", ["opencap", "plug-in-gait"])
def test_markers_lie_where_the_tree_carries_them(markers: str) -> None:
    for spread in (Spread(), BY_LANDMARKS):
        trial = simulate("fullbody", "squat", 4, 5.0, noise=PERFECT, markers=markers, spread=spread)
        moving = kinematics(trial.truth.tree, motion_of(trial))
        for site in trial.truth.sites:
            carried = moving.segments[site.segment].point(site.place)
            np.testing.assert_allclose(trial.recording.marker(site.name), carried)
    joints = trial.truth.data["joint_centres"]
    if markers == "opencap":
        for name, joint in (("R_HJC_reg", "hip_r"), ("L_HJC_reg", "hip_l")):
            np.testing.assert_allclose(trial.recording.marker(name), joints.sel(joint=joint).values, atol=1e-9)
        both = 0.5 * (trial.recording.marker("r_knee") + trial.recording.marker("r_mknee"))
        np.testing.assert_allclose(both, joints.sel(joint="knee_r").values, atol=1e-9)


def test_the_two_sides_are_each_others_mirror_image() -> None:
    trial = perfect("squat", 1)
    by_name = {segment.name: segment for segment in trial.truth.tree}
    turned = np.diag([1.0, 1.0, -1.0])
    for name, right in by_name.items():
        if name.endswith("_r"):
            left = by_name[name[:-2] + "_l"]
            np.testing.assert_allclose(left.placement, turned @ right.placement)
            np.testing.assert_allclose(left.com, turned @ right.com)
            np.testing.assert_allclose(left.inertia, turned @ right.inertia @ turned)
    assert sum(segment.mass for segment in trial.truth.tree) == pytest.approx(70.0, rel=1e-12)


def test_shares_add_up_to_the_whole() -> None:
    rng = np.random.default_rng(1)
    wrench = rng.standard_normal((20, 6)) * 50.0 + [0.0, 700.0, 0.0, 0.0, 0.0, 100.0]
    right, left = np.tile([0.3, 0.0, 0.1], (20, 1)), np.tile([0.1, 0.0, -0.1], (20, 1))
    for share in (None, rng.uniform(0.0, 1.0, 20)):
        parts = split_between(wrench, Support(right, left, share))
        np.testing.assert_allclose(parts[0] + parts[1], wrench, atol=1e-9)
    alone = split_between(wrench, Support(right, left, np.ones(20)))
    np.testing.assert_allclose(alone[0], wrench, atol=1e-9)
    np.testing.assert_allclose(alone[1], 0.0, atol=1e-12)


def test_a_leg_that_does_not_reach_is_named() -> None:
    for trial in (perfect("squat", 1), simulate("fullbody", "squat", 1, 6.0, noise=PERFECT, spread=BY_LANDMARKS)):
        motion = motion_of(trial, 300)
        moving = kinematics(trial.truth.tree, motion)
        feet = {segment: moving.segments[segment] for _, segment in FEET}
        jets = {n: Jet(motion.q[:, k], motion.qd[:, k], motion.qdd[:, k]) for k, n in enumerate(motion.names)}
        found = close_legs(trial.truth.tree, jets, feet)
        for name, jet in found.items():  # from the truth's own pelvis and feet, the truth's own angles
            np.testing.assert_allclose(jet.second, jets[name].second, atol=1e-7)
    hip, ankle = (trial.truth.data["joint_centres"].sel(joint=j).values[::300] for j in ("hip_r", "ankle_r"))
    np.testing.assert_allclose(knee_flexion(trial.truth.tree, hip, ankle, "r"), found["knee_angle_r"].value, atol=1e-9)
    high = jets | {"pelvis_ty": jets["pelvis_ty"] + 0.2}
    with pytest.raises(ConfigError, match="right leg does not reach"):
        close_legs(trial.truth.tree, high, feet)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"model": "fullbody", "motion": "sway"}, "fullbody knows squat, gait"),
        ({"model": "sagittal7", "motion": "gait"}, "sagittal7 knows squat"),
        ({"model": "fullbody", "motion": "gait", "duration_s": 1.0}, "duration_s is 1, expected at least 2.5 s"),
        ({"model": "fullbody", "markers": "cgm9"}, "marker set 'cgm9': unknown"),
        ({"model": "sagittal7", "markers": "opencap"}, "markers is 'opencap' for 'sagittal7'"),
    ],
)
def test_what_cannot_be_is_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(DynakinError, match=message):
        simulate(**given)  # type: ignore[arg-type]
