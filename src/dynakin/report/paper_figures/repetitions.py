"""Mean curves over the repetitions as a figure for papers."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from dynakin.report.labels import moment_note
from dynakin.report.method_styles import LineStyle, method_styles
from dynakin.report.plot import ESTIMATED, QUIET
from dynakin.report.sections.method_panels import curve_unit, draw_curves, percent_label
from dynakin.report.sections.repetitions import grouped, in_order, kind_of, title_of
from dynakin.results.estimate import Estimate
from dynakin.results.measures.mean_curves import MeanCurve, estimate_curves
from dynakin.validation.methods import Trial

_COLUMNS = 4


def repetitions_figure(estimate: Estimate, comparison: Trial | None = None) -> Figure | None:
    """Joint angles, moments and wrench over 0 to 100 % of a repetition: mean, and one standard deviation as a band."""
    curves = estimate_curves(estimate) if comparison is None else comparison.curves()
    groups = grouped(curves)
    if not groups:
        return None
    styles = method_styles(dict.fromkeys(curve.method for curve in curves))
    rows = [
        kept[k : k + _COLUMNS]
        for kind in ("angles", "moments", "wrench")
        if (kept := [group for group in groups if kind_of(group) == kind])
        for k in range(0, len(kept), _COLUMNS)
    ]
    figure = Figure(figsize=(7.2, 0.55 + 1.5 * len(rows)), layout="constrained")
    places = figure.subplots(len(rows), _COLUMNS, squeeze=False)
    for row, panels in zip(rows, places, strict=True):
        for axes in panels[len(row) :]:
            axes.set_visible(False)
        for group, axes in zip(row, panels, strict=False):
            draw_curves(axes, [(styles[curve.method], curve) for curve in in_order(group)])
            axes.margins(y=0.1)
            axes.set_title(_short(estimate, group), fontsize=7.5)
            axes.set_ylabel(curve_unit(group[0]), fontsize=7.5)
    first = groups[0][0]
    n = int(max(curve.n.max() for curve in curves))
    figure.supxlabel(f"{percent_label(first.movement)}, n = {n}", fontsize=8, color=QUIET)
    _key(figure, list(styles.values()), band=n > 1)
    return figure


def _short(estimate: Estimate, group: Sequence[MeanCurve]) -> str:
    """The title and what a moment stands for, in lines as wide as a panel."""
    note = moment_note(estimate, group[0].quantity.removesuffix("/moment")) if kind_of(group) == "moments" else ""
    return "\n".join(textwrap.fill(text, 24) for text in (title_of(group[0]), note) if text)


def _key(figure: Figure, styles: Sequence[LineStyle], *, band: bool) -> None:
    axes = figure.axes[0]
    handles: list[Artist] = []
    for style in styles:
        handles += axes.plot(
            [], [], color=style.colour, linewidth=style.width, linestyle=style.pattern, label=style.label
        )
    if band:
        handles.append(Patch(color=ESTIMATED, alpha=0.2, linewidth=0, label="± 1 standard deviation"))
    figure.legend(handles=handles, loc="outside upper left", ncols=5, borderaxespad=0.2, columnspacing=1.4)
