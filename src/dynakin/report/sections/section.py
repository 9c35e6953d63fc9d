"""What a page is made of: a heading, words, tables and panels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from dynakin.report.method_styles import LineStyle
from dynakin.report.sections.panels import Panel
from dynakin.report.text_tables import TextTable

P = ParamSpec("P")
S = TypeVar("S")
T = TypeVar("T")


def needs(*blocks: str, otherwise: T) -> Callable[[Callable[P, S]], Callable[P, S | T]]:
    """Of a finding or a section made from metrics, its last argument: ``otherwise`` where one of these blocks of
    ``metrics.json`` is None, because the stage that makes it failed (`dynakin.results.failures`)."""

    def with_them(make: Callable[P, S]) -> Callable[P, S | T]:
        @wraps(make)
        def made(*args: P.args, **others: P.kwargs) -> S | T:
            metrics: Any = args[-1]
            return otherwise if any(metrics[block] is None for block in blocks) else make(*args, **others)

        return made

    return with_them


@dataclass(frozen=True)
class Section:
    """A heading, paragraphs, tables and panels; ``folded`` panels open on a click.

    key: names of the lines that all pages know ("measured", "estimated", "band", "bound"); lines: those of methods.
    band: what the bands of ``lines`` are. notes: further lines of words. parts: sections of their own, below a smaller
    heading.
    """

    anchor: str
    title: str
    text: str
    panels: list[Panel] = field(default_factory=list)
    wide: list[Panel] = field(default_factory=list)
    folded: list[Panel] = field(default_factory=list)
    folded_title: str = ""
    key: tuple[str, ...] = ()
    lines: tuple[LineStyle, ...] = ()
    band: str = ""
    tables: list[TextTable] = field(default_factory=list)
    notes: tuple[str, ...] = ()
    parts: list[Section] = field(default_factory=list)

    @property
    def empty(self) -> bool:
        """Whether there is nothing to show."""
        return not (self.panels or self.wide or self.folded or self.tables or self.notes or self.parts)


NOTHING = Section("", "", "")
"""A section that is left out."""
