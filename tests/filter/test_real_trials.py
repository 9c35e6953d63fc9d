"""The estimator on the shared recordings, as a stranger would run it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.errors import ModelError
from dynakin.recordings.formats.mot import read_table
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.sources import ABSENT


@pytest.fixture(scope="module")
def squats1(data_dir: Path) -> dynakin.Estimate:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", forces=folder / "squats1_grf.mot")
    model = dynakin.load_model("sagittal7", subject=dynakin.Subject(mass_kg=60.05), markers="opencap")
    return dynakin.Estimator(model).run(recording, lag_s=0.0)  # the paper filters


def test_squats1_follows_markers_and_plates_as_the_paper_does(squats1: dynakin.Estimate) -> None:
    metrics = compute_metrics(squats1)
    assert metrics["window"]["start_s"] == 2.0
    assert metrics["markers"]["mean_rms_mm"] <= 4.0
    for component, limit in {"fx": 6.0, "fy": 10.0, "mz": 7.0}.items():
        assert metrics["wrench"]["rms"][component] <= limit


def test_squats1_knee_moves_as_another_system_says(squats1: dynakin.Estimate, data_dir: Path) -> None:
    # The other system's angles are three-dimensional and of the right leg; only the movement is compared, not the zero.
    table = read_table(data_dir / "opencap_subject4" / "squats1_ik.mot")
    other = table.column("knee_angle_r")
    ours = squats1.data["coordinates"].sel(coordinate="knee").values
    difference = np.degrees((ours - ours.mean()) - (other - other.mean()))
    assert np.ptp(np.degrees(ours)) > 20.0
    assert np.sqrt(np.mean(difference**2)) < 5.0


def test_squats1_keeps_every_parameter_within_its_bounds(squats1: dynakin.Estimate) -> None:
    assert len(squats1.parameters) == 6 + 34 + 28 + 4
    for p in squats1.parameters:
        if p.kind == "plates":
            continue
        assert p.lower is not None and p.upper is not None
        assert p.lower <= p.value <= p.upper, p.name
        assert 0.0 < p.sd < np.inf, p.name


@pytest.mark.parametrize("side", ["auto", "right", "both"])
def test_flywheel_squat_runs_to_the_end_without_preparation(data_dir: Path, side: str) -> None:
    recording = dynakin.read(data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d")
    model = dynakin.load_model("squat7", subject=dynakin.Subject(mass_kg=78.6))
    result = dynakin.Estimator(model, side=side).run(recording)
    assert result.data.sizes["time"] == 317
    for name in ("state", "state_sd", "moments", "markers_estimated", "wrench_estimated", "nis"):
        values = result.data[name].values
        if name == "markers_estimated":
            values = values[..., :2]
        if name == "wrench_estimated":
            values = values[:, [0, 1, 5]]
        known = np.ones(values.shape, dtype=bool)
        if name == "moments":  # the cable's force is in the plates and in no segment
            known = result.data["moment_source"].values != ABSENT
            assert not known.all()
        assert np.array_equal(np.isfinite(values), known), name
    if side != "auto":  # the right shoulder is lost for 68 frames
        assert any(event.kind == "missing" and event.subject == "RSHO" for event in result.events)
        assert np.isnan(result.data["markers_measured"].sel(marker="RSHO").values[:, 0]).sum() == 68
    assert any("abdomen has no markers: locked" in text for text in map(str, result.messages))


def test_what_weighs_nobody_is_no_mass(data_dir: Path) -> None:
    """0.1 took 33 kg (a drop jump), 39 kg (a chair), 63 kg, 57 kg (steps off the plates) and 129 kg (a flywheel)."""
    opencap, gait = data_dir / "opencap_subject4", data_dir / "plugin_gait"

    def mass_of(trial: Path, forces: Path | None, model: str, markers: str = "auto") -> float:
        recording = dynakin.read(trial, forces)
        return dynakin.Estimator(dynakin.load_model(model, dynakin.Subject(), markers)).calibrate(recording).mass_kg

    def of_subject4(name: str) -> float:
        return mass_of(opencap / f"{name}.trc", opencap / f"{name}_grf.mot", "fullbody", "opencap")

    for name, why in (
        ("DJ1", r"1\.5 s of a movement on them are too short to weigh the person"),
        ("STS1", r"their load goes from 0 to 205 % of its mean, which is no weight"),
    ):
        with pytest.raises(ModelError, match=rf"nobody stands still on the plates of {name}, and {why}.*--mass"):
            of_subject4(name)
    with pytest.raises(ModelError, match="mass_kg is not given and cannot be found"):
        mass_of(gait / "S1_FlywheelSquat.c3d", None, "squat7")
    # a walk weighs its person by the plates' impulse while every standing foot is on them (63 and 58 kg while standing)
    assert of_subject4("walking1") == pytest.approx(63.3, abs=2.0)
    assert mass_of(gait / "GaitNormal_1.c3d", None, "fullbody") == pytest.approx(58.2, abs=2.0)
    assert of_subject4("static1") == pytest.approx(60.05, abs=0.1)
    assert of_subject4("squats1") == pytest.approx(60.05, abs=0.1)  # 13 s of squats, never above 119 % of the mean


def test_walking_is_refused_because_the_toe_moves(data_dir: Path) -> None:
    recording = dynakin.read(data_dir / "plugin_gait" / "GaitNormal_1.c3d")
    assert len(recording.plates) == 3
    model = dynakin.load_model("squat7", subject=dynakin.Subject(mass_kg=66.0))
    with pytest.raises(ModelError, match=r"RTOE moves \d+ mm"):
        dynakin.Estimator(model).run(recording)
