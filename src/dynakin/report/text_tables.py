"""A comparison's tables as words, for the page and for the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dynakin.results.naming import listed
from dynakin.units import COMPONENTS
from dynakin.validation.differences import AngleDifference, MomentDifference
from dynakin.validation.table2 import MARKERS, Row, Spread
from dynakin.validation.truth import TruthRow
from dynakin.validation.unseen import UnseenRow


@dataclass(frozen=True)
class TextTable:
    """A table whose cells are written; the columns ``numbers`` stand to the right. ``folded``: opens on a click."""

    title: str
    headings: tuple[str, ...]
    rows: list[tuple[str, ...]]
    numbers: tuple[int, ...]
    folded: bool = False


def shown(value: Spread, digits: int, unit: str = "") -> str:
    """Mean and, over several trials, standard deviation."""
    if value.mean is None:
        return "–"
    text = f"{value.mean:z.{digits}f}" + (f" ± {value.sd:.{digits}f}" if value.sd is not None else "")
    return f"{text} {unit}".rstrip().replace("-", "−")


def table2_text(
    rows: Sequence[Row], title: str, *, single_markers: bool = False, of: int = 1, doubted: Sequence[str] = ()
) -> TextTable:
    """Rows of Table II or of a held-out trial: the markers' mean and the wrench, or each single marker.

    Args:
        of: trials in all: a row over fewer says over how many. doubted: trials whose mass or forces are doubted: rows
            of the wrench are marked, and the title names them.
    """
    found = []
    for row in rows:
        if (row.quantity in (MARKERS, *COMPONENTS)) == single_markers:
            continue
        mark = " *" if doubted and row.quantity in COMPONENTS else ""
        over = f" (n = {row.rms.n})" if row.rms.n < of else ""
        found.append((name_of(row.quantity) + mark, row.method + over, *_fit(row)))
    if doubted:
        title += f"; * with trials whose mass or forces are doubted: {listed(list(doubted), 4)}"
    headings = ("", "method", "RMS", "of range, %", "of RMS, %", "r")
    return TextTable(title, headings, _once(found), (2, 3, 4, 5), folded=single_markers)


def angle_text(rows: Sequence[AngleDifference]) -> TextTable:
    """Differences to the classical angles."""
    found = [
        (row.coordinate, row.method, *(shown(value, 1, row.unit) for value in (row.rms, row.mean, row.rms_about_mean)))
        for row in rows
    ]
    headings = ("coordinate", "method", "RMS", "mean", "RMS about mean")
    return TextTable(f"Coordinates against {_references(rows)}", headings, _once(found), (2, 3, 4))


def moment_text(rows: Sequence[MomentDifference]) -> TextTable:
    """Differences to AT's joint moments (of a whole body, to those of inverse dynamics)."""
    found = [(row.coordinate, row.method, *_fit(row)) for row in rows]
    headings = ("coordinate", "method", "RMS", "of range, %", "of RMS, %", "r")
    return TextTable(f"Joint moments against {_references(rows)}", headings, _once(found), (2, 3, 4, 5))


def unseen_text(rows: Sequence[UnseenRow]) -> TextTable:
    """Yardsticks: methods side by side, RMS."""
    methods = list(dict.fromkeys(row.method for row in rows))
    figures = {(row.yardstick, row.quantity, row.method): row for row in rows}
    found = []
    for yardstick, quantity in dict.fromkeys((row.yardstick, row.quantity) for row in rows):
        if quantity not in (MARKERS, *COMPONENTS):
            continue
        cells = [figures.get((yardstick, quantity, method)) for method in methods]
        texts = ("" if cell is None else shown(cell.rms, 1, cell.unit) for cell in cells)
        found.append((yardstick, name_of(quantity), *texts))
    numbers = tuple(range(2, 2 + len(methods)))
    return TextTable("What was not seen, RMS error", ("", "", *methods), _once(found), numbers)


def unseen_texts(rows: Sequence[UnseenRow]) -> list[TextTable]:
    """The same, a table each yardstick with the methods that it has: narrow enough for a terminal."""
    found = []
    for yardstick in dict.fromkeys(row.yardstick for row in rows):
        whole = unseen_text([row for row in rows if row.yardstick == yardstick])
        cells = [row[1:] for row in whole.rows]
        title = f"{yardstick[:1].upper()}{yardstick[1:]}, RMS error"
        headings = tuple(name.removesuffix(" extrapolation") for name in whole.headings[1:])
        found.append(TextTable(title, headings, cells, tuple(k - 1 for k in whole.numbers)))
    return found


def truth_text(rows: Sequence[TruthRow]) -> TextTable:
    """Errors against a simulation's truth: methods side by side."""
    methods = list(dict.fromkeys(row.method for row in rows))
    figures = {(row.quantity, row.method): row.rms for row in rows}
    found = [
        (f"{quantity}, {unit}", *(shown(figures[quantity, method], 2) for method in methods))
        for quantity, unit in dict.fromkeys((row.quantity, row.unit) for row in rows)
    ]
    title = "Against the simulation's truth, RMS error (moments: of the legs, where every method has them measured)"
    return TextTable(title, ("", *methods), found, tuple(range(1, 1 + len(methods))))


def name_of(quantity: str) -> str:
    """Components as the paper writes them."""
    return quantity.upper() if quantity in COMPONENTS else quantity


def _references(rows: Sequence[AngleDifference] | Sequence[MomentDifference]) -> str:
    return ", ".join(dict.fromkeys(row.against for row in rows))


def _fit(row: Row | MomentDifference) -> tuple[str, str, str, str]:
    return (
        shown(row.rms, 1, row.unit),
        shown(row.nrms_range_percent, 1),
        shown(row.nrms_rms_percent, 1),
        shown(row.correlation, 2),
    )


def _once(rows: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """The first cell only where it changes."""
    before = [""] + [row[0] for row in rows[:-1]]
    return [("" if row[0] == last else row[0], *row[1:]) for row, last in zip(rows, before, strict=True)]
