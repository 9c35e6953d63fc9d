"""What is judged that no method was given: names of the yardsticks, and their figures."""

from __future__ import annotations

from dynakin.units import COMPONENTS
from dynakin.validation.table2 import MARKERS, spread

Figures = dict[tuple[str, str, str], float | None]  # (yardstick, quantity, method) -> RMS in the quantity's unit

WITHHELD, LEFT_OUT = "plates withheld", "marker left out"
PERSISTENCE, LINEAR = "persistence", "linear extrapolation"


def ahead(horizon_s: float) -> str:
    """Name of the yardstick that looks so far ahead."""
    return f"{1000.0 * horizon_s:g} ms ahead"


def with_mean(yardstick: str, figures: Figures) -> Figures:
    """The same, opened by the mean over markers of each method."""
    methods = dict.fromkeys(method for _, _, method in figures)
    means: Figures = {
        (yardstick, MARKERS, method): spread(
            [value for (_, q, m), value in figures.items() if m == method and q not in COMPONENTS]
        ).mean
        for method in methods
    }
    return means | figures
