"""A batch takes the keys of a run's configuration as `run` does, and its trials' folders are those of runs."""

from __future__ import annotations

import csv
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.cli.app import main
from dynakin.recordings.recording import Plate
from dynakin.simulation.trial import simulate

Said = pytest.CaptureFixture[str]
SUBJECT = 'mass_kg = 70.0\nheight_m = 1.75\nsex = "male"\n'
ONE = f'\n[[subjects]]\nname = "one"\n{SUBJECT}'


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    simulate("sagittal7", "squat", 3, 5.0, 50.0).save(folder / "one" / "squat")
    return folder


def study(folder: Path, output: Path, more: str = "") -> Path:
    keys = f'model = "sagittal7"\noutput = "{output}"\ntrials = "*/markers.trc"\nforces = "forces.mot"\n'
    path = output.parent / f"{output.name}.toml"
    path.write_text(keys + more + ONE.replace('"one"\n', f'"one"\nfolder = "{folder}/one"\n'))
    return path


@pytest.fixture(scope="module")
def plain(subject: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("plain") / "out"
    assert main(["batch", str(study(subject, output))]) == 0
    return output / "one" / "markers"


def test_its_configuration_is_one_that_run_repeats(plain: Path) -> None:
    written = tomllib.loads((plain / "config.toml").read_text())
    assert Path(written["trial"]).is_absolute() and Path(written["output"]) == plain.absolute()
    before = (plain / "coordinates.mot").read_text()
    assert main(["run", str(plain / "config.toml")]) == 0
    assert (plain / "coordinates.mot").read_text() == before
    assert tomllib.loads((plain / "config.toml").read_text()) == written


def test_smoothing_zero_and_signs_are_those_that_were_asked_for(subject: Path, plain: Path, tmp_path: Path) -> None:
    more = 'lag_s = 0.05\nzero = "standing"\nsigns = "clinical"\n'
    assert main(["batch", str(study(subject, tmp_path / "out", more))]) == 0
    folder, run = tmp_path / "out" / "one" / "markers", tmp_path / "run"
    assert main(["run", str(folder / "config.toml"), "-o", str(run)]) == 0
    for name in ("angles.sto", "coordinates.mot"):
        assert (folder / name).read_text() == (run / name).read_text()
    assert "knee_flexion" in (folder / "angles.sto").read_text()
    assert (folder / "coordinates.mot").read_text() != (plain / "coordinates.mot").read_text()


def test_the_identified_subject_is_looked_for_beside_the_trials(subject: Path, tmp_path: Path, capsys: Said) -> None:
    (subject / "one" / "other.toml").write_text('model = "squat7"\n')
    assert main(["batch", str(study(subject, tmp_path / "out", 'parameters = "other.toml"\n'))]) != 0
    assert f"{subject}/one/other.toml" in " ".join(capsys.readouterr().out.split()).replace(" ", "")


def exchanged(one: Plate, other: Plate) -> Plate:
    """The forces of the one at the place of the other, as with two cables in each other's sockets."""
    moment = np.cross(other.cop, one.force) + one.free_moment
    return replace(one, moment=moment, cop=other.cop, corners=other.corners)


def twisted(plate: Plate) -> Plate:
    """With a free moment that feet do not make."""
    more = 0.08 * plate.force
    return replace(plate, moment=plate.moment + more, free_moment=plate.free_moment + more)


def test_exchanged_plates_fail_by_name_and_stop_no_other(tmp_path: Path, capsys: Said) -> None:
    for number, name in enumerate(("good", "exchanged"), start=3):
        trial = simulate("fullbody", "squat", number, 5.0, 12.5)
        if name == "exchanged":
            a, b = trial.recording.plates
            trial = replace(trial, recording=trial.recording.with_plates((exchanged(a, b), exchanged(b, a))))
        trial.save(tmp_path / "S1" / name)
    keys = 'model = "fullbody"\noutput = "out"\ntrials = "*/markers.trc"\nforces = "forces.mot"\n'
    (tmp_path / "study.toml").write_text(f'{keys}[[subjects]]\nname = "S1"\n{SUBJECT}')
    assert main(["batch", str(tmp_path / "study.toml"), "--tables-only"]) == 1
    worked = json.loads((tmp_path / "out" / "batch.json").read_text())
    assert set(worked["trials"]) == {"S1/good"} and set(worked["failed"]) == {"S1/exchanged"}
    (failed,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Failed")]
    assert failed.startswith("Failed  S1/exchanged: ") and "pushes the feet apart" in failed
    assert "if the two were exchanged" in failed


def test_what_rests_on_doubted_forces_is_marked(tmp_path: Path, capsys: Said) -> None:
    """A free moment too large for feet is warned of, and stops nothing."""
    for number, name in enumerate(("good", "doubted"), start=3):
        trial = simulate("fullbody", "squat", number, 5.0, 12.5)
        if name == "doubted":
            trial = replace(trial, recording=trial.recording.with_plates(tuple(map(twisted, trial.recording.plates))))
        trial.save(tmp_path / "S1" / name)
    keys = 'model = "fullbody"\noutput = "out"\ntrials = "*/markers.trc"\nforces = "forces.mot"\n'
    (tmp_path / "study.toml").write_text(f'{keys}[[subjects]]\nname = "S1"\n{SUBJECT}')
    assert main(["batch", str(tmp_path / "study.toml"), "--tables-only"]) == 0
    rows = json.loads((tmp_path / "out" / "batch.json").read_text())["trials"]
    assert not rows["S1/good"]["findings"] and "Force plates" in rows["S1/doubted"]["findings"]
    assert "force plates" in rows["S1/doubted"]["verdict"]["default"]
    with (tmp_path / "out" / "trials.csv").open(encoding="utf-8", newline="") as file:
        findings = {row["trial"]: row["findings"] for row in csv.DictReader(file)}
    assert findings["S1/good"] == "" and "Force plates" in findings["S1/doubted"]
    said = capsys.readouterr().out
    verdicts = [line for line in said.splitlines() if line.startswith("Verdict")]
    assert "Verdict S1/good: Nothing in this run speaks against using it." in verdicts and len(verdicts) == 2
    assert "FY *" in said and "are doubted: S1/doubted" in " ".join(said.split())
    warned = [line for line in said.splitlines() if line.startswith("Warned")]
    assert any(line.startswith("Warned  S1/doubted: plate 1: free moment") for line in warned)
    assert not any("S1/good: plate 1" in line for line in warned)
