"""Yardsticks that following cannot satisfy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.errors import ConfigError, RecordingError
from dynakin.settings import presets
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.case import Setup
from dynakin.validation.unseen import unseen, unseen_figures
from dynakin.validation.yardsticks import Figures, extrapolated, held, line, persisted


def test_a_straight_line_is_extrapolated_exactly_and_persistence_lags_by_the_span() -> None:
    time = np.arange(50) / 100.0
    signal = (3.0 + 2.0 * time)[:, None] * np.array([1.0, -1.0])
    ahead, before = extrapolated(time, signal, 10), persisted(signal, 10)
    assert np.isnan(ahead[:11]).all() and np.isnan(before[:10]).all()
    assert np.allclose(ahead[11:], signal[11:])
    assert np.allclose(signal[10:] - before[10:], [0.2, -0.2])
    assert np.allclose(line(time, signal, 20), signal)
    assert np.array_equal(held(signal, 20), np.repeat(signal[20:21], 50, axis=0))


def test_what_is_held_is_the_last_value_that_was_seen() -> None:
    signal = np.array([[1.0], [2.0], [np.nan], [np.nan], [5.0]])
    assert np.array_equal(held(signal, 3), np.full((5, 1), 2.0))


@pytest.fixture(scope="module")
def figures(simulated: SimulatedTrial, setup: Setup) -> Figures:
    return unseen_figures(simulated.recording, setup)


def test_rows_hold_every_yardstick_next_to_what_raw_data_predict(figures: Figures) -> None:
    rows = unseen([figures])
    methods = {"EKF (default)", "persistence", "linear extrapolation"}
    for yardstick in ("plates withheld", "marker left out", "100 ms ahead"):
        assert {row.method for row in rows if row.yardstick == yardstick} == methods
    assert all(row.rms.mean is not None and row.rms.mean > 0.0 for row in rows)
    assert {row.quantity for row in rows if row.yardstick == "plates withheld"} == {"fx", "fy", "mz"}
    left_out = [row for row in rows if row.yardstick == "marker left out" and row.method == "persistence"]
    assert left_out[0].quantity == "markers"
    assert left_out[0].rms.mean == pytest.approx(np.mean([row.rms.mean for row in left_out[1:]]))


def test_a_marker_left_out_is_predicted_by_the_others_alone(
    simulated: SimulatedTrial, setup: Setup, figures: Figures
) -> None:
    recording = simulated.recording
    name = "r_thigh2"
    column = recording.marker_names.index(name)
    moved = recording.markers.copy()
    late = recording.time > recording.time[-1] - 0.25 * (recording.time[-1] - recording.time[0])
    moved[late, column] += 0.5  # m; nobody can predict it, so it must all be error
    both = [figures, unseen_figures(replace(recording, markers=moved), setup)]
    honest, shifted = (each["marker left out", name, "EKF (default)"] for each in both)
    assert honest is not None and honest < 60.0
    assert shifted is not None and shifted > 200.0


def test_a_filter_whose_noise_fits_predicts_what_the_paper_s_gains_do_not(setup: Setup) -> None:
    trial = simulate_squat(seed=2, duration_s=8.0, mass_kg=70.0, noise=SensorNoise.none())
    figures = unseen_figures(trial.recording, replace(setup, noise={**setup.noise, "paper": presets.paper()}))
    for yardstick, quantity in (
        ("100 ms ahead", "markers"),
        ("marker left out", "markers"),
        ("plates withheld", "fy"),
    ):
        of = {m: figures[yardstick, quantity, m] for m in ("EKF (default)", "EKF (paper)", "persistence")}
        assert of["EKF (default)"] < 0.3 * of["persistence"], yardstick  # type: ignore[operator]
        assert of["EKF (default)"] < 0.7 * of["EKF (paper)"], yardstick  # type: ignore[operator]
    for quantity in ("fx", "fy", "mz"):  # with constant joint accelerations FX and MZ were worse than held
        found, held_on = (figures["100 ms ahead", quantity, m] for m in ("EKF (default)", "persistence"))
        assert found < 0.7 * held_on, quantity  # type: ignore[operator]
    assert figures["100 ms ahead", "markers", "EKF (paper)"] > figures["100 ms ahead", "markers", "persistence"]  # type: ignore[operator]


def test_what_cannot_be_judged_is_refused(simulated: SimulatedTrial, setup: Setup) -> None:
    with pytest.raises(ConfigError, match="horizon is 20 s"):
        unseen_figures(simulated.recording, setup, horizon_s=20.0)
    with pytest.raises(RecordingError, match="too short to leave a marker out"):
        unseen_figures(simulated.recording.window(0.0, 3.0), setup)
