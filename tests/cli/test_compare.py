"""`dynakin compare` as a user calls it, on a short simulated trial."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import pytest

from dynakin.cli.app import main
from dynakin.cli.compare_inputs import cases_of, without_plates_in_words
from dynakin.simulation.output import save_trial
from dynakin.simulation.trial import simulate_squat

Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Arguments that name a trial of 10 s and how it is worked on."""
    folder = tmp_path_factory.mktemp("trial") / "squat"
    save_trial(simulate_squat(seed=4, duration_s=10.0, mass_kg=70.0), folder)
    return [str(folder / "markers.trc"), "--forces", str(folder / "forces.mot")]


SUBJECT = ["--model", "sagittal7", "--markers", "opencap", "--mass", "70", "--height", "1.75", "--sex", "male"]


def test_a_horizon_that_cannot_be_is_refused_before_anything_runs(trial: list[str], capsys: Said) -> None:
    assert main(["compare", *trial, *SUBJECT, "--unseen", "--horizon-ms", "-5"]) == 2
    said = capsys.readouterr()
    assert "the horizon is -0.005 s (--horizon-ms), expected more than 0 and less than half" in said.err
    assert not said.out.strip()


def test_trials_of_one_name_are_told_apart(trial: list[str], tmp_path: Path) -> None:
    shutil.copytree(Path(trial[0]).parent, tmp_path / "other")
    one, other = Path(trial[0]), tmp_path / "other" / "markers.trc"
    cases = cases_of([one, other], [], [], 6.0, {"model": "sagittal7", "mass_kg": 70.0})
    assert [case.recording.name for case in cases] == ["squat/markers", "other/markers"]
    assert [case.recording.name for case in cases_of([one], [], [], 6.0, {})] == ["markers"]


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def test_one_trial_gives_table_ii_on_screen_and_as_files(trial: list[str], tmp_path: Path, capsys: Said) -> None:
    out = tmp_path / "comparison"
    assert main(["compare", *trial, *SUBJECT, "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    for word in ("EKF (default)", "AT (6 Hz)", "classical (6 Hz)", "FY", "N m", "knee", "squats after the adaptation"):
        assert word in printed
    rows = rows_of(out / "table2.csv")
    assert {row["quantity"] for row in rows} >= {"markers", "fx", "fy", "mz", "r_knee"}
    summary = json.loads((out / "comparison.json").read_text())
    assert summary["schema_version"] == 1 and summary["trials"][0]["window"]["start_s"] == 2.0
    assert float(rows[0]["rms"]) == summary["table2"][0]["rms"]
    curves = rows_of(out / "repetitions.csv")
    assert len(curves) % 101 == 0 and {row["quantity"] for row in curves} >= {"knee", "knee/moment", "fy"}
    assert not (out / "held_out.csv").exists()
    page = (out / "report.html").read_text()
    for words in ("dynakin comparison", "Joint moments against AT", "squats after the adaptation", "cutoff_hz = 6.0"):
        assert words in page
    assert "Held out" not in page and "http://" not in page.replace("http://www.w3.org", "")


@pytest.mark.nightly
def test_many_trials_give_mean_and_deviation(trial: list[str], tmp_path: Path, capsys: Said) -> None:
    markers, _, forces = trial
    out, other = tmp_path / "comparison", tmp_path / "other"
    save_trial(simulate_squat(seed=5, duration_s=10.0, mass_kg=70.0), other)
    both = [markers, str(other / "markers.trc"), "--forces", forces, "--forces", str(other / "forces.mot")]
    assert main(["compare", *both, *SUBJECT, "--cutoff-hz", "8", "-o", str(out)]) == 0
    assert "2 trials, mean ± standard deviation" in capsys.readouterr().out
    row = rows_of(out / "table2.csv")[0]
    assert row["n"] == "2" and float(row["rms_sd"]) > 0.0
    assert any(row["method"] == "AT (8 Hz)" for row in rows_of(out / "table2.csv"))


def test_a_recording_given_twice_is_no_second_trial(trial: list[str], tmp_path: Path, capsys: Said) -> None:
    """Its deviations were all 0."""
    copy = shutil.copytree(Path(trial[0]).parent, tmp_path / "copy") / "markers.trc"
    twice = [trial[0], trial[0], *trial[1:], *trial[1:]]
    assert main(["compare", *twice, *SUBJECT]) == 2
    assert f"{trial[0]} is given twice" in (said := capsys.readouterr()).err and not said.out.strip()
    pair = ["--identify-on", trial[0], "--test-on", str(copy), *trial[1:], *trial[1:]]
    assert main(["compare", *pair, *SUBJECT]) == 2
    assert f"{trial[0]} and {copy} are one recording" in (said := capsys.readouterr()).err and not said.out.strip()


def test_forces_beside_a_trial_are_named_and_missing_ones_refused_before_anything_runs(
    trial: list[str], tmp_path: Path, capsys: Said
) -> None:
    shutil.copy(trial[0], tmp_path / "walk.trc")
    alone = tmp_path / "walk.trc"
    save_trial(simulate_squat(seed=5, duration_s=5.0, mass_kg=70.0), tmp_path / "other")
    pair = ["--identify-on", str(alone), "--test-on", str(tmp_path / "other" / "markers.trc")]
    for how in ([str(alone), "--halves"], pair):
        assert main(["compare", *how, *SUBJECT]) == 2
        said = capsys.readouterr()
        assert f"{alone}: no force plates" in said.err and "(--forces)" in said.err and not said.out.strip()
    shutil.copy(trial[2], tmp_path / "walk_grf.mot")
    assert main(["compare", str(alone), "--halves", *SUBJECT]) == 2
    assert "(--forces walk_grf.mot lies next to the recording)" in capsys.readouterr().err
    (said_first,) = without_plates_in_words(cases_of([alone], [], [], 6.0, {"model": "sagittal7", "mass_kg": 70.0}))
    assert str(said_first) == "walk: No force plates; --forces walk_grf.mot lies next to the recording."
    main(["compare", str(alone), *SUBJECT])
    assert "walk_grf.mot lies next to the recording" in " ".join(capsys.readouterr().out.split())


def test_halves_and_unseen_stand_beside_persistence(trial: list[str], tmp_path: Path, capsys: Said) -> None:
    out = tmp_path / "comparison"
    assert main(["compare", *trial, *SUBJECT, "--halves", "--unseen", "--horizon-ms", "50", "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "markers, second half" in " ".join(printed.split()) and "50 ms ahead" in printed
    assert {row["method"] for row in rows_of(out / "held_out.csv")} >= {"EKF (default), table", "persistence: mean"}
    page = (out / "report.html").read_text()
    assert "EKF (default), identified" in page and "50 ms ahead" in page
    yardsticks = {row["yardstick"] for row in rows_of(out / "unseen.csv")}
    assert yardsticks == {"plates withheld", "marker left out", "50 ms ahead"}


def test_identified_on_one_trial_and_judged_on_another(trial: list[str], tmp_path: Path, capsys: Said) -> None:
    folder = tmp_path / "other"
    save_trial(simulate_squat(seed=4, duration_s=9.0, mass_kg=70.0), folder)
    pair = ["--identify-on", trial[0], "--test-on", str(folder / "markers.trc")]
    forces = ["--forces", trial[2], "--forces", str(folder / "forces.mot")]
    assert main(["compare", *pair, *forces, *SUBJECT, "-o", str(tmp_path / "out")]) == 0
    assert "judged from markers alone" in capsys.readouterr().out
    rows = rows_of(tmp_path / "out" / "held_out.csv")
    assert {row["quantity"] for row in rows} == {"fx", "fy", "mz"}
    assert "squat/markers → other/markers" in (tmp_path / "out" / "report.html").read_text()


def test_a_configuration_may_stand_for_a_trial(trial: list[str], tmp_path: Path) -> None:
    """And gives what the same options give."""
    config = tmp_path / "squat.toml"
    lines = [f'trial = "{trial[0]}"', f'forces = "{trial[2]}"', 'model = "sagittal7"', 'markers = "opencap"']
    config.write_text("\n".join([*lines, "mass_kg = 66.0", "height_m = 1.75", 'sex = "male"']))
    options = [*SUBJECT[:5], "66", *SUBJECT[6:]]  # another mass than the trial's own: it is read from the file
    assert main(["compare", str(config), "-o", str(tmp_path / "a")]) == 0
    assert main(["compare", *trial, *options, "-o", str(tmp_path / "b")]) == 0
    for table in ("table2.csv", "angles.csv", "moments.csv"):
        assert rows_of(tmp_path / "a" / table) == rows_of(tmp_path / "b" / table) != []
    (warned,) = {
        tuple(json.loads((tmp_path / k / "comparison.json").read_text())["trials"][0]["warnings"]) for k in "ab"
    }
    assert any("66.0 kg" in warning for warning in warned)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["compare"], "no trial was given"),
        (["compare", "{trial}", "--model", "fulbody"], "did you mean 'fullbody'"),
        (["compare", "{trial}", "--model", "sagittal7"], "no force plates"),
        (["compare", "{trial}", "{trial}", "--forces", "{forces}", "--model", "sagittal7"], "given once for 2 trials"),
        (["compare", "--identify-on", "{trial}", "--model", "sagittal7"], "--test-on is missing"),
        (["compare", "{trial}", "--identify-on", "{trial}", "--test-on", "{trial}"], "stands alone"),
        (["compare", "{trial}", "--model", "sagittal7", "--preset", "best"], "preset 'best' is unknown"),
        (["compare", "{trial}", "--model", "sagittal7", "--cutoff-hz", "0"], "cut-off is 0 Hz"),
        (["compare", "{trial}", "--forces", "{forces}", *SUBJECT, "--unseen", "--horizon-ms", "0"], "horizon is 0 s"),
        (["compare", "no.c3d", "--model", "sagittal7"], "no.c3d"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(arguments: list[str], expected: str, trial: list[str], capsys: Said) -> None:
    known = {"{trial}": trial[0], "{forces}": trial[2]}
    assert main([known.get(word, word) for word in arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1
    assert expected in said


def test_a_folder_of_somebody_else_is_left_alone(trial: list[str], tmp_path: Path, capsys: Said) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    assert main(["compare", *trial, *SUBJECT, "-o", str(tmp_path)]) == 2
    assert "thesis.txt" in capsys.readouterr().err
    assert [entry.name for entry in tmp_path.iterdir()] == ["thesis.txt"]


def test_what_makes_a_trial_doubtful_is_said_everywhere(trial: list[str], tmp_path: Path, capsys: Said) -> None:
    out = tmp_path / "comparison"
    subject = ["--model", "sagittal7", "--markers", "opencap", "--mass", "40"]  # of 70 kg
    assert main(["compare", *trial, *subject, "--height", "1.75", "-o", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    (compared,) = json.loads((out / "comparison.json").read_text())["trials"]
    assert any("the person weighs 40.0 kg" in warning for warning in compared["warnings"])
    for text in (said, (out / "report.html").read_text()):
        assert "the person weighs 40.0 kg" in text
