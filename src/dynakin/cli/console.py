"""What all commands print with: results on stdout, progress and errors on stderr."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

if TYPE_CHECKING:
    from dynakin.report.text_tables import TextTable


def out() -> Console:
    """Console of results. Names in them are not markup, and numbers are not coloured at random."""
    return Console(highlight=False, markup=False)


def print_error(message: str) -> None:
    """One line on stderr, for any message."""
    print(f"error: {' '.join(message.split())}", file=sys.stderr)


def table(*headings: str, numbers: tuple[int, ...] = (), title: str | None = None) -> Table:
    """A plain table; the columns ``numbers`` are set to the right."""
    made = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left", title_style="bold", pad_edge=False)
    for index, heading in enumerate(headings):
        made.add_column(heading, justify="right" if index in numbers else "left", overflow="fold")
    return made


def as_table(text: TextTable) -> Table:
    """A table of the report on screen."""
    made = table(*text.headings, numbers=text.numbers, title=text.title)
    for row in text.rows:
        made.add_row(*row)
    return made


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on stderr, where somebody looks at it; gives the callback (done, total)."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)

        def advance(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield advance


@contextmanager
def busy(what: str) -> Iterator[None]:
    """Says on stderr what takes a moment, where somebody looks at it."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    with console.status(what):
        yield
