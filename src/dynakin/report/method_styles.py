"""One line for each method, the same in every figure and table's key."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from dynakin.report.plot import ESTIMATED, MEASURED, QUIET, REFERENCE

# After the first filter: Okabe and Ito's green, purple and sky blue, for further presets beside it.
_FILTERS = (ESTIMATED, "#009E73", "#CC79A7", "#56B4E9")
_CLASSICAL = "#6A3D9A"
Dash = Literal["solid", "dashed", "dotted"]
_PATTERNS: dict[Dash, tuple[float, ...]] = {"solid": (), "dashed": (4, 1.6), "dotted": (1.2, 1.4)}


@dataclass(frozen=True)
class LineStyle:
    """How a method is drawn; ``band``: its spread is drawn too, of others it would hide what lies below."""

    label: str
    colour: str
    width: float
    dash: Dash = "solid"
    band: bool = False

    @property
    def css(self) -> str:
        """Of the line in a page's key."""
        return f"border-top: {max(2, round(1.7 * self.width))}px {self.dash} {self.colour}"

    @property
    def pattern(self) -> tuple[float, tuple[float, ...] | None]:
        """Of matplotlib's dashes."""
        return (0.0, _PATTERNS[self.dash] or None)


DERIVED_LINE = LineStyle("derived from the motion", QUIET, 1.2, "dashed")
"""In the key of figures in which some of a line is derived, because a contact is not measured."""


def method_styles(names: Iterable[str]) -> dict[str, LineStyle]:
    """Line of each method by its name: "measured", "EKF ...", "AT ..." and "classical ..."."""
    found: dict[str, LineStyle] = {}
    filters = 0
    for name in names:
        if name == "measured":
            found[name] = LineStyle(name, MEASURED, 2.6)
        elif name.startswith("AT"):
            found[name] = LineStyle(name, REFERENCE, 1.1, "dashed")
        elif name.startswith("classical"):
            found[name] = LineStyle(name, _CLASSICAL, 1.2, "dotted")
        else:
            found[name] = LineStyle(name, _FILTERS[filters % len(_FILTERS)], 1.2, band=filters == 0)
            filters += 1
    return found
