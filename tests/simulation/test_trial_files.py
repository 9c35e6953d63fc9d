"""A trial as files: read back it is the same, written again it has the same bytes."""

from __future__ import annotations

import json
import time as clock
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import dynakin
from dynakin.errors import OutputError
from dynakin.recordings.formats.mot import read_table
from dynakin.simulation.output import TRIAL_FILES, SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate

WORST = SensorNoise.laboratory().changed({"occlusion_per_min": 3.0, "flying_per_min": 10.0, "swap_per_min": 5.0})


def worst_trial(seed: int = 5) -> SimulatedTrial:
    return simulate("sagittal7", "sit-to-stand", seed, 11.0, noise=WORST)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> tuple[SimulatedTrial, Path]:
    trial = worst_trial()
    return trial, trial.save(tmp_path_factory.mktemp("trial") / "one")


def test_the_same_seed_gives_the_same_bytes(saved: tuple[SimulatedTrial, Path], tmp_path: Path) -> None:
    """Later by more than a second, so that a time written into a file would show."""
    _, folder = saved
    clock.sleep(max(0.0, folder.stat().st_mtime + 1.1 - clock.time()))
    again, other = worst_trial().save(tmp_path / "again"), worst_trial(6).save(tmp_path / "other")
    assert sorted(path.name for path in again.iterdir()) == sorted(TRIAL_FILES)
    for name in TRIAL_FILES:
        assert (again / name).read_bytes() == (folder / name).read_bytes(), name
        assert (other / name).read_bytes() != (folder / name).read_bytes(), name


def test_what_is_read_back_is_what_was_simulated(tmp_path: Path) -> None:
    """But for markers that jump, which the reader takes as missing, and labels that it puts right."""
    noise = WORST.changed({"flying_per_min": 0.0, "swap_per_min": 0.0})
    trial = simulate("sagittal7", "sit-to-stand", 5, 11.0, noise=noise)
    folder = trial.save(tmp_path / "one")
    recording = dynakin.read(folder / "markers.trc", forces=folder / "forces.mot")
    assert recording.marker_names == trial.recording.marker_names
    np.testing.assert_allclose(recording.markers, trial.recording.markers, atol=1e-9)
    assert len(recording.plates) == 3
    for mine, back in zip(trial.recording.plates, recording.plates, strict=True):
        assert back.name == mine.name
        np.testing.assert_allclose(back.force, mine.force, atol=1e-9)
        np.testing.assert_allclose(back.moment, mine.moment, atol=1e-9)  # the seat's too, loaded or not
    assert not [note for note in map(str, recording.notes) if "not used" in note]


def test_without_errors_the_files_hold_the_true_wrench(tmp_path: Path) -> None:
    trial = simulate("squat7", "squat", 2, 5.0, noise=SensorNoise.none())
    folder = trial.save(tmp_path / "perfect")
    recording = dynakin.read(folder / "markers.trc", forces=folder / "forces.mot")
    truth = read_table(folder / "truth_wrench.sto")
    np.testing.assert_allclose(recording.total_wrench(about=trial.truth.origin_L), truth.values, atol=1e-8)


def test_the_truth_is_in_the_files(saved: tuple[SimulatedTrial, Path]) -> None:
    trial, folder = saved
    data = trial.truth.data
    names = [str(name) for name in data["coordinate"].values]
    for file, variable in (("coordinates.mot", "coordinates"), ("speeds.sto", "speeds")):
        table = read_table(folder / f"truth_{file}").radians(names)
        assert list(table.names) == names
        np.testing.assert_allclose(table.values, data[variable].values, atol=1e-12)
    moments = read_table(folder / "truth_moments.sto")
    np.testing.assert_allclose(moments.column("knee_moment"), data["moments"].sel(coordinate="knee"), atol=1e-9)
    with xr.open_dataset(folder / "truth.nc", engine="netcdf4") as stored:
        for variable in data.data_vars:
            np.testing.assert_array_equal(stored[variable].values, data[variable].values, err_msg=str(variable))
        assert stored["moments"].attrs["units"] == "N m"
    content = json.loads((folder / "truth.json").read_text())
    assert content["schema_version"] == 1
    assert content["parameters"] == trial.truth.parameters
    assert content["simulation"]["sensors"] == WORST.as_dict()
    assert content["simulation"]["seed"] == 5
    assert {fault["kind"] for fault in content["faults"]} >= {"occluded", "flying"}
    assert set(content["plates"]) == {"plate 1", "plate 2", "plate 3"}


def test_another_trial_replaces_the_old_one_but_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    short = {"duration_s": 3.0, "rate_hz": 50.0}
    simulate("sagittal7", "sway", 1, **short).save(folder)
    simulate("sagittal7", "sway", 2, **short).save(folder)
    assert json.loads((folder / "truth.json").read_text())["simulation"]["seed"] == 2
    assert [path.name for path in tmp_path.iterdir()] == ["out"]  # no temporary folder stays
    (folder / "thesis.doc").write_text("years of work")
    with pytest.raises(OutputError, match=r"holds thesis\.doc"):
        simulate("sagittal7", "sway", 3, **short).save(folder)
    assert (folder / "thesis.doc").read_text() == "years of work"
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        simulate("sagittal7", "sway", 3, **short).save(tmp_path / "file")
