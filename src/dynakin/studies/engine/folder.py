"""The folder of a long piece of work: begun, gone on with, and full of tables at the end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from dynakin.errors import OutputError

ROWS = "rows.jsonl"
"""The journal: rows as they came. A folder that holds it is ours, and is gone on with."""


def open_folder(folder: Path, own: Sequence[str]) -> Path:
    """Make a folder for long work, or go on in one that was begun.

    Args:
        own: beginnings of the names that the work writes.

    Raises:
        OutputError: it cannot be made, or holds something else.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        names = sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith("."))
    except OSError as error:
        raise OutputError(f"{folder}: cannot write results there ({error.strerror or error})") from None
    foreign = [name for name in names if name != ROWS and not name.startswith(tuple(own))]
    if foreign:
        raise OutputError(f"{folder}: is no folder of this command (it holds {foreign[0]}); name a new or an empty one")
    return folder


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Says in one line why something could not be written into ``folder``.

    Raises:
        OutputError: a file cannot be written.
    """
    try:
        yield
    except OSError as error:
        raise OutputError(f"{error.filename or folder}: cannot be written ({error.strerror or error})") from None
