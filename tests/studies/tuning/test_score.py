"""One trial and one setting: the figures, and what does not change them."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from dynakin.errors import ConfigError
from dynakin.filter.estimator import Estimator
from dynakin.recordings.recording import Recording
from dynakin.results.measures.fit import marker_rms_mm, signal_fit
from dynakin.results.measures.metrics import compute_metrics
from dynakin.settings import presets
from dynakin.studies.tuning.score import Shared, figures_of, score_task
from dynakin.studies.tuning.settings import check_setting, value_of
from dynakin.studies.tuning.trial import prepare, undoubting


def test_the_papers_criterion_is_the_sum_of_what_run_reports(paper: Shared, definition, recording: Recording) -> None:
    found = score_task(paper, (0, {}))
    metrics = compute_metrics(Estimator(definition, presets.paper()).run(recording))
    markers = [rms / 1000.0 for rms in metrics["markers"]["rms_mm"].values() if rms is not None]
    assert found["paper"] == pytest.approx(sum(markers) + sum(metrics["wrench"]["rms"].values()), rel=1e-9)
    assert found["markers_mm"] == pytest.approx(metrics["markers"]["mean_rms_mm"], rel=1e-9)
    assert found["nis_per_row"] == pytest.approx(metrics["consistency"]["mean_nis_per_dof"], rel=1e-9)
    assert {name: found[name] for name in ("fx", "fy", "mz")} == pytest.approx(metrics["wrench"]["rms"], rel=1e-9)


def test_tasks_and_trials_pickle_and_leave_each_other_alone(default: Shared) -> None:
    """A setting that adds or takes states must not change the model that the next one starts from."""
    alone = score_task(default, (0, {}))
    copy = pickle.loads(pickle.dumps(default))
    score_task(default, (0, {"soft_tissue_sd_fraction": 0.01, "plate_force_sd_n": 1e-3, "plate_delay_sd_s": 0.0}))
    assert score_task(default, (0, {})) == alone == score_task(copy, (0, {}))


def test_ahead_is_one_for_a_filter_that_only_holds_the_last_value(default: Shared) -> None:
    """By its definition: errors 100 ms ahead over the change in 100 ms, each channel by itself."""
    trial = default.trials[0]
    change = trial.persistence()
    then = np.arange(trial.first, trial.end)
    axes = np.array([True, True, False])
    moved = marker_rms_mm(trial.markers[then, 0], trial.markers[then - trial.ahead, 0], axes)
    assert 1000.0 * np.hypot(*change[:2]) == pytest.approx(moved, rel=1e-9)
    fy = signal_fit(trial.wrench[then, 1], trial.wrench[then - trial.ahead, 1]).rms
    assert change[-5] == pytest.approx(fy, rel=1e-9)


def test_a_declared_sigma_is_not_the_one_that_is_tried(paper: Shared) -> None:
    louder = {
        "marker_variance_scale": 100.0,
        "force_variance_n2": 100.0 * paper.base.force_variance_n2,
        "moment_variance_n2_m2": 100.0 * paper.base.moment_variance_n2_m2,
    }
    trial, tried = paper.trials[0], paper.base.changed(**louder)
    found = score_task(paper, (0, louder))["sigma"]
    assert found == figures_of(trial, undoubting(tried), paper.base)["sigma"]
    assert found == pytest.approx(10.0 * figures_of(trial, undoubting(tried), tried)["sigma"])


def test_what_the_starting_gates_refuse_is_taken_out_once(definition, recording: Recording) -> None:
    markers = recording.markers.copy()
    markers[180:185, 4] += 0.3  # flies away
    trial = prepare(replace(recording, markers=markers), Estimator(definition, presets.default()))
    assert np.isnan(trial.markers[180:185]).any(axis=2).sum() >= 5
    assert score_task(Shared((trial,), presets.default()), (0, {}))["markers_mm"] < 5.0


def test_halves_share_the_trial_and_add_up(default: Shared) -> None:
    whole = score_task(default, (0, {}))
    parts = Shared(default.trials[0].halves(), default.base)
    first, second = (score_task(parts, (k, {})) for k in range(2))
    assert first["n_rows"] + second["n_rows"] == whole["n_rows"]
    assert first["log_likelihood"] + second["log_likelihood"] == pytest.approx(whole["log_likelihood"], rel=1e-12)
    assert first["done"] < second["done"] == whole["done"]


def test_a_filter_that_loses_the_person_has_no_figures(paper: Shared) -> None:
    trial = paper.trials[0]
    markers = trial.markers.copy()
    markers[150:] += 3.0  # somebody else, further than a body with its toes in the ground can reach
    found = score_task(replace(paper, trials=(replace(trial, markers=markers),)), (0, {}))
    assert found["divergence"] and 150 < found["done"] < len(trial.time)
    assert found["paper"] is None and found["nll"] is None


def test_the_marker_that_is_left_out_is_worse_than_all_that_are_seen(default: Shared) -> None:
    found = score_task(replace(default, left_out=True), (0, {}))
    assert found["left_out"] > 2.0 * found["markers_mm"]


def test_settings_are_checked() -> None:
    with pytest.raises(ConfigError, match=r"'jerk_density' cannot be varied \(did you mean 'jerk_density_rad2_s5'\?\)"):
        check_setting("jerk_density")
    with pytest.raises(ConfigError, match="'jerk_density_rad2_s5' is 0 in these settings"):
        value_of(presets.paper(), "jerk_density_rad2_s5")
    with pytest.raises(ConfigError, match="force_variance_n2"):
        presets.paper().changed(force_variance_n2=-1.0)
