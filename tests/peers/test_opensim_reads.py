"""OpenSim reads the files of an output folder and finds the values that were written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynakin.pipeline.result import Result
from dynakin.results.estimate import Estimate
from dynakin.results.files.markers import laboratory_markers
from dynakin.results.files.motion import write_moments

opensim: Any = pytest.importorskip("opensim", reason="OpenSim is not installed (pip install opensim)")
pytestmark = pytest.mark.peers


@pytest.fixture(scope="module")
def folder(estimate: Estimate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Result(estimate).save(tmp_path_factory.mktemp("opensim") / "out")


@pytest.mark.parametrize("name", ["coordinates.mot", "speeds.sto", "accelerations.sto"])
def test_motion_tables_in_degrees(folder: Path, estimate: Estimate, name: str) -> None:
    table = opensim.TimeSeriesTable(str(folder / name))
    assert table.getTableMetaDataString("inDegrees") == "yes"
    assert list(table.getColumnLabels()) == estimate.coordinate_names
    np.testing.assert_allclose(table.getIndependentColumn(), estimate.time, atol=1e-12)
    values = estimate.data[Path(name).stem].values.copy()
    values[:, estimate.is_rotation()] = np.degrees(values[:, estimate.is_rotation()])
    np.testing.assert_allclose(table.getMatrix().to_numpy(), values, rtol=5e-6, atol=1e-5)


def test_storage_turns_the_coordinates_back_into_radians(folder: Path, estimate: Estimate) -> None:
    storage = opensim.Storage(str(folder / "coordinates.mot"))
    assert storage.isInDegrees()
    assert storage.getSize() == len(estimate.time)


def test_moments(folder: Path, estimate: Estimate) -> None:
    table = opensim.TimeSeriesTable(str(folder / "moments.sto"))
    assert list(table.getColumnLabels())[2] == "knee_moment"
    np.testing.assert_allclose(table.getMatrix().to_numpy(), estimate.data["moments"].values, rtol=5e-6, atol=1e-5)


def test_moments_that_are_not_known_are_gaps(estimate: Estimate, tmp_path: Path) -> None:
    data = estimate.data.copy(deep=True)
    data["moments"][10:20, 1] = np.nan
    data["moments"][5, 2] = np.inf
    write_moments(replace(estimate, data=data), tmp_path / "moments.sto")
    table = opensim.TimeSeriesTable(str(tmp_path / "moments.sto"))
    expected = data["moments"].values.copy()
    expected[5, 2] = np.nan
    np.testing.assert_allclose(table.getMatrix().to_numpy(), expected, rtol=5e-6, atol=1e-5, equal_nan=True)
    # The older Storage class has no word for a gap: it ends at the first one, whatever stands there (docs/formats.md).
    assert opensim.Storage(str(tmp_path / "moments.sto")).getSize() < len(estimate.time)


def test_wrench(folder: Path, estimate: Estimate) -> None:
    table = opensim.TimeSeriesTable(str(folder / "wrench.sto"))
    column = table.getDependentColumn("fy_estimated").to_numpy()
    expected = estimate.data["wrench_estimated"].sel(component="fy").values
    np.testing.assert_allclose(column, expected, rtol=5e-6, atol=1e-5)


def test_markers_in_their_own_unit_with_gaps(folder: Path, estimate: Estimate) -> None:
    table = opensim.TimeSeriesTableVec3(str(folder / "markers.trc"))
    assert table.getTableMetaDataString("Units") == estimate.recording.length_unit == "mm"
    assert list(table.getColumnLabels()) == estimate.marker_names
    expected = 1000.0 * laboratory_markers(estimate)
    flat = table.flatten()  # kept: what it gives out is a view of it
    values = flat.getMatrix().to_numpy().reshape(expected.shape)
    np.testing.assert_allclose(values, expected, atol=6e-4, equal_nan=True)
    assert np.isnan(values).any()


@pytest.mark.parametrize("name", ["powers.sto", "centre_of_pressure.sto"])
def test_tables_of_the_body(folder: Path, estimate: Estimate, name: str) -> None:
    table = opensim.TimeSeriesTable(str(folder / name))
    assert table.getNumRows() == len(estimate.time)
    if name == "powers.sto":
        assert list(table.getColumnLabels()) == [f"{c}_power" for c in estimate.coordinate_names]
        np.testing.assert_allclose(table.getMatrix().to_numpy(), estimate.powers(), rtol=5e-6, atol=1e-5)
