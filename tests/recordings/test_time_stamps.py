"""Time stamps that scatter: put on their even grid where the movement says so, kept where it was sampled unevenly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dynakin.recordings.formats.ground_forces import attach_forces
from dynakin.recordings.formats.mot import Table
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions
from dynakin.recordings.times import rate_of, settled_times
from dynakin.simulation.trial import simulate


@pytest.fixture(scope="module", params=[3, 8])
def gait(request: pytest.FixtureRequest) -> Recording:
    return simulate("fullbody", "gait", request.param, 2.5, markers="opencap").recording


@pytest.mark.parametrize("jitter_s", [0.001, 0.002, 0.004])
def test_stamps_of_software_are_put_back(gait: Recording, jitter_s: float) -> None:
    stamps = gait.time + np.random.default_rng(1).uniform(-jitter_s, jitter_s, gait.n_frames)
    time, notes = settled_times(stamps, gait.markers)
    assert len(notes) == 1 and "about an even 100 Hz" in notes[0].text
    np.testing.assert_allclose(time, gait.time, atol=jitter_s / 5)


@pytest.mark.parametrize("jitter_s", [0.001, 0.003])
def test_uneven_sampling_with_right_times_stays(gait: Recording, jitter_s: float) -> None:
    stamps = gait.time + np.random.default_rng(1).uniform(-jitter_s, jitter_s, gait.n_frames)
    stamps[[0, -1]] = gait.time[[0, -1]]
    markers = CubicSpline(gait.time, gait.markers)(stamps)
    time, notes = settled_times(stamps, markers)
    assert not notes
    np.testing.assert_array_equal(time, stamps)


@pytest.mark.parametrize("missing", [3, 60, 125])
def test_even_times_and_missing_frames_stay(gait: Recording, missing: int) -> None:
    keep = np.arange(gait.n_frames) != missing
    stamps = gait.time + np.random.default_rng(1).uniform(-0.002, 0.002, gait.n_frames)
    for time, markers in ((gait.time, gait.markers), (stamps[keep], gait.markers[keep])):
        found, notes = settled_times(time, markers)
        assert not notes and found is time


def test_who_stands_still_decides_nothing(gait: Recording) -> None:
    stamps = gait.time + np.random.default_rng(1).uniform(-0.002, 0.002, gait.n_frames)
    still = np.repeat(gait.markers[:1], gait.n_frames, axis=0)
    assert not settled_times(stamps, still)[1]
    noise = 5e-4 * np.random.default_rng(2).normal(size=still.shape)
    assert not settled_times(stamps, still + noise)[1]


def test_rate_of_scattered_times_is_the_mean_one() -> None:
    time = np.arange(200) / 100.0
    scattered = time + np.random.default_rng(0).uniform(-0.004, 0.004, 200)
    assert rate_of(scattered) == pytest.approx(100.0, rel=0.005)
    assert rate_of(np.delete(time, 100)) == pytest.approx(100.0)


def test_forces_beside_scattered_markers_are_not_called_slow(gait: Recording) -> None:
    stamps = gait.time + np.random.default_rng(1).uniform(-0.004, 0.004, gait.n_frames)
    stamps[[0, -1]] = gait.time[[0, -1]]
    names = tuple(f"FP1_{axis}" for axis in ("vx", "vy", "vz", "px", "py", "pz", "mx", "my", "mz"))
    plate = gait.plates[0]
    values = np.hstack([plate.force, np.nan_to_num(plate.cop), plate.free_moment])
    table = Table(names, gait.time, values, None, Path("forces.mot"))
    uneven = replace(gait, time=stamps, plates=())
    assert len(attach_forces(uneven, table, ReadOptions()).plates) == 1
    table = replace(table, time=stamps)  # stamped by the same program
    found = attach_forces(replace(gait, plates=()), table, ReadOptions())
    off = np.abs(found.plates[0].force - plate.force).max(axis=1)
    assert np.percentile(off, 90) < 30.0
