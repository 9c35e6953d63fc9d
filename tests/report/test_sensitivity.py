"""Figure 3 from a file: the grid that is read, what is drawn, and the message for a bad file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from dynakin.errors import ConfigError
from dynakin.report.paper_figures.figures import save_sensitivity_figures
from dynakin.report.paper_figures.sensitivity import GAINS, read_sensitivity

HEADER = ",".join([*GAINS, "criterion"])
EXPONENTS = np.arange(-6.0, 7.0, 3.0)


def bowl(a: float, b: float, c: float) -> float:
    """Least, 40, at (3, 0, 3); diverged where a + b is small."""
    return np.nan if a + b < -3.0 else 40.0 + (a - 3.0) ** 2 + 2.0 * b**2 + (c - 3.0) ** 2


@pytest.fixture
def table(tmp_path: Path) -> Path:
    rows = [(a, b, c, bowl(a, b, c)) for c in EXPONENTS for b in EXPONENTS[::-1] for a in EXPONENTS]  # in any order
    lines = [",".join("" if np.isnan(x) else f"{x:g}" for x in row) for row in rows]
    path = tmp_path / "gains.csv"
    path.write_text("\n".join(["# made", HEADER, *lines]))
    return path


def test_csv_and_netcdf_give_the_same_grid(table: Path, tmp_path: Path) -> None:
    grid = read_sensitivity(table)
    assert grid.criterion.shape == (5, 5, 5)
    assert [float(axis[k]) for axis, k in zip(grid.gains, grid.optimum, strict=True)] == [3.0, 0.0, 3.0]
    assert grid.criterion[grid.optimum] == 40.0 and np.isnan(grid.criterion[0, 0, 0])
    values = grid.criterion.transpose(2, 0, 1)  # another order of dimensions
    coords = dict(zip(GAINS, grid.gains, strict=True))
    array = xr.DataArray(values, dims=(GAINS[2], GAINS[0], GAINS[1]), coords=coords, attrs={"units": "mm"})
    array.to_dataset(name="criterion").to_netcdf(tmp_path / "gains.nc", engine="netcdf4")
    again = read_sensitivity(tmp_path / "gains.nc")
    np.testing.assert_array_equal(again.criterion, grid.criterion)
    assert again.unit == "mm"


def test_figure_has_three_slices_through_the_optimum_with_units(table: Path, tmp_path: Path) -> None:
    (path,) = save_sensitivity_figures({"gains": read_sensitivity(table)}, tmp_path / "figures", ("svg",))
    text = path.read_text(encoding="utf-8")
    words = " | ".join(re.findall(r"<text[^>]*>([^<]*)</text>", text))
    for label in ("gain of coordinates", "gain of speeds", "gain of accelerations"):
        assert words.count(label) == 2  # each gain is held in one slice
    assert words.count("log₁₀ of Q in rad²") == 2 and words.count("log₁₀ of Q in (rad/s²)²") == 2
    assert "sum of RMS differences, mm + N + N m" in words and "○: 40.0" in words
    assert text.count("<pattern") >= 1  # cells of filters that diverged are hatched


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("a,b\n1,2\n", "no column log10_coordinate_variance, expected log10_coordinate_variance, log10_speed_variance"),
        (HEADER, "no rows"),
        (f"{HEADER}\n1,2,x,4", "row 1: log10_acceleration_variance is 'x', expected a number"),
        (f"{HEADER}\n1,,3,4", "row 1: log10_speed_variance is blank, expected a finite number"),
        (f"{HEADER}\n1,2,3,4\n1,2,3,5", "[1.0, 2.0, 3.0] stand there twice"),
        (f"{HEADER}\n1,2,3,nan", "no finite criterion"),
        (f"{HEADER}\n1,2,3", "no finite criterion"),
    ],
)
def test_a_bad_table_is_said_in_one_line(tmp_path: Path, content: str, expected: str) -> None:
    path = tmp_path / "gains.csv"
    path.write_text(content)
    with pytest.raises(ConfigError) as error:
        read_sensitivity(path)
    assert str(path) in error.value.message and expected in error.value.message and "\n" not in error.value.message


def test_what_is_no_grid_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no\.nc: cannot be read \(No such file"):
        read_sensitivity(tmp_path / "no.nc")
    (tmp_path / "text.nc").write_text("not netCDF")
    with pytest.raises(ConfigError, match=r"text\.nc: cannot be read"):
        read_sensitivity(tmp_path / "text.nc")
    xr.Dataset({"criterion": ("a", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="netcdf4")
    with pytest.raises(ConfigError, match="no variable criterion over log10_coordinate_variance"):
        read_sensitivity(tmp_path / "other.nc")
