"""Errors against truth: nothing for the truth itself, and each kind of error where it was put."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.report.text_tables import truth_text
from dynakin.results.measures.sources import ABSENT, DERIVED, MEASURED
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.case import Setup
from dynakin.validation.methods import ComparedTrial, Method, compare_trial
from dynakin.validation.truth import FIGURES, LEG, TRUTH, against_truth, truth_errors


@pytest.fixture(scope="module")
def truth() -> xr.Dataset:
    return simulate_squat(seed=2, duration_s=6.0).truth.data


def as_estimate(truth: xr.Dataset) -> xr.Dataset:
    return truth.rename(wrench="wrench_estimated").copy(deep=True)


def errors(data: xr.Dataset, truth: xr.Dataset) -> dict[str, float]:
    window = truth["time"].values >= 2.0
    return dict(zip((title for title, _ in FIGURES), truth_errors("it", data, truth, window, LEG).values, strict=True))


def test_the_truth_has_no_error(truth: xr.Dataset) -> None:
    assert errors(as_estimate(truth), truth) == dict.fromkeys((title for title, _ in FIGURES), 0.0)


def test_an_offset_of_one_angle_counts_as_it_is_and_not_about_the_mean(truth: xr.Dataset) -> None:
    data = as_estimate(truth)
    data["coordinates"].loc[{"coordinate": "knee"}] += np.radians(7.0)
    found = errors(data, truth)
    assert found["angles"] == pytest.approx(1.0)  # 7 deg in one of seven coordinates
    assert found["about their mean"] == pytest.approx(0.0, abs=1e-9)


def test_errors_before_the_window_and_moments_of_other_joints_do_not_count(truth: xr.Dataset) -> None:
    data = as_estimate(truth)
    data["speeds"].values[data["time"].values < 2.0] += 5.0
    data["moments"].loc[{"coordinate": "toe"}] += 100.0
    found = errors(data, truth)
    assert found["speeds"] == 0.0 and found["moments"] == 0.0


def test_wrench_components_are_told_apart_and_order_of_coordinates_does_not_matter(truth: xr.Dataset) -> None:
    data = as_estimate(truth)
    data["wrench_estimated"].loc[{"component": "mz"}] -= 3.0
    found = errors(data.isel(coordinate=slice(None, None, -1)), truth)
    assert found["MZ"] == pytest.approx(3.0)
    assert found["FX"] == found["FY"] == found["angles"] == 0.0


def test_a_joint_that_is_known_nowhere_does_not_count(truth: xr.Dataset) -> None:
    data = as_estimate(truth)
    data["moments"].loc[{"coordinate": "knee"}] = np.nan
    data["moments"].loc[{"coordinate": "hip"}] += 3.0
    assert errors(data, truth)["moments"] == pytest.approx(1.5)  # of ankle and hip
    data["moments"].loc[{"coordinate": list(LEG)}] = np.nan
    assert np.isnan(errors(data, truth)["moments"])


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> ComparedTrial:
    """Of a simulated squat whose truth lies beside it."""
    folder = tmp_path_factory.mktemp("squat")
    made = simulate_squat(seed=2, duration_s=5.0, mass_kg=70.0)
    made.save(folder)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    setup = Setup(Estimator(dynakin.load_model("sagittal7", subject, markers="opencap")), lag_s=0.0)
    return compare_trial(replace(made.recording, path=str(folder / "markers.trc")), setup)


def test_every_method_of_a_simulated_trial_has_every_figure(compared: ComparedTrial) -> None:
    _, rows = against_truth([compared])
    assert {(row.quantity, row.method) for row in rows} == {(q, m.name) for q, _ in FIGURES for m in compared.methods}
    assert all(row.rms.n == 1 and row.rms.mean is not None for row in rows)
    elsewhere = {name: replace(e, recording=replace(e.recording, path=None)) for name, e in compared.estimates.items()}
    assert against_truth([replace(compared, estimates=elsewhere)])[1] == []


def test_a_truth_of_another_model_is_left_out_and_that_is_said(compared: ComparedTrial) -> None:
    assert against_truth([compared])[0] == [compared]
    in_space = {"ankle": "ankle_angle_r", "knee": "knee_angle_r", "hip": "hip_flexion_r"}
    path = Path(str(next(iter(compared.estimates.values())).recording.path)).with_name(TRUTH)
    with xr.open_dataset(path) as stored:
        kept = stored.load()
    names = [in_space.get(str(name), str(name)) for name in kept["coordinate"].values]
    kept.assign_coords(coordinate=names).to_netcdf(path)  # as a simulation of fullbody has it
    try:
        (noted,), rows = against_truth([compared])
        assert rows == []
        (note,) = (note for note in map(str, noted.notes) if "another model" in note)
        assert note.endswith("which has no ankle, hip and knee.") and str(path) in note
    finally:
        kept.to_netcdf(path)


def test_methods_are_judged_over_the_moments_that_all_have_measured(compared: ComparedTrial) -> None:
    """A filter that is 50 N m off where a moment is derived, and inverse dynamics that has none there."""
    path = Path(str(next(iter(compared.estimates.values())).recording.path))
    with xr.open_dataset(path.parent / TRUTH) as stored:
        true = stored["moments"].sel(coordinate=list(compared.coordinate_names)).transpose("time", "coordinate").values
    derived = np.zeros(true.shape, dtype=bool)
    derived[compared.time > 3.0] = True
    knee = compared.coordinate_names.index("knee")

    def saying(name: str, moments: np.ndarray, code: int) -> Method:
        sources = (("time", "coordinate"), np.where(derived, code, MEASURED).astype(np.uint8))
        data = compared.methods[0].data.assign(moments=(("time", "coordinate"), moments), moment_source=sources)
        return replace(compared.methods[0], name=name, moments=moments, data=data)

    filtered = saying("EKF (default)", np.where(derived, true + 50.0, true + 1.0), DERIVED)
    inverse = saying("IK + ID (6 Hz)", np.where(derived, np.nan, true + 2.0), ABSENT)
    inverse.moments[:, knee] = np.nan  # and no frame at all of one joint
    _, both = against_truth([replace(compared, methods=(filtered, inverse))])
    found = {row.method: row.rms.mean for row in both if row.quantity == "moments"}
    assert found == {"EKF (default)": pytest.approx(1.0), "IK + ID (6 Hz)": pytest.approx(2.0)}
    text = truth_text(both)
    assert text.headings == ("", "EKF (default)", "IK + ID (6 Hz)")
    assert ("moments, N m", "1.00", "2.00") in text.rows
    assert "where every method has them measured" in text.title
