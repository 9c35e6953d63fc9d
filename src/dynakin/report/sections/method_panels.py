"""Panels with several methods: over time, and over the repetitions' 0 to 100 %."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from dynakin.report.method_styles import LineStyle
from dynakin.report.plot import MEASURED, draw_sourced, new_axes, thin, to_svg
from dynakin.report.sections.panels import Panel
from dynakin.results.measures.mean_curves import PERCENT, MeanCurve


def overlaid(
    key: str,
    title: str,
    unit: str,
    time: np.ndarray,
    lines: Sequence[tuple[LineStyle, np.ndarray]],
    *,
    derived: np.ndarray | None = None,
    note: str = "",
) -> Panel:
    """Signals (T,) of several methods over time, the first at the bottom; solid ones but the measured are dashed where
    they are ``derived`` (T,) bool, because a contact is not measured."""
    figure, axes = new_axes()
    for style, values in lines:
        if style.dash == "solid" and style.colour != MEASURED:
            draw_sourced(axes, time, values, derived, color=style.colour, linewidth=style.width)
        else:
            axes.plot(*thin(time, values), color=style.colour, linewidth=style.width, linestyle=style.pattern)
    axes.set_xlim(float(time[0]), float(time[-1]))
    _finish(axes, "time, s", unit)
    return Panel(title, note, to_svg(figure, key, f"{title} in {unit} over time, by method"))


def repeated(
    key: str, title: str, unit: str, curves: Sequence[tuple[LineStyle, MeanCurve]], *, note: str = ""
) -> Panel:
    """Mean curves over the repetitions, with a band of one standard deviation where the style has one."""
    figure, axes = new_axes()
    draw_curves(axes, curves)
    _finish(axes, percent_label(curves[0][1].movement), unit)
    return Panel(title, note, to_svg(figure, key, f"{title} in {unit}, mean over the repetitions, by method"))


def draw_curves(axes: Axes, curves: Sequence[tuple[LineStyle, MeanCurve]]) -> None:
    """Mean curves and their bands; moments and forces per kg of body mass."""
    for style, curve in curves:
        mean, sd = (curve.mean, curve.sd) if curve.mean_per_kg is None else (curve.mean_per_kg, curve.sd_per_kg)
        assert sd is not None
        axes.plot(PERCENT, mean, color=style.colour, linewidth=style.width, linestyle=style.pattern)
        if style.band:
            axes.fill_between(PERCENT, mean - sd, mean + sd, color=style.colour, alpha=0.2, linewidth=0)
    axes.set_xlim(0.0, 100.0)
    axes.set_xticks([0, 25, 50, 75, 100])


def percent_label(movement: str) -> str:
    """What 0 to 100 % are of."""
    return "% of the squat" if movement == "squat" else "% of the gait cycle"


def curve_unit(curve: MeanCurve) -> str:
    """Unit as `draw_curves` shows it."""
    return curve.unit if curve.mean_per_kg is None else f"{curve.unit}/kg"


def _finish(axes: Axes, x: str, unit: str) -> None:
    axes.margins(y=0.08)
    axes.set_xlabel(x)
    axes.set_ylabel(unit)
    axes.yaxis.set_label_coords(-0.155, 0.5)
