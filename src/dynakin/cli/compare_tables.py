"""The tables that `compare` prints."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from dynakin.cli.console import table
from dynakin.comparison import AngleDifference, MomentDifference, Row, Spread, UnseenRow
from dynakin.comparison.table2 import MARKERS
from dynakin.results import COMPONENTS


def shown(value: Spread, digits: int, unit: str = "") -> str:
    """Mean and, over several trials, standard deviation."""
    if value.mean is None:
        return "–"
    text = f"{value.mean:.{digits}f}" + (f" ± {value.sd:.{digits}f}" if value.sd is not None else "")
    return f"{text} {unit}".rstrip()


def table2_table(rows: Sequence[Row], title: str) -> Table:
    """Rows of Table II or of a held-out trial: the markers' mean and the wrench; single markers are in the CSV."""
    made = table("", "method", "RMS", "of range, %", "of RMS, %", "r", numbers=(2, 3, 4, 5), title=title)
    last = ""
    for row in rows:
        if row.quantity not in (MARKERS, *COMPONENTS):
            continue
        made.add_row(
            name_of(row.quantity) if row.quantity != last else "",
            row.method,
            shown(row.rms, 1, row.unit),
            shown(row.nrms_range_percent, 1),
            shown(row.nrms_rms_percent, 1),
            shown(row.correlation, 2),
        )
        last = row.quantity
    return made


def angle_table(rows: Sequence[AngleDifference]) -> Table:
    """Differences to the classical angles."""
    title = "Coordinates against the classical method"
    made = table("coordinate", "method", "RMS", "mean", "RMS about mean", numbers=(2, 3, 4), title=title)
    for row in rows:
        figures = (row.rms, row.mean, row.rms_about_mean)
        made.add_row(row.coordinate, row.method, *(shown(value, 1, row.unit) for value in figures))
    return made


def moment_table(rows: Sequence[MomentDifference]) -> Table:
    """Differences to AT's joint moments."""
    title = "Joint moments against AT"
    made = table("coordinate", "method", "RMS", "of range, %", "of RMS, %", "r", numbers=(2, 3, 4, 5), title=title)
    for row in rows:
        made.add_row(
            row.coordinate,
            row.method,
            shown(row.rms, 1, row.unit),
            shown(row.nrms_range_percent, 1),
            shown(row.nrms_rms_percent, 1),
            shown(row.correlation, 2),
        )
    return made


def unseen_table(rows: Sequence[UnseenRow]) -> Table:
    """Yardsticks: methods side by side, RMS."""
    methods = list(dict.fromkeys(row.method for row in rows))
    made = table("", "", *methods, numbers=tuple(range(2, 2 + len(methods))), title="What was not seen, RMS error")
    figures = {(row.yardstick, row.quantity, row.method): row for row in rows}
    last = ""
    for yardstick, quantity in dict.fromkeys((row.yardstick, row.quantity) for row in rows):
        if quantity not in (MARKERS, *COMPONENTS):
            continue
        cells = [figures.get((yardstick, quantity, method)) for method in methods]
        texts = ["" if cell is None else shown(cell.rms, 1, cell.unit) for cell in cells]
        made.add_row(yardstick if yardstick != last else "", name_of(quantity), *texts)
        last = yardstick
    return made


def name_of(quantity: str) -> str:
    """Components as the paper writes them."""
    return quantity.upper() if quantity in COMPONENTS else quantity
