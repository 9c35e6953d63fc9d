"""Figures of fit and consistency, against numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.pipeline.result import Result
from dynakin.results.estimate import Estimate
from dynakin.results.measures.consistency import (
    GROUPS,
    Consistency,
    Innovations,
    Limit,
    Limits,
    consistency,
    judge_group,
    lag_one,
    limits,
    noise_from,
    statistics_of,
)
from dynakin.results.measures.fit import marker_rms_mm
from dynakin.results.measures.metrics import compute_metrics, evaluation_window
from support.estimates.synthetic import make_estimate

PLANE = np.array([True, True, False])


def test_marker_rms_is_the_distance_in_the_modelled_plane() -> None:
    measured = np.zeros((4, 3))
    estimated = np.array([[0.003, 0.004, 9.0]] * 4)
    assert marker_rms_mm(measured, estimated, PLANE) == pytest.approx(5.0)


def test_marker_rms_leaves_out_missing_frames_and_is_undefined_without_any() -> None:
    measured = np.array([[0.0, 0.0, 0.0], [np.nan] * 3])
    estimated = np.array([[0.001, 0.0, 0.0], [5.0, 5.0, 5.0]])
    assert marker_rms_mm(measured, estimated, PLANE) == pytest.approx(1.0)
    assert marker_rms_mm(measured[1:], estimated[1:], PLANE) is None


def test_window_starts_after_two_seconds_of_a_long_trial_only() -> None:
    long = np.arange(401) / 100.0 + 7.0
    assert evaluation_window(long).all()
    longer = np.arange(451) / 100.0 + 7.0
    assert longer[evaluation_window(longer)][0] == pytest.approx(9.0)


TIME = np.arange(600) / 100.0
MARKERS = Limits(Limit("markers", 0.2), Limit("markers_larger", 2.0))


def drawn(seed: int, scale: float = 1.0) -> Innovations:
    """White innovations of six columns, ``scale`` times as large as their deviations, which differ."""
    sd = np.tile([0.001, 0.002, 0.003, 1.0, 2.0, 5.0], (len(TIME), 1))
    return scale * sd * np.random.default_rng(seed).normal(size=sd.shape), sd


@pytest.mark.parametrize(("scale", "word"), [(1.0, "consistent"), (3.0, "overconfident"), (0.2, "conservative")])
def test_a_word_follows_the_size_of_the_innovations(scale: float, word: str) -> None:
    found = statistics_of(TIME, drawn(1, scale), drawn(2))
    assert found["markers"] == pytest.approx(scale**2, rel=0.08)
    assert found["markers_averaged"] == pytest.approx(scale**2, rel=0.3)
    assert found["markers_larger"] == max(found["markers"], found["markers_averaged"])
    assert found["wrench"] == pytest.approx(1.0, rel=0.08)
    assert judge_group(found, MARKERS) == word


def test_what_lasts_is_overconfident_however_small_it_is_in_a_frame() -> None:
    innovations, sd = drawn(3, 0.5)
    slow = innovations + 0.7 * sd * np.sign(np.sin(2.0 * np.pi * TIME / 3.0))[:, None]
    found = statistics_of(TIME, (slow, sd), drawn(4))
    assert found["markers"] < 1.0 < 2.0 < found["markers_averaged"]
    assert judge_group(found, MARKERS) == "overconfident"


def test_missing_rows_do_not_count_and_nothing_is_said_without_covariances() -> None:
    innovations, sd = drawn(5)
    gaps = np.where(np.arange(len(TIME))[:, None] % 3, innovations, np.nan)
    assert statistics_of(TIME, (gaps, sd), drawn(6))["markers_averaged"] == pytest.approx(1.0, rel=0.3)
    never = statistics_of(TIME, (np.full_like(sd, np.nan), sd), (innovations, None))
    assert never == {} and judge_group(never, MARKERS) is None


def test_of_all_groups_the_word_that_matters_most() -> None:
    words = {"motion": "conservative", "moments": "overconfident"}
    assert Consistency(1.0, None, 1, None, None, judgements=words).judgement == "overconfident"  # type: ignore[arg-type]
    assert Consistency(1.0, None, 1, None, None).judgement is None


def test_the_thresholds_are_of_statistics_that_exist_and_in_order() -> None:
    names = set(statistics_of(TIME, drawn(7), drawn(8)))
    assert set(limits()) == {"declared", "calibrated", "given"}
    for groups in limits().values():
        assert set(groups) == set(GROUPS)
        for own in groups.values():
            assert {own.conservative.statistic, own.overconfident.statistic} <= names
            assert 0.0 < own.conservative.value < own.overconfident.value


def test_noise_is_calibrated_where_its_scales_were_found_here_or_elsewhere() -> None:
    assert noise_from({}) == noise_from({"noise_used": {"variance_scale": 1.0, "jerk_scale": {}}}) == "declared"
    assert noise_from({"noise_used": {"variance_scale": 0.2, "jerk_scale": {}}}) == "calibrated"
    assert noise_from({"noise_used": {"variance_scale": 1.0, "jerk_scale": {"feet": 2.0}}}) == "calibrated"
    given = {"variance_scale": 0.2, "jerk_scale": {"feet": 2.0}}  # by a preset: nothing was found in this recording
    assert noise_from({"noise": {"adapt": False, **given}, "noise_used": given}) == "given"


def test_what_lasts_is_borne_further_where_the_noise_was_calibrated() -> None:
    innovations, sd = drawn(9)
    slow = innovations + 0.28 * sd * np.sign(np.sin(2.0 * np.pi * TIME / 3.0))[:, None]
    given = TIME, np.full(len(TIME), 6.0), np.full(len(TIME), 6), (slow, sd), drawn(10)
    assert consistency(*given).judgements["motion"] == "overconfident"
    found = consistency(*given, noise="calibrated")
    assert found.judgement == "consistent" and "was calibrated on this recording" in found.verdict


def test_true_covariances_give_a_mean_within_the_95_percent_interval() -> None:
    rng = np.random.default_rng(2)
    inside = 0
    nothing = np.empty((50, 0)), None
    for _ in range(200):
        found = consistency(np.arange(50) / 100.0, rng.chisquare(10, 50), np.full(50, 10), nothing, nothing)
        assert found.interval_95 is not None and found.mean_nis_per_dof is not None
        inside += found.interval_95[0] < found.mean_nis_per_dof < found.interval_95[1]
    assert 180 <= inside <= 199


def test_a_run_without_covariances_of_its_innovations_is_not_judged(estimate: Estimate) -> None:
    found = compute_metrics(estimate)["consistency"]
    assert found["judgement"] is None and found["judgements"] == {} and "not judged" in found["verdict"]


def test_metrics_are_computed_once_and_given_as_copies(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[object] = []

    def counted(estimate: object) -> dict[str, object]:
        calls.append(estimate)
        return {}

    monkeypatch.setattr("dynakin.results.measures.metrics.adaptation", counted)
    made = Result(make_estimate(2.0))
    first = made.metrics()
    first["window"]["start_s"] = -1.0
    assert made.metrics()["window"]["start_s"] == 0.0 and len(calls) == 1


def test_lag_one_counts_neighbouring_pairs_only_and_does_not_depend_on_units() -> None:
    rng = np.random.default_rng(4)
    e = rng.normal(size=(300, 3)) + 0.5
    e[100:150, 1] = np.nan
    assert lag_one(e) == pytest.approx(lag_one(e * [1.0, 1000.0, 1e-3]))
    alternating = np.where(np.arange(40) % 2, 1.0, -1.0)[:, None]
    assert lag_one(alternating) == pytest.approx(-1.0)
    gaps = np.where(np.arange(40) % 2, 1.0, np.nan)[:, None]
    assert lag_one(gaps) is None


def test_metrics_hold_the_keys_of_the_design(estimate: Estimate) -> None:
    metrics = compute_metrics(estimate)
    assert set(metrics) == {
        "schema_version",
        "moments",
        "peak_moments_per_kg",
        "work",
        "angles",
        "asymmetry",
        "feet",
        "contacts",
        "window",
        "lag_s",
        "marker_places",
        "unmarked_joints",
        "markers",
        "wrench",
        "prediction",
        "tracking",
        "consistency",
        "adaptation",
        "bounds",
        "soft_tissue",
        "identifiability",
        "events",
        "timing",
    }
    assert metrics["window"] == {"start_s": 2.0, "end_s": 12.0}
    assert set(metrics["markers"]) == {"rms_mm", "mean_rms_mm"}
    assert set(metrics["wrench"]) == {"rms", "nrms_percent", "nrms_range_percent", "correlation"}
    assert set(metrics["wrench"]["rms"]) == {"fx", "fy", "mz"}  # fz, mx, my are measured but not modelled
    assert metrics["timing"]["frames"] == 1201


def test_metrics_show_noise_of_known_size_and_gaps() -> None:
    metrics = compute_metrics(make_estimate(40.0, seed=5))
    # marker noise is 1.5 mm an axis, the planar distance therefore 1.5 sqrt(2); the thigh marker drifts besides
    assert metrics["markers"]["rms_mm"]["S1:RKNE"] == pytest.approx(1.5 * np.sqrt(2), rel=0.05)
    assert metrics["markers"]["rms_mm"]["S1:RTHI"] > 3.0
    assert metrics["wrench"]["rms"] == pytest.approx({"fx": 2.0, "fy": 5.0, "mz": 3.0}, rel=0.06)
    assert metrics["prediction"]["wrench"]["rms"]["fx"] == pytest.approx(np.sqrt(5.0), rel=0.06)
    assert metrics["events"]["missing_frames"] == {"S1:RASI": 40, "S1:RELB": 25}
    assert metrics["events"]["parameters_at_bound"] == ["length/thigh", "inertia/pelvis/mass"]
