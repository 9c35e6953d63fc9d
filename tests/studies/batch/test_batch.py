"""A study of simulated subjects: Table II over all of them, and what is wrong with single trials named."""

from __future__ import annotations

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from dynakin.cli.app import main
from dynakin.errors import ConfigError
from dynakin.simulation.trial import simulate
from dynakin.studies.batch.dataset import copies, read_dataset
from dynakin.studies.batch.process import Options, belongs_to

TRIAL = "output = 'o'\ntrials = '*.trc'\n[[subjects]]\nname = 'a'\n"
SUBJECTS, TRIALS, SECONDS, RATE_HZ = 3, 2, 5.0, 50.0
CORRUPT, SWAPPED = "S3/squat_2", "S2/squat_1"


def swap_plates(path: Path) -> None:
    """Each plate's forward and upward channels change places, as with a cable in the wrong socket.

    (Plates exchanged under the two feet: test_keys.py. A model in the plane takes their sum, so it loses nothing then.)
    """
    lines = path.read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("time"))
    names = lines[head].split("\t")
    for plate in (1, 2):
        a, b = (names.index(f"ground_force_{plate}_v{axis}") for axis in "xy")
        names[a], names[b] = names[b], names[a]
    lines[head] = "\t".join(names)
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    rng = np.random.default_rng(5)
    text = 'model = "sagittal7"\noutput = "out"\ntrials = "*/markers.trc"\nforces = "forces.mot"\n'
    for s in range(1, SUBJECTS + 1):
        mass, height = round(float(rng.uniform(55, 90)), 1), round(float(rng.uniform(1.6, 1.9)), 2)
        for t in range(1, TRIALS + 1):
            trial = simulate("sagittal7", "squat", 10 * s + t, SECONDS, RATE_HZ, mass_kg=mass, height_m=height)
            trial.save(folder / f"S{s}" / f"squat_{t}")
        text += f'\n[[subjects]]\nname = "S{s}"\nmass_kg = {mass}\nheight_m = {height}\nsex = "male"\n'
    corrupt, swapped = (folder / name for name in (CORRUPT, SWAPPED))
    markers = (corrupt / "markers.trc").read_text()
    (corrupt / "markers.trc").write_text(markers[: len(markers) // 2] + "1\tx")
    swap_plates(swapped / "forces.mot")
    (folder / "study.toml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def done(study: Path) -> int:
    return main(["batch", str(study / "study.toml"), "--tables-only"])


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_bad_trials_are_named_and_stop_nothing(study: Path, done: int) -> None:
    assert done == 1
    written = json.loads((study / "out" / "batch.json").read_text())
    assert set(written["failed"]) == {CORRUPT, SWAPPED}
    assert "markers.trc" in written["failed"][CORRUPT]["message"]
    assert re.search("plate|force|foot", written["failed"][SWAPPED]["message"])
    assert not any(failure["unexpected"] for failure in written["failed"].values())
    assert len(written["trials"]) == SUBJECTS * TRIALS - 2


def test_table2_is_mean_and_deviation_over_the_good_trials(study: Path, done: int) -> None:
    single = rows(study / "out" / "trials.csv")
    (found,) = (
        row for row in rows(study / "out" / "table2.csv") if (row["quantity"], row["method"]) == ("fy", "EKF (default)")
    )
    values = [float(row["rms"]) for row in single if (row["quantity"], row["method"]) == ("fy", "EKF (default)")]
    assert len(values) == int(found["n"]) == SUBJECTS * TRIALS - 2
    assert float(found["rms"]) == pytest.approx(np.mean(values))
    assert float(found["rms_sd"]) == pytest.approx(np.std(values, ddof=1))
    methods = {row["method"] for row in single}
    assert methods == {"EKF (default)", "AT (6 Hz)", "classical (6 Hz)"}
    by_subject = {r["quantity"]: r for r in rows(study / "out" / "table2_subjects.csv") if r["method"] == "AT (6 Hz)"}
    assert by_subject["markers"]["n"] == str(SUBJECTS)


def test_a_batch_that_is_run_again_works_on_what_failed_only(study: Path, done: int) -> None:
    table = (study / "out" / "table2.csv").read_text()
    lines = (study / "out" / "rows.jsonl").read_text()
    assert main(["batch", str(study / "study.toml"), "--tables-only"]) == 1
    assert (study / "out" / "rows.jsonl").read_text() == lines
    assert (study / "out" / "table2.csv").read_text() == table


def test_a_batch_that_was_moved_goes_on_where_it_lies(study: Path, done: int, tmp_path: Path) -> None:
    shutil.copytree(study / "out", tmp_path / "moved")
    lines = (study / "out" / "rows.jsonl").read_text()
    assert main(["batch", str(study / "study.toml"), "--tables-only", "-o", str(tmp_path / "moved")]) == 1
    assert (tmp_path / "moved" / "rows.jsonl").read_text() == lines


def test_a_batch_goes_on_by_another_spelling_of_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was refused as one of other settings, to be removed, when called from elsewhere than where it began."""
    folder = tmp_path / "study"
    (folder / "a" / "x").mkdir(parents=True)
    for name in ("a/x/t.trc", "a/x/f.mot", "a/still.trc", "mine.toml"):
        (folder / name).write_text("")
    text = 'trials = "x/*.trc"\nforces = "f.mot"\nstatic = "still.trc"\nfunctional = {hip_r = "gone.trc"}\n'
    (folder / "study.toml").write_text(f"output = 'o'\n{text}\n[[subjects]]\nname = 'a'\n")

    def found(path: str | Path, preset: str = "mine.toml") -> dict[str, object]:
        return belongs_to(read_dataset(Path(path)), Options((preset,)))

    monkeypatch.chdir(folder)
    begun = found("study.toml")
    assert found(folder / "study.toml", str(folder / "mine.toml")) == begun
    monkeypatch.chdir(tmp_path)
    for spelling in ("study", "./study/../study"):
        assert found(f"{spelling}/study.toml", "study/mine.toml") == begun
    folder.rename(tmp_path / "moved")
    assert found("moved/study.toml", "moved/mine.toml") == begun
    (tmp_path / "moved" / "a" / "still.trc").write_text("changed")
    assert found("moved/study.toml", "moved/mine.toml") != begun


def test_a_copy_is_left_out_and_named(tmp_path: Path) -> None:
    trials = "trials = [{trial = 'x.trc', forces = 'x.mot'}, {trial = 'y.trc', forces = 'y.mot'}, "
    trials += "{trial = 'x.trc', name = 'paper', forces = 'x.mot', preset = 'paper'}, {trial = 'x.trc', name = 'none'}]"
    (tmp_path / "s.toml").write_text(f"output = 'o'\n[[subjects]]\nname = 'a'\n{trials}\n")
    (tmp_path / "a").mkdir()
    for name in ("x.trc", "y.trc", "x.mot", "y.mot"):
        (tmp_path / "a" / name).write_text(name[1:])
    assert copies(read_dataset(tmp_path / "s.toml")) == {"a/y": "a/x"}
    (tmp_path / "a" / "y.mot").write_text(".tom")
    assert copies(read_dataset(tmp_path / "s.toml")) == {}


def test_a_copy_stops_nothing(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for trial in ("squat_1", "squat_2"):
        shutil.copytree(study / "S1" / "squat_1", tmp_path / "S1" / trial)
    text = (study / "study.toml").read_text()
    (tmp_path / "study.toml").write_text(text[: text.index('\n[[subjects]]\nname = "S2"')])
    assert main(["batch", str(tmp_path / "study.toml"), "--tables-only"]) == 1
    said = capsys.readouterr().out
    assert "1 trial of 1 subject" in said and "S1/squat_2: is a copy of S1/squat_1 and left out" in said


def test_tables_that_are_not_there_are_not_announced(
    study: Path, done: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (study / "study.toml").read_text().split("[[subjects]]")[0]
    text += f'[[subjects]]\nname = "one"\nfolder = "{study}/S3"\ntrials = "squat_2/markers.trc"\nmass_kg = 70.0\n'
    (tmp_path / "one.toml").write_text(text)
    assert main(["batch", str(tmp_path / "one.toml")]) == 2
    assert f"Tables  {tmp_path}/out/batch.json\n" in capsys.readouterr().out


def test_results_of_each_trial_are_written(study: Path, tmp_path: Path) -> None:
    text = (study / "study.toml").read_text().split("[[subjects]]")[0]
    text += f'[[subjects]]\nname = "one"\nfolder = "{study}/S1"\ntrials = "squat_1/markers.trc"\nmass_kg = 70.0\n'
    (tmp_path / "one.toml").write_text(text)
    assert main(["batch", str(tmp_path / "one.toml")]) == 0
    assert (tmp_path / "out" / "one" / "markers" / "report.html").is_file()


def test_presets_that_are_files_lie_beside_the_dataset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "study").mkdir()
    (tmp_path / "elsewhere").mkdir()
    for name in ("own", "hers", "his"):
        (tmp_path / "study" / f"{name}.toml").write_text('base = "default"\n')
    (tmp_path / "study" / "study.toml").write_text(
        'output = "o"\npresets = ["own.toml", "paper"]\n[[subjects]]\nname = "a"\npreset = "hers.toml"\n'
        'trials = [{trial = "x.c3d"}, {trial = "y.c3d", preset = "his.toml"}, {trial = "z.c3d", preset = "paper"}]\n'
    )
    monkeypatch.chdir(tmp_path / "elsewhere")
    found = read_dataset(Path("../study/study.toml"))
    assert found.presets == ("../study/own.toml", "paper")
    expected = ["../study/hers.toml", "../study/his.toml", "paper"]
    assert [session.content["preset"] for session in found.sessions] == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('output = "o"\n', "no subjects"),
        ("[[subjects]]\nname = 'a'\n", "output is missing"),
        ("output = 'o'\nmodle = 'x'\n[[subjects]]\nname = 'a'\n", "unknown key 'modle' (did you mean 'model'?)"),
        ("output = 'o'\n[[subjects]]\nmass_kg = 70\n", "subject 1 has no name"),
        ("output = 'o'\n[[subjects]]\nname = 'a'\nmas_kg = 70\n", "subject 'a': unknown key 'mas_kg'"),
        ("output = 'o'\n[[subjects]]\nname = 'a'\n", "no file *.c3d in"),
        (f"{TRIAL}mass_kg = '81 kg'\n", "a/x: mass_kg: Input should be a valid number"),
        (f"{TRIAL}mass_kg = -3\n", "a/x: subject: mass_kg: Input should be greater than 0"),
        (f"presets = ['nope']\n{TRIAL}", "presets: preset 'nope' is unknown"),
        (f"preset = 'nope'\n{TRIAL}", "a/x: preset 'nope' is unknown"),
        ("output = 'o'\n[[subjects]]\nname = 'a'\ntrials = [{file = 'x'}]\n", "expected a pattern"),
        ("output = 'o'\n[[subjects]]\nname = 'a'\ntrials = [{trial = 'x.c3d'}, {trial = 'x.trc'}]\n", "two trials"),
        ("output = 'o'\n[[subjects]]\nname = '..'\n", "subject 1: name is '..', expected the name of a folder"),
        ("output = 'o'\n[[subjects]]\nname = 'a/b'\n", "subject 1: name is 'a/b', expected the name of a folder"),
        *(
            (f"output = 'o'\n[[subjects]]\nname = 'a'\ntrials = [{{trial = 'x.c3d', name = {name!r}}}]\n", said)
            for name, said in (
                ("../../../x", "trial 'x.c3d': name is '../../../x', expected the name of a folder"),
                ("..", "trial 'x.c3d': name is '..', expected the name of a folder"),
                ("", "trial 'x.c3d': name is '', expected the name of a folder"),
                ("n" * 300, "of at most 200 bytes"),
            )
        ),
        ("output = 'o'\ntrials = '/etc/*'\n[[subjects]]\nname = 'a'\n", "subject 'a': trials is '/etc/*'"),
        ("output = 'o'\n[[subjects]]\nname = 'a'\ntrials = '**x/*.trc'\n", "subject 'a': trials is '**x/*.trc'"),
        ("output = 'o'\n[[subjects]]\nname = 'a'\ntrials = ''\n", "subject 'a': trials is '', expected a pattern"),
    ],
)
def test_a_bad_dataset_is_said_in_one_line(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "x.trc").write_text("")
    with pytest.raises(ConfigError) as error:
        read_dataset(path)
    assert str(path) in error.value.message and expected in error.value.message and "\n" not in error.value.message
