"""How far something long is and how much time remains: one line a stage, in a terminal or in a notebook.

    with stage("drawing figures") as report:
        for done, figure in enumerate(figures):
            report(done, len(figures))

Whoever takes long opens a stage; whether and where it is seen is decided here alone. A file or a pipe has a plain line
of stderr every 30 s, so that nobody takes a long run for one that hangs; a worker (`silent`) shows nothing.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol

Progress = Callable[[int, int], None]
"""Called with (done, in all) now and then."""

_EVERY_S = 0.5  # between two lines of a notebook
_PIPED_S = 30.0  # between two lines of a file or a pipe, and before the first


class _Screen(Protocol):
    """Shows stages, those within another below it; ``report`` is called with a stage's count (done, in all)."""

    def open(self, what: str) -> int: ...
    def report(self, stage: int, done: int, total: int) -> None: ...
    def close(self, stage: int) -> None: ...


_SCREEN: ContextVar[_Screen | None] = ContextVar("screen", default=None)
"""Where the outermost stage that is open is shown."""


@contextmanager
def stage(what: str, progress: Progress | None = None) -> Iterator[Progress]:
    """Show that ``what`` is being done; gives the callback (done, in all), without which only the time is shown.

    Args:
        progress: somebody else's callback, which is given instead; nothing is shown.
    """
    screen = _Nobody() if progress is not None else _SCREEN.get() or _new_screen()
    before = _SCREEN.set(screen)
    try:
        number = screen.open(what)
        try:
            yield progress or (lambda done, total: screen.report(number, done, total))
        finally:
            screen.close(number)
    finally:
        _SCREEN.reset(before)


@contextmanager
def silent() -> Iterator[None]:
    """Nothing is shown within: a worker's stages are not those of whoever waits for all workers."""
    before = _SCREEN.set(_Nobody())
    try:
        yield
    finally:
        _SCREEN.reset(before)


def _new_screen() -> _Screen:
    if _in_notebook():
        return _Notebook()
    if sys.stderr is None:
        return _Nobody()
    return _Terminal() if sys.stderr.isatty() else _Piped()


def _in_notebook() -> bool:
    """Whether a kernel runs this, whose output is a page."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"


class _Nobody:
    def open(self, what: str) -> int:
        return 0

    def report(self, stage: int, done: int, total: int) -> None:
        pass

    def close(self, stage: int) -> None:
        pass


class _Terminal:
    """Rich's bars on stderr; they are gone when all is done."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn
        from rich.progress import TimeRemainingColumn as Remaining

        own = sys.stdout is not None and sys.stdout.isatty()  # what a file is to have stays out of the terminal

        self._id = TaskID
        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
        self._bars = Progress(
            *columns, TextColumn("passed,"), Remaining(), TextColumn("remaining"), console=Console(stderr=True),
            transient=True, redirect_stdout=own,
        )  # fmt: skip

    def open(self, what: str) -> int:
        if not self._bars.tasks:
            self._bars.start()
        return self._bars.add_task(what, total=None)

    def report(self, stage: int, done: int, total: int) -> None:
        self._bars.update(self._id(stage), completed=done, total=total)

    def close(self, stage: int) -> None:
        self._bars.remove_task(self._id(stage))
        if not self._bars.tasks:
            self._bars.stop()


class _Piped:
    """A line of stderr now and then."""

    def __init__(self) -> None:
        self._stages: list[tuple[str, float]] = []
        self._last = time.monotonic()

    def open(self, what: str) -> int:
        self._stages.append((what, time.monotonic()))
        return len(self._stages) - 1

    def report(self, stage: int, done: int, total: int) -> None:
        now = time.monotonic()
        if now - self._last >= _PIPED_S:
            self._last = now
            what, began = self._stages[stage]
            print(line(what, done, total, now - began), file=sys.stderr, flush=True)

    def close(self, stage: int) -> None:
        del self._stages[stage:]


class _Notebook:
    """A line of text below the cell, written anew twice a second and empty at the end; needs no widgets."""

    def __init__(self) -> None:
        from IPython import display  # type: ignore[import-not-found, unused-ignore]

        self._stages: list[tuple[str, float]] = []
        self._show: Any = display
        self._handle = display.display(self._text(""), display_id=True)
        self._last = 0.0

    def open(self, what: str) -> int:
        self._stages.append((what, time.monotonic()))
        self._write(f"{what} …")
        return len(self._stages) - 1

    def report(self, stage: int, done: int, total: int) -> None:
        now = time.monotonic()
        if now - self._last >= _EVERY_S:
            what, began = self._stages[stage]
            self._write(line(what, done, total, now - began))

    def close(self, stage: int) -> None:
        del self._stages[stage:]
        self._write(f"{self._stages[-1][0]} …" if self._stages else "")

    def _write(self, text: str) -> None:
        self._last = time.monotonic()
        self._handle.update(self._text(text))

    def _text(self, text: str) -> Any:
        return self._show.Pretty(text)


def line(what: str, done: int, total: int, passed_s: float) -> str:
    """ "estimating: 40 %, 0:12 passed, 0:18 remaining"; what remains by the speed until now."""
    share = min(done / total, 1.0) if total > 0 else 0.0
    rest = f", {_minutes(passed_s * (1.0 - share) / share)} remaining" if share > 0.0 else ""
    return f"{what}: {100.0 * share:.0f} %, {_minutes(passed_s)} passed{rest}"


def _minutes(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d}"
