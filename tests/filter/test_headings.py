"""A person may head anywhere in a laboratory of any axes: joints, and what is read along the walk, stay the same."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from dynakin import read
from dynakin.filter.estimator import Estimator
from dynakin.model.definition import load_model
from dynakin.pipeline.result import Result
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.results.failures import Failures
from dynakin.results.measures.angles import angle_columns, with_angles
from dynakin.results.measures.facing import PELVIS, facing, nearly_singular
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.tracking import without_lost
from dynakin.settings.subject import Subject

Array = npt.NDArray[np.float64]
QUARTER = Rotation.from_euler("Y", 90.0, degrees=True).as_matrix()
BACK = Rotation.from_euler("Y", 180.0, degrees=True).as_matrix()
Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
LEGS = [f"{name}_{side}" for name in ("hip_flexion", "knee_angle", "ankle_angle") for side in "rl"]


def turned(recording: Recording, R_LG: Array) -> Recording:
    """The same trial in a laboratory whose axes are turned: p_L = R_LG p."""
    plates = tuple(
        replace(
            plate,
            **{name: getattr(plate, name) @ R_LG.T for name in ("force", "moment", "cop", "free_moment")},
        )
        for plate in recording.plates
    )
    return replace(recording, markers=recording.markers @ R_LG.T, plates=plates)


@cache
def estimated(folder: Path, turn: str, forward: str = "auto") -> Estimate:
    trial = read(folder / "opencap_subject4/squats1.trc", folder / "opencap_subject4/squats1_grf.mot")
    trial = turned(trial.window(2.0, 4.0), {"none": np.eye(3), "left": QUARTER, "back": BACK, "Z up": Z_UP}[turn])
    return Estimator(load_model("fullbody", Subject(mass_kg=60.05, height_m=1.70)), forward=forward).run(trial)


def moved(recording: Recording, by_m: Array) -> Recording:
    """The same trial in a laboratory whose origin lies elsewhere."""
    plates = tuple(
        replace(plate, moment=plate.moment + np.cross(by_m, plate.force), cop=plate.cop + by_m)
        for plate in recording.plates
    )
    return replace(recording, markers=recording.markers + by_m, plates=plates)


def test_moments_do_not_depend_on_where_the_origin_is(data_dir: Path) -> None:
    """One plate is withheld: what its leg carries follows from the sum, with any error that is about the origin."""
    trial = read(data_dir / "opencap_subject4/squats1.trc", data_dir / "opencap_subject4/squats1_grf.mot")
    trial = trial.window(2.0, 3.0)
    trial = replace(trial, plates=trial.plates[:1])
    estimator = Estimator(load_model("fullbody", Subject(mass_kg=60.05, height_m=1.70)))
    here, there = (of(estimator.run(t), "moments", LEGS) for t in (trial, moved(trial, np.array([10.0, 0.0, -5.0]))))
    assert np.abs(here - there).max() < 0.2  # N m


def of(estimate: Estimate, variable: str, names: list[str]) -> Array:
    return np.asarray(estimate.data[variable].sel(coordinate=names).transpose("time", "coordinate").values)


@pytest.mark.parametrize("turn", ["left", pytest.param("back", marks=pytest.mark.nightly)])
def test_the_speeds_of_the_pelvis_turn_with_it(data_dir: Path, turn: str) -> None:
    seen = facing(estimated(data_dir, turn))
    angles, speeds = (of(seen, block, list(PELVIS)) for block in ("coordinates", "speeds"))
    difference = np.gradient(angles, seen.time, axis=0)[1:-1] - speeds[1:-1]
    assert np.sqrt(np.mean(difference**2)) < 0.1 * np.sqrt(np.mean(speeds**2))


@pytest.mark.parametrize("turn", ["left", "Z up", pytest.param("back", marks=pytest.mark.nightly)])
def test_joints_and_figures_do_not_depend_on_the_laboratory(data_dir: Path, turn: str) -> None:
    one, other = estimated(data_dir, "none"), estimated(data_dir, turn)
    assert np.abs(of(one, "moments", LEGS) - of(other, "moments", LEGS)).max() < 1.0  # N m; measured: 0.3
    assert np.degrees(np.abs(of(one, "coordinates", LEGS) - of(other, "coordinates", LEGS)).max()) < 0.3
    pelvis = [np.degrees(of(facing(e), "coordinates", list(PELVIS))) for e in (one, other)]
    assert np.abs(pelvis[0] - pelvis[1]).max() < 0.3
    assert np.degrees(np.ptp(of(one, "coordinates", ["pelvis_tilt"]))) > 5.0  # a squat's lean, seen by all of them
    for name in ("fx", "fy", "fz"):
        ours, theirs = (compute_metrics(e)["wrench"]["rms"][name] for e in (one, other))
        assert ours == pytest.approx(theirs, rel=0.1, abs=0.1)
    clinical = [angle_columns(with_angles(e, {}, "clinical")) for e in (one, other)]
    assert clinical[0][0][:3] == ["pelvic_tilt", "pelvic_obliquity", "pelvic_rotation"]
    assert np.abs(clinical[0][1] - clinical[1][1]).max() < 1.0


def test_vectors_of_files_are_the_laboratorys_and_of_figures_the_persons(data_dir: Path) -> None:
    one, other = estimated(data_dir, "none"), estimated(data_dir, "left")
    np.testing.assert_array_equal(other.ground.rotation, np.eye(3))
    for name in ("mass_centre", "wrench_measured", "foot_wrench", "joint_loads", "markers_estimated"):
        ours, theirs = one.data[name].values, other.data[name].values
        apart = ours.reshape(*ours.shape[:-1], -1, 3) @ QUARTER.T - theirs.reshape(*theirs.shape[:-1], -1, 3)
        assert np.nanmax(np.abs(apart)) < (0.001 if name in ("mass_centre", "markers_estimated") else 2.0), name
    faced = facing(other)
    np.testing.assert_allclose(faced.ground.rotation[0], QUARTER @ facing(one).ground.rotation[0], atol=1e-9)
    assert facing(faced) is faced
    inwards = faced.data["foot_wrench"].sel(component="fz").mean("time")
    assert inwards.sel(foot="right") < -20.0 and inwards.sel(foot="left") > 20.0  # the ground pushes feet together


def test_a_lab_with_z_up_has_the_coordinates_of_the_same_lab_with_y_up(data_dir: Path) -> None:
    one, other = estimated(data_dir, "none"), estimated(data_dir, "Z up")
    np.testing.assert_allclose(one.data["coordinates"].values, other.data["coordinates"].values, atol=1e-6)
    assert other.ground.in_words == "laboratory frame with Y up (X, Y, Z are x, z, -y of the laboratory)"
    assert one.ground.in_words == "laboratory frame"


def test_forward_that_is_given_is_x(data_dir: Path) -> None:
    estimate = estimated(data_dir, "left", "-Z")
    np.testing.assert_allclose(estimate.ground.rotation, [[0, 0, -1], [0, 1, 0], [1, 0, 0]], atol=1e-12)
    lean = np.degrees(of(estimate, "coordinates", list(PELVIS)))
    assert np.ptp(lean[:, 0]) > 5.0 and np.abs(lean[:, 1:]).max() < 12.0


def test_a_lean_near_the_singularity_is_said(data_dir: Path) -> None:
    estimate = estimated(data_dir, "left")
    assert nearly_singular(estimate) == []
    data = estimate.data.copy(deep=True)
    data["coordinates"].loc[{"coordinate": "pelvis_list"}][7] = np.radians(-84.0)
    (said,) = nearly_singular(replace(estimate, data=data))
    assert str(said).startswith("Warning: pelvis_list reaches -84 deg at 2.07 s") and "--forward" in said.text


def test_lost_frames_of_who_faces_off_x_stay_lost_and_lose_nothing_else(data_dir: Path, tmp_path: Path) -> None:
    trial = read(data_dir / "opencap_subject4/squats1.trc", data_dir / "opencap_subject4/squats1_grf.mot")
    trial = turned(trial.window(2.0, 6.0), QUARTER)
    markers = trial.markers.copy()
    gap = slice(200, 230)
    markers[gap] = np.nan
    trial = replace(trial, markers=markers)
    estimate = Estimator(load_model("fullbody", Subject(mass_kg=60.05, height_m=1.70))).run(trial, lag_s=0.0)
    assert estimate.lost[205:230].any() and not estimate.lost[:195].any()
    failures = Failures()
    Result(estimate, failures=failures).save(tmp_path / "gap")
    assert failures.messages() == []
    faced = of(facing(estimate), "coordinates", list(PELVIS))
    np.testing.assert_array_equal(np.isnan(faced).any(axis=1), estimate.lost)
    assert np.degrees(np.nanmax(np.abs(faced[:, 1:]))) < 12.0  # turned before the gap and after it

    held = estimate.data.assign(tracking=("time", np.full(len(estimate.time), 2)))
    nothing = without_lost(replace(estimate, data=held, messages=[]))
    assert nothing.lost.all() and nearly_singular(nothing) == []
    Result(nothing, failures=failures).save(tmp_path / "lost", keep_lost=True)
    assert failures.messages() == []
    assert (tmp_path / "lost" / "report.html").exists()
