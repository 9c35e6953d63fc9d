"""Noise that a session finds in its innovations, frame by frame."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import dynakin
from dynakin.filter.live.found_noise import DECLARED_S, FORGETS_S, FoundNoise
from dynakin.filter.noise import LATE_SHARE
from dynakin.recordings.recording import Recording
from dynakin.settings.noise import Noise
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate

RATE_HZ, ROWS = 100.0, 60


def looked_at(
    speed_m_s: float, nis: float, seconds: float, found: FoundNoise | None = None, **report: Any
) -> FoundNoise:
    """Markers that go along at a speed, with the same innovations in each step."""
    found = FoundNoise() if found is None else found
    begun = found._seen[-1][0] + 1.0 / RATE_HZ if found._seen else 0.0
    said: Any = SimpleNamespace(**({"tracking": "following", "n_rows": ROWS, "nis": nis * ROWS} | report))
    for k in range(round(seconds * RATE_HZ)):
        at = begun + k / RATE_HZ
        found.look(at, np.full((8, 3), speed_m_s * at / np.sqrt(3.0)), said)
    return found


def test_what_is_declared_holds_until_somebody_moves() -> None:
    assert FoundNoise().variance_scale(late=True) == 1.0
    assert looked_at(0.005, 0.001, 60.0).variance_scale(late=True) > 0.75  # who sways shows the cameras alone
    assert looked_at(1.0, 0.04, 60.0, tracking="lost").variance_scale(late=True) == 1.0
    assert looked_at(1.0, 0.0, 60.0, n_rows=0).variance_scale(late=True) == 1.0


def test_the_factor_is_that_of_the_innovations_the_more_is_seen() -> None:
    found = looked_at(1.0, 0.04, 0.3 + DECLARED_S)
    assert np.log(found.variance_scale(late=True)) == pytest.approx(0.5 * np.log(0.04), rel=0.05)
    assert looked_at(1.0, 0.04, 60.0).variance_scale(late=True) == pytest.approx(0.04, rel=0.2)
    found = looked_at(1.0, 0.04, 60.0)
    at_once = found.variance_scale(late=False)
    assert np.log(at_once) == pytest.approx(LATE_SHARE * np.log(found.variance_scale(late=True)))


def test_it_follows_slowly_what_changes_and_stays_while_somebody_stands() -> None:
    found = looked_at(1.0, 0.04, 30.0)
    before = found.variance_scale(late=True)
    assert looked_at(0.005, 0.001, 30.0, found).variance_scale(late=True) == pytest.approx(before, rel=0.05)
    after = looked_at(1.0, 0.4, 0.5, found).variance_scale(late=True)
    assert before < after < 2.0 * before
    assert looked_at(1.0, 0.4, 5.0 * FORGETS_S, found).variance_scale(late=True) == pytest.approx(0.4, rel=0.1)


@pytest.fixture(scope="module")
def walk() -> SimulatedTrial:
    return simulate("fullbody", "gait", 6, 2.5, 60.0, mass_kg=70.0, height_m=1.75, sex="male")


def steps(recording: Recording) -> Iterator[dynakin.Sample]:
    plates = recording.plates
    for k, t in enumerate(recording.time):
        markers = {name: recording.marker(name)[k] for name in recording.marker_names}
        yield dynakin.Sample(float(t), markers, {plate.name: plate.wrench[k] for plate in plates})


def test_deviations_of_a_loop_hold_the_truth_and_are_not_several_times_the_errors(walk: SimulatedTrial) -> None:
    """By the declared noise they were 3 to 9 times as wide as a live estimate of `truth3d`'s walks erred."""
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    model = dynakin.load_model("fullbody", subject=subject)
    estimator = dynakin.Estimator(model)
    live = estimator.start(walk.recording, lag_s=0.05)
    declared = dynakin.Estimator(model, Noise(adapt=False)).start(walk.recording, lag_s=0.05)
    truth = walk.truth.data["speeds"].transpose("time", "coordinate")
    names = [str(name) for name in truth["coordinate"].values]
    errors: list[list[float]] = []
    said: list[list[float]] = []
    wide: list[list[float]] = []
    for sample in steps(walk.recording):
        for tracker in (live, declared):
            tracker.step(sample)
        late, same = live.delayed(), declared.delayed()
        if late is None or same is None or late.time_s < 1.0:
            continue
        np.testing.assert_array_equal(late.speeds, same.speeds)  # the movement is the same
        true = truth.sel(time=late.time_s, method="nearest").values
        errors.append([late.speeds[name] - value for name, value in zip(names, true, strict=True)])
        for tracker, sd in ((live, said), (declared, wide)):
            found = tracker.deviations(delayed=True)["speeds"]
            sd.append([found[name] for name in names])
    sd = np.array(said)
    moves = (sd > 0.0).all(axis=0) & (np.sqrt(np.mean(np.square(errors), axis=0)) > 0.01)
    inside = (np.abs(errors) < 1.96 * sd)[:, moves].mean()
    over = np.median(np.sqrt(np.mean(sd**2, axis=0))[moves] / np.sqrt(np.mean(np.square(errors), axis=0))[moves])
    assert inside > 0.85 and 0.5 < over < 2.5, (inside, over)
    assert np.median(np.array(wide)[:, moves] / sd[:, moves]) > 1.3  # 1.43
    assert live.found_noise(delayed=True).variance_scale < 0.3 and declared.found_noise().variance_scale == 1.0
    assert live.fresh().found_noise().variance_scale == 1.0
