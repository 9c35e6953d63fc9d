"""What all commands print with: results on stdout, errors on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any, cast

from rich import box
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from dynakin.report.text_tables import TextTable


def out() -> Console:
    """Console of results. Names in them are not markup, and numbers are not coloured at random."""
    return Console(highlight=False, markup=False, file=cast(IO[str], _Stdout()))


class _Stdout:
    """Standard output that takes no more where what it leads to is full: a run goes on, saves its results, and ends
    with `lost_output`. A closed pipe still ends it."""

    def write(self, text: str) -> int:
        return self._or_lost(lambda: sys.stdout.write(text))

    def flush(self) -> None:
        self._or_lost(sys.stdout.flush)

    def _or_lost(self, act: Callable[[], int | None]) -> int:
        try:
            return act() or 0
        except BrokenPipeError:
            raise
        except OSError as error:
            if not lost_output():
                print_error(f"standard output cannot be written ({error.strerror or error}); the run goes on without")
            _LOST.append(error)
            nowhere = os.open(os.devnull, os.O_WRONLY)  # takes what is still in the buffer, at the end too
            os.dup2(nowhere, sys.stdout.fileno())
            os.close(nowhere)
            return 0

    def __getattr__(self, name: str) -> Any:
        return getattr(sys.stdout, name)


_LOST: list[OSError] = []


def lost_output() -> bool:
    """Whether something that was printed did not arrive."""
    return bool(_LOST)


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
