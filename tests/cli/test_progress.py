"""What is seen of long work: stages with their remaining time, in a terminal and a notebook, in a file now and then."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import dynakin
from dynakin import progress
from dynakin.progress import line, silent, stage
from dynakin.simulation.trial import simulate_squat
from dynakin.studies.engine.tasks import Task, attempt


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Seen:
    """A screen that keeps what it is given."""

    def __init__(self) -> None:
        self.stages: list[str] = []
        self.reports: dict[str, list[tuple[int, int]]] = {}
        self.open_now = 0

    def open(self, what: str) -> int:
        self.stages.append(what)
        self.open_now += 1
        return len(self.stages) - 1

    def report(self, stage: int, done: int, total: int) -> None:
        self.reports.setdefault(self.stages[stage], []).append((done, total))

    def close(self, stage: int) -> None:
        self.open_now -= 1


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Seen:
    screen = Seen()
    monkeypatch.setattr(progress, "_new_screen", lambda: screen)
    return screen


def test_a_terminal_shows_each_stage_with_its_share_and_what_remains(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")  # the tests' own may be one that cannot draw
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    with stage("estimating") as report:
        for done in range(5):
            report(done, 10)
        with stage("the plates again"):
            pass
    text = shown.getvalue()
    assert "estimating" in text and "40%" in text and "remaining" in text and "the plates again" in text


def test_a_file_has_a_plain_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([0.0, 0.0, 10.0, 40.0, 50.0, 71.0])
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    with stage("estimating") as report:
        for done in (10, 40, 50, 71):
            report(done, 100)
    assert capsys.readouterr().err.splitlines() == [
        "estimating: 40 %, 0:40 passed, 1:00 remaining", "estimating: 71 %, 1:11 passed, 0:29 remaining",
    ]  # fmt: skip


def test_nothing_is_shown_of_short_work_in_a_file_or_by_a_worker(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with stage("estimating") as report:
        report(1, 2)
    assert capsys.readouterr().err == ""
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    with silent(), stage("estimating") as report:
        report(1, 2)

    def works(shared: object, payload: object) -> dict[str, int]:
        with stage("of a worker"):
            return {"row": 1}

    assert attempt(works, None, Task("a", None)).row == {"row": 1}
    assert shown.getvalue() == ""


def test_a_notebook_has_a_line_below_the_cell_that_is_empty_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    texts: list[str] = []
    handle = SimpleNamespace(update=texts.append)
    display = SimpleNamespace(display=lambda text, display_id: handle, Pretty=str)
    shell = type("ZMQInteractiveShell", (), {})()
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell, display=display))
    monkeypatch.setattr(progress, "_EVERY_S", 0.0)
    with stage("estimating") as report:
        report(1, 4)
        with stage("the plates again"):
            pass
    assert texts[0] == "estimating …" and texts[1].startswith("estimating: 25 %, 0:00 passed")
    assert texts[2:] == ["the plates again …", "estimating …", ""]


def test_what_remains_follows_from_the_speed_until_now() -> None:
    assert line("estimating", 40, 100, 12.0) == "estimating: 40 %, 0:12 passed, 0:18 remaining"
    assert line("estimating", 0, 100, 75.0) == "estimating: 0 %, 1:15 passed"


def test_every_long_part_of_a_run_reports(seen: Seen, tmp_path: Path) -> None:
    recording = simulate_squat(seed=1, duration_s=6.0).recording
    result = dynakin.run(
        recording, model="sagittal7", markers="opencap", mass_kg=70.0, height_m=1.75, sex="male", observability=False
    )
    result.save(tmp_path / "out", check=False)
    result.save_figures(tmp_path / "figures", ("svg",))
    assert seen.stages == [
        "measuring the person",
        "estimating",
        "comparing with the reference methods",
        "writing results and report",
        "drawing figures",
        "saving figures",
    ]
    assert seen.open_now == 0
    for what in ("estimating", "writing results and report", "saving figures"):
        done = [done / total for done, total in seen.reports[what]]
        assert done == sorted(done) and 0.8 < done[-1] <= 1.0, what


def test_who_has_a_callback_is_called_and_nothing_is_shown(seen: Seen) -> None:
    called: list[tuple[int, int]] = []
    with stage("estimating", lambda done, total: called.append((done, total))) as report:
        report(1, 2)
    assert called == [(1, 2)] and seen.stages == []
