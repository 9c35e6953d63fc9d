"""What a batch leaves in its folder beside the trials' own results."""

from __future__ import annotations

from pathlib import Path

from dynakin.results.files.versions import versions
from dynakin.results.measures.fit import SignalFit
from dynakin.studies.batch.process import Batch
from dynakin.studies.engine.folder import write_csv, write_json
from dynakin.validation.files import flat


def write_batch(folder: Path, batch: Batch) -> None:
    """``table2.csv`` (over trials), ``table2_subjects.csv`` (over subjects), ``trials.csv`` (a row a trial, quantity
    and method) and ``batch.json`` (what failed and why, notes, events).

    Raises:
        OutputError: a file cannot be written.
    """
    for name, rows in (("table2", batch.table2()), ("table2_subjects", batch.table2_of_subjects())):
        if rows:
            write_csv(folder / f"{name}.csv", [flat(row) for row in rows])
    single = [
        {"trial": name, "quantity": quantity, "method": method, **dict(zip(SignalFit._fields, fit, strict=True))}
        for name, fits in batch.fits().items()
        for (quantity, method), fit in fits.items()
    ]
    if single:
        write_csv(folder / "trials.csv", single)
    write_json(
        folder / "batch.json",
        {
            "versions": versions(),
            "trials": {name: {k: v for k, v in row.items() if k != "fits"} for name, row in batch.rows.items()},
            "failed": {
                name: {"message": failure.message, "unexpected": failure.unexpected, "details": failure.details}
                for name, failure in batch.failures.items()
            },
        },
    )
