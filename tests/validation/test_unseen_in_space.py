"""What no method has seen of a whole body: how it is divided, carried on and judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import dynakin
from dynakin.errors import ConfigError
from dynakin.filter.estimator import Estimator
from dynakin.simulation.output import SimulatedTrial, save_trial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate
from dynakin.units import COMPONENTS
from dynakin.validation.case import Setup
from dynakin.validation.unseen import unseen, unseen_figures
from dynakin.validation.unseen_in_space import left_out_groups
from dynakin.validation.yardsticks import Figures

FILTER, CLASSICAL = "EKF (default)", "IK + ID (6 Hz)"


@pytest.fixture(scope="module")
def walk() -> SimulatedTrial:
    return simulate("fullbody", "gait", 3, 2.5, 50.0, noise=SensorNoise.none())


@pytest.fixture(scope="module")
def setup() -> Setup:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    return Setup(Estimator(dynakin.load_model("fullbody", subject)), lag_s=0.0)


@pytest.fixture(scope="module")
def figures(walk: SimulatedTrial, setup: Setup) -> Figures:
    return unseen_figures(walk.recording, setup)


def test_no_two_markers_of_a_group_help_each_other(walk: SimulatedTrial, setup: Setup) -> None:
    calibrated = setup.estimator("default").calibrate(walk.recording)
    groups = left_out_groups(calibrated)
    assert sorted(k for group in groups for k in group) == list(range(len(calibrated.spec.markers)))
    parents = {segment.name: segment.parent for segment in calibrated.spec.segments}
    for group in groups:
        segments = [calibrated.spec.markers[k].segment for k in group]
        assert len(set(segments)) == len(segments)
        assert not {parents[name] for name in segments} & set(segments)
    assert len(groups) < 15


def test_filter_and_classical_method_stand_beside_each_other(figures: Figures) -> None:
    rows = unseen([figures])
    methods = {FILTER, CLASSICAL, "IK + ID (12 Hz)"}
    free = {"persistence", "linear extrapolation"}
    for yardstick, expected in (
        ("marker left out", methods),
        ("plates withheld", methods),
        ("100 ms ahead", methods | free),
    ):
        of = [row for row in rows if row.yardstick == yardstick]
        assert {row.method for row in of} == expected
        assert all(row.rms.mean is not None and row.rms.mean > 0.0 for row in of)
    assert {row.quantity for row in rows if row.yardstick == "plates withheld"} == set(COMPONENTS)


def test_what_is_known_without_errors_is_foretold_well(figures: Figures) -> None:
    for method in (FILTER, CLASSICAL):
        markers = figures["marker left out", "markers", method]
        assert markers is not None and markers < 10.0  # mm: the person's tissue moves, and is not the table's
        push = figures["plates withheld", "fy", method]
        assert push is not None and push < 0.2 * 70.0 * 9.81  # live, from 50 Hz: the filter's is late
    ahead = {method: figures["100 ms ahead", "markers", method] for method in (FILTER, "persistence")}
    assert ahead[FILTER] < 0.4 * ahead["persistence"]  # type: ignore[operator]
    push = {method: figures["100 ms ahead", "fy", method] for method in (FILTER, CLASSICAL, "persistence")}
    assert push[FILTER] < 0.6 * push["persistence"]  # type: ignore[operator]
    assert push[FILTER] < push[CLASSICAL]  # type: ignore[operator]


@pytest.mark.nightly
def test_nothing_that_is_withheld_is_used(walk: SimulatedTrial, setup: Setup, figures: Figures) -> None:
    """Where a marker and the plates err by a lot, their predictions stay, and only these are all error."""
    recording = walk.recording
    name = "r_thigh2"
    markers = recording.markers.copy()
    markers[len(markers) // 2 :, recording.marker_names.index(name)] += 0.06  # further off it is left out
    found = unseen_figures(replace(recording, markers=markers), setup)
    assert found["marker left out", name, FILTER] > 30.0  # type: ignore[operator]
    honest, other = (each["marker left out", "L_thigh2", FILTER] for each in (figures, found))
    assert honest is not None and other is not None and abs(other - honest) < 3.0


def test_a_horizon_beyond_the_trial_is_refused(walk: SimulatedTrial, setup: Setup) -> None:
    with pytest.raises(ConfigError, match="horizon is 2 s"):
        unseen_figures(walk.recording, setup, horizon_s=2.0)


@pytest.fixture(scope="module")
def folder(walk: SimulatedTrial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_trial(walk, tmp_path_factory.mktemp("walk") / "trial")


def test_errors_against_a_simulations_truth_are_in_the_table(folder: Path, tmp_path: Path, capsys: object) -> None:
    from dynakin.cli.app import main

    out = tmp_path / "out"
    trial = [str(folder / "markers.trc"), "--forces", str(folder / "forces.mot")]
    subject = ["--model", "fullbody", "--mass", "70", "--height", "1.75", "--sex", "male", "--live-like"]
    assert main(["compare", *trial, *subject, "-o", str(out)]) == 0
    rows = (out / "truth.csv").read_text().splitlines()
    assert any(row.startswith("angles,deg,IK + ID (6 Hz)") for row in rows)
    assert "Against the simulation" in (out / "report.html").read_text()
    errors = [float(row.split(",")[3]) for row in rows if row.startswith("about their mean")]
    assert len(errors) == 3 and max(errors) < 8.0
