"""Squats found in a height whose squats are known, and their mean curves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.comparison import Repetition, Trial, after_adaptation, curves, squat_repetitions
from dynakin.comparison.methods import pelvis_height
from dynakin.comparison.repetitions import normalised
from dynakin.reference import landmark_paths
from dynakin.simulation import SimulatedTrial

TIME = np.arange(0.0, 20.0, 0.01)


def squats(starts: dict[float, float], standing: float = 0.9, length: float = 2.0) -> np.ndarray:
    """Height with a cosine dip of some depth (m) from each start (s) on."""
    height = np.full(len(TIME), standing)
    for start, depth in starts.items():
        inside = (start <= TIME) & (start + length >= TIME)
        height[inside] -= depth * 0.5 * (1.0 - np.cos(2.0 * np.pi * (TIME[inside] - start) / length))
    return height + 0.002 * np.sin(2.0 * np.pi * 0.7 * TIME)  # sway


def test_each_squat_is_found_whole_deep_or_shallow() -> None:
    starts = {2.0: 0.35, 6.0: 0.12, 9.0: 0.3, 14.0: 0.2}
    found = squat_repetitions(TIME, squats(starts))
    assert len(found) == len(starts)
    for repetition, (start, depth) in zip(found, starts.items(), strict=True):
        assert repetition.lowest_s == pytest.approx(start + 1.0, abs=0.1)
        assert start <= repetition.start_s < start + 0.6
        assert start + 1.4 < repetition.end_s <= start + 2.0
        assert repetition.depth_m == pytest.approx(depth, abs=0.02)
        assert repetition.first < repetition.lowest < repetition.last
        assert TIME[repetition.first] == repetition.start_s


def test_a_squat_that_the_recording_cuts_is_left_out() -> None:
    height = squats({2.0: 0.3, 6.0: 0.3, 10.0: 0.3})
    cut = (TIME >= 2.8) & (TIME <= 10.8)  # begins near the bottom of the first, ends near that of the last
    found = squat_repetitions(TIME[cut], height[cut])
    assert [round(r.lowest_s) for r in found] == [7]


def test_standing_or_not_knowing_the_height_is_no_squat() -> None:
    assert squat_repetitions(TIME, squats({})) == []
    assert squat_repetitions(TIME, np.full(len(TIME), np.nan)) == []
    lost = squats({2.0: 0.3, 6.0: 0.3})
    lost[(TIME > 2.5) & (TIME < 3.6)] = np.nan  # too long a gap to be filled
    assert [round(r.lowest_s) for r in squat_repetitions(TIME, lost)] == [7]


def test_pelvis_height_follows_the_hip(simulated: SimulatedTrial) -> None:
    definition = dynakin.load_model("sagittal7", dynakin.Subject(mass_kg=70.0, height_m=1.75), markers="opencap")
    initial = dynakin.initialise(definition, simulated.recording)
    height = pelvis_height(simulated.recording, initial)
    hip = landmark_paths(simulated.recording, initial, definition)["hip"][:, 1]
    seen = np.isfinite(height) & np.isfinite(hip)
    assert np.corrcoef(height[seen], hip[seen])[0, 1] > 0.99


def test_curves_run_from_start_to_end_and_their_spread_is_over_repetitions(compared: Trial) -> None:
    time = compared.time
    ramp = np.repeat(time[:, None], len(compared.coordinate_names), axis=1)
    method = replace(compared.methods[0], coordinates=np.radians(ramp), moments=np.ones_like(ramp) * 140.0)
    trial = replace(compared, methods=(method,), mass_kg=70.0)
    repetitions = [Repetition(k, k + 50, k + 100, time[k], time[k + 50], time[k + 100], 0.3) for k in (100, 300)]
    rows = curves(trial, repetitions)
    knee = {row.percent: row for row in rows if row.quantity == "knee"}
    assert sorted(knee) == list(range(101))
    middle = knee[50.0]
    assert (middle.unit, middle.n, middle.mean_per_kg) == ("deg", 2, None)
    assert middle.mean == pytest.approx(time[250]) and middle.sd == pytest.approx(2.0 / np.sqrt(2.0))
    moment = next(row for row in rows if row.quantity == "knee/moment")
    assert (moment.unit, moment.mean, moment.mean_per_kg, moment.sd_per_kg) == ("N m", 140.0, 2.0, 0.0)
    assert curves(trial, []) == []


def test_normalised_keeps_the_ends() -> None:
    signal = np.sin(TIME)
    curve = normalised(TIME, signal, 37, 412)
    assert len(curve) == 101 and curve[0] == signal[37] and curve[-1] == pytest.approx(signal[412])


def test_only_squats_after_the_adaptation_count(compared: Trial) -> None:
    found = squat_repetitions(compared.time, compared.height)
    assert found
    assert after_adaptation(compared) == [r for r in found if r.start_s >= 2.0]


def test_squats1_has_five_squats(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    model = dynakin.load_model("sagittal7", dynakin.Subject(mass_kg=60.05), markers="opencap")
    found = squat_repetitions(recording.time, pelvis_height(recording, dynakin.initialise(model, recording)))
    assert len(found) == 5
    assert all(0.25 < repetition.depth_m < 0.45 for repetition in found)
