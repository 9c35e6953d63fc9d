"""What a page is made of: a heading, words, tables and panels."""

from __future__ import annotations

from dataclasses import dataclass, field

from dynakin.report.method_styles import LineStyle
from dynakin.report.panels import Panel
from dynakin.report.text_tables import TextTable


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
