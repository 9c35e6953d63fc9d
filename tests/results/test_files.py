"""Every file of an output folder: complete, of known units, and equal to the arrays when read back."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from dynakin.pipeline.result import Result
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.read import read
from dynakin.results.estimate import Estimate
from dynakin.results.files.folder import OUTPUT_FILES
from dynakin.results.files.markers import write_trc
from dynakin.results.measures.fit import marker_rms_mm, signal_fit
from support.estimates.synthetic import make_estimate

DIGITS = 5e-8
"""Relative: tables have eight significant digits."""
DIGITS_OF_RATES = DIGITS_OF_LOADS = 5e-6
"""Those of moments and powers six."""
MICROMETRE = 1e-6
STEPS = ("markers", "joint_centres", "joint_orientations")
"""In whole steps of about 1e-6 in estimate.nc."""


@pytest.fixture(scope="module")
def folder(estimate: Estimate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Result(estimate).save(tmp_path_factory.mktemp("results") / "out")


def test_every_variable_is_documented(folder: Path) -> None:
    manual = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
    with xr.open_dataset(folder / "estimate.nc") as data:
        names = [str(name) for name in data.data_vars if not str(name).startswith(("parameter_", "event_"))]
    assert [name for name in names if f"`{name}`" not in manual] == []


def test_all_files_are_there_and_none_is_left_beside(folder: Path) -> None:
    assert {entry.name for entry in folder.iterdir()} == set(OUTPUT_FILES)  # none of the optional ones
    assert [entry.name for entry in folder.parent.iterdir()] == ["out"]


@pytest.mark.parametrize("name", ["coordinates.mot", "speeds.sto", "accelerations.sto"])
def test_motion_tables_are_in_degrees_for_rotations_only(folder: Path, estimate: Estimate, name: str) -> None:
    text = (folder / name).read_text().splitlines()
    assert "inDegrees=yes" in text
    top = text.index("endheader")
    columns = text[top + 1].split("\t")
    values = np.array([line.split("\t") for line in text[top + 2 :]], dtype=float)
    assert columns == ["time", *estimate.coordinate_names]
    assert f"nRows={len(values)}" in text and f"nColumns={len(columns)}" in text
    expected = estimate.data[Path(name).stem].values
    digits = DIGITS if name == "coordinates.mot" else DIGITS_OF_RATES
    np.testing.assert_allclose(values[:, 3], np.degrees(expected[:, 2]), rtol=digits)
    np.testing.assert_allclose(values[:, 8], expected[:, 7], rtol=digits)  # the translation


def test_our_own_reader_gets_the_coordinates_back(folder: Path, estimate: Estimate) -> None:
    table = read_table(folder / "coordinates.mot")
    assert table.in_degrees
    np.testing.assert_allclose(table.time, estimate.time)


def test_moments_are_named_as_inverse_dynamics_names_them(folder: Path, estimate: Estimate) -> None:
    table = read_table(folder / "moments.sto")
    assert not table.in_degrees
    assert table.names[2] == "knee_moment" and table.names[-1] == "slide_force"
    np.testing.assert_allclose(table.values, estimate.data["moments"].values, rtol=DIGITS_OF_LOADS, atol=5e-7)


def test_wrench_has_columns_for_what_is_measured_and_modelled_only(folder: Path) -> None:
    table = read_table(folder / "wrench.sto")
    measured = [f"{c}_measured" for c in ("fx", "fy", "fz", "mx", "my", "mz")]
    assert list(table.names) == [*measured, "fx_estimated", "fy_estimated", "mz_estimated"]


def test_figures_recomputed_from_the_files_equal_metrics_json(folder: Path, estimate: Estimate) -> None:
    metrics = json.loads((folder / "metrics.json").read_text())
    markers, window = read(folder / "markers.trc"), estimate.time >= metrics["window"]["start_s"]
    every_axis = np.ones(
        3, dtype=bool
    )  # out of the plane nothing differs, so the laboratory distance is the planar one
    for name, reported in metrics["markers"]["rms_mm"].items():
        measured = estimate.recording.marker(name)[window]
        assert marker_rms_mm(measured, markers.marker(name)[window], every_axis) == pytest.approx(reported, abs=1e-4)
    table = read_table(folder / "wrench.sto")
    columns = dict(zip(table.names, table.values.T, strict=True))
    for component, reported in metrics["wrench"]["rms"].items():
        fit = signal_fit(columns[f"{component}_measured"][window], columns[f"{component}_estimated"][window])
        assert fit.rms == pytest.approx(reported, rel=1e-5)


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_markers_are_written_in_the_unit_and_frame_of_the_recording(tmp_path: Path, unit: str) -> None:
    made = make_estimate(3.0, unit=unit, gaps=False)
    back = read(Result(made).save(tmp_path / "out") / "markers.trc")
    assert back.length_unit == unit
    assert list(back.marker_names) == made.marker_names
    measured = made.recording.markers[:, : len(made.marker_names)]
    difference = made.ground.vectors_to_ground(back.markers - measured)
    assert np.abs(difference[..., 2]).max() < MICROMETRE  # as measured
    assert 0.001 < np.std(difference[..., :2]) < 0.005
    expected = made.data["markers_estimated"].values[..., :2]
    np.testing.assert_allclose(made.ground.points_to_ground(back.markers)[..., :2], expected, atol=MICROMETRE)


def test_missing_markers_are_blank_cells(folder: Path) -> None:
    back = read(folder / "markers.trc")
    assert np.isnan(back.marker("S1:RASI")[300:340]).all()
    assert np.isfinite(back.marker("S1:RASI")[340:]).all()
    row = (folder / "markers.trc").read_text().splitlines()[6 + 310]
    assert row.count("\t") == 1 + 3 * 10  # blank cells keep their columns


def test_trc_of_a_single_frame(tmp_path: Path) -> None:
    write_trc(tmp_path / "one.trc", np.array([0.5]), ["A"], np.array([[[1.0, 2.0, np.nan]]]), unit="m")
    back = read(tmp_path / "one.trc")
    assert back.n_frames == 1 and back.time[0] == 0.5


def test_parameters_json_is_strict_json_with_every_parameter(folder: Path, estimate: Estimate) -> None:
    content = json.loads((folder / "parameters.json").read_text(), parse_constant=pytest.fail)
    assert content["schema_version"] == 2
    found = {entry["name"]: entry for entry in content["parameters"]}
    assert set(found) == {p.name for p in estimate.parameters}
    thigh = found["length/thigh"]
    assert thigh["at_bound"] and thigh["table"] is None and thigh["unit"] == "m"
    assert thigh["value"] == pytest.approx(1.2 * 0.43)


def test_threads_may_save_at_a_time(tmp_path: Path) -> None:
    """In a process of its own, which the library would crash."""
    program = f"""
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import dynakin
from dynakin.results.files.netcdf import write_netcdf
from dynakin.simulation import simulate
from dynakin.simulation.output import save_trial
trial = simulate("squat7", "squat", 1, 5.0)
estimate = dynakin.run(trial.recording, model="squat7").estimate
def write(k):
    write_netcdf(estimate, Path({str(tmp_path)!r}) / f"{{k}}.nc")
    save_trial(trial, Path({str(tmp_path)!r}) / f"truth_{{k}}")
with ThreadPoolExecutor(3) as threads:
    list(threads.map(write, range(12)))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("*.nc"))) == len(list(tmp_path.glob("*/*.nc"))) == 12


def test_netcdf_gives_everything_back_with_labels(folder: Path, estimate: Estimate) -> None:
    with xr.open_dataset(folder / "estimate.nc", engine="netcdf4") as data:
        assert data.attrs["schema_version"] == 2
        for name, variable in estimate.data.data_vars.items():
            over_time = variable.dtype.kind == "f" and variable.ndim > 1 and variable.dims[0] == "time"
            bits = 0 if not over_time else 13 if str(name).endswith("_sd") else 24
            off = 2.0**-21 if over_time and bits == 24 and str(name).startswith(STEPS) else 0.0
            sd = estimate.data.get(f"{name}_sd") if over_time else None
            if sd is None:
                relative = 2.0**-bits if bits else 0.0
                np.testing.assert_allclose(data[name].values, variable.values, rtol=relative, atol=off)
            else:
                np.testing.assert_array_equal(data[name].isnull(), variable.isnull())
                room = 2.0**-bits * np.abs(variable) + np.maximum(off, 5e-5 * sd)
                assert not (np.abs(data[name] - variable) > room).any(), name
        np.testing.assert_array_equal(data["time"].values, estimate.time)
        knee = data["coordinates"].sel(coordinate="knee")
        expected = estimate.data["coordinates"].sel(coordinate="knee")
        sd = estimate.data["coordinates_sd"].sel(coordinate="knee").values
        np.testing.assert_allclose(knee.values, expected.values, rtol=2.0**-24, atol=5e-5 * sd.min())
        assert float(data["parameter_value"].sel(parameter="length/thigh")) == pytest.approx(1.2 * 0.43)
        assert list(data["event_kind"].values) == [event.kind for event in estimate.events]
        np.testing.assert_allclose(data["ground_rotation"].values, estimate.ground.rotation)
        assert data["markers_estimated"].attrs["units"] == "m"


def test_what_is_rounded_away_is_far_below_its_deviation(folder: Path, estimate: Estimate) -> None:
    with xr.open_dataset(folder / "estimate.nc", engine="netcdf4") as data:
        pairs = [name for name in map(str, estimate.data.data_vars) if f"{name}_sd" in estimate.data]
        assert {"coordinates", "speeds", "accelerations", "state"} <= set(pairs)
        for name in pairs:
            sd = estimate.data[f"{name}_sd"].values
            lost = np.abs(data[name].values - estimate.data[name].values)
            assert (lost[sd > 0.0] <= 1e-3 * sd[sd > 0.0]).all(), name


def test_config_toml_holds_what_was_used_and_versions(folder: Path, estimate: Estimate) -> None:
    content = tomllib.loads((folder / "config.toml").read_text())
    versions = content.pop("versions")
    assert {"dynakin", "python", "numpy"} <= set(versions)
    assert content == {key: value for key, value in estimate.config.items() if value is not None}
