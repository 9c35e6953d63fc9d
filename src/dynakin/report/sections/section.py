"""What a page shows, and what it is made of: sections with a heading, words, tables and panels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from dynakin.report.chart import Panel
from dynakin.report.styles import LineStyle
from dynakin.report.text_tables import TextTable
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import reported
from dynakin.results.measures.mean_curves import MeanCurve, estimate_curves
from dynakin.results.measures.repetitions import Found, repetitions_of
from dynakin.validation.methods import ComparedTrial


@dataclass(frozen=True, eq=False)
class Page:
    """What a section is made from: one estimate (facing forward), its metrics, and, where they were run, the reference
    methods on the same trial.

    A block of ``metrics`` is None where the stage that makes it failed (`dynakin.results.failures`).
    """

    estimate: Estimate
    metrics: dict[str, Any]
    comparison: ComparedTrial | None = None

    @cached_property
    def planar(self) -> bool:
        """Whether the model explains the markers in one plane only."""
        return self.estimate.planar

    @cached_property
    def repetitions(self) -> Found:
        """Squats or gait cycles."""
        return repetitions_of(self.estimate) if self.comparison is None else self.comparison.repetitions

    @cached_property
    def curves(self) -> Sequence[MeanCurve]:
        """Mean curves over the repetitions, of every method; angles as the page shows them all."""
        found = estimate_curves(self.estimate) if self.comparison is None else self.comparison.curves()
        shown = reported(self.estimate)
        if not shown.asked:
            return found
        degrees = dict(zip(self.estimate.coordinate_names, np.degrees(shown.offset), strict=True))
        sign = dict(zip(self.estimate.coordinate_names, shown.sign, strict=True))
        return [
            replace(curve, mean=sign[curve.quantity] * (curve.mean - degrees[curve.quantity]))
            if curve.unit == "deg" and curve.quantity in sign
            else curve
            for curve in found
        ]


@dataclass(frozen=True)
class Section:
    """A heading, paragraphs, tables and panels; ``folded`` panels open on a click.

    lines: the key of the panels. band: what the bands of ``lines`` are. notes: further lines of words. parts: sections
    of their own, below a smaller heading.
    """

    anchor: str
    title: str
    text: str
    panels: list[Panel] = field(default_factory=list)
    wide: list[Panel] = field(default_factory=list)
    folded: list[Panel] = field(default_factory=list)
    folded_title: str = ""
    lines: tuple[LineStyle, ...] = ()
    band: str = ""
    tables: list[TextTable] = field(default_factory=list)
    notes: tuple[str, ...] = ()
    parts: list[Section] = field(default_factory=list)

    @property
    def empty(self) -> bool:
        """Whether there is nothing to show."""
        return not (self.panels or self.wide or self.folded or self.tables or self.notes or self.parts)
