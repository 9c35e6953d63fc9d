"""Every example runs as it stands, and so do the ten lines of the README."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.read import read
from dynakin.results.files.markers import write_trc

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 3


def numbers(pattern: str, text: str) -> np.ndarray:
    """What the groups of a pattern hold, a row a match."""
    return np.array(re.findall(pattern, text), dtype=float)


def run_a_trial(said: str, folder: Path) -> None:
    """The knee of simulated squats by 70 kg, in words and in the folder that it names."""
    ((low, high, sd),) = numbers(r"knee moment, both legs: (\S+) to (\S+) N m, standard deviation (\S+) N m", said)
    assert -250.0 < low < -100.0 and 0.0 < high < 50.0 and 0.5 < sd < 10.0
    ((fit,),) = numbers(r"markers: (\S+) mm RMS", said).reshape(-1, 1, 1)
    assert 0.1 < fit < 1.5 and "\nThe standard deviations fit this recording.\n" in said
    results = folder / "out" / "example_01"
    assert said.endswith("written to out/example_01\n") and (results / "report.html").exists()
    knee = read_table(results / "moments.sto").column("knee_moment")
    np.testing.assert_allclose([knee.min(), knee.max()], [low, high], atol=0.6)


def step_by_step(said: str, folder: Path) -> None:
    """A line a second, 50 ms late; a squat bends the knee by 90 degrees, with a moment against it."""
    pattern = r"(\S+) s  knee +(\S+) deg  now; at (\S+) s moment +(\S+) \+- (\S+) N m, speed +(\S+) rad/s"
    lines = numbers(pattern, said)
    np.testing.assert_array_equal(lines[:, 0], np.arange(2.0, 9.0))
    np.testing.assert_allclose(lines[:, 0] - lines[:, 2], 0.05)
    knee, moment, sd = lines[:, [1, 3, 4]].T
    assert 80.0 < knee.max() < 110.0 and knee.min() < 10.0 and ((sd > 0.5) & (sd < 10.0)).all()
    assert (moment[knee > 40.0] < -20.0).all() and moment.min() > -200.0


def own_model(said: str, folder: Path) -> None:
    """Lengths and masses of the model's four segments: near their start, and as heavy as the person."""
    lines = re.findall(r"^(\S+)\s+(\S+) -> +(\S+) \+- (\S+) \S+", said, re.M)
    found = {name: (float(initial), float(value), float(sd)) for name, initial, value, sd in lines}
    for segment in ("foot", "shank", "thigh"):
        initial, value, sd = found[f"length/{segment}"]
        assert abs(value - initial) < 0.02 and 0.001 < sd < 0.02
    masses = [value for name, (_, value, _) in found.items() if name.endswith("/mass")]
    assert len(masses) == 4 and sum(masses) == pytest.approx(70.0, abs=0.5)
    assert "gated: R_wrist_radius contradicts all else" in said  # the model has no arms


def live_own_source(said: str, folder: Path) -> None:
    """The session finds the streams, asks to stand, and gives the knee twice a second."""
    for words in ("Streams: 47 markers at 100 Hz, 2 plates at 100 Hz.", "Stand still and upright", "Ready: move."):
        assert words in said
    lines = numbers(r"(\S+) s  knee +(\S+) deg  moment +(\S+) N m", said)
    np.testing.assert_allclose(np.diff(lines[:, 0]), 0.5)
    _, knee, moment = lines.T
    assert len(lines) >= 4 and 50.0 < knee.max() < 110.0 and (moment[knee > 50.0] < -20.0).all()


SHOWS = {
    "01_run_a_trial": run_a_trial,
    "02_step_by_step": step_by_step,
    "03_own_model": own_model,
    "04_live_own_source": live_own_source,
}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_shows_what_it_promises(path: Path, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, str(path)], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    SHOWS[path.stem](done.stdout, tmp_path)


def test_the_ten_lines_of_the_readme_run(data_dir: Path, tmp_path: Path) -> None:
    block = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    assert block is not None
    folder = data_dir / "opencap_subject4"
    squat = read(folder / "squats1.trc").window(0.0, 5.0)  # all of it is run in filter/test_real_trials.py
    write_trc(tmp_path / "squats1.trc", squat.time, list(squat.marker_names), squat.markers, unit="mm")
    (tmp_path / "squats1_grf.mot").symlink_to(folder / "squats1_grf.mot")
    done = subprocess.run([sys.executable, "-c", block[1]], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    out = tmp_path / "out" / "squats1"
    assert (out / "report.html").exists()
    assert done.stdout.count(f"Name: knee_angle_r, Length: {squat.n_frames}") == 2  # the moment, and its deviation
    verdict = json.loads((out / "metrics.json").read_text())["consistency"]["verdict"]
    assert verdict and done.stdout.splitlines()[-1] == verdict
