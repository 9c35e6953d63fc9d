"""Mean curves over repetitions: their ends, their spread, gaps, sides, and the file."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.results.estimate import Estimate
from dynakin.results.measures.mean_curves import (
    MEASURED,
    PERCENT,
    curve_points,
    estimate_curves,
    mean_curves,
    normalised,
    signals,
    write_curves,
)
from dynakin.results.measures.repetitions import Repetition, repetitions_of

TIME = np.arange(0.0, 8.0, 0.01)
ROTATION = np.array([True, False])


def repetition(first: int, side: str = "both") -> Repetition:
    return Repetition("squat", side, first, first + 100, float(TIME[first]), float(TIME[first + 100]))


def test_normalised_keeps_the_ends() -> None:
    signal = np.sin(TIME)
    curve = normalised(TIME, signal, 37, 412)
    assert len(curve) == 101 and curve[0] == signal[37] and curve[-1] == pytest.approx(signal[412])


def test_curves_run_from_start_to_end_and_their_spread_is_the_samples_over_repetitions() -> None:
    ramp = np.column_stack([np.radians(TIME), 0.001 * TIME])
    every = signals(["knee", "slide"], ROTATION, ramp, np.full_like(ramp, 140.0))
    found = {c.quantity: c for c in mean_curves(TIME, [repetition(100), repetition(300)], {"EKF": every}, 70.0)}
    assert {c.quantity: c.unit for c in found.values()} == {
        "knee": "deg",
        "knee/moment": "N m",
        "slide": "mm",
        "slide/moment": "N",
    }
    for name in ("knee", "slide"):
        np.testing.assert_allclose(found[name].mean, TIME[200] + PERCENT / 100.0)
        np.testing.assert_allclose(found[name].sd, 2.0 / np.sqrt(2.0))
        assert found[name].mean_per_kg is None
    moment = found["knee/moment"]
    np.testing.assert_allclose(moment.mean_per_kg, 2.0)
    np.testing.assert_allclose(moment.sd_per_kg, 0.0, atol=1e-12)


def test_an_angle_without_a_deviation_is_no_value(estimate: Estimate) -> None:
    """Nobody saw the knee in the middle of the first repetition: the number there is only where the body is posed."""
    items = repetitions_of(estimate).items
    middle, sd = (items[0].first + items[0].last) // 2, estimate.data["coordinates_sd"].copy()
    sd.loc[{"coordinate": "knee"}][{"time": slice(middle - 10, middle + 10)}] = np.nan
    hidden = replace(estimate, data=estimate.data.assign(coordinates_sd=sd))
    (curve,) = [c for c in estimate_curves(hidden) if c.quantity == "knee" and c.method != MEASURED]
    assert curve.n.min() == len(items) - 1 and curve.n.max() == len(items) == curve.of


def test_one_repetition_has_no_deviation_and_gaps_do_not_count() -> None:
    values = np.radians(np.sin(TIME))
    values[120:140] = np.nan
    every = signals(["knee"], ROTATION[:1], values[:, None])
    (alone,) = mean_curves(TIME, [repetition(300)], {"EKF": every}, 70.0)
    assert np.isnan(alone.sd).all() and np.isfinite(alone.mean).all()
    (both,) = mean_curves(TIME, [repetition(100), repetition(300)], {"EKF": every}, 70.0)
    assert both.n[30] == 1 and both.n[60] == 2 and np.isnan(both.sd[30])
    assert both.mean[30] == pytest.approx(np.sin(TIME[330]))


def test_feet_are_not_averaged_together() -> None:
    every = signals(["knee"], ROTATION[:1], TIME[:, None])
    found = mean_curves(TIME, [repetition(100, "left"), repetition(300, "right")], {"EKF": every}, 70.0)
    assert [(c.side, int(c.n[0])) for c in found] == [("left", 1), ("right", 1)]
    assert mean_curves(TIME, [], {"EKF": every}, 70.0) == []


def test_what_is_nowhere_known_has_no_curve() -> None:
    wrench = np.full((len(TIME), 6), np.nan)
    wrench[:, 1] = 600.0
    assert [(s.quantity, s.unit) for s in signals([], ROTATION[:0], wrench=wrench)] == [("fy", "N")]


def test_file_of_a_run_holds_the_mean_of_its_repetitions(estimate: Estimate, tmp_path: Path) -> None:
    write_curves(tmp_path / "r.csv", curve_points("squat", estimate_curves(estimate)))
    with (tmp_path / "r.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["method"] for row in rows} == {"EKF (paper)", MEASURED} and len(rows) % 101 == 0
    (start,) = [row for row in rows if (row["quantity"], row["percent"]) == ("knee", "0")]
    knee = np.degrees(estimate.data["coordinates"].sel(coordinate="knee").values)
    found = [knee[r.first] for r in repetitions_of(estimate).items]
    assert float(start["mean"]) == pytest.approx(np.mean(found), rel=5e-6) and start["mean_per_kg"] == ""
    assert float(start["sd"]) == pytest.approx(np.std(found, ddof=1), rel=5e-4) and int(start["n"]) == len(found)
    (force,) = [r for r in rows if (r["quantity"], r["percent"], r["method"]) == ("fy", "50", MEASURED)]
    assert float(force["mean_per_kg"]) == pytest.approx(float(force["mean"]) / 60.05, rel=1e-5)


def test_nothing_repeated_leaves_the_line_of_names(tmp_path: Path) -> None:
    write_curves(tmp_path / "r.csv", [])
    assert (tmp_path / "r.csv").read_text().startswith("trial,movement,side,method,quantity,unit,percent,n,mean,sd")
