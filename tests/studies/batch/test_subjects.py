"""A dataset's subjects identified on their own trials, and the option that turns it off."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from dynakin.cli.app import main
from dynakin.model.identified import read_identified
from dynakin.simulation.trial import simulate
from dynakin.studies.batch.dataset import Dataset, read_dataset
from dynakin.studies.batch.subjects import IdentifyOptions, identify_on_trials, subject_tasks, with_parameters

TRIALS = {"squat": ("squat", 6.0), "squats": ("squat", 9.0), "sway": ("sway", 6.0)}
PATHS = {"markers": "trc", "forces": "mot"}
KEYS = 'model = "sagittal7"\nmarkers = "opencap"\noutput = "out"\ntrials = "*/markers.trc"\nforces = "forces.mot"\n'
SUBJECT = '[[subjects]]\nname = "S1"\nmass_kg = 70.0\nheight_m = 1.75\nsex = "male"\n'


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three trials of one person."""
    folder = tmp_path_factory.mktemp("study")
    for name, (task, seconds) in TRIALS.items():
        simulate("sagittal7", task, 1, seconds, 50.0).save(folder / "S1" / name)
    (folder / "study.toml").write_text(KEYS + SUBJECT)
    return folder


@pytest.fixture(scope="module")
def dataset(study: Path) -> Dataset:
    return read_dataset(study / "study.toml", study / "out")


@pytest.fixture(scope="module")
def row(dataset: Dataset, study: Path) -> dict[str, Any]:
    (task,) = subject_tasks(dataset)
    return identify_on_trials(IdentifyOptions(study / "out"), task.payload)


def test_a_subject_is_identified_on_its_trials_and_they_start_from_it(dataset: Dataset, row: dict[str, Any]) -> None:
    assert row["use"] == "bodies" and "segment inertia is used" in row["said"][-1]
    assert sorted(read_identified(Path(row["file"])).trials) == sorted(TRIALS)
    given = with_parameters(dataset, {"S1": row})
    assert [session.content["parameters"] for session in given.sessions] == [row["file"]] * 3
    kept = with_parameters(dataset, {"S1": row | {"use": "table"}})
    assert not any("parameters" in session.content for session in kept.sessions)


def test_a_subject_whose_parameters_are_given_or_that_has_one_trial_is_left_alone(dataset: Dataset) -> None:
    first, *others = dataset.sessions
    assert subject_tasks(replace(dataset, sessions=(first,))) == []
    given = replace(first, content=first.content | {"parameters": "subject.toml"})
    assert subject_tasks(replace(dataset, sessions=(given, *others))) == []


def test_without_enough_plates_the_table_is_kept_and_it_says_why(dataset: Dataset, tmp_path: Path) -> None:
    def without(session: Any) -> Any:
        return replace(session, content={key: value for key, value in session.content.items() if key != "forces"})

    one, *others = dataset.sessions
    said = identify_on_trials(IdentifyOptions(tmp_path), [one, *(without(session) for session in others)])
    assert said["use"] == "table" and said["file"] is None
    assert said["said"][0].startswith("The table is kept: 1 of 3 trials can be identified on, expected two; S1/")
    assert all(f"{session.name} has no force plates" in said["said"][0] for session in others)
    assert list(tmp_path.iterdir()) == []
    other = replace(others[0], content=others[0].content | {"mass_kg": 80.0})
    said = identify_on_trials(IdentifyOptions(tmp_path), [one, other])
    assert "has other settings than" in said["said"][0]


def test_a_copy_is_no_second_trial(dataset: Dataset, tmp_path: Path) -> None:
    one = dataset.sessions[0]
    said = identify_on_trials(IdentifyOptions(tmp_path), [one, replace(one, trial="copy")])
    assert said["use"] == "table" and "the markers are the same" in said["said"][-1]


@pytest.mark.parametrize("option", ["--identify", "--no-identify"])
def test_command_line(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str) -> None:
    arguments = [str(study / "study.toml"), "-o", str(tmp_path / "out"), "--tables-only", "--jobs", "1", option]
    assert main(["batch", *arguments]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    written = json.loads((tmp_path / "out" / "batch.json").read_text())
    used = any(
        "Identified inertial parameters are used" in " ".join(row["notes"]) for row in written["trials"].values()
    )
    assert used == (option == "--identify") == ("Subject S1: The identified segment inertia is used" in printed)
    assert (tmp_path / "out" / "S1" / "subject.toml").is_file() == used and bool(written["subjects"]) == used
    assert main(["batch", *arguments]) == 0  # goes on: nothing is left to do
    assert json.loads((tmp_path / "out" / "batch.json").read_text())["subjects"] == written["subjects"]


def test_another_person_is_left_out_wherever_its_name_stands(
    study: Path, dataset: Dataset, row: dict[str, Any], tmp_path: Path
) -> None:
    """The trials that agree say who the subject is, not the one whose name comes first."""
    simulate("sagittal7", "squat", 3, 5.0, 50.0, height_m=1.4, mass_kg=70.0).save(tmp_path / "S1" / "other")
    one = dataset.sessions[0]
    paths = {key: str(tmp_path / "S1" / "other" / f"{key}.{end}") for key, end in PATHS.items()}
    stranger = replace(one, trial="other", content=one.content | {"trial": paths["markers"], "forces": paths["forces"]})
    for order in ([stranger, *dataset.sessions], [*dataset.sessions, stranger]):
        said = identify_on_trials(IdentifyOptions(tmp_path / "out"), order)
        assert said["use"] == "bodies" and said["said"][1:] == row["said"]
        assert re.fullmatch(r"Left out: S1/other: .* from those in \w+ \(median.*another person.*", said["said"][0])
        assert "in markers" not in said["said"][0]
        assert sorted(read_identified(Path(said["file"])).trials) == sorted(TRIALS)
