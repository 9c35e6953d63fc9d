"""What all commands print with: results on stdout, errors on stderr."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
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
