"""`dynakin check` says what `dynakin run` does, and ends as it would."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dynakin.cli.app import main
from dynakin.simulation.trial import simulate

Said = pytest.CaptureFixture[str]


def told(capsys: Said) -> tuple[str, str]:
    """What stands on stdout and stderr, without line breaks."""
    said = capsys.readouterr()
    return " ".join(said.out.split()), " ".join(said.err.split())


def ran(arguments: list[str], out: Path) -> int:
    return main(["run", *arguments, "-o", str(out)])


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated walk and squat as files, forces beside them, as `dynakin simulate` writes them."""
    folder = tmp_path_factory.mktemp("walk")
    assert main(["simulate", "squat", "--model", "fullbody", "--duration", "4", "-o", str(folder)]) == 0
    return folder


def test_what_is_there_and_what_run_would_do(data_dir: Path, capsys: Said) -> None:
    trial = str(data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d")
    assert main(["check", trial, "--model", "squat7", "--mass", "78.6"]) == 0
    found, _ = told(capsys)
    for words in ("317 frames at 100 Hz", "2 force plates", "Vertical +Z", "RSHO 78.5 %", "23 of 30", "abdomen"):
        assert words in found
    assert "--static S1_StandingRef.c3d (found beside the recording)" in found
    assert "Moments: absent in all 317 frames." in found  # the cable


@pytest.mark.parametrize(
    ("options", "refusal"),
    [
        (["--model", "squat7", "--mass", "66"], "RTOE moves"),
        (["--model", "sagittal7", "--mass", "66"], "RTOE moves"),
        (["--model", "fullbody", "--markers", "opencap"], "marker"),
    ],
)
def test_check_refuses_as_run_does(
    data_dir: Path, tmp_path: Path, options: list[str], refusal: str, capsys: Said
) -> None:
    trial = str(data_dir / "plugin_gait" / "GaitNormal_1.c3d")
    assert main(["check", trial, *options]) == 1
    _, checked = told(capsys)
    assert ran([trial, *options], tmp_path / "out") == 2
    assert told(capsys)[1] == checked
    assert refusal in checked


def test_check_promises_what_run_keeps(data_dir: Path, tmp_path: Path, capsys: Said) -> None:
    """Without an option: the same moments for the same reasons, what is assumed said first."""
    trial = str(data_dir / "pycgm" / "Movement_trial.c3d")
    assert main(["check", trial]) == 0
    found, _ = told(capsys)
    assert ran([trial], tmp_path / "out") == 0
    said, _ = told(capsys)
    moments = json.loads((tmp_path / "out" / "metrics.json").read_text())["moments"]
    assert moments["verdict"] in found and all(reason in found for reason in moments["reasons"])
    first = said[: said.index(moments["verdict"])]
    for words in ("fullbody (the default", "plug-in-gait", "Mass 85.00 kg: from the file", "plate 2 and plate 4 under"):
        assert words in first and words in found
    assert "right: plate 4 0.34 to 1.07 s; plate 2 1.37 to 2.13 s; off the plates 2.48 to 2.68 s." in found
    assert "--static Static_trial.c3d (found beside the recording)" in found
