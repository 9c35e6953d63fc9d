"""`tune fit`: it finds the noise that there is, says how sure it is, and judges itself where it was not fitted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from dynakin.cli.app import main
from dynakin.errors import ConfigError
from dynakin.settings import presets
from dynakin.simulation.trial import simulate
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import open_pool
from dynakin.studies.tuning.fit import Fit, Fitter, belongs_to_fit, usual_names
from dynakin.studies.tuning.likelihood import REACH, Likelihood
from dynakin.studies.tuning.optimise import curvature, deviations, minimise
from dynakin.studies.tuning.output import recommendation
from dynakin.studies.tuning.score import Shared
from support.own_data import own_noise, own_trial

WRONG = {
    "jerk_density_rad2_s5": 5.0,
    "soft_tissue_sd_fraction": 0.3,
    "marker_sd_m": 3.0,
    "force_variance_n2": 0.2,
    "plate_force_sd_n": 4.0,
}
"""Settings to be found, and the factor by which the fit starts off."""


@pytest.fixture(scope="module")
def own(default: Shared) -> Shared:
    """Two trials of the true settings, and settings that are wrong."""
    truth = own_noise()
    wrong = own_noise(**{name: getattr(truth, name) * factor for name, factor in WRONG.items()})
    return Shared(tuple(own_trial(default.trials[0], truth, seed) for seed in (1, 2)), wrong)


@pytest.fixture(scope="module")
def fit(own: Shared) -> Fit:
    with open_pool("threads", 2) as pool:
        return Fitter(own, tuple(WRONG), pool).run()


def test_the_true_noise_is_recovered_within_a_factor_of_two(fit: Fit) -> None:
    truth = own_noise()
    for setting in fit.settings:
        assert 0.5 < setting.value / getattr(truth, setting.name) < 2.0, setting
        assert setting.known and not setting.at_limit


def test_the_interval_is_as_wide_as_it_should_be(fit: Fit) -> None:
    """Five intervals of 95 %: one may miss, and none by far; and none is wider than a factor 2."""
    truth = own_noise()
    off = [
        abs(np.log(s.value / getattr(truth, s.name))) / (np.log(s.high / s.low) / (2 * 1.96))
        for s in fit.settings
        if s.low and s.high
    ]
    assert len(off) == len(WRONG)
    assert sorted(off)[-2] < 2.0 and max(off) < 4.0
    assert all(s.high / s.value < 2.0 for s in fit.settings if s.high)


def test_what_is_fitted_is_better_where_it_was_not_fitted(fit: Fit) -> None:
    assert [fold.held_out for fold in fit.folds] == ["own 1", "own 2"]
    for fold in fit.folds:
        assert fold.figures["fitted"]["nll"] < fold.figures["start"]["nll"]
    assert fit.figures["fitted"]["nis_per_row"] == pytest.approx(1.0, abs=0.1)
    assert recommendation(fit)[0].startswith("Use the fitted settings")


def test_half_and_twice_of_an_optimum_cost(fit: Fit) -> None:
    assert all(s.halved > 0.0 and s.doubled > 0.0 for s in fit.settings)


def test_a_fit_that_is_run_again_takes_its_rows_from_the_journal(own: Shared, tmp_path: Path) -> None:
    path, whose = tmp_path / "rows.jsonl", belongs_to_fit(own)
    points = [np.zeros(1), np.array([0.5])]
    with open_pool("threads", 1) as pool:
        first = Likelihood(own, ("force_variance_n2",), pool, Journal(path, whose)).costs(points)

        def refuse(*_: object) -> None:
            raise AssertionError("worked again")

        pool.run = lambda function, shared, tasks: iter(()) if not tasks else refuse()  # type: ignore[method-assign]
        np.testing.assert_array_equal(
            Likelihood(own, ("force_variance_n2",), pool, Journal(path, whose)).costs(points), first
        )


def test_the_optimiser_finds_a_valley_and_its_curvature() -> None:
    H = np.array([[400.0, 90.0, 0.0], [90.0, 50.0, 0.0], [0.0, 0.0, 0.0]])
    centre = np.array([1.0, -0.5, 0.0])

    def costs(points):
        return np.array([0.5 * (p - centre) @ H @ (p - centre) + 1e5 for p in points])

    found = minimise(costs, np.zeros(3), REACH)
    np.testing.assert_allclose(found.point[:2], centre[:2], atol=0.1)
    assert found.converged and found.cost - 1e5 < 1.0 and not found.at_limit.any()
    np.testing.assert_allclose(curvature(costs, found.point), H, atol=1e-4)
    sd = deviations(H)
    np.testing.assert_allclose(sd[:2], np.sqrt(np.diag(np.linalg.inv(H[:2, :2]))), rtol=1e-9)
    assert np.isinf(sd[2])


def test_an_optimum_at_the_end_of_the_range_is_told() -> None:
    found = minimise(lambda points: np.array([100.0 * p[0] for p in points]), np.zeros(1), REACH)
    assert found.at_limit[0] and found.point[0] == pytest.approx(-REACH)


def test_one_trial_is_held_out_by_halves_and_written_as_a_preset(tmp_path: Path, capsys) -> None:
    files, folder = tmp_path / "squat", tmp_path / "fit"
    simulate("sagittal7", "squat", 3, 5.0, 50.0).save(files)
    trial = [str(files / "markers.trc"), "--forces", str(files / "forces.mot"), "--model", "sagittal7", "--mass", "70"]
    code = main(["tune", "fit", *trial, "--vary", "force_variance_n2", "--backend", "threads", "-o", str(folder)])
    assert code == 0
    written = json.loads((folder / "fit.json").read_text())
    assert [fold["held_out"].split(", ")[1] for fold in written["held_out"]] == ["first half", "second half"]
    assert set(written["figures"]) == {"fitted", "start", "paper"}
    assert presets.preset(str(folder / "preset_fit.toml")).force_variance_n2 == written["settings"][0]["value"]
    assert written["recommendation"][0] in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("names", "criterion", "expected"),
    [
        ((), "nll", "expected at least one"),
        (("jerk_density_rad2_s5", "jerk_density_rad2_s5"), "nll", "each once"),
        (("coordinate_variance",), "nll", "'coordinate_variance' is 0 in these settings"),
        (("jerk_density",), "nll", "did you mean 'jerk_density_rad2_s5'"),
        (("jerk_density_rad2_s5",), "nlll", "criterion 'nlll'"),
    ],
)
def test_what_cannot_be_fitted_is_refused(own: Shared, names: tuple, criterion: str, expected: str) -> None:
    with open_pool("threads", 1) as pool, pytest.raises(ConfigError, match=expected):
        Fitter(own, names, pool, criterion=criterion)


def test_what_is_usually_fitted_is_what_the_settings_use() -> None:
    assert usual_names(presets.paper())[:3] == ("coordinate_variance", "speed_variance", "acceleration_variance")
    assert {"jerk_density_rad2_s5", "marker_sd_m", "plate_force_sd_n"} < set(usual_names(presets.default()))
    assert "marker_variance_scale" not in usual_names(presets.default())
