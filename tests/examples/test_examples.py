"""Every example runs as it stands, and so do the ten lines of the README."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from dynakin.recordings.read import read
from dynakin.results.files.markers import write_trc

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 3


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path: Path, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, str(path)], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


def test_the_ten_lines_of_the_readme_run(data_dir: Path, tmp_path: Path) -> None:
    block = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    assert block is not None
    folder = data_dir / "opencap_subject4"
    squat = read(folder / "squats1.trc").window(0.0, 5.0)  # all of it is run in filter/test_real_trials.py
    write_trc(tmp_path / "squats1.trc", squat.time, list(squat.marker_names), squat.markers, unit="mm")
    (tmp_path / "squats1_grf.mot").symlink_to(folder / "squats1_grf.mot")
    done = subprocess.run([sys.executable, "-c", block[1]], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "squats1" / "report.html").exists()
