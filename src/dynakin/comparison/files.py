"""A comparison as files: one CSV a table, and everything in ``comparison.json``."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from dynakin.comparison.statistics import Spread
from dynakin.errors import OutputError
from dynakin.results.json_files import write_metrics
from dynakin.results.versions import versions

SCHEMA_VERSION = 1
FILES = ("table2.csv", "angles.csv", "moments.csv", "held_out.csv", "unseen.csv", "repetitions.csv", "comparison.json")
"""All that such a folder may hold; anything else in it is the user's."""
_SUMMARY = "comparison.json"


def flat(row: Any) -> dict[str, Any]:
    """A row (a dataclass of plain fields) as plain data; a `Spread` x becomes x, x_sd and, once for the row, n."""
    found: dict[str, Any] = {}
    for entry in fields(row):
        value = getattr(row, entry.name)
        if isinstance(value, Spread):
            found |= {entry.name: value.mean, f"{entry.name}_sd": value.sd, "n": max(value.n, found.get("n", 0))}
        else:
            found[entry.name] = value
    return found


def check_comparison_folder(folder: Path) -> None:
    """Make sure, before anything long is computed, that a comparison can be written to ``folder``.

    Raises:
        OutputError: a file is in the way, the place cannot be written, or the folder holds something else.
    """
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is a file, a folder for the comparison was expected")
    names = sorted(entry.name for entry in folder.iterdir()) if folder.exists() else []
    foreign = [name for name in names if name not in FILES]
    if names and (foreign or _SUMMARY not in names):
        what = (foreign or names)[0]
        raise OutputError(f"{folder}: is no comparison of dynakin (it holds {what}); name a new folder or an empty one")
    above = folder.absolute()
    while not above.exists():
        above = above.parent
    try:
        with tempfile.TemporaryDirectory(prefix=".dynakin-", dir=above):
            pass
    except OSError as error:
        raise OutputError(f"{folder}: cannot write there ({error.strerror or error})") from None


def save_comparison(
    folder: str | Path, tables: Mapping[str, Sequence[Any]], more: Mapping[str, Any] | None = None
) -> Path:
    """Write each table as ``NAME.csv``, and all of them with ``more`` into ``comparison.json``.

    An earlier comparison is replaced; a CSV without rows is not written. All files are written before the first takes
    the place of an old one.

    Args:
        tables: rows, dataclasses, by the name of their file: table2, angles, moments, held_out, unseen, repetitions.
        more: further plain data: settings, notes.

    Raises:
        OutputError: as `check_comparison_folder`.
    """
    folder = Path(folder)
    check_comparison_folder(folder)
    plain = {name: [flat(row) for row in rows] for name, rows in tables.items() if rows}
    summary = {"schema_version": SCHEMA_VERSION, "versions": versions(), **(more or {})}
    summary |= {name: rows for name, rows in plain.items() if name != "repetitions"}  # curves are long: CSV only
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".dynakin-", dir=folder) as made:
            for name, rows in plain.items():
                _write_csv(Path(made) / f"{name}.csv", rows)
            write_metrics(summary, Path(made) / _SUMMARY)
            written = {entry.name for entry in Path(made).iterdir()}
            for name in sorted(written):
                (Path(made) / name).replace(folder / name)
        for name in set(FILES) - written:
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot write the comparison there ({error.strerror or error})") from None
    return folder


def _write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
