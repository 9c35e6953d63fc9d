"""A judging trial's plates are read by the metric alone: other plates, the same prediction to the last bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.errors import ModelError
from dynakin.identification.decision import parts_of, posteriors, rms_of
from dynakin.identification.trials import Common, MeasuredTrial, measure_all
from dynakin.recordings.recording import Recording
from support.identification import Case
from support.squat_estimator import estimator


def other_plates(recording: Recording, frames: slice) -> Recording:
    """The same markers on plates that say something else, and in places nothing, in these frames."""
    rng = np.random.default_rng(1)
    plates = []
    for plate in recording.plates:
        force, moment = plate.force.copy(), plate.moment.copy()
        force[frames] += rng.normal(0.0, 30.0, force[frames].shape)
        moment[frames] *= -1.0
        force[frames][::7] = np.nan
        moment[frames][::7] = np.nan
        plates.append(replace(plate, force=force, moment=moment))
    return recording.with_plates(tuple(plates))


def predicted(common: Common, others: list[MeasuredTrial], left_out: MeasuredTrial) -> dict[str, np.ndarray]:
    """As `decide` takes what the others say of what is left out: by candidate, low-passed and full band."""
    found = posteriors(common, others)
    bands = {"low-passed": left_out.movement.states, "full band": left_out.full_band().movement.states}
    return {
        f"{use}, {band}": one.wrench(common, states) for use, one in found.items() for band, states in bands.items()
    }


def foretold(case: Case, recordings: list[Recording]) -> tuple[list[MeasuredTrial], list[dict[str, np.ndarray]]]:
    """Parts and what the others say of each, from the recordings on: model, kinematics, plates, estimate."""
    common = Common.measure(estimator(), recordings[0], case.common.static)
    parts = parts_of(measure_all(common, recordings))
    return parts, [predicted(common, [p for j, p in enumerate(parts) if j != k], part) for k, part in enumerate(parts)]


@pytest.fixture(scope="module")
def whole(case: Case) -> tuple[list[MeasuredTrial], list[dict[str, np.ndarray]]]:
    return foretold(case, [sim.recording for sim in case.sims])


@pytest.mark.parametrize("judging", [0, 1, 2, 3])
def test_a_half_is_foretold_without_its_plates(
    case: Case, whole: tuple[list[MeasuredTrial], list[dict[str, np.ndarray]]], judging: int
) -> None:
    recordings = [sim.recording for sim in case.sims]
    parts, before = whole
    start = parts[judging].movement.time[0]
    end = parts[judging].movement.time[-1]
    trial = judging // 2
    time = recordings[trial].time
    first = int(np.searchsorted(time, start - 1e-9))
    last = len(time) if judging % 2 else int(np.searchsorted(time, end + 1e-9))
    recordings[trial] = other_plates(recordings[trial], slice(first, last))
    changed, after = foretold(case, recordings)
    assert len(before[judging]) == 4  # two candidates, two bands
    for name, values in before[judging].items():
        np.testing.assert_array_equal(after[judging][name], values, err_msg=name)
        others = [k for k in range(4) if k != judging]
        differs = any(not np.array_equal(after[k][name], before[k][name]) for k in others)
        assert differs == name.startswith("bodies")  # the table asks nobody
        # another verdict, of the band that it is on
        judged = [
            part.full_band() if name.endswith("full band") else part for part in (changed[judging], parts[judging])
        ]
        assert not np.array_equal(rms_of(case.common, judged[0], values), rms_of(case.common, judged[1], values))


def test_a_trial_is_foretold_without_its_plates(case: Case) -> None:
    common, trials = case.common, list(case.trials)
    judged = replace(trials[1], wrench=np.full_like(trials[1].wrench, np.nan))
    before = predicted(common, [trials[0]], trials[1])
    after = predicted(common, [trials[0]], judged)
    for name, values in before.items():
        np.testing.assert_array_equal(after[name], values, err_msg=name)
    assert not trials[1].movement.recording.plates
    full = trials[1].full_band()
    assert full.movement.states.shape == trials[1].movement.states.shape
    assert np.diff(full.movement.states, 2, axis=0).std() > np.diff(trials[1].movement.states, 2, axis=0).std()
    assert np.isnan(rms_of(common, judged, after["bodies, low-passed"])).all()


def test_plates_of_a_judged_trial_do_not_tell_the_mass(case: Case) -> None:
    model = estimator().model
    unweighed = replace(estimator(), model=model.with_subject(model.subject.changed(mass_kg=None)))
    with pytest.raises(ModelError, match="body mass is not known; expected it"):
        Common.measure(unweighed, case.sims[0].recording)
    common = Common.measure(unweighed, case.sims[0].recording, case.common.static)
    assert common.initial.mass_kg == pytest.approx(70.0, rel=0.02)
