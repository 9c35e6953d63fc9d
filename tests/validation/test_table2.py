"""Table II: its figures recomputed by hand, and what they are over several trials."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError, OutputError
from dynakin.filter.estimator import Estimator
from dynakin.report.text_tables import shown, table2_text
from dynakin.results.measures.fit import SignalFit
from dynakin.results.measures.metrics import compute_metrics
from dynakin.validation.case import Setup
from dynakin.validation.differences import angle_differences, moment_differences
from dynakin.validation.files import save_comparison
from dynakin.validation.methods import ComparedTrial, compare_trial
from dynakin.validation.table2 import Spread, marker_fit, spread, table2, table2_of

IN_PLANE = np.array([True, True, False])


def test_marker_figures_do_not_depend_on_the_axes_nor_on_where_zero_is() -> None:
    generator = np.random.default_rng(1)
    measured = np.cumsum(generator.normal(0.0, 0.01, (200, 3)), axis=0)
    estimated = measured + generator.normal(0.0, 0.003, (200, 3))
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0.0], [np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    fit = marker_fit(measured, estimated, IN_PLANE)
    moved = marker_fit(measured @ turn.T + 2.0, estimated @ turn.T + 2.0, IN_PLANE)
    distance = np.linalg.norm((measured - estimated)[:, :2], axis=1)
    assert fit.rms == pytest.approx(1000.0 * np.sqrt(np.mean(distance**2)))
    for name in ("rms", "nrms_rms_percent", "correlation"):
        assert getattr(moved, name) == pytest.approx(getattr(fit, name))


def test_marker_without_movement_has_no_per_cent_and_one_never_seen_no_figure() -> None:
    still = np.zeros((10, 3))
    assert marker_fit(still, still + 0.001, IN_PLANE)[1:] == (None, None, None)
    assert marker_fit(np.full((10, 3), np.nan), still, IN_PLANE) == (None, None, None, None)


def test_mean_and_sample_deviation_over_the_trials_that_have_a_figure() -> None:
    assert spread([1.0, None, 3.0]) == Spread(2.0, pytest.approx(np.sqrt(2.0)), 2)
    assert spread([5.0]) == Spread(5.0, None, 1)
    assert spread([None]) == Spread(None, None, 0)


def test_rows_are_recomputable_from_the_estimate_after_the_adaptation(compared: ComparedTrial) -> None:
    rows = {(row.quantity, row.method): row for row in table2([compared])}
    metrics = compute_metrics(compared.estimates["default"])
    assert compared.time[compared.window][0] == pytest.approx(2.0)
    assert rows["markers", "EKF (default)"].rms.mean == pytest.approx(metrics["markers"]["mean_rms_mm"])
    for component in ("fx", "fy", "mz"):
        row = rows[component, "EKF (default)"]
        assert row.rms.mean == pytest.approx(metrics["wrench"]["rms"][component])
        assert row.nrms_rms_percent.mean == pytest.approx(metrics["wrench"]["nrms_percent"][component])
    assert ("fz", "EKF (default)") not in rows  # a planar model says nothing of it


def test_every_method_has_markers_and_wrench_and_the_filter_follows_them_closest(compared: ComparedTrial) -> None:
    rows = {(row.quantity, row.method): row.rms.mean for row in table2([compared])}
    for quantity in ("markers", "fx", "fy", "mz"):
        ekf, *others = (rows[quantity, name] for name in ("EKF (default)", "AT (6 Hz)", "classical (6 Hz)"))
        assert ekf is not None
        assert all(other is not None and ekf < other for other in others), quantity


def test_two_trials_give_their_mean_and_deviation(compared: ComparedTrial) -> None:
    shifted = replace(compared, measured_wrench=compared.measured_wrench + np.array([0, 30.0, 0, 0, 0, 0]))
    (one,), (two,), (both,) = (
        [row for row in table2(trials) if (row.quantity, row.method) == ("fy", "AT (6 Hz)")]
        for trials in ([compared], [shifted], [compared, shifted])
    )
    assert both.rms.n == 2
    assert both.rms.mean == pytest.approx((one.rms.mean + two.rms.mean) / 2)  # type: ignore[operator]
    assert both.rms.sd == pytest.approx(abs(one.rms.mean - two.rms.mean) / np.sqrt(2))  # type: ignore[operator]


def test_angles_and_moments_are_compared_coordinate_by_coordinate(compared: ComparedTrial) -> None:
    ekf, at, classical = compared.methods
    k, w = compared.coordinate_names.index("knee"), compared.window
    (angle,) = [row for row in angle_differences([compared]) if row.coordinate == "knee"]
    error = np.degrees(ekf.coordinates[w, k] - classical.coordinates[w, k])
    error = error[np.isfinite(error)]
    assert angle.unit == "deg" and angle.mean.mean == pytest.approx(error.mean())
    assert angle.rms.mean == pytest.approx(np.hypot(error.mean(), error.std()))
    (moment,) = [row for row in moment_differences([compared]) if row.coordinate == "knee"]
    difference = ekf.moments[w, k] - at.moments[w, k]
    assert moment.unit == "N m" and moment.rms.mean == pytest.approx(np.sqrt(np.nanmean(difference**2)))


def test_files_hold_the_rows_and_replace_only_an_earlier_comparison(compared: ComparedTrial, tmp_path: Path) -> None:
    rows = table2([compared])
    folder = tmp_path / "out"
    save_comparison(folder, {"table2": rows, "angles": angle_differences([compared]), "truth": rows})
    save_comparison(folder, {"table2": rows})
    assert sorted(entry.name for entry in folder.iterdir()) == ["comparison.json", "table2.csv"]
    with (folder / "table2.csv").open() as file:
        read = list(csv.DictReader(file))
    assert [line["quantity"] for line in read] == [row.quantity for row in rows]
    assert float(read[0]["rms"]) == rows[0].rms.mean and read[0]["rms_sd"] == ""
    assert json.loads((folder / "comparison.json").read_text())["table2"][0]["method"] == "EKF (default)"
    (folder / "mine.txt").write_text("kept")
    with pytest.raises(OutputError, match=r"mine\.txt"):
        save_comparison(folder, {"table2": rows})


def test_a_row_over_fewer_trials_says_so_and_forces_that_are_doubted_are_marked() -> None:
    one, none = SignalFit(1.0, 2.0, 3.0, 0.9), SignalFit(None, None, None, None)
    rows = table2_of([{("markers", "EKF"): one, ("fy", "EKF"): one}, {("markers", "EKF"): one, ("fy", "EKF"): none}])
    text = table2_text(rows, "2 trials", of=2, doubted=["A/walk"])
    assert [row[:2] for row in text.rows] == [("markers", "EKF"), ("FY *", "EKF (n = 1)")]
    assert text.title.endswith("whose mass or forces are doubted: A/walk")


def test_settings_that_make_no_sense_are_refused() -> None:
    model = dynakin.load_model("sagittal7")
    with pytest.raises(ConfigError, match="no preset"):
        Setup(Estimator(model), {})
    with pytest.raises(ConfigError, match="0 Hz"):
        Setup(Estimator(model), cutoff_hz=0.0)


def test_squats1_filter_follows_the_plates_far_below_the_table(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    model = dynakin.load_model("sagittal7", dynakin.Subject(mass_kg=60.05), markers="opencap")
    rows = {
        (row.quantity, row.method): row.rms.mean
        for row in table2([compare_trial(recording, Setup(Estimator(model), lag_s=0.0))])
    }
    limits = {"fx": (6.0, 15.0, 30.0), "fy": (10.0, 20.0, 45.0), "mz": (7.0, 15.0, 30.0)}
    for component, (ekf, least, most) in limits.items():
        assert (rows[component, "EKF (default)"] or np.inf) < ekf
        assert least < (rows[component, "AT (6 Hz)"] or 0.0) < most


def test_what_rounds_to_nothing_has_no_sign() -> None:
    assert shown(Spread(-0.02, None, 1), 1, "deg") == "0.0 deg" and shown(Spread(-0.2, 0.1, 2), 1) == "−0.2 ± 0.1"
