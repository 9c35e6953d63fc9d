"""A comparison as files: one CSV a table, and everything in ``comparison.json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from dynakin.files import expanded, write_csv, write_json
from dynakin.results.files.config import versions
from dynakin.results.files.folder import FolderKind, replacing
from dynakin.validation.table2 import Spread

SCHEMA_VERSION = 1
FILES = (
    "table2.csv",
    "angles.csv",
    "moments.csv",
    "held_out.csv",
    "unseen.csv",
    "repetitions.csv",
    "truth.csv",
    "comparison.json",
    "report.html",
)
_SUMMARY = "comparison.json"
COMPARISON = FolderKind(FILES, _SUMMARY, "comparison of dynakin")


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


def save_comparison(
    folder: str | Path,
    tables: Mapping[str, Sequence[Any]],
    more: Mapping[str, Any] | None = None,
    page: str | None = None,
) -> Path:
    """Write each table as ``NAME.csv``, all of them with ``more`` into ``comparison.json``, and ``report.html``.

    An earlier comparison is replaced as a whole; a CSV without rows is not written.

    Args:
        tables: rows, dataclasses, by the name of their file: table2, angles, moments, truth, held_out, unseen,
            repetitions.
        more: further plain data: settings, notes.
        page: the report as HTML (`dynakin.report.render_comparison`); none is written without it.

    Raises:
        OutputError: as `dynakin.results.files.folder.check_output_writable`.
    """
    folder = expanded(folder)
    plain = {name: [flat(row) for row in rows] for name, rows in tables.items() if rows}
    summary = {"schema_version": SCHEMA_VERSION, "versions": versions(), **(more or {})}
    summary |= {name: rows for name, rows in plain.items() if name != "repetitions"}  # curves are long: CSV only
    with replacing(folder, kind=COMPARISON) as made:
        for name, rows in plain.items():
            write_csv(made / f"{name}.csv", rows)
        write_json(made / _SUMMARY, summary)
        if page is not None:
            (made / "report.html").write_text(page, encoding="utf-8", newline="\n")
    return folder
