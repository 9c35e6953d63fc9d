"""The whole body in space: measured on a person who stands, started anywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.filter.estimator import Estimator
from dynakin.filter.uncertainty.sizes import LANDMARKS, ONE_SIDED, SINCE_CENTRE, less_sure_joints
from dynakin.model.calibration.how import Calibration
from dynakin.model.definition import load_model
from dynakin.recordings.feet.contact import SHARED_PLATE
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Recording
from dynakin.report.findings.forces import moments
from dynakin.results.measures.metrics import compute_metrics
from support.made_in_space import RATE, WHO, definition, measured, recording_of, standing, standing_places, states

LABORATORY = GroundFrame(np.eye(3), np.zeros(3), "+Y", np.array([1.0, 0.0, 0.0]))


def test_a_symmetric_person_is_measured_symmetrically_and_upright() -> None:
    initial = measured()
    start, geometry = initial.plan.start, initial.plan.geometry
    for name, value in start.items():
        if name.endswith("_r"):
            assert value == pytest.approx(start[name[:-2] + "_l"], abs=1e-6), name
    for name in ("pelvis_list", "pelvis_rotation", "lumbar_bending", "lumbar_rotation", "pelvis_tz"):
        assert start[name] == pytest.approx(0.0, abs=1e-6)
    assert 0.38 < geometry.lengths["thigh"] < 0.44 and 0.38 < geometry.lengths["shank"] < 0.44
    assert initial.feet == {"right": "foot_r", "left": "foot_l"}
    assert sum(body.mass for body in initial.plan.inertia.values()) == pytest.approx(70.0)
    for name, body in initial.plan.inertia.items():
        assert body.possible(), name
        if name.endswith("_r"):
            np.testing.assert_allclose(initial.plan.inertia[name[:-2] + "_l"].mirrored().vector, body.vector, atol=1e-9)


def test_markers_stand_where_they_were_measured_and_knees_lie_inside() -> None:
    initial = measured()
    core = _core.Model(initial.spec)
    places = standing_places()
    found = _core.marker_positions(core, core.initial_state())
    away = [np.linalg.norm(p - places[name]) for p, name in zip(found, initial.recorded_markers, strict=True)]
    assert max(away) < 1e-3
    _, origins = _core.segment_poses(core, core.initial_state())
    knee = origins[core.segment_names.index("shank_r")]
    assert np.linalg.norm(knee - places["RKNE"]) == pytest.approx(0.02797 * 1.75 + 0.007, abs=2e-3)
    assert knee[2] < places["RKNE"][2] - 0.04


def test_signs_are_those_of_opensim() -> None:
    """A positive coordinate moves what it should, on both sides."""
    initial = measured()
    core = _core.Model(initial.spec)
    names, x0 = list(core.layout.names), core.initial_state()
    before = _core.marker_positions(core, x0)
    k = {name: i for i, name in enumerate(initial.recorded_markers)}

    def moved(coordinate: str, marker: str) -> np.ndarray:
        x = x0.copy()
        x[names.index(coordinate)] += 0.2
        return np.asarray(_core.marker_positions(core, x)[k[marker]] - before[k[marker]])

    for side, out in (("r", 1.0), ("l", -1.0)):
        S = side.upper()
        assert moved(f"hip_flexion_{side}", f"{S}KNE")[0] > 0.05
        assert moved(f"hip_adduction_{side}", f"{S}ANK")[2] * out < -0.1
        assert moved(f"hip_rotation_{side}", f"{S}TOE")[2] * out < -0.01  # toes inward
        assert moved(f"knee_angle_{side}", f"{S}ANK")[0] < -0.05
        assert moved(f"ankle_angle_{side}", f"{S}TOE")[1] > 0.02
        assert moved(f"subtalar_angle_{side}", f"{S}MT5")[1] < 0.0  # sole turns inward, outer edge down
        assert moved(f"arm_flex_{side}", f"{S}ELB")[0] > 0.03
        assert moved(f"arm_add_{side}", f"{S}ELB")[2] * out < -0.03
        assert moved(f"elbow_flex_{side}", f"{S}WRA")[0] > 0.02
    assert moved("pelvis_tilt", "CLAV")[0] < -0.03  # backward
    assert moved("lumbar_extension", "CLAV")[0] < -0.03
    assert moved("lumbar_bending", "CLAV")[2] > 0.03  # to the right
    assert moved("pelvis_rotation", "RASI")[0] > 0.0 or moved("pelvis_rotation", "RASI")[2] < 0.0


@pytest.mark.parametrize("seed", range(4))
def test_starts_at_any_heading_in_any_pose(seed: int) -> None:
    rng, initial = np.random.default_rng(seed), measured()
    time = np.arange(20) / RATE
    pose = {
        f"{name}_{side}": np.full(20, np.deg2rad(rng.uniform(low, high)))
        for side in "rl"
        for name, low, high in (
            ("hip_flexion", -10, 90),
            ("hip_adduction", -25, 5),
            ("knee_angle", 0, 110),
            ("arm_flex", 0, 120),
            ("elbow_flex", 0, 80),
        )
    }
    x = states(initial, pose, rng.uniform(-np.pi, np.pi), rng.uniform(-3, 3, 3), time)
    trial = recording_of(initial, x, time, plates=False, noise_m=0.001)
    found = definition().calibrate(trial, static=standing(), how=Calibration(ground=LABORATORY))
    n = len([c for c in found.spec.coordinates if not c.locked])
    names = list(found.names)
    turned = [k for k in range(n) if not names[k].startswith("pelvis_t") or names[k] == "pelvis_tilt"]
    difference = np.rad2deg((found.x0[turned] - x[0, turned] + np.pi) % (2 * np.pi) - np.pi)
    assert np.abs(difference).max() < 3.0
    assert np.abs(found.x0[:n] - x[0, :n])[[names.index(f"pelvis_t{a}") for a in "xyz"]].max() < 0.005


def squat(time: np.ndarray) -> dict[str, np.ndarray]:
    """Both knees to 60 deg and back in 2 s; hips and ankles follow, and the pelvis goes down."""
    depth = 0.5 * (1.0 - np.cos(np.pi * time))
    motion = {f"{name}_{side}": np.deg2rad(deg) * depth for side in "rl"
              for name, deg in (("knee_angle", 60.0), ("hip_flexion", 55.0), ("ankle_angle", 20.0))}  # fmt: skip
    return motion | {"pelvis_ty": -0.10 * depth, "pelvis_tilt": np.deg2rad(-10.0) * depth}


def test_skin_that_never_comes_back_to_where_it_was_measured_leaves_places_less_known() -> None:
    """A squat comes back to standing; its bottom alone does not, and feet stay where they were."""
    initial = measured()
    time = np.arange(200) / RATE
    x = states(initial, squat(time), 0.0, np.zeros(3), time)

    def since(frames: slice) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
        trial = recording_of(initial, x[frames], time[frames], plates=False, noise_m=0.0005)
        found = definition().calibrate(trial, static=standing(), how=Calibration(ground=LABORATORY))
        sd = dict(zip(found.names, found.sd0.tolist(), strict=True))
        sites = found.measured_plan().sites
        centres = less_sure_joints(found)
        return {s.segment: s.since_m for s in sites}, {s.segment: sd[f"marker/{s.name}/x"] for s in sites}, centres

    whole, bottom = since(slice(None)), since(slice(80, 120))
    assert not any(whole[0].values()) and set(whole[2].values()) <= {ONE_SIDED}
    turned = np.tanh(np.deg2rad([55.0 * 0.95 - 15.0, 60.0 * 0.95 - 15.0]) / np.deg2rad(50.0))
    declared = next(s.soft_tissue_m for s in initial.measured_plan().sites if s.segment == "thigh_r")
    assert bottom[0]["thigh_r"] == pytest.approx(declared * np.sqrt(np.mean(turned**2)), rel=0.1)
    assert bottom[1]["thigh_r"] == pytest.approx(np.hypot(whole[1]["thigh_r"], bottom[0]["thigh_r"]), rel=1e-6)
    assert bottom[0]["head"] == 0.0
    assert bottom[0]["foot_r"] < 0.2 * bottom[0]["thigh_r"]
    skin_m = np.hypot(bottom[0]["thigh_r"], bottom[0]["shank_r"])
    assert bottom[2]["shank_r"] == pytest.approx(np.hypot(ONE_SIDED, SINCE_CENTRE * skin_m / LANDMARKS.hinge_centre))
    assert "head" not in bottom[2]


def test_the_filter_follows_a_moving_body_at_any_heading_without_knowing_which() -> None:
    initial = measured()
    time = np.arange(200) / RATE
    x = states(initial, squat(time), 2.0, np.array([0.5, 0.0, -0.7]), time)
    trial = recording_of(initial, x, time, noise_m=0.0005)
    estimator = Estimator(definition(), vertical="+Y", estimate=["lengths", "markers", "inertia"])
    result = estimator.run(trial, static=standing())
    names = [str(name) for name in result.data["coordinate"].values]
    free = [c.name for c in initial.spec.coordinates if not c.locked]
    for name in ("hip_flexion_r", "knee_angle_l", "ankle_angle_r", "hip_adduction_l", "pelvis_tilt"):
        error = result.data["coordinates"].values[:, names.index(name)] - x[:, free.index(name)]
        assert np.rad2deg(np.sqrt(np.mean(error**2))) < 1.5, name
    assert np.isfinite(result.data["state"].values).all()
    assert any("Both feet stand on plate 1" in text for text in map(str, result.messages))
    contact = result.data["foot_contact"].copy(data=np.full(result.data["foot_contact"].shape, SHARED_PLATE, np.uint8))
    shared = replace(result, data=result.data.assign(foot_contact=contact))
    said = moments(shared, compute_metrics(result))
    assert said is not None and said.level == "warning" and "plate of its own" in said.advice
    assert said.text.startswith("The right foot and the left foot share a plate whenever they bear")
    assert not [event for event in result.events if event.kind == "reset"]


def test_without_plates_it_still_moves_and_says_so() -> None:
    initial = measured()
    time = np.arange(60) / RATE
    trial = recording_of(initial, states(initial, squat(time), 0.0, np.zeros(3), time), time, plates=False)
    result = Estimator(definition(), vertical="+Y", estimate=["markers"]).run(trial, static=standing())
    assert np.isnan(result.data["wrench_measured"].values).all()
    assert any("No force plates" in text for text in map(str, result.messages))
    assert any(event.kind == "missing" and event.subject == "plates" for event in result.events)


@pytest.mark.parametrize("kept", [("lengths",), ("markers", "inertia"), ()])
def test_what_is_not_estimated_is_no_state(kept: tuple[str, ...]) -> None:
    estimator = Estimator(definition(), estimate=kept)  # type: ignore[arg-type]
    initial = estimator.start(measured()).calibrated
    blocks = {name.split("/")[0] for name in initial.names}
    for block, kind in {
        "length": "lengths",
        "marker": "markers",
        "soft_tissue": "soft_tissue",
        "inertia": "inertia",
    }.items():
        assert (block in blocks) == (kind in kept)
    assert np.isfinite(initial.sd0).all() and np.isfinite(initial.x0).all()


def test_a_person_without_arms_or_head_markers_has_them_locked() -> None:
    whole = standing()
    kept = [
        k for k, name in enumerate(whole.marker_names) if name[1:] not in ("ELB", "UPA", "WRA", "WRB", "FHD", "BHD")
    ]
    names = tuple(whole.marker_names[k] for k in kept)
    initial = definition().calibrate(Recording("legs", None, whole.time, names, whole.markers[:, kept]))
    locked = {c.name for c in initial.spec.coordinates if c.locked}
    assert {"arm_flex_r", "elbow_flex_l", "neck_extension"} <= locked
    assert sum(body.mass for body in initial.plan.inertia.values()) == pytest.approx(70.0)


def test_a_movement_that_never_shows_most_markers_at_once_is_refused() -> None:
    whole = standing()
    markers = whole.markers.copy()
    markers[::2, ::2], markers[1::2, 1::2] = np.nan, np.nan  # each frame shows the other half
    with pytest.raises(ModelError, match=r"no frame shows \d+ % of the \d+ markers"):
        definition().calibrate(
            replace(whole, markers=markers), static=whole, how=Calibration(vertical="+Y", forward=(1.0, 0.0, 0.0))
        )


def test_a_limb_written_once_has_two_sides() -> None:
    model = load_model("fullbody").model
    right, left = (next(s for s in model.segments if s.name == f"foot_{side}") for side in "rl")
    assert (right.parent, left.parent) == ("shank_r", "shank_l")
    np.testing.assert_allclose(np.array(left.axes[2].direction) * [-1, -1, 1], right.axes[2].direction)
    assert {term.length for term in (*right.placement, *left.placement)} == {"shank"}
    assert not load_model("squat7").model.sided


def test_a_recording_in_which_sides_are_swapped_is_refused() -> None:
    whole = standing()
    other = {"R": "L", "L": "R"}
    names = tuple(other[n[0]] + n[1:] if n[0] in other else n for n in whole.marker_names)
    swapped = Recording("swapped", None, whole.time, names, whole.markers)
    with pytest.raises(ModelError, match="swapped"):
        definition().calibrate(swapped, static=whole, how=Calibration(ground=LABORATORY))


def test_both_tables_have_the_trunk_and_head_before_the_spine() -> None:
    """De Leva gives how far down the trunk from C7 its parts lie, not that they lie behind it: L5/S1 was 18 N m off."""
    plans = [
        load_model("fullbody", WHO, markers="plug-in-gait", table=table).calibrate(standing()).measured_plan()
        for table in ("dumas", "deleva")
    ]
    for name, within in {"torso": 0.02, "head": 0.02, "pelvis": 0.02, "foot_r": 0.03}.items():
        dumas, deleva = (plan.inertia[name].centre[0] for plan in plans)
        assert abs(deleva - dumas) < within, name
