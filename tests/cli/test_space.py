"""Models in space as a user calls them: `run` and `compare` on short simulated trials, and an OpenSim file."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from dynakin import Estimator, Subject, load_model
from dynakin.cli.app import main
from dynakin.results.files.folder import OUTPUT_FILES
from dynakin.simulation.trial import simulate

SUBJECT = ["--model", "fullbody", "--mass", "70", "--height", "1.75", "--sex", "male"]
# a squat on two plates; a walk over three of them, which stand in the middle third of its way
TRIALS = {"squat": (5.0, 12.5), "gait": (5.0, 25.0)}
MOST = {"squat": (14.0, 6.5, 1.5), "gait": (7.0, 68.0, 39.0)}
"""Half as much again as it is (9.4 mm, 4.4 N, 1.0 N; 4.5 mm, 45 N, 26 N): markers left out, mm; the vertical force
withheld, and given, N of 687."""


def saved(folder: Path, motion: str) -> list[str]:
    """Arguments that name a trial."""
    duration_s, rate_hz = TRIALS[motion]
    simulate("fullbody", motion, 3, duration_s, rate_hz).save(folder)
    return [str(folder / "markers.trc"), "--forces", str(folder / "forces.mot")]


@pytest.mark.parametrize(
    "motion", [pytest.param(name, marks=pytest.mark.nightly if name == "gait" else ()) for name in TRIALS]
)
def test_compare_judges_a_body_in_space_by_what_it_has_not_seen(motion: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["compare", *saved(tmp_path / "trial", motion), *SUBJECT, "--unseen", "-o", str(out)]) == 0
    with (out / "unseen.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    fit = {(row["yardstick"], row["quantity"]): float(row["rms"]) for row in rows if row["method"] == "EKF (default)"}
    left_out, withheld, given = MOST[motion]
    assert fit["marker left out", "markers"] < left_out
    # the whole weight was the error where a foot off the plates was taken for a body in the air
    assert fit["plates withheld", "fy"] < withheld
    with (out / "table2.csv").open(encoding="utf-8", newline="") as file:
        judged = {row["method"]: row for row in csv.DictReader(file) if row["quantity"] == "fy"}
    assert set(judged) == {"EKF (default)", "IK + ID (6 Hz)"}  # 12 Hz is hardly below half of these rates, or above
    weight = judged["EKF (default)"]
    assert float(weight["rms"]) < given


def test_plates_of_a_walk_are_used_with_cameras_of_15_hz() -> None:
    """They were said to carry 10 % more than the motion needs."""
    walk = simulate("fullbody", "gait", 3, 5.0, 15.0).recording
    ready = Estimator(load_model("fullbody", Subject(mass_kg=70.0, height_m=1.75, sex="male"))).prepare(walk)
    assert np.isfinite(ready.measured.wrench).all(axis=1).sum() > 10


def test_run_on_a_body_in_space(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["run", *saved(tmp_path / "trial", "squat"), *SUBJECT, "-o", str(out)]) == 0
    assert {file.name for file in out.iterdir()} >= set(OUTPUT_FILES)
    assert json.loads((out / "metrics.json").read_text())["markers"]


def test_run_on_an_opensim_model(data_dir: Path, tmp_path: Path) -> None:
    folder, out = data_dir / "opencap_subject4", tmp_path / "out"
    for name, head in (("squats1.trc", 6), ("squats1_grf.mot", 7)):
        lines = (folder / name).read_text().splitlines()[: head + 80]
        (tmp_path / name).write_text("\n".join(lines).replace("1346", "80") + "\n")
    model = ["--model", str(folder / "optimized_scale_and_markers.osim"), "--mass", "60.05"]
    trial = [str(tmp_path / "squats1.trc"), "--forces", str(tmp_path / "squats1_grf.mot")]
    assert main(["run", *trial, *model, "-o", str(out)]) == 0
    assert {file.name for file in out.iterdir()} >= set(OUTPUT_FILES)
    fit = json.loads((out / "metrics.json").read_text())
    assert fit["window"]["end_s"] == 0.79 and fit["markers"]["mean_rms_mm"] < 20.0
