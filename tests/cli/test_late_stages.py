"""Late stages of `run` that fail, and recordings of one frame or with times in another unit."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.cli import summary
from dynakin.cli.app import main
from dynakin.pipeline import stages
from dynakin.recordings.recording import Recording
from dynakin.report.paper_figures import figures
from dynakin.results.files.folder import OUTPUT_FILES
from dynakin.results.files.markers import write_trc
from dynakin.results.files.storage import write_storage
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate_squat

SUBJECT = ["--model", "sagittal7", "--markers", "opencap", "--mass", "70", "--height", "1.75"]
Said = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def squat() -> SimulatedTrial:
    return simulate_squat(seed=3, duration_s=5.0)


def broken(*_: object, **__: object) -> None:
    raise ValueError("zero-size array")


def test_what_fails_after_the_estimate_is_named_and_the_rest_saved(
    squat: SimulatedTrial, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    squat.save(tmp_path / "trial")
    monkeypatch.setattr(stages, "trial_of", broken)
    monkeypatch.setattr("dynakin.identification.observability.trial.identifiability", broken)
    monkeypatch.setattr(summary, "print_summary", broken)
    monkeypatch.setitem(figures.FIGURES, "figure5_angles", broken)
    trial = [str(tmp_path / "trial" / "markers.trc"), "--forces", str(tmp_path / "trial" / "forces.mot")]
    out, drawn = tmp_path / "out", tmp_path / "figures"
    assert main(["run", *trial, *SUBJECT, "-o", str(out), "--figures", str(drawn)]) == 1
    said = capsys.readouterr().err.splitlines()
    failed = [
        "comparison with the reference methods",
        "observability of the constants",
        "summary",
        "figure figure5_angles",
    ]
    assert said == [f"error: Failed: {stage}: ValueError: zero-size array." for stage in failed]
    assert {file.name for file in out.iterdir()} >= {*OUTPUT_FILES, "failures.log"}
    assert json.loads((out / "metrics.json").read_text())["failures"] == failed
    page = (out / "report.html").read_text()
    assert all(stage in page for stage in failed) and "Nothing in this run speaks against using it" not in page
    assert (drawn / "figure4_markers.svg").exists() and not (drawn / "figure5_angles.svg").exists()


def test_figures_that_cannot_be_written_are_refused_before_or_named_after(
    squat: SimulatedTrial, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Said
) -> None:
    """Before, the results were written and the exit code was 2, as if nothing were; other failures went unsaid."""
    squat.save(tmp_path / "trial")
    trial = [str(tmp_path / "trial" / "markers.trc"), "--forces", str(tmp_path / "trial" / "forces.mot")]
    out = tmp_path / "out"
    assert main(["run", *trial, *SUBJECT, "-o", str(out), "--figures", "/proc/figures"]) == 2
    assert "/proc/figures: cannot write results there" in capsys.readouterr().err and not out.exists()

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("dynakin.identification.observability.trial.identifiability", broken)
    monkeypatch.setitem(figures.FIGURES, "figure4_markers", full)
    assert main(["run", *trial, *SUBJECT, "-o", str(out), "--figures", str(tmp_path / "figures")]) == 1
    said = capsys.readouterr().err.splitlines()
    assert said[0].endswith("Failed: observability of the constants: ValueError: zero-size array.")
    assert said[1].endswith("figures: cannot write figures there (No space left on device).") and len(said) == 2
    assert json.loads((out / "metrics.json").read_text())["failures"][-1] == "figures"


def written(recording: Recording, folder: Path) -> list[str]:
    write_trc(folder / "m.trc", recording.time, list(recording.marker_names), recording.markers, unit="mm")
    names, columns = [], []
    for number, plate in enumerate(recording.plates, 1):
        for stem, values in (("v", plate.force), ("p", np.nan_to_num(plate.cop)), ("m", plate.free_moment)):
            names += [f"ground_force_{number}_{stem}{axis}" for axis in "xyz"]
            columns.append(values)
    write_storage(folder / "f.mot", "forces", recording.time, names, np.hstack(columns), in_degrees=False)
    return [str(folder / "m.trc"), "--forces", str(folder / "f.mot")]


def test_one_frame_is_refused_of_a_whole_body(squat: SimulatedTrial, tmp_path: Path, capsys: Said) -> None:
    """`check` would have run it, and `run` said "cannot convert float NaN to integer"."""
    trial = [*written(squat.recording.window(0.0, 0.0), tmp_path), "--mass", "70"]
    assert main(["check", *trial]) == 1
    said = capsys.readouterr().err
    assert said == f"error: {tmp_path / 'm.trc'}: found 1 frame, expected at least 2: one shows no movement\n"
    assert main(["run", *trial, "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == said


def test_one_frame_gives_results_and_a_page(squat: SimulatedTrial, tmp_path: Path) -> None:
    """0.1 lost it all: ValueError in the page's player."""
    squat.save(tmp_path / "trial")
    for name in ("markers.trc", "forces.mot"):
        lines = (tmp_path / "trial" / name).read_text().splitlines()
        head = next(k for k, line in enumerate(lines) if line.startswith(("Frame#", "endheader")))
        first = head + (2 if name == "forces.mot" else 3)
        kept = [line.replace("nRows=501", "nRows=2") for line in lines[: first + (2 if name == "forces.mot" else 1)]]
        if name == "markers.trc":
            kept[2] = kept[2].replace("\t501\t", "\t1\t").replace("\t501", "\t1")
        (tmp_path / "trial" / name).write_text("\n".join(kept) + "\n")
    trial = [str(tmp_path / "trial" / "markers.trc"), "--forces", str(tmp_path / "trial" / "forces.mot")]
    assert main(["run", *trial, *SUBJECT, "-o", str(tmp_path / "out")]) == 0
    assert {file.name for file in (tmp_path / "out").iterdir()} >= set(OUTPUT_FILES)
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["failures"] == []


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_times_in_another_unit_are_refused(squat: SimulatedTrial, factor: float, tmp_path: Path, capsys: Said) -> None:
    """0.1 took minutes (ms), or asked for 6.8 TiB and lost the results (us)."""
    trial = written(replace(squat.recording, time=factor * squat.recording.time), tmp_path)
    out = tmp_path / "out"
    code = main(["run", *trial, *SUBJECT, "-o", str(out)])
    said = capsys.readouterr().err
    unit = {1e3: "milliseconds", 1e6: "microseconds"}[factor]
    assert code == 2 and f"they seem to be in {unit}, expected seconds" in said and not out.exists()
