"""The markers: how far each is from where it was measured, and how far it moves on its segment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dynakin.report.bars import Bar, value_bars
from dynakin.report.chart import Line, Panel, chart
from dynakin.report.labels import short_marker_names
from dynakin.report.sections.forces import DIRECTIONS
from dynakin.report.sections.section import Page, Section
from dynakin.report.styles import ESTIMATED, ESTIMATED_LINE, INK, MEASURED, MEASURED_LINE, QUIET, LineStyle
from dynakin.report.text_tables import TextTable
from dynakin.results.estimate import AXES
from dynakin.results.naming import number, words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_AXIS_COLOURS = {"x": "#0072B2", "y": "#009E73", "z": "#CC79A7"}


def marker_section(page: Page) -> Section | None:
    """RMS a marker, each over time, and in a plane their paths."""
    if page.metrics["markers"] is None:
        return None
    names = short_marker_names(page.estimate.marker_names)
    rms = {names[name]: value for name, value in page.metrics["markers"]["rms_mm"].items()}
    measured, estimated = (page.estimate.values(f"markers_{kind}") for kind in ("measured", "estimated"))
    window = page.metrics["window"]
    span = f"between {window['start_s']:.4g} and {window['end_s']:.4g} s."
    if page.planar:
        return Section(
            "markers",
            "Markers",
            f"Root mean square distance {span} In the plane of the model.",
            wide=[
                _rms_bars("RMS distance of each marker", rms),
                _plane_paths(list(names.values()), measured[:, :, :2], estimated[:, :, :2]),
            ],
            folded=_over_time(page, measured, estimated),
            folded_title="Every marker over time",
            lines=(MEASURED_LINE, ESTIMATED_LINE),
        )
    order = sorted(rms, key=lambda name: -(rms[name] or 0.0))
    half = -(-len(order) // 2)
    most = max((value for value in rms.values() if value is not None), default=None)
    return Section(
        "markers",
        "Markers",
        f"Root mean square distance in space {span} Where soft tissue is estimated, an estimated marker holds its "
        "displacement: how far each moves on its segment says how well a rigid body fits.",
        wide=[
            _rms_bars(f"RMS distance, {what}", {name: rms[name] for name in part}, most)
            for what, part in (("largest first", order[:half]), ("continued", order[half:]))
            if part
        ],
        folded=_differences(page, 1000.0 * (estimated - measured), rms),
        folded_title="Every marker over time: estimated less measured",
        lines=tuple(LineStyle(DIRECTIONS[axis], _AXIS_COLOURS[axis], 1.2) for axis in AXES),
        tables=[table for table in (_displacements(page),) if table.rows],
    )


def _over_time(page: Page, measured: np.ndarray, estimated: np.ndarray) -> list[Panel]:
    names = short_marker_names(page.estimate.marker_names)
    return [
        chart(
            f"{names[name]}, {DIRECTIONS[axis]}",
            "mm",
            page.estimate.time,
            [Line(1000.0 * measured[:, k, i], MEASURED, 2.6), Line(1000.0 * estimated[:, k, i], ESTIMATED, 1.1)],
        )
        for k, name in enumerate(page.estimate.marker_names)
        for i, axis in enumerate(AXES)
        if page.estimate.modelled_axes()[i]
    ]


def _differences(page: Page, difference: np.ndarray, rms: dict[str, float | None]) -> list[Panel]:
    names = short_marker_names(page.estimate.marker_names)
    return [
        chart(
            names[name],
            "mm",
            page.estimate.time,
            [Line(difference[:, k, i], _AXIS_COLOURS[axis], 0.9) for i, axis in enumerate(AXES)],
            note="RMS " + number(rms[names[name]], "mm"),
            least_range=10.0,
        )
        for k, name in enumerate(page.estimate.marker_names)
    ]


def _displacements(page: Page) -> TextTable:
    names, carriers = short_marker_names(page.estimate.marker_names), page.estimate.marker_segments
    found = (page.metrics["soft_tissue"] or {"markers": {}})["markers"]
    rows = [
        (
            names.get(name, name),
            words(carriers.get(name, "")),
            *(number(found[name][f"{key}_mm"], digits=2) for key in ("rms", "max", "expected")),
        )
        for name in sorted(found, key=lambda name: -(found[name]["max_mm"] or 0.0))
    ]
    headings = ("marker", "segment", "RMS, mm", "largest, mm", "usual, mm")
    return TextTable("Movement of each marker on its segment", headings, rows, (2, 3, 4), folded=True)


def _rms_bars(title: str, rms: dict[str, float | None], most: float | None = None) -> Panel:
    """RMS distance of each marker as labelled bars, in the order given; ``most`` fills the width, else the largest."""
    known = {name: value for name, value in rms.items() if value is not None}
    most = most or max(known.values(), default=1.0)
    decimals = 1 if most >= 1.0 else 2
    bars = [Bar(name, value, f"{value:.{decimals}f} mm") for name, value in known.items()]
    return value_bars(title, "estimated against measured, mm", bars, most, "RMS of each marker, mm")


def _plane_paths(names: list[str], measured: np.ndarray, estimated: np.ndarray) -> Panel:
    """Paths of the markers in the sagittal plane, (T, M, 2) m, each labelled where it starts."""
    from dynakin.report.figure import new_axes, to_svg  # Matplotlib: only a planar model's page waits

    figure, axes = new_axes()
    step = max(1, len(measured) // 400)
    for index in range(len(names)):
        axes.plot(*measured[::step, index].T, color=MEASURED, linewidth=3.0, solid_capstyle="round")
        axes.plot(*estimated[::step, index].T, color=ESTIMATED, linewidth=1.0)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(True, axis="both")
    axes.set_xlabel("forward, m")
    axes.set_ylabel("up, m")
    _label_paths(axes, names, estimated[0])
    return Panel(
        "Paths in the sagittal plane", "seen from the right", to_svg(figure, "paths", "Marker paths in the plane")
    )


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
