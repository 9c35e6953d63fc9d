"""Frames that are no estimate: found by all markers' distance and by refusals, empty in files, and said with times."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import dynakin
from dynakin.errors import LostError
from dynakin.filter.estimator import Estimator
from dynakin.messages import warning
from dynakin.model.definition import load_model
from dynakin.pipeline.result import Result
from dynakin.recordings.formats.mot import read_table
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.tracking import refuse_lost, tracking_of, why_lost, without_lost
from dynakin.settings.subject import Subject
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.case import Setup
from dynakin.validation.methods import compare_trial
from support.estimates.synthetic import make_estimate

ARM = slice(7, 10)
"""Three of ten markers."""


def arm_off(frames: slice, metres: float = 0.1) -> Estimate:
    """The synthetic squat with three of ten markers' estimates off for some frames."""
    estimate = make_estimate(gaps=False)
    markers = estimate.data["markers_estimated"].copy(deep=True)
    markers[frames, ARM, 0] += metres
    return replace(estimate, data=estimate.data.assign(markers_estimated=markers))


def test_a_good_estimate_has_no_lost_frame() -> None:
    assert not tracking_of(make_estimate()).lost.any()
    assert not tracking_of(arm_off(slice(None), 0.03)).lost.any()  # skin moves by that


def test_lost_frames_are_empty_and_out_of_the_figures() -> None:
    estimate = without_lost(arm_off(slice(500, 520)))
    assert np.flatnonzero(estimate.lost).tolist() == list(range(500, 520))
    for name in ("coordinates", "speeds", "moments", "markers_estimated", "wrench_estimated", "nis"):
        values = estimate.data[name].transpose("time", ...).values
        assert np.isnan(values[500:520]).all(), name
    assert np.isfinite(estimate.data["markers_measured"].values[505, :, :2]).all()
    assert why_lost(estimate) is None  # 1.7 % of the frames
    (said,) = [message for message in map(str, estimate.messages) if "lost" in message]
    assert said.startswith("Warning: the person was lost: 20 of 1201 frames") and "(5.00 to 5.19 s)" in said
    first, second, third = estimate.marker_names[ARM]
    assert said.endswith(f"or are refused, in most of these frames {first}, {second} and {third}.")
    metrics = compute_metrics(estimate)
    whole = compute_metrics(make_estimate(gaps=False))
    assert metrics["markers"]["rms_mm"] == pytest.approx(whole["markers"]["rms_mm"], rel=0.05)
    assert metrics["tracking"]["lost_frames"] == 20 and not metrics["tracking"]["trial_lost"]
    assert metrics["consistency"]["verdict"].startswith("Of the frames that are not lost")
    work = {name: entry["positive_j"] for name, entry in metrics["work"].items()}
    assert all(np.isfinite(value) for value in work.values())


def test_skin_that_takes_up_a_wrong_posture_counts() -> None:
    estimate = make_estimate(gaps=False)
    names = [f"marker/{marker}/x" for marker in estimate.marker_names[ARM]]
    state = estimate.data["state"].copy(deep=True)
    state.loc[{"element": names}] += 0.15  # the markers fit as before
    assert tracking_of(replace(estimate, data=estimate.data.assign(state=state))).lost.all()


def test_refused_markers_count_by_their_share_and_by_limb() -> None:
    estimate = make_estimate(gaps=False)
    verdict = np.ones((len(estimate.time), len(estimate.marker_names) + 1), dtype=int)
    verdict[100:300, 0] = 2  # one marker alone
    thigh = [k for k, p in enumerate(p for p in estimate.parameters if p.kind == "marker" and p.name.endswith("/x"))
             if p.segment == "thigh"]  # fmt: skip
    assert len(thigh) > 1
    verdict[400:420, thigh] = 2  # too short for a limb
    verdict[600:700, thigh] = 2
    data = estimate.data.assign(verdict=(("time", "sensor"), verdict))
    lost = tracking_of(replace(estimate, data=data)).lost
    assert np.flatnonzero(lost).tolist() == list(range(600, 700))


def test_a_lost_trial_is_saved_only_where_asked(tmp_path: Path) -> None:
    estimate = without_lost(arm_off(slice(300, 500)))
    assert why_lost(estimate) is not None and "17 % of the frames with markers, expected 10 %" in why_lost(estimate)
    with pytest.raises(LostError, match=r"3\.00 to 4\.99 s.*nothing is saved \(keep_lost=True saves"):
        Result(estimate).save(tmp_path / "out")
    assert not (tmp_path / "out").exists()
    folder = Result(estimate).save(tmp_path / "out", keep_lost=True)
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["tracking"]["trial_lost"] and metrics["consistency"]["judgement"] is None
    assert "The filter is consistent" not in (folder / "report.html").read_text()
    table = np.genfromtxt((folder / "coordinates.mot").read_text().split("endheader\n")[1].splitlines()[1:])
    assert np.isnan(table[300:500, 1:]).all() and np.isfinite(table[:300, 1:]).all()
    with xr.open_dataset(folder / "estimate.nc", engine="netcdf4") as data:
        assert int(data["lost"].sum()) == 200


def test_what_keeps_the_good_frames_is_said_where_it_is_and_where_there_are_any() -> None:
    estimate = without_lost(arm_off(slice(300, 500)))
    with pytest.raises(LostError, match=r"nothing is saved \(--keep-lost saves the frames that are good\)\. Look"):
        refuse_lost(estimate, "--keep-lost")
    with pytest.raises(LostError, match=r"at most; nothing is saved\. Look"):
        refuse_lost(estimate)
    with pytest.raises(LostError, match=r"at most; no frame is good, nothing is saved\. Look"):
        refuse_lost(without_lost(arm_off(slice(None))), "--keep-lost")


def test_a_lost_trial_says_what_was_doubted_of_it_before() -> None:
    """Of a standing trial of somebody else, say, and not only that labels may be swapped."""
    estimate = without_lost(arm_off(slice(300, 500)))
    other = warning("calibration", "distances differ by 23 mm from those in other. Lengths are other's.")
    doubted = replace(estimate, messages=[*estimate.messages, other, warning("mass", "something else.")])
    expected = (
        r"at most; nothing is saved.*\. What was doubted before: distances differ by 23 mm .* Lengths are other's"
    )
    with pytest.raises(LostError, match=expected) as error:
        refuse_lost(doubted)
    assert "something else" not in str(error.value)
    assert "doubted" not in (why_lost(estimate) or "")


@pytest.fixture(scope="module")
def squat() -> SimulatedTrial:
    return simulate_squat(seed=3, duration_s=6.0)


@pytest.mark.parametrize("lag_s", [0.0, 0.05, np.inf])
def test_known_truth_what_is_flagged_is_what_is_wrong(squat: SimulatedTrial, lag_s: float) -> None:
    """From 3 to 4.5 s every marker but the feet's carries another one's label: no posture fits. The motion is found
    again a tenth of that later at most."""
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    model = dynakin.load_model("sagittal7", subject=subject, markers="opencap")
    good = dynakin.Estimator(model).run(squat.recording, lag_s=lag_s)
    assert not good.lost.any()
    markers = squat.recording.markers.copy()
    names = squat.recording.marker_names
    others = [k for k, name in enumerate(names) if not name.endswith(("toe", "5meta", "calc"))]  # these must stay
    markers[300:450, others] = np.roll(markers[300:450][:, others], 5, axis=1)
    mislabelled = replace(squat.recording, markers=markers)
    found = dynakin.Estimator(model).run(mislabelled, lag_s=lag_s)
    assert found.lost[310:450].all() and why_lost(found) is not None
    truth = squat.truth.data["coordinates"].sel(coordinate=found.coordinate_names)
    error = np.abs(found.data["coordinates"].values - truth.transpose("time", "coordinate").values)
    assert np.nanmax(np.degrees(error)) < 25.0  # what is left is right
    with pytest.raises(LostError, match=r"EKF \(default\): the person was lost.*3\.00 to 4\.61 s"):
        compare_trial(mislabelled, Setup(Estimator(model), lag_s=lag_s))


@pytest.mark.nightly
def test_a_drop_jump_is_followed(data_dir: Path) -> None:
    """0.1 saved it with markers 64 mm off and `The filter is consistent`; later it was refused as lost."""
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "DJ1.trc", folder / "DJ1_grf.mot")
    subject = Subject(mass_kg=60.05, height_m=1.70)
    estimate = Estimator(load_model("fullbody", subject, markers="opencap")).run(recording)
    assert not tracking_of(estimate).lost.any()
    reference = read_table(folder / "DJ1_ik.mot")
    for joint in ("hip_flexion", "knee_angle", "ankle_angle"):
        for side in "rl":
            wanted = np.interp(
                estimate.time, reference.time, reference.values[:, reference.names.index(f"{joint}_{side}")]
            )
            ours = estimate.data["coordinates"].sel(coordinate=f"{joint}_{side}").values
            assert np.corrcoef(wanted, ours)[0, 1] > 0.98  # measured: 0.984 to 0.999


def test_places_that_move_with_their_segment_are_no_distance() -> None:
    """Joint angles move with what all places of a segment move by together; 0.1 counted it: a fit of 1.5 mm was lost.
    More than that, or apart, is a wrong posture."""
    estimate = make_estimate(gaps=False)
    places = [p.name for p in estimate.parameters if p.kind == "marker" and p.name.endswith("/x")]

    def moved(metres: list[float]) -> bool:
        state = estimate.data["state"].copy(deep=True)
        state.loc[{"element": places}] += np.array(metres)
        return bool(tracking_of(replace(estimate, data=estimate.data.assign(state=state))).lost.any())

    assert not moved([0.070] * len(places))
    assert moved([0.150] * len(places))
    assert moved([0.070 * (-1) ** k for k in range(len(places))])


def test_sitting_down_in_the_plane_that_fits_is_not_lost(data_dir: Path) -> None:
    """Sitting down and standing up: places on the bounds of trunk and pelvis, markers within 5 mm."""
    folder = data_dir / "opencap_subject4"
    trial = dynakin.read(folder / "STS1.trc", folder / "STS1_grf.mot").window(0.0, 6.0)
    model = dynakin.load_model("sagittal7", subject=dynakin.Subject(mass_kg=60.05, height_m=1.70), markers="opencap")
    estimate = dynakin.Estimator(model).run(trial)
    assert compute_metrics(estimate)["markers"]["mean_rms_mm"] < 5.0
    assert not estimate.lost.any()
