"""Infinity never reaches a file; what is not known is NaN, null or a blank cell."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from dynakin.arrays import finite
from dynakin.files import with_nulls, write_csv, write_json
from dynakin.pipeline.result import Result
from dynakin.recordings.formats.mot import read_table
from dynakin.results.estimate import Estimate
from dynakin.results.files.storage import write_storage

TABLES = ("coordinates.mot", "speeds.sto", "moments.sto", "powers.sto", "wrench.sto", "uncertainty.sto")


def refuse(text: str) -> None:
    raise AssertionError(f"{text} is no JSON")


def spoilt(estimate: Estimate) -> Estimate:
    """Infinite numbers where an overflow or a division by zero could leave them, NaN where a moment is not known."""
    data = estimate.data.copy(deep=True)
    data["moments"][3, 2], data["moments"][4, 1] = np.inf, np.nan
    data["speeds"][5, 0] = -np.inf
    data["coordinates_sd"][6, 1] = np.inf
    data["wrench_estimated"][7, 1] = np.inf
    data["markers_estimated"][8, 0, 0] = np.inf
    parameter = replace(estimate.parameters[0], upper=float("inf"), sd=float("nan"))
    config = estimate.config | {"noise": {"unseen_sd": float("inf")}}
    return replace(estimate, data=data, parameters=[parameter, *estimate.parameters[1:]], config=config)


def test_no_file_of_a_run_holds_an_infinite_number(estimate: Estimate, tmp_path: Path) -> None:
    folder = Result(spoilt(estimate)).save(tmp_path / "out")
    for name in TABLES:
        rows = (folder / name).read_text(encoding="utf-8").split("endheader", 1)[1]
        assert "inf" not in rows.casefold(), name
    moments = read_table(folder / "moments.sto").values
    assert np.isnan(moments[3, 2]) and np.isnan(moments[4, 1]) and np.isnan(moments).sum() == 2
    assert "inf" not in (folder / "markers.trc").read_text(encoding="utf-8").casefold()
    assert "inf" not in (folder / "repetitions.csv").read_text(encoding="utf-8").casefold()
    for name in ("metrics.json", "parameters.json"):
        json.loads((folder / name).read_text(encoding="utf-8"), parse_constant=refuse)
    with xr.open_dataset(folder / "estimate.nc") as written:
        for name, variable in written.data_vars.items():
            assert variable.dtype.kind != "f" or not np.isinf(variable.values).any(), name
        json.loads(written.attrs["configuration"], parse_constant=refuse)


def test_tables_csv_and_json_by_themselves(tmp_path: Path) -> None:
    write_storage(
        tmp_path / "a.sto", "t", np.arange(2.0), ["x"], np.array([[np.inf], [np.nan]]), in_degrees=False
    )  # fmt: skip
    assert (tmp_path / "a.sto").read_text(encoding="utf-8").splitlines()[-2:] == ["0\tnan", "1\tnan"]
    write_csv(tmp_path / "a.csv", [{"a": float("nan"), "b": np.float64("inf"), "c": 1.5, "d": "text"}])
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == "a,b,c,d\n,,1.5,text\n"
    write_json(tmp_path / "a.json", {"a": [1.0, float("inf")], "b": {"c": float("nan")}})
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {"a": [1.0, None], "b": {"c": None}}


def test_finite_numbers_stay_as_they_are() -> None:
    values = np.array([1.0, -0.0, np.nan])
    assert finite(values) is values
    assert with_nulls({"a": (1, True, "x", None)}) == {"a": [1, True, "x", None]}
    assert with_nulls([np.float32("nan"), np.int64(2), 10**400]) == [None, 2, 10**400]
