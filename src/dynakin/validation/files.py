"""A comparison as files: one CSV a table, and everything in ``comparison.json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from dynakin.files import expanded, write_csv
from dynakin.results.files.config import versions, write_metrics
from dynakin.results.files.folder import FolderKind, check_output_writable, replacing
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


def check_comparison_folder(folder: str | Path) -> None:
    """Make sure, before anything long is computed, that a comparison can be written to ``folder``.

    Raises:
        OutputError: a file is in the way, the place cannot be written, or the folder holds something else.
    """
    check_output_writable(folder, kind=COMPARISON)


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
        OutputError: as `check_comparison_folder`.
    """
    folder = expanded(folder)
    plain = {name: [flat(row) for row in rows] for name, rows in tables.items() if rows}
    summary = {"schema_version": SCHEMA_VERSION, "versions": versions(), **(more or {})}
    summary |= {name: rows for name, rows in plain.items() if name != "repetitions"}  # curves are long: CSV only
    with replacing(folder, kind=COMPARISON) as made:
        for name, rows in plain.items():
            write_csv(made / f"{name}.csv", rows)
        write_metrics(summary, made / _SUMMARY)
        if page is not None:
            (made / "report.html").write_text(page, encoding="utf-8", newline="\n")
    return folder
