"""A late stage that fails: everything else is saved, and the failure is named."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from rich.console import Console

from dynakin.cli import summary
from dynakin.errors import OutputError
from dynakin.pipeline import result
from dynakin.pipeline.result import Result
from dynakin.report import page
from dynakin.results.estimate import Estimate
from dynakin.results.failures import Failures
from dynakin.results.files.folder import OUTPUT_FILES, check_folder_writable, check_output_writable
from dynakin.results.measures import metrics
from support.estimates.synthetic import make_estimate
from support.estimates.walking import make_walker


def broken(*_: object, **__: object) -> None:
    raise MemoryError("Unable to allocate 6.8 TiB")


@pytest.fixture(scope="module")
def short() -> Estimate:
    return make_estimate(1.0)


def test_a_page_that_fails_loses_no_file(short: Estimate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "write_report", broken)
    made = Result(short)
    out, failures = made.save(tmp_path / "out", check=False), made.failures
    assert {file.name for file in out.iterdir()} >= {*OUTPUT_FILES, "failures.log"} - {"report.html"}
    assert not (out / "report.html").exists()
    expected = "Failed: report.html: MemoryError: Unable to allocate 6.8 TiB."
    assert list(map(str, failures.messages())) == [expected]
    written = json.loads((out / "metrics.json").read_text())
    assert written["messages"][-1] == expected and written["failures"] == ["report.html"]
    assert "Traceback" in (out / "failures.log").read_text()
    check_output_writable(out)  # with its log it is still ours
    with pytest.raises(OutputError, match=r"the results are saved .*Failed: report\.html"):  # nobody takes the failures
        Result(short).save(out)
    monkeypatch.undo()
    Result(short).save(out)
    assert (out / "report.html").exists() and not (out / "failures.log").exists()


def test_a_figure_or_a_file_that_fails_is_left_out_and_named_on_the_page(
    short: Estimate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(metrics, "asymmetry", broken)
    monkeypatch.setattr(result, "write_markers", broken)
    fresh = Result(make_estimate(1.0))
    out = fresh.save(tmp_path / "out", check=False)
    assert [failure.stage for failure in fresh.failures.found] == ["asymmetry in metrics.json", "markers.trc"]
    written = json.loads((out / "metrics.json").read_text())
    assert written["asymmetry"] is None and written["markers"]["mean_rms_mm"] > 0.0
    assert not (out / "markers.trc").exists()
    assert "Not made" in (out / "report.html").read_text()


def test_a_full_disk_is_no_stage_of_the_results_but_one_of_what_comes_after_them() -> None:
    with pytest.raises(OSError, match="No space"), Failures().stage("report.html", writes=True):
        raise OSError(28, "No space left on device")


FUNCTIONS = {
    "markers": "_markers",
    "wrench": "_wrench",
    "prediction": "_prediction",
    "consistency": "_consistency",
    "adaptation": "adaptation",
    "bounds": "parameter_bounds",
    "soft_tissue": "soft_tissue",
    "identifiability": "posterior_figures",
    "moments": "moment_figures",
    "peak_moments_per_kg": "_peak_moments",
    "work": "work",
    "asymmetry": "asymmetry",
    "feet": "foot_figures",
    "tracking": "tracking_figures",
    "events": "_events",
}
"""What makes each block of ``metrics.json``."""


@pytest.mark.parametrize("block", FUNCTIONS)
@pytest.mark.parametrize(
    "make",
    [
        pytest.param(make_walker, id="space"),
        pytest.param(partial(make_estimate, 1.0), id="plane", marks=pytest.mark.nightly),
    ],
)
def test_page_and_console_bear_any_block_that_failed(
    block: str, make: Callable[..., Estimate], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    estimate, text = make(), io.StringIO()
    monkeypatch.setattr(metrics, FUNCTIONS[block], broken)
    monkeypatch.setattr(summary, "out", lambda: Console(file=text, width=200))
    made = Result(estimate)
    folder = made.save(tmp_path / "out", check=False)
    known = {"markers": {"markers in metrics.json", "prediction in metrics.json"}}
    known["wrench"] = {"wrench in metrics.json", "prediction in metrics.json"}
    assert {failure.stage for failure in made.failures.found} == known.get(block, {f"{block} in metrics.json"})
    assert "Not made" in (folder / "report.html").read_text()
    summary.print_summary(made, folder)
    assert "Report" in text.getvalue()

    failures = Failures()
    with failures.stage("figures"):
        raise OSError(28, "No space left on device")
    assert list(map(str, failures.messages())) == ["Failed: figures: OSError: [Errno 28] No space left on device."]


def test_a_folder_for_figures_may_hold_anything_but_has_to_take_files(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("")
    assert check_folder_writable(tmp_path) == tmp_path and check_folder_writable(tmp_path / "a" / "b")
    assert [entry.name for entry in tmp_path.iterdir()] == ["thesis.tex"]
    for folder in (tmp_path / "thesis.tex", tmp_path / "thesis.tex" / "a", Path("/proc/figures"), "a\0b"):
        with pytest.raises(OutputError, match="cannot write"):
            check_folder_writable(folder)
