"""Labelled horizontal bars, written as SVG by hand as in `dynakin.report.chart`, for the same reasons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from math import isfinite

from dynakin.report.chart import Panel
from dynakin.report.styles import ESTIMATED, INK, MEASURED, QUIET

# Tenths of a point, as in a chart; a column of the page is 3096 wide.
_WIDTH, _LETTER, _BASE, _GAP = 3096, 46, 28, 40
_OVER_MARKS = ' font-weight="bold" stroke="#fff" stroke-width="25" paint-order="stroke"'


@dataclass(frozen=True)
class Bar:
    """A line of the figure: its label, how far it reaches, and what stands behind it."""

    label: str
    value: float
    text: str


def value_bars(title: str, note: str, bars: Sequence[Bar], most: float, description: str) -> Panel:
    """One bar below the other in the order given; ``most`` fills the width."""
    row = 144
    left, right = _columns(bars)
    parts: list[str] = []
    for k, bar in enumerate(bars):
        own = _length(bar.value / most if most else 0.0, left, right)
        parts += [
            _text(left - _GAP, row * k + 72, bar.label, INK, "end"),
            f'<path d="M{left} {row * k + 72}h{own}" stroke="{ESTIMATED}" stroke-width="90"/>',
            _text(left + own + 40, row * k + 72, bar.text, INK),
        ]
    return Panel(title, note, _svg(parts, row * len(bars), description))


def share_bars(
    title: str, note: str, groups: Mapping[str, Sequence[Bar]], marks: Sequence[float], description: str
) -> Panel:
    """Shares of 1 below the name of their group, each with the whole behind it; ``marks`` are lines across all."""
    row = 112
    left, right = _columns([bar for bars in groups.values() for bar in bars])
    parts: list[str] = []
    headings: list[str] = []
    at = 0
    for group, bars in groups.items():
        at += 140
        headings.append(_text(left, at - 40, group, INK, more=_OVER_MARKS))
        for bar in bars:
            middle = at + row // 2
            own = _length(min(bar.value, 1.0), left, right)
            parts += [
                _text(left - _GAP, middle, bar.label, INK, "end"),
                f'<path d="M{left} {middle}H{right}" stroke="{MEASURED}" stroke-opacity=".45" stroke-width="34"/>',
                f'<path d="M{left} {middle}h{own}" stroke="{ESTIMATED}" stroke-width="34"/>',
                _text(right + 40, middle, bar.text, QUIET),
            ]
            at += row
    across = "".join(f"M{left + _length(mark, left, right)} 0V{at}" for mark in marks)
    parts.append(f'<path d="{across}" stroke="{QUIET}" stroke-width="7" stroke-dasharray="40 30"/>')
    parts.append(f'<path d="M{left} {at}H{right}" stroke="#b8c0c8" stroke-width="7"/>')
    parts += [
        _text(left + _length(mark, left, right), at + 80, f"{mark:g}", QUIET, "middle") for mark in (0.0, *marks, 1.0)
    ]
    return Panel(title, note, _svg([*parts, *headings], at + 130, description))


def _columns(bars: Sequence[Bar]) -> tuple[int, int]:
    """Where bars begin and end, so that the longest label and text fit next to them."""
    left = _LETTER * max((len(bar.label) for bar in bars), default=0) + _GAP
    return left, max(_WIDTH - _LETTER * max((len(bar.text) for bar in bars), default=0) - _GAP, left + 300)


def _length(share: float, left: int, right: int) -> int:
    return round(share * (right - left)) if isfinite(share) else 0


def _text(x: int, y: int, words: str, colour: str, anchor: str = "", more: str = "") -> str:
    more += f' text-anchor="{anchor}"' if anchor else ""
    return f'<text x="{x}" y="{y + _BASE}" fill="{colour}"{more}>{escape(words)}</text>'


def _svg(parts: Sequence[str], height: int, description: str) -> str:
    label = escape(description, quote=True)
    view = f"0 0 {_WIDTH} {height}"
    return f'<svg class="bars" viewBox="{view}" role="img" aria-label="{label}">{"".join(parts)}</svg>'
