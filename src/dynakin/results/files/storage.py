"""OpenSim's table format: `.mot` and `.sto` files that OpenSim reads (its storage format, version 1)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dynakin.arrays import finite
from dynakin.errors import OutputError

EXACT = 15
"""Significant digits that hold a double: of truth and recordings, which others compute from."""
DIGITS = 8
"""Of an estimate: no coarser than the single precision of ``estimate.nc``, far below any deviation."""
DIGITS_OF_RATES = 6
"""Of speeds and accelerations: a millidegree a second of a hundred degrees, where deviations are whole ones."""
DIGITS_OF_LOADS = 6
"""Of forces, moments and powers: 1 mN of a body's weight."""
DECIMALS_OF_LOADS = 6
"""Of these and the places that go with them: less than 1 uN, 1 um is rounding, where nothing acts."""
DIGITS_OF_SD = 3
"""Of a standard deviation, which itself is not known to two."""
_TIME = "%.12g"


def write_storage(
    path: Path,
    title: str,
    time: np.ndarray,
    names: Sequence[str],
    values: np.ndarray,
    *,
    in_degrees: bool,
    notes: Sequence[str] = (),
    digits: int = EXACT,
    decimals: int | None = None,
) -> None:
    """Write one table.

    Args:
        title: first line of the file.
        time: (T,) s.
        names: one a column, without ``time``.
        values: (T, N) in the units that the file is to carry; NaN is written as ``nan``, and so is infinity.
        in_degrees: OpenSim's header line; says in what the rotational columns are given.
        notes: lines of the header for people, ``;`` and ``=`` excluded since readers take ``key=value`` for settings.
        digits: significant ones of the values. decimals: after which all is rounding, however small the value.
    """
    values = finite(values) if decimals is None else np.round(finite(values), decimals) + 0.0  # no -0
    if values.shape != (len(time), len(names)):
        raise OutputError(
            f"{path.name}: values of shape {values.shape}, expected ({len(time)}, {len(names)}) for its names"
        )
    header = [
        title,
        "version=1",
        f"nRows={len(time)}",
        f"nColumns={len(names) + 1}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
        "",
        *(note.replace("=", " is ") for note in notes),
        "",
        "endheader",
        "\t".join(["time", *names]),
    ]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join(header) + "\n")
        row = "\t".join([_TIME, *[f"%.{digits}g"] * len(names)]) + "\n"
        file.write("".join(row % tuple(line) for line in np.column_stack([time, values]).tolist()))
