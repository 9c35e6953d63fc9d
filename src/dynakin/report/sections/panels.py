"""The small panels of the page; the page lays them out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from dynakin.report.plot import ESTIMATED, INK, LIMIT, MEASURED, QUIET, draw_sourced, new_axes, thin, to_svg
from dynakin.results.naming import number


@dataclass(frozen=True)
class Panel:
    """One figure with its title and a line below the title."""

    title: str
    note: str
    svg: str


def compared(
    key: str,
    title: str,
    unit: str,
    time: np.ndarray,
    measured: np.ndarray | None,
    estimated: np.ndarray,
    *,
    note: str = "",
    sd: np.ndarray | None = None,
    derived: np.ndarray | None = None,
) -> Panel:
    """Measured (wide, grey) with the estimate (thin, blue) over it; ``sd`` adds a band of two standard deviations.

    A band that would press the line flat is not drawn; the note says how wide it is. Where the estimate is ``derived``
    (T,) bool from the motion the line is dashed, without a band.
    """
    if sd is not None and derived is not None:
        sd = np.where(derived, np.nan, sd)
    figure, axes = new_axes()
    if measured is not None:
        axes.plot(*thin(time, measured), color=MEASURED, linewidth=2.6, solid_capstyle="round")
    if sd is not None and band_is_too_wide(estimated, sd):
        note = f"{note}, 2 sd {number(2.0 * float(np.nanmedian(sd)), unit, digits=2)}"
    elif sd is not None:
        t, low = thin(time, estimated - 2.0 * sd)
        high = np.interp(t, time, estimated + 2.0 * sd)
        axes.fill_between(t, low, high, color=ESTIMATED, alpha=0.18, linewidth=0)
    draw_sourced(axes, time, estimated, derived, color=ESTIMATED, linewidth=1.1)
    axes.set_xlim(float(time[0]), float(time[-1]))
    axes.margins(y=0.08)
    _keep_apart(axes, estimated)
    axes.set_xlabel("time, s")
    axes.set_ylabel(unit)
    axes.yaxis.set_label_coords(-0.155, 0.5)
    return Panel(title, note, to_svg(figure, key, f"{title} in {unit} over time"))


def band_is_too_wide(values: np.ndarray, sd: np.ndarray) -> bool:
    """Whether a band of two standard deviations hides how the values move; what is NaN has no band."""
    if not np.isfinite(sd).any() or not np.isfinite(values).any():
        return False
    return bool(2.0 * np.nanmedian(sd) > max(0.6 * float(np.nanmax(values) - np.nanmin(values)), 1e-12))


def parameter_path(
    key: str,
    title: str,
    unit: str,
    time: np.ndarray,
    path: np.ndarray,
    *,
    lower: float | None,
    upper: float | None,
    sd: np.ndarray,
    note: str = "",
) -> Panel:
    """A parameter over time between its bounds, which are labelled with their values."""
    figure, axes = new_axes()
    t, values = thin(time, path)
    band = 2.0 * np.interp(t, time, sd)
    low, high = (-np.inf if lower is None else lower), (np.inf if upper is None else upper)
    axes.fill_between(
        t,
        np.clip(values - band, low, high),
        np.clip(values + band, low, high),
        color=ESTIMATED,
        alpha=0.18,
        linewidth=0,
    )
    axes.plot(t, values, color=ESTIMATED, linewidth=1.3)
    axes.set_xlim(float(time[0]), float(time[-1]))
    for bound, word, on_top in ((lower, "lower bound", False), (upper, "upper bound", True)):
        if bound is None:
            continue
        axes.axhline(bound, color=LIMIT, linewidth=1.0, linestyle=(0, (5, 3)))
        axes.annotate(
            f"{word} {bound:.3g} {unit}",
            (0.99, bound),
            xycoords=("axes fraction", "data"),
            xytext=(0, 3 if on_top else -3),
            textcoords="offset points",
            ha="right",
            va="bottom" if on_top else "top",
            color=LIMIT,
            fontsize=7.5,
        )
    axes.margins(y=0.2)  # room for the words beyond the bounds
    axes.set_xlabel("time, s")
    axes.set_ylabel(unit)
    axes.yaxis.set_label_coords(-0.155, 0.5)
    return Panel(title, note, to_svg(figure, key, f"{title} in {unit} over time, with its bounds"))


def rms_bars(key: str, rms: dict[str, float | None], most: float | None = None) -> Panel:
    """RMS distance of each marker as labelled bars, in the order given; ``most`` fills the width, else the largest."""
    names = [name for name, value in rms.items() if value is not None]
    values = [value for value in rms.values() if value is not None]
    figure, axes = new_axes(4.3, 0.42 + 0.2 * len(names), fitted=True)
    places = np.arange(len(names))[::-1]
    most = most or max(values, default=1.0)
    decimals = 1 if most >= 1.0 else 2
    axes.barh(places, values, color=ESTIMATED, height=0.62)
    for place, value in zip(places, values, strict=True):
        axes.annotate(
            f"{value:.{decimals}f} mm",
            (value, place),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            color=INK,
            fontsize=8,
        )
    axes.set_yticks(places, names, color=INK)
    axes.set_xlim(0.0, 1.18 * most or 1.0)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.grid(False)
    axes.set_xticks([])
    axes.spines["bottom"].set_visible(False)
    return Panel(
        "RMS distance of each marker", "estimated against measured, mm", to_svg(figure, key, "RMS of each marker, mm")
    )


def plane_paths(key: str, names: list[str], measured: np.ndarray, estimated: np.ndarray, moved_from: int = 0) -> Panel:
    """Paths of the markers in the sagittal plane, (T, M, 2) m, each labelled where it starts."""
    figure, axes = new_axes(4.3, 4.6, fitted=True)
    step = max(1, len(measured) // 400)
    for index in range(len(names)):
        axes.plot(*measured[::step, index].T, color=MEASURED, linewidth=3.0, solid_capstyle="round")
        axes.plot(*estimated[::step, index].T, color=ESTIMATED, linewidth=1.0)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(True, axis="both")
    axes.set_xlabel("forward, m")
    axes.set_ylabel("up, m")
    _label_paths(axes, names, estimated[moved_from])
    return Panel("Paths in the sagittal plane", "seen from the right", to_svg(figure, key, "Marker paths in the plane"))


def _label_paths(axes: Axes, names: list[str], start: np.ndarray) -> None:
    """Names in one column to the right, in the order of their heights and never closer than a line of text."""
    seen = np.flatnonzero(np.isfinite(start).all(axis=1))
    if not len(seen):
        return
    order = seen[np.argsort(start[seen, 1])]
    low, high = axes.get_ylim()
    gap = 0.036 * (high - low)
    heights = start[order, 1].copy()
    for k in range(1, len(heights)):
        heights[k] = max(heights[k], heights[k - 1] + gap)
    for index, height in zip(order, heights, strict=True):
        axes.annotate(
            names[index],
            (start[index, 0], start[index, 1]),
            xytext=(1.02, height),
            textcoords=("axes fraction", "data"),
            va="center",
            color=INK,
            fontsize=7.5,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": QUIET, "linewidth": 0.4, "alpha": 0.6, "shrinkA": 1, "shrinkB": 0},
        )


def _keep_apart(axes: Axes, values: np.ndarray) -> None:
    """A line that hardly moves is not blown up to fill its panel with noise."""
    finite = values[np.isfinite(values)]
    if len(finite) and np.ptp(finite) < 1e-9 * max(1.0, float(np.abs(finite).max())):
        middle = float(finite[0])
        axes.set_ylim(middle - 1.0, middle + 1.0)
