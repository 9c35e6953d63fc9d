"""Bad input: one clear line on stderr, exit code 2, and nothing half-written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dynakin.cli import compare_inputs
from dynakin.cli.app import main
from dynakin.errors import ConfigError
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.results.files.markers import write_trc
from dynakin.results.files.storage import write_storage
from dynakin.simulation.trial import simulate_squat

Refused = Callable[..., str]


@pytest.fixture(scope="module")
def squat() -> Recording:
    return simulate_squat(seed=3, duration_s=5.0).recording


@pytest.fixture
def trial(squat: Recording, tmp_path: Path) -> Path:
    """A simulated squat as a TRC file with its forces as MOT beside it."""
    write_trc(tmp_path / "squat.trc", squat.time, list(squat.marker_names), squat.markers, unit="mm")
    _write_forces(tmp_path / "squat.mot", squat)
    return tmp_path / "squat.trc"


def _write_forces(path: Path, recording: Recording, frames: slice = slice(None)) -> None:
    names, columns = [], []
    for number, plate in enumerate(recording.plates, 1):
        cop = np.nan_to_num(plate.cop)
        for stem, values in (("v", plate.force), ("p", cop), ("m", plate.free_moment)):
            names += [f"ground_force_{number}_{stem}{axis}" for axis in "xyz"]
            columns.append(values)
    write_storage(path, "forces", recording.time[frames], names, np.hstack(columns)[frames], in_degrees=False)


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Refused:
    """Run a command that must be refused; gives its one line of error."""

    def run(*arguments: str | Path) -> str:
        before = sorted(tmp_path.rglob("*"))
        code = main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        assert code == 2, said.out + said.err
        assert said.err.startswith("error: ") and said.err.count("\n") == 1, said.err
        assert "Traceback" not in said.err
        assert sorted(tmp_path.rglob("*")) == before, "something was left behind"
        return said.err

    return run


def _options(tmp_path: Path, **changed: str) -> list[str]:
    options = {
        "--forces": str(tmp_path / "squat.mot"),
        "--model": "sagittal7",
        "--markers": "opencap",
        "--mass": "70",
        "-o": str(tmp_path / "out"),
    } | {f"--{key}" if len(key) > 1 else f"-{key}": value for key, value in changed.items()}
    return [part for pair in options.items() for part in pair if pair[1]]


def test_the_trial_itself_runs(trial: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(trial), *_options(tmp_path)]) == 0, capsys.readouterr().err
    assert (tmp_path / "out" / "report.html").exists()


def test_no_such_file(refused: Refused, tmp_path: Path) -> None:
    assert "nowhere.trc" in refused("run", tmp_path / "nowhere.trc", *_options(tmp_path))


def test_not_a_c3d(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "squat.c3d").write_text("this is no C3D, whatever its name says\n" * 40)
    assert "squat.c3d" in refused("run", tmp_path / "squat.c3d", *_options(tmp_path, forces=""))


def test_truncated_c3d(refused: Refused, tmp_path: Path, data_dir: Path) -> None:
    whole = (data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d").read_bytes()
    (tmp_path / "cut.c3d").write_bytes(whole[: len(whole) // 3])
    assert "cut.c3d" in refused("run", tmp_path / "cut.c3d", *_options(tmp_path, forces="", model="squat7", markers=""))


def test_wrong_column_count(trial: Path, refused: Refused, tmp_path: Path) -> None:
    lines = trial.read_text().splitlines()
    lines[30] += "\t1.0\t2.0"
    trial.write_text("\n".join(lines) + "\n")
    assert "line 31" in refused("run", trial, *_options(tmp_path))


def test_unknown_model_and_marker_set_name_the_nearest(trial: Path, refused: Refused, tmp_path: Path) -> None:
    assert "did you mean 'opencap'" in refused("run", trial, *_options(tmp_path, markers="opencup"))
    assert "did you mean 'sagittal7'" in refused("run", trial, *_options(tmp_path, model="sagital7"))


def test_a_needed_marker_that_is_absent_everywhere(
    trial: Path, squat: Recording, refused: Refused, tmp_path: Path
) -> None:
    markers = squat.markers.copy()
    gone = [k for k, name in enumerate(squat.marker_names) if "knee" in name]
    assert gone
    markers[:, gone] = np.nan
    write_trc(trial, squat.time, list(squat.marker_names), markers, unit="m")
    assert "knee" in refused("run", trial, *_options(tmp_path)).casefold()


def test_no_plates(trial: Path, refused: Refused, tmp_path: Path) -> None:
    assert "no force plates" in refused("run", trial, *_options(tmp_path, forces=""))


def test_forces_that_end_too_early(trial: Path, squat: Recording, refused: Refused, tmp_path: Path) -> None:
    _write_forces(tmp_path / "squat.mot", squat, slice(0, 100))
    assert "squat.mot" in refused("run", trial, *_options(tmp_path))


def test_a_frame_without_any_marker(trial: Path, squat: Recording, refused: Refused, tmp_path: Path) -> None:
    markers = squat.markers.copy()
    markers[200] = np.nan
    write_trc(trial, squat.time, list(squat.marker_names), markers, unit="m")
    assert "frame 201" in refused("run", trial, *_options(tmp_path), "--preset", "paper")


def test_mass_of_zero(trial: Path, refused: Refused, tmp_path: Path) -> None:
    assert "mass_kg" in refused("run", trial, *_options(tmp_path, mass="0"))


@pytest.mark.parametrize("command", ["fit", "grid"])
def test_tune_takes_the_forces_beside_its_trial(command: str, trial: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = (trial.parent / "squat.mot").rename(trial.parent / "squat_grf.mot")
    taken: list[Path | None] = []

    def cases_of(trials: list[Path], forces: list[Path | None], *_: object) -> None:
        taken.extend(forces)
        raise ConfigError("as far as this")

    monkeypatch.setattr(compare_inputs, "cases_of", cases_of)
    assert main(["tune", command, str(trial), str(trial.parent / "other.trc"), "-o", str(trial.parent / "out")]) == 2
    assert taken == [there, None]


def test_a_decimal_comma_is_told(trial: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--mass", "60,05"], ["--mass=60,05"]):
        assert main(["run", str(trial), *words, "-o", "out"]) == 2
        assert capsys.readouterr().err.endswith("--mass is 60,05, expected a number with a decimal point: 60.05\n")


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_folder_is_no_trial(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, str(tmp_path)]) == 2
    assert f"{tmp_path}: is a folder, expected a recording (.c3d, .csv or .trc)" in " ".join(
        capsys.readouterr().err.split()
    )


def test_a_number_in_another_unit_names_the_option(trial: Path, refused: Refused, tmp_path: Path) -> None:
    said = refused("run", trial, *_options(tmp_path, mass="6200"))
    assert "mass_kg" in said and "expected kilograms (--mass)" in said
    assert "expected metres (--height), 1.70?" in refused("run", trial, *_options(tmp_path, height="170"))


def test_of_an_unknown_model_the_models_are_listed(trial: Path, refused: Refused, tmp_path: Path) -> None:
    said = refused("run", trial, *_options(tmp_path, model="fulbody"))
    assert "did you mean 'fullbody'" in said and "expected fullbody, sagittal7, squat7, or a .toml or .osim" in said


def test_an_option_is_no_value_of_another(trial: Path, refused: Refused, tmp_path: Path) -> None:
    said = refused("run", trial, *_options(tmp_path, o=""), "--figures", "-o", tmp_path / "out")
    assert "Option --figures has no value: after it stands -o" in said
    said = refused("tune", "grid", trial, "--model", "--mass", "70")
    assert "Option --model has no value: after it stands --mass" in said
    assert "has no value" not in refused("run", tmp_path / "nowhere.trc", *_options(tmp_path), "--forward", "-X")


def test_a_misspelt_key_in_a_configuration(trial: Path, refused: Refused, tmp_path: Path) -> None:
    config = tmp_path / "run.toml"
    config.write_text('trial = "squat.trc"\nmodel = "sagittal7"\noutput = "out"\nhieght_m = 1.7\n')
    said = refused("run", config)
    assert "run.toml" in said and "'hieght_m'" in said and "did you mean 'height_m'" in said


def test_an_output_that_cannot_be_written(trial: Path, refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "file" in refused("run", trial, *_options(tmp_path, o=str(tmp_path / "file" / "out")))
    assert "thesis" in refused("run", trial, *_options(tmp_path, o=str(_somebodys_folder(tmp_path))))


def _somebodys_folder(tmp_path: Path) -> Path:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("")
    return tmp_path / "mine"


def test_the_output_is_checked_before_anything_is_read(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    assert "is a file" in refused("run", tmp_path / "nowhere.trc", *_options(tmp_path))


def test_an_unknown_option_and_command(refused: Refused, trial: Path, tmp_path: Path) -> None:
    assert "--mas" in refused("run", trial, "--mas", "70")
    assert "rum" in refused("rum", trial)
    assert "forward" in refused("run", trial, *_options(tmp_path, forward="1,2,x"))


def test_what_is_missing_is_named(refused: Refused, trial: Path, tmp_path: Path) -> None:
    assert "-o OUT" in refused("run", trial)
    assert "TRIAL..." in refused("compare", "--model", "squat7")


def test_walking_is_refused_by_a_model_with_a_fixed_toe(refused: Refused, data_dir: Path, tmp_path: Path) -> None:
    gait = data_dir / "plugin_gait" / "GaitNormal_1.c3d"
    assert len(read(gait).plates) == 3
    assert "toe" in refused("run", gait, "--model", "squat7", "-o", tmp_path / "out")


def test_debugging_lets_the_error_through(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from dynakin.errors import RecordingError

    monkeypatch.setenv("DYNAKIN_DEBUG", "1")
    with pytest.raises(RecordingError):
        main(["check", str(tmp_path / "nowhere.trc")])
