"""Each command once, as a user calls it."""

from __future__ import annotations

import json
import math
import runpy
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import dynakin
from dynakin.cli.app import main
from dynakin.model.definition import available_models
from dynakin.model.markers.marker_set import available_marker_sets
from dynakin.results.files.folder import OUTPUT_FILES

Said = pytest.CaptureFixture[str]

OF_THE_BODY = ("centre_of_mass.sto", "joint_reactions.sto", "joint_reactions_source.sto")


def test_version(capsys: Said) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"dynakin {dynakin.__version__}\n"


def test_without_arguments_the_commands_are_listed(capsys: Said) -> None:
    main([])
    said = capsys.readouterr()
    for command in ("run", "demo", "check", "model", "print-config"):
        assert command in said.out + said.err


def test_who_stops_a_command_is_told_so(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("dynakin.pipeline.stages.configure", stopped)
    assert main(["check", "trial.c3d"]) == 130
    assert "stopped" in capsys.readouterr().err


def test_installed_command_gives_its_exit_code(tmp_path: Path) -> None:
    code = "import sys; from dynakin.cli import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", code, "check", str(tmp_path / "no.c3d")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.startswith("error: ") and "no.c3d" in done.stderr


def test_the_package_is_the_command(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.setattr(sys, "argv", ["dynakin", "--version"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("dynakin", run_name="__main__")
    assert ended.value.code == 0 and dynakin.__version__ in capsys.readouterr().out


def test_model_lists_and_describes(capsys: Said) -> None:
    assert main(["model"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in (*available_models(), *available_marker_sets()))
    assert main(["model", "squat7"]) == 0
    printed = capsys.readouterr().out
    for word in ("thorax", "ankle", "-50 to 50", "RKNE", "4 x 7"):
        assert word in printed


def test_model_says_what_it_lets_one_identify(capsys: Said) -> None:
    assert main(["model", "squat7", "--identifiability", "--mass", "60"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    for words in (
        "22 of 28 inertial numbers",
        "foot mass + mass of all that it carries",
        "arm: a turn about the shoulder",
    ):
        assert words.lower() in printed.lower()


def test_model_says_what_a_trial_tells(data_dir: Path, capsys: Said) -> None:
    folder = data_dir / "opencap_subject4"
    trial = ["--trial", str(folder / "squats1.trc"), "--forces", str(folder / "squats1_grf.mot"), "--mass", "60.05"]
    assert main(["model", "sagittal7", "--identifiability", *trial]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    for words in ("Lengths (6): 5 known from the data", "Movements that would help", "the foot's mass, first"):
        assert words in printed


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["squat7", "--mass", "60"], "--mass is of use only with --identifiability"),
        (["squat7", "--identifiability", "--forces", "x.mot"], "--forces is of use only with --trial"),
        (["squat7", "--identifiability", "--static", "x.trc"], "--static is of use only with --trial"),
        (["squat7", "--static", "x.trc"], "--static is of use only with --identifiability"),
        (["--identifiability"], "expected a model's name"),
        (["squat7", "--identifiability", "--trial", "no.c3d"], "no.c3d"),
    ],
)
def test_options_of_identifiability_that_do_not_fit(arguments: list[str], expected: str, capsys: Said) -> None:
    assert main(["model", *arguments]) == 2
    said = capsys.readouterr().err
    assert expected in said and said.count("\n") == 1


def test_demo_compares_with_the_truth_and_says_where_the_report_lies(tmp_path: Path, capsys: Said) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "-o", str(out), "--duration", "6"]) == 0
    printed = capsys.readouterr().out
    assert "RMS error against the truth" in printed and str(out / "report.html") in printed.replace("\n", "")
    assert {entry.name for entry in out.iterdir()} == {*OUTPUT_FILES, *OF_THE_BODY}
    page = (out / "report.html").read_text()
    assert 'id="methods"' in page and "classical (6 Hz)" in page and "against AT" in page


@pytest.mark.nightly
def test_run_on_real_data_and_again_from_its_own_configuration(data_dir: Path, tmp_path: Path, capsys: Said) -> None:
    folder = data_dir / "opencap_subject4"
    options = ["--model", "sagittal7", "--markers", "opencap", "--mass", "60.05", "--preset", "paper"]
    forces = ["--forces", str(folder / "squats1_grf.mot")]
    out, again = tmp_path / "out", tmp_path / "again"
    assert main(["run", str(folder / "squats1.trc"), *forces, *options, "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "17 markers" in printed and "Verdict:" in printed
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["markers"]["mean_rms_mm"] <= 4.0
    rms = metrics["wrench"]["rms"]
    assert rms["fx"] <= 6.0 and rms["fy"] <= 10.0 and rms["mz"] <= 7.0

    used = tomllib.loads((out / "config.toml").read_text())
    assert used["mass_kg"] == 60.05 and used["noise"]["coordinate_variance"] == 1000.0
    assert used["versions"]["dynakin"] == dynakin.__version__
    assert main(["run", str(out / "config.toml"), "-o", str(again)]) == 0
    repeated = json.loads((again / "metrics.json").read_text())
    assert repeated["window"] == metrics["window"] and repeated["events"] == metrics["events"]
    assert repeated["markers"]["rms_mm"] == pytest.approx(metrics["markers"]["rms_mm"], rel=1e-3)
    for key in ("rms", "nrms_percent", "correlation"):
        assert repeated["wrench"][key] == pytest.approx(metrics["wrench"][key], rel=1e-3)


def test_run_smooths_unless_told_otherwise_and_says_where_it_cannot(
    data_dir: Path, tmp_path: Path, capsys: Said
) -> None:
    trial = str(data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d")
    options = ["--model", "squat7", "--mass", "78.6", "-o"]

    def used(name: str, *more: str) -> tuple[float, str]:
        out = tmp_path / name
        assert main(["run", trial, *options, str(out), *more]) == 0
        printed = " ".join(capsys.readouterr().out.split())
        return tomllib.loads((out / "config.toml").read_text())["lag_s"], printed

    lag_s, printed = used("default")
    assert lag_s == math.inf and "settled after" not in printed and "does not settle" not in printed
    lag_s, printed = used("live", "--live-like")
    assert lag_s == 0.0 and "settled after" in printed and "Not smoothed" not in printed
    lag_s, printed = used("late", "--lag", "0.05")
    assert lag_s == pytest.approx(0.05) and "settled after" in printed
    assert "each frame estimated as it would be live, 50 ms late" in (tmp_path / "late" / "report.html").read_text()
    lag_s, printed = used("paper", "--preset", "paper")
    assert lag_s == 0.0 and "Not smoothed: bounds are kept by constraint 'gain'" in printed
    assert "Not smoothed: bounds" in (tmp_path / "paper" / "report.html").read_text()
    assert main(["run", trial, *options, str(tmp_path / "no"), "--preset", "paper", "--smooth"]) == 2
    assert "lag_s: bounds are kept by constraint 'gain'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--lag", "20"], "the lag is 20.0, expected seconds (no longer frames), 0 to 1, such as 0.05"),
        (["--lag", "-1"], "--lag"),
        (["--lag", "nan"], "--lag"),
        (["--lag", "0.05", "--live-like"], "--lag and --live-like: expected one of them"),
    ],
)
def test_lags_that_cannot_be_are_refused(options: list[str], said: str, data_dir: Path, capsys: Said) -> None:
    trial = str(data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d")
    assert main(["run", trial, "--model", "squat7", *options, "-o", "nowhere"]) == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_run_replaces_its_own_output_and_draws_figures(data_dir: Path, tmp_path: Path, capsys: Said) -> None:
    trial = str(data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d")
    options = ["--model", "squat7", "--mass", "78.6", "-o", str(tmp_path / "out")]
    assert main(["run", trial, *options]) == 0
    gains = tmp_path / "gains.csv"
    gains.write_text(
        "log10_coordinate_variance,log10_speed_variance,log10_acceleration_variance,criterion\n3,2,3,5\n4,2,3,\n"
    )
    figures = ["--figures", str(tmp_path / "figures"), "--sensitivity", str(gains)]
    assert main(["run", trial, *options, *figures]) == 0
    drawn = {entry.suffix for entry in (tmp_path / "figures").iterdir()}
    assert (tmp_path / "figures" / "figure3_sensitivity.svg").exists()
    assert (tmp_path / "figures" / "repetitions_angles.pdf").exists()
    assert drawn == {".svg", ".pdf", ".png"} and str(tmp_path / "figures") in capsys.readouterr().out.replace("\n", "")
    written = {*OUTPUT_FILES, *OF_THE_BODY}
    assert {entry.name for entry in (tmp_path / "out").iterdir()} == written
