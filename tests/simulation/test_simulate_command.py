"""`dynakin simulate`: files, and one line for what is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dynakin.cli.app import main
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.output import TRIAL_FILES
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate


def test_it_writes_what_the_api_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = "--model squat7 --motion sway --seed 3 --duration 4 --sensors laboratory --sensor plate_lag_s=0.01"
    assert main(["simulate", *options.split(), "--spread", "0.5", "--sex", "mean", "-o", str(tmp_path / "cli")]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Simulated squat7, seed 3: standing and swaying." in printed and "Message(" not in printed
    assert "--model squat7 --mass 70 --height 1.75 -o OUT" in printed
    noise = SensorNoise.laboratory().changed({"plate_lag_s": 0.01})
    trial = simulate("squat7", "sway", 3, 4.0, sex=None, noise=noise, spread=Spread().times(0.5))
    trial.save(tmp_path / "api")
    for name in TRIAL_FILES:
        assert (tmp_path / "cli" / name).read_bytes() == (tmp_path / "api" / name).read_bytes(), name


def test_a_path_with_a_space_is_quoted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "--duration", "5", "-o", str(tmp_path / "a b")]) == 0
    said = capsys.readouterr().out
    assert f"dynakin run '{tmp_path}/a b/markers.trc' --forces '{tmp_path}/a b/forces.mot' --model" in said


def test_a_motion_from_its_own_truth(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    assert main(["simulate", "--duration", "5", "-o", str(one)]) == 0
    assert main(["simulate", "--motion", str(one / "truth_coordinates.mot"), "--seed", "8", "-o", str(two)]) == 0
    content = json.loads((two / "truth.json").read_text())
    assert content["simulation"]["duration_s"] == 5.0
    assert "low-passed at 6 Hz" in content["notes"][0]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["--motion", "jump"],
            "motion is 'jump', expected squat, sit-to-stand, sway or a .mot or .sto file that exists",
        ),
        (["--model", "chain"], "model is 'chain', expected sagittal7 or squat7 or fullbody"),
        (["--sensor", "plate_lag_s"], "--sensor: found 'plate_lag_s', expected KEY=NUMBER"),
        (["--sensor", "plate_lag_s=soon"], "--sensor: found 'plate_lag_s=soon'"),
        (["--spread", "-1"], "the factor is -1, expected 0 or more"),
        (["--mass", "0"], "simulated subject: mass_kg: Input should be greater than 0, found 0.0"),
        (["--mass", "700"], "found 700.0; expected kilograms (--mass)"),
        (["--height", "175"], "found 175.0; expected metres (--height), 1.75?"),
        (["--sex", "robot"], "found 'robot'"),
        (["--duration", "0"], "duration_s is 0, expected a positive number"),
        (["--seed", "-3"], "seed is -3"),
    ],
)
def test_what_is_wrong_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    assert main(["simulate", *options, "-o", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("error: ")
    assert said in captured.err
    assert not (tmp_path / "out").exists()


def test_a_folder_of_somebody_elses_is_refused_before_anything_is_computed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert main(["simulate", "-o", str(tmp_path)]) == 2
    assert "holds notes.txt" in capsys.readouterr().err
