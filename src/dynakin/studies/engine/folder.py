"""The folder of a long piece of work: begun, gone on with, and full of tables at the end."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dynakin.arrays import with_nulls
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


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Rows of the same columns; what is None or no finite number is a blank cell, numbers keep all their digits.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(with_nulls(dict(row)) for row in rows)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from None


def write_json(path: Path, content: Any) -> None:
    """
    Raises:
        OutputError: the file cannot be written.
    """
    try:
        text = json.dumps(with_nulls(content), indent=2, ensure_ascii=False, allow_nan=False)
        path.write_text(text + "\n", encoding="utf-8", newline="\n")
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from None
