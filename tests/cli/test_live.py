"""`dynakin live` as a user calls it."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from dynakin.cli.app import main
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.sinks.recorder import recorded

Said = pytest.CaptureFixture[str]
PERSON = ["--model", "sagittal7", "--markers", "opencap", "--mass", "70", "--height", "1.75", "--sex", "male"]


def written(folder: Path) -> Path:
    """A recording as a file."""
    recording: Recording = simulate_squat(seed=1, duration_s=5.0).recording
    columns = ["time"] + [f"{name}_{axis}" for name in recording.marker_names for axis in "xyz"]
    rows = [",".join(columns)]
    for k, t in enumerate(recording.time):
        rows.append(",".join([f"{t:.4f}", *(f"{value:.6f}" for value in recording.markers[k].ravel())]))
    path = folder / "squat.csv"
    path.write_text("\n".join(rows).replace("nan", "") + "\n")
    return path


def test_live_estimates_records_and_finishes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    source = "simulate:squat,model=sagittal7,duration=5,speed=0"
    static = written(tmp_path)
    monkeypatch.chdir(tmp_path)
    options = [*PERSON, "--static", static.name]
    assert main(["live", "--source", source, *options, "--record", str(tmp_path / "r")]) == 0
    said = capsys.readouterr().out
    assert "Stand still" in said and "Ready: move." in said and "--finish" in said
    assert (tmp_path / "r" / "stream.dkr").stat().st_size > 100_000
    monkeypatch.chdir(Path(__file__).parent)
    assert main(["live", "--finish", str(tmp_path / "r"), "-o", str(tmp_path / "o")]) == 0
    assert (tmp_path / "o" / "report.html").exists()
    assert tomllib.loads((tmp_path / "o" / "config.toml").read_text())["static"] == str(static)
    static.unlink()
    assert main(["live", "--finish", str(tmp_path / "r"), "-o", str(tmp_path / "other")]) == 2
    said = capsys.readouterr().err
    assert f"the session's static, {static}, is there no more, expected it, or --static FILE" in said
    assert said.count("\n") == 1 and not (tmp_path / "other").exists()
    known = str(tmp_path / "o" / "parameters.json")
    assert main(["live", "--source", source, *PERSON, "--parameters", known, "--lag", "0.1"]) == 0
    said = capsys.readouterr().out
    assert "go on from" in said and "Estimates come 100 ms late" in said
    assert main(["live", "--source", source, *PERSON, "--lag", "20"]) == 2
    assert "lag_s is 20.0, expected seconds (no longer frames)" in " ".join(capsys.readouterr().err.split())


@pytest.mark.skipif(os.name != "posix", reason="limits of processes are set by POSIX calls")
def test_a_recording_that_the_disk_cannot_take_is_no_success(tmp_path: Path) -> None:
    """A limit on the size of files stands for the end of the disk; what was written before it can be read."""
    folder = tmp_path / "r"
    source = "simulate:squat,model=sagittal7,duration=8,speed=4"
    limited = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000)); "
        "from dynakin.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", limited, "live", "--source", source, *PERSON, "--record", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 1, done.stdout + done.stderr
    assert done.stdout.count("the recording has ended") == 1 and "Recorded in" not in done.stdout
    assert "stream.dkr takes no more (File too large)" in done.stdout and "Traceback" not in done.stderr
    assert done.stdout.index("the recording has ended") > done.stdout.index("Stand still")
    kept = recorded(folder)
    assert 0.5 < kept.time[-1] < 7.0 and (folder / "stream.dkr").stat().st_size <= 400_000


def test_an_identified_subject_is_refused_where_it_is_another_models(tmp_path: Path, capsys: Said) -> None:
    """What is said of it comes from `run`; here only that the file is read and reaches the model."""
    source = "simulate:squat,model=sagittal7,duration=5,speed=0"
    wrong = tmp_path / "subject.toml"
    wrong.write_text('model = "squat7"\n')
    assert main(["live", "--source", source, *PERSON, "--parameters", str(wrong)]) == 2
    assert "subject.toml" in capsys.readouterr().err


def test_nothing_but_a_simulated_person_is_needed(capsys: Said) -> None:
    assert main(["live", "--source", "simulate:squat,duration=5,speed=0"]) == 0
    said = capsys.readouterr().out
    assert "51 markers at 100 Hz, 2 plates" in said and "Ready: move." in said and "Warning" not in said


def test_markers_alone_are_enough_to_see_a_person_move(tmp_path: Path, capsys: Said) -> None:
    source = f"replay:{written(tmp_path)},speed=0"
    assert main(["live", "--source", source, "--model", "sagittal7", "--markers", "opencap"]) == 0
    said = capsys.readouterr().out
    assert "70 kg are taken" in said and "Ready: move." in said


def test_a_recording_that_is_too_short_is_told_so(tmp_path: Path, capsys: Said) -> None:
    assert main(["live", "--source", f"replay:{written(tmp_path)},speed=0,duration=0.2", *PERSON]) == 2
    assert "ended before the model was measured: 0.2 s came" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--source", "nowhere:x"], "expected one of lsl:..., qtm:..., replay:..., simulate:..."),
        (["--source", "replay:none.c3d"], "none.c3d"),
        (["--source", "squats1.trc"], "'squats1.trc' is a file, expected replay:squats1.trc"),
        (["--source", "replay:x.trc,sped=2"], "unknown option 'sped'"),
        (["--source", "replay:x.trc,loop=maybe"], "loop is 'maybe', expected loop alone, or loop=yes or loop=no"),
        (["--source", "simulate:squat,loop=maybe"], "loop is 'maybe'"),
        (["--source", "simulate:squat,sed=2"], "unknown option 'sed'"),
        (["--source", "simulate:dance"], "dance"),
        (["--source", "lsl:a", "--forces", "b.mot"], "goes with replay:FILE only"),
        ([], "--source is missing"),
        (["--finish", "nothing", "-o", "out"], "cannot be read"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(arguments: list[str], words: str, tmp_path: Path, capsys: Said) -> None:
    finish = [str(tmp_path / "o") if a == "out" else a for a in arguments]
    assert main(["live", *finish]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--delay", "-1"], "--delay is -1, expected seconds, 0 or more"),
        (["--standing-wait", "nan"], "--standing-wait is nan"),
        (["--port", "99999"], "--port is 99999, expected 0 (any that is free) to 65535"),
    ],
)
def test_numbers_that_cannot_be_are_refused(words: list[str], said: str, capsys: Said) -> None:
    assert main(["live", "--source", "simulate:squat,duration=5,speed=0", *words]) == 2
    assert said in " ".join(capsys.readouterr().err.replace("│", " ").split())
