"""One small figure as inline SVG: text stays text, ids stay apart, numbers are rounded to what a screen shows."""

from __future__ import annotations

import io
import re
from typing import Any

import matplotlib as mpl
import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from dynakin.report.styles import GRID, INK, QUIET, by_source, thin

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # for measuring; the page's own font is put in its place
    "font.size": 8.0,
    "axes.edgecolor": "#b8c0c8",
    "axes.linewidth": 0.7,
    "axes.labelcolor": QUIET,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3,
    "ytick.major.size": 0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.grid": True,
    "axes.grid.axis": "y",
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
}
FILE_STYLE: dict[Any, Any] = {
    **_STYLE,
    "pdf.fonttype": 42,  # letters stay letters, as journals ask
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "legend.fontsize": 8,
    "legend.labelcolor": INK,
    "legend.frameon": False,
    "savefig.facecolor": "white",
}
"""Of the figures that are written as files of their own."""
_GROUP_ID = re.compile(r' id="(?:figure|axes|patch|matplotlib\.axis|xtick|ytick|line2d|text|[A-Za-z]+Collection)_\d+"')
_TAG = re.compile(r"<[^>]*>")
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")


class Figure(matplotlib.figure.Figure):
    """A figure that a notebook shows by itself, without pyplot and its list of open figures."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        with mpl.rc_context(FILE_STYLE):
            self.savefig(buffer, format="png", dpi=144)
        return buffer.getvalue()


def new_axes() -> tuple[Figure, Axes]:
    """A figure with one set of axes in the report's style, which makes room for its labels."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(4.3, 4.6), layout="constrained")
        figure.patch.set_alpha(0.0)
        axes = figure.add_subplot()
        axes.patch.set_alpha(0.0)
        axes.yaxis.set_major_locator(MaxNLocator(5))
    return figure, axes


def draw_sourced(
    axes: Axes, time: np.ndarray, values: np.ndarray, source: np.ndarray, *, color: str, linewidth: float
) -> None:
    """A line over time (T,) that shows where its values come from (T,)."""
    for part, pattern in by_source(values, source):
        axes.plot(*thin(time, part), color=color, linewidth=linewidth, linestyle=(0.0, pattern or None))


def to_svg(figure: Figure, key: str, description: str) -> str:
    """The figure as an `<svg>` element that scales with its column.

    Args:
        key: unique in the page; keeps the ids of one figure apart from the others'.
        description: for people who hear the page instead of seeing it.
    """
    buffer = io.StringIO()
    with mpl.rc_context({**_STYLE, "svg.hashsalt": key}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = _GROUP_ID.sub("", text)
    text = _TAG.sub(lambda tag: _LONG_NUMBER.sub(_rounded, tag.group()), text)  # numbers in words stay as they are
    text = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", text)
    text = re.sub(r"font-family:[^;\"]*;?", "", text)
    text = re.sub(r"\n\s*", "\n", text)
    label = description.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    head, _, rest = text.partition(">")
    head = re.sub(r' (?:width|height)="[^"]*"', "", head)
    return f'{head} role="img" aria-label="{label}">{rest}'


def _rounded(number: re.Match[str]) -> str:
    return f"{float(number.group()):.2f}".rstrip("0").rstrip(".")
