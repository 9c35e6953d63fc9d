"""The guard of figures finds what changed, and nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "figures.py"
MOMENTS = "moments\nversion=1\nnRows=3\nendheader\ntime\tknee_moment\n0\t{a!r}\n0.01\t-41.5\n0.02\tnan\n"
METRICS = {"markers": {"mean_rms_mm": 0.57}, "timing": {"median_us": 80.0}, "verdict": "The trial was followed well."}


def tree(folder: Path, moment: float = 12.25, **metrics: object) -> Path:
    """Results of one case."""
    case = folder / "squat"
    case.mkdir(parents=True)
    (case / "moments.sto").write_text(MOMENTS.format(a=moment))
    (case / "metrics.json").write_text(json.dumps(METRICS | metrics))
    (case / "markers.csv").write_text("time,RKNE_x,method\n0,0.100000,EKF\n0.01,,EKF\n")
    return folder


def compared(*arguments: object) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--compare", *map(str, arguments)], capture_output=True, text=True, timeout=120
    )
    assert not done.stderr
    return done.returncode, done.stdout


def test_timing_words_and_rounding_are_no_difference(tmp_path: Path) -> None:
    before = tree(tmp_path / "a")
    after = tree(tmp_path / "b", 12.25 + 1e-9, timing={"median_us": 99.0}, verdict="It was followed, all in all.")
    code, said = compared(before, after)
    assert code == 0 and "0 columns differ, 0 missing, 0 added" in said


def test_a_changed_number_is_named_with_its_size(tmp_path: Path) -> None:
    code, said = compared(tree(tmp_path / "a"), tree(tmp_path / "b", 12.25 + 41.5e-6))
    assert code == 1 and "| squat/moments.sto | knee_moment | 1.0e-06 | 1 |" in said


@pytest.mark.parametrize(("old", "new"), [("nan", "0.0"), ("0.100000", "0.200000"), ("EKF", "AT"), (",,", ",0.1,")])
def test_cells_without_a_number_count_too(old: str, new: str, tmp_path: Path) -> None:
    before, after = tree(tmp_path / "a"), tree(tmp_path / "b")
    for path in after.rglob("m*.*"):
        path.write_text(path.read_text().replace(old, new))
    code, said = compared(before, after)
    assert code == 1 and "1 columns differ" in said


def test_the_last_digit_of_a_text_is_counted_but_no_difference(tmp_path: Path) -> None:
    before, after = tree(tmp_path / "a"), tree(tmp_path / "b")
    path = after / "squat" / "markers.csv"
    path.write_text(path.read_text().replace("0.100000", "0.100001"))
    code, said = compared(before, after)
    assert code == 0 and "1 values differ by the last digit" in said


def test_missing_and_added_are_listed_and_a_renamed_key_is_neither(tmp_path: Path) -> None:
    before, after = tree(tmp_path / "a"), tree(tmp_path / "b", markers={"rms_mean_mm": 0.57})
    code, said = compared(before, after)
    assert code == 1 and "- squat/metrics.json: markers.mean_rms_mm" in said and "1 missing, 1 added" in said
    assert compared(before, after, "--renamed", "mean_rms_mm=rms_mean_mm")[0] == 0
    (before / "squat" / "moments.sto").unlink()
    renamed = [before, after, "--renamed", "mean_rms_mm=rms_mean_mm"]
    assert compared(*renamed)[0] == 1
    code, said = compared(*renamed, "--allow-added")
    assert code == 0 and "- squat/moments.sto" in said


def test_empty_trees_guard_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    assert compared(tmp_path / "a", tmp_path / "a")[0] == 1
