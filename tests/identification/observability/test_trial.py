"""What a trial observes, and advice that keeps its word."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from dynakin import Estimator, Subject, load_model
from dynakin.identification.observability.excitation import Bench
from dynakin.identification.observability.trial import identifiability
from dynakin.pipeline.result import Result
from dynakin.results.measures.posterior import judged, posterior_figures
from dynakin.simulation.trial import simulate
from support.identifiability import Told, estimated_squat


def test_an_exact_replay_of_the_trial_ends_as_sure_as_the_trial(squat: Told) -> None:
    """So what other motions give on the same bench can be held against it."""
    bench = Bench(squat.tracker, squat.estimate)
    at = bench.measured.block("inertia")
    now, ended = bench.deviations(bench.trial)[at], squat.estimate.data["state_sd"].values[-1, at]
    np.testing.assert_allclose(now, ended, rtol=0.1)


def test_the_advised_motion_shrinks_the_deviations_as_it_was_said(squat: Told) -> None:
    """Simulated anew with the motion on top, by the simulator's own mechanics, soft tissue and sensors."""
    gains = squat.found.gains["shoulder"]
    words = {e.name: e.words for e in squat.found.tried}["shoulder"]
    assert words == "moving the shoulder by ± 30 deg once a second"
    assert max(gains.values()) > 2.0
    moved, _ = estimated_squat("shoulder", 30.0)
    before, after = (e.data["state_sd"].isel(time=-1) for e in (squat.estimate, moved))
    for name, factor in gains.items():
        assert float(before.sel(element=name) / after.sel(element=name)) == pytest.approx(factor, rel=0.15), name


def test_what_no_motion_tells_is_not_told_by_one(squat: Told) -> None:
    moved, _ = estimated_squat("shoulder", 30.0)
    said = next(text for text in squat.found.advice if "foot's" in text)
    assert "it does not move" in said
    before, after = (e.data["state_sd"].isel(time=-1) for e in (squat.estimate, moved))
    for number in ("mass", "mx", "my", "izz"):
        ratio = before.sel(element=f"inertia/foot/{number}") / after.sel(element=f"inertia/foot/{number}")
        assert float(ratio) == pytest.approx(1.0, abs=0.05)


def test_tried_motions_keep_the_feet_loaded_and_the_person_in_balance(squat: Told) -> None:
    bench = Bench(squat.tracker, squat.estimate)
    ankle, shoulder = (bench.coordinates.index(name) for name in ("ankle", "shoulder"))
    assert bench.possible(bench.trial)
    assert bench.possible(bench.with_added(shoulder, np.radians(30.0), 1.0))
    assert not bench.possible(bench.with_added(ankle, np.radians(5.0), 1.0))
    assert not any(excitation.name == "toe" for excitation in squat.found.tried)


def test_a_whole_body_keeps_its_feet_and_is_judged_by_the_declared_noise() -> None:
    """Its noise calibrates itself, and the deviations of constants are by the declared one, their sums' too."""
    trial = simulate("fullbody", seed=3, duration_s=5.0)
    subject = Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimate, tracker = Estimator(load_model("fullbody", subject)).track(trial.recording)
    assert not 0.8 < tracker.noise.variance_scale < 1.25
    found = identifiability(tracker, estimate)
    tried = {excitation.name for excitation in found.tried or ()}
    assert "lumbar_rotation" in tried and not tried & {"hip_flexion_r", "knee_angle_l", "ankle_angle_r", "pelvis_tilt"}
    assert found.gains
    sums = zip(found.base, found.structure.base.K, strict=True)
    of_one = next(entry for entry, row in sums if (np.abs(row) > 1e-6).sum() == 1)
    parameter = next(p for p in estimate.parameters if p.name == of_one.name)
    assert (of_one.prior_sd, of_one.sd) == pytest.approx((parameter.prior_sd, parameter.posterior_sd), rel=1e-6)


def test_without_motions_all_else_is_there(squat: Told, tmp_path: Path) -> None:
    found = identifiability(squat.tracker, squat.estimate, motions=False)
    assert found.tried is None and found.gains == {}
    assert found.advice[-1].startswith("Movements that would help are found by: dynakin model")
    assert [text for text in found.advice if "foot's" in text] == [t for t in squat.found.advice if "foot's" in t]
    whole, part = squat.found.as_dict(), found.as_dict()
    assert {key for key in whole if whole[key] != part[key]} == {"excitation", "advice"}
    page = (Result(squat.estimate, observability=found).save(tmp_path / "out") / "report.html").read_text()
    assert "What the data leave open" in page and ">Movements that would help<" not in page


def test_base_parameters_carry_the_filters_covariance(squat: Told) -> None:
    data, base = squat.estimate.data, squat.found.structure.base
    over = list(base.over)
    P = data["final_covariance"].sel(element=over, element_=over).values
    entry = squat.found.base[5]
    assert entry.sd == pytest.approx(np.sqrt(base.K[5] @ P @ base.K[5]))
    assert entry.sd < entry.prior_sd
    assert sum(entry.share < 0.9 for entry in squat.found.base) > 10


def test_covariances_are_kept_and_written(squat: Told, tmp_path: Path) -> None:
    estimate = squat.estimate
    sd = np.sqrt(np.diag(estimate.data["final_covariance"].values))
    np.testing.assert_allclose(sd, estimate.data["state_sd"].values[-1], rtol=1e-9)
    for p in estimate.parameters:
        if p.estimated:
            variance = estimate.data["initial_covariance"].sel(element=p.name, element_=p.name)
            assert p.prior_sd == pytest.approx(float(np.sqrt(variance)))
    folder = Result(estimate, observability=squat.found).save(tmp_path / "out")
    with xr.open_dataset(folder / "estimate.nc") as read:
        assert read["final_covariance"].dims == ("element", "element_")
        np.testing.assert_allclose(read["final_covariance"], estimate.data["final_covariance"], rtol=2.0**-33)
    page = (folder / "report.html").read_text()
    assert 'id="identifiability"' in page and "Movements that would help" in page
    assert "What no measurement observes" in page


def test_the_block_of_the_metrics_agrees_with_the_estimate(squat: Told) -> None:
    block = squat.found.as_dict()
    assert block["base_parameters"]["rank"] == 22 and block["base_parameters"]["of"] == 28
    assert block["gauges"]["count"] == len(block["gauges"]["directions"])
    for p in squat.estimate.parameters:
        if p.estimated and p.kind != "plates":
            entry = block["parameters"][p.name]
            assert entry["share"] == pytest.approx(p.posterior_sd / p.prior_sd)
            assert entry["judgement"] == judged(entry["share"])
    assert posterior_figures(squat.estimate)["verdict"] == block["verdict"]
    counts = block["groups"]["lengths"]
    assert sum(counts.values()) == sum(p.kind == "length" and p.estimated for p in squat.estimate.parameters)
