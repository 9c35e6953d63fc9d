"""Figures 4 to 7 of the paper: markers over a cycle, joint angles, wrench, knee moment; all moments, and mean
curves."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Patch

from dynakin.report.body import chain_of, painted
from dynakin.report.chart import Line, band_is_too_wide, value_range
from dynakin.report.figure import Figure, draw_sourced
from dynakin.report.labels import COMPONENT_LABELS, moment_note
from dynakin.report.sections.repetitions import (
    ONE_SD,
    Plot,
    curve_unit,
    drawn,
    kind_of,
    least_range,
    note_of,
    percent_label,
    plots_by_method,
    side_plots,
)
from dynakin.report.sides import Joint, joints_of, normalising_mass, side_lines
from dynakin.report.styles import BAND, ESTIMATED, INK, MEASURED, QUIET, LineStyle, method_styles, source_key
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import ways_of
from dynakin.results.measures.fit import signal_fit
from dynakin.results.measures.mean_curves import PERCENT, estimate_curves
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.measures.pressure import floor_height
from dynakin.results.measures.repetitions import repetitions_of
from dynakin.results.measures.sources import moment_sources, wrench_sources
from dynakin.results.naming import number, sentence, words
from dynakin.units import COMPONENTS
from dynakin.validation.differences import angle_differences, moment_differences
from dynakin.validation.methods import AT, CLASSICAL, ComparedTrial, Method

_PICTURES = 6


def markers_figure(estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure | None:
    """Figure 4: the stick figure and the markers, measured (hollow) and estimated (filled), over one cycle."""
    cycle = middle_cycle(estimate)
    frames = np.linspace(cycle.start, cycle.stop - 1, _PICTURES).astype(int)
    chain, carriers = chain_of(estimate), estimate.marker_segments
    colours, key = painted(estimate, chain)
    measured = estimate.values("markers_measured")[:, :, :2]
    estimated = estimate.values("markers_estimated")[:, :, :2]
    paint = [colours.get(carriers.get(name, ""), INK) for name in estimate.marker_names]
    shown = np.concatenate([measured[frames], estimated[frames], chain.points[frames][:, :, :2]], axis=1)
    width = max(float(np.nanmax(shown[k, :, 0]) - np.nanmin(shown[k, :, 0])) for k in range(_PICTURES))
    floor = floor_height(estimate)
    figure = Figure(figsize=(7.2, 3.1), layout="constrained")
    axes = figure.add_subplot()
    for place, frame in enumerate(frames):
        middle = 0.5 * (np.nanmax(shown[place, :, 0]) + np.nanmin(shown[place, :, 0]))
        moved = np.array([1.22 * width * place - middle, 0.0])
        lines = [chain.points[frame][[b.start, b.end], :2] + moved for b in chain.bones]
        axes.add_collection(LineCollection(lines, colors=[colours[b.segment] for b in chain.bones], linewidths=3.2))
        (x, y), seen = (estimated[frame] + moved).T, (measured[frame] + moved).T
        axes.scatter(x, y, s=11, c=paint, zorder=3, linewidths=0)
        axes.scatter(seen[0], seen[1], s=26, facecolors="none", edgecolors=INK, linewidths=0.7, zorder=4)
        text = f"{estimate.time[frame]:.2f} s"
        axes.text(1.22 * width * place, floor - 0.09, text, ha="center", va="top", color=QUIET)
    span = (-0.62 * width, (1.22 * (_PICTURES - 1) + 0.62) * width)
    axes.plot(span, [floor, floor], color="#b8c0c8", linewidth=1.0, zorder=0)
    axes.plot([span[0], span[0] + 0.5], [floor - 0.32] * 2, color=QUIET, linewidth=1.6)
    axes.text(span[0] + 0.55, floor - 0.32, "0.5 m", va="center", color=QUIET)
    axes.set_aspect("equal")
    axes.set_xlim(span)
    axes.set_ylim(floor - 0.42, float(np.nanmax(shown[:, :, 1])) + 0.08)
    axes.axis("off")
    whose = "segment" if estimate.planar else "side"
    axes.set_title(f"Markers over one cycle: measured (hollow) and estimated (filled, in the {whose}’s colour)")
    letters = sum(len(name) + 4 for name in key)
    at, step = span[0] + 1.0, (span[1] - span[0] - 1.0) / max(letters, 60)
    for name, colour in key.items():
        axes.text(at, floor - 0.32, name, color=colour, va="center", weight="bold")
        at += (len(name) + 4) * step
    return figure


def angles_figure(estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure | None:
    """Figure 5: every free coordinate with its band, right and left over each other, with the classical method's."""
    values, sd = estimate.known("coordinates"), estimate.values("coordinates_sd")
    joints = [joint for joint in joints_of(estimate) if np.any(sd[:, list(joint.columns.values())])]
    if not joints:
        return None
    styles, alone = side_lines(estimate), estimate.planar
    classical = _reference(comparison, CLASSICAL) if alone else None
    differences = {row.coordinate: row for row in angle_differences([] if comparison is None else [comparison])}
    figure, every = _grid(len(joints), 1.75 if alone else 1.55)
    for axes, joint in zip(every, joints, strict=False):
        factor, unit = (180.0 / np.pi, "deg") if joint.rotation else (1000.0, "mm")
        notes = []
        for side, k in joint.columns.items():
            own, half, colour = factor * values[:, k], 2.0 * factor * sd[:, k], styles[side].colour
            if classical is not None:
                _draw(axes, estimate.time, factor * classical.coordinates[:, k], classical, zorder=3)
                if found := differences.get(joint.stem):  # none where both hold it still
                    notes.append(f"RMS difference {number(found.rms.mean, unit)}")
            axes.plot(estimate.time, own, color=colour, linewidth=1.2)
            wide = band_is_too_wide(own, 0.5 * half)  # it would press the line flat
            if not wide:
                axes.fill_between(estimate.time, own - half, own + half, color=colour, alpha=0.18, linewidth=0)
            usual = float(np.nanmedian(half)) if np.isfinite(half).any() else np.nan
            if alone:
                notes.append(f"2 sd: {number(usual, unit, digits=2)}{' (too wide)' if wide else ''}")
            elif wide:
                notes.append(f"({styles[side].label} 2 sd: {number(usual, digits=2)})".replace("( ", "("))
        if alone:
            axes.margins(y=0.12)
            axes.set_xlabel("\n".join(notes))
        _title(axes, (f"{joint.title}, {unit}", *(() if alone else notes)), 32)
        axes.set_xlim(float(estimate.time[0]), float(estimate.time[-1]))
    figure.supxlabel("time, s", fontsize=8, color=QUIET)
    if alone:
        _key(figure, every[0], [_EKF, *_styles(classical)], band=ESTIMATED)
    else:
        _key(figure, every[0], _side_styles(estimate, joints), band=QUIET)
    return figure


def moments_figure(estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure | None:
    """Every joint's moment with its band, right and left over each other: derived values dashed, priors dotted.

    Args:
        comparison: not drawn; Figure 7 has the table's moments.
    """
    moments, source, styles = estimate.values("moments"), moment_sources(estimate.data), side_lines(estimate)
    sd = estimate.values("moments_sd") if "moments_sd" in estimate.data else np.full_like(moments, np.nan)
    has = np.isfinite(moments).any(axis=0)
    joints = [
        replace(joint, columns={side: k for side, k in joint.columns.items() if has[k]})
        for joint in joints_of(estimate)
        if joint.region != "Whole body" and has[list(joint.columns.values())].any()
    ]
    if not joints:
        return None
    figure, every = _grid(len(joints), 1.6)
    ways, names = ways_of(estimate), estimate.coordinate_names
    for axes, joint in zip(every, joints, strict=False):
        lines = [Line(moments[:, k], "", sd=sd[:, k], source=source[:, k]) for k in joint.columns.values()]
        for side, k in joint.columns.items():
            moment, half, colour = moments[:, k], 2.0 * sd[:, k], styles[side].colour
            draw_sourced(axes, estimate.time, moment, source[:, k], color=colour, linewidth=1.2)
            axes.fill_between(estimate.time, moment - half, moment + half, color=colour, alpha=0.18, linewidth=0)
        title = joint.name + ways[k] if joint.rotation else f"{joint.name}, N"
        _title(axes, (title, moment_note(estimate, names[k])), 24)
        axes.set_ylim(value_range(lines, 0.02 * (normalising_mass(estimate) or 1.0)))
        axes.set_xlim(float(estimate.time[0]), float(estimate.time[-1]))
    figure.supxlabel("time, s", fontsize=8, color=QUIET)
    figure.supylabel("moment, N m", fontsize=8, color=QUIET)
    shown = [k for joint in joints for k in joint.columns.values()]
    _key(figure, every[0], [*_side_styles(estimate, joints), *source_key(source[:, shown])], band=QUIET)
    return figure


def _grid(panels: int, height: float) -> tuple[Figure, np.ndarray]:
    """A page's width of so many panels, rows of so many inches; what is left over in the last row is empty."""
    columns = min(4, panels)
    rows = -(-panels // columns)
    figure = Figure(figsize=(7.2, 0.5 + height * rows), layout="constrained")
    every = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in every[panels:]:
        axes.set_visible(False)
    return figure, every


def _title(axes: Axes, texts: Sequence[str], letters: int) -> None:
    """Lines of so many letters, as the panel holds; what is in brackets stays together."""
    whole = [re.sub(r"\(.*\)", lambda found: found[0].replace(" ", "\xa0"), text) for text in texts if text]
    lines = "\n".join(textwrap.fill(text, letters) for text in whole)
    axes.set_title(lines.replace("\xa0", " "), fontsize=7.5)


def _side_styles(estimate: Estimate, joints: Sequence[Joint]) -> list[LineStyle]:
    """The sides that these joints have, as a key names them."""
    styles = side_lines(estimate)
    sides = dict.fromkeys(side for joint in joints for side in joint.columns)
    return [replace(styles[side], label=styles[side].label or "middle", width=1.4) for side in sides]


def wrench_figure(estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure | None:
    """Figure 6: the wrench as measured, estimated, and from the table and classical angles ("AT")."""
    measured, estimated = (estimate.values(f"wrench_{kind}") for kind in ("measured", "estimated"))
    shown = [k for k in range(len(COMPONENTS)) if np.isfinite(estimated[:, k]).any()]
    if not shown:
        return None
    at = _reference(comparison, AT)
    source = wrench_sources(estimate.data)
    figure = Figure(figsize=(7.2, 0.5 + 1.35 * len(shown)), layout="constrained")
    every = figure.subplots(len(shown), 1, sharex=True, squeeze=False).ravel()
    window = evaluation_window(estimate.time)
    for axes, k in zip(every, shown, strict=True):
        title, unit = COMPONENT_LABELS[COMPONENTS[k]]
        axes.plot(estimate.time, measured[:, k], color=MEASURED, linewidth=2.8, solid_capstyle="round")
        if at is not None:
            _draw(axes, estimate.time, at.wrench[:, k], at)
        draw_sourced(axes, estimate.time, estimated[:, k], source[:, k], color=ESTIMATED, linewidth=1.0)
        rms = [f"EKF {number(signal_fit(measured[window, k], estimated[window, k]).rms, unit)}"]
        if at is not None:
            rms.append(f"AT {number(signal_fit(measured[window, k], at.wrench[window, k]).rms, unit)}")
        axes.set_title(f"{title} {COMPONENTS[k]}, {unit}")
        if np.isfinite(measured[:, k]).any():
            axes.set_title(f"RMS difference: {', '.join(rms)}", loc="right", color=QUIET, weight="normal", fontsize=8)
        axes.set_xlim(float(estimate.time[0]), float(estimate.time[-1]))
    every[-1].set_xlabel("time, s")
    marked = _source_key(source[:, shown])
    _key(figure, every[0], [LineStyle("measured", MEASURED, 2.8), _EKF, *marked, *_styles(at)])
    return figure


def knee_moment_figure(estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure | None:
    """Figure 7: the moment about each knee, estimated, and from the table and classical angles ("AT")."""
    moments, names = estimate.values("moments"), estimate.coordinate_names
    free = sorted(k for joint in joints_of(estimate) for k in joint.columns.values())
    knees = [k for k in free if "knee" in names[k] and np.isfinite(moments[:, k]).any()]
    if not knees:
        return None
    source = moment_sources(estimate.data)
    figure = Figure(figsize=(4.6, 0.5 + 2.3 * len(knees)), layout="constrained")
    every = figure.subplots(len(knees), 1, sharex=True, squeeze=False).ravel()
    at = _reference(comparison, AT)
    differences = {row.coordinate: row for row in moment_differences([] if comparison is None else [comparison])}
    for axes, k in zip(every, knees, strict=True):
        name, moment = names[k], moments[:, k]
        draw_sourced(axes, estimate.time, moment, source[:, k], color=ESTIMATED, linewidth=1.2)
        if "moments_sd" in estimate.data:
            sd = estimate.values("moments_sd")[:, k]
            axes.fill_between(estimate.time, moment - 2.0 * sd, moment + 2.0 * sd, color=ESTIMATED, alpha=0.2, lw=0)
        note = moment_note(estimate, name)
        axes.set_title(f"{sentence(words(name))} moment, N m{f' ({note})' if note else ''}")
        if at is not None:
            _draw(axes, estimate.time, at.moments[:, k], at)
            row = differences[name]
            axes.set_xlabel(
                f"time, s\nRMS difference {number(row.rms.mean, 'N m')}, "
                f"{number(row.nrms_rms_percent.mean, digits=2)} % of AT’s RMS"
            )
        else:
            axes.set_xlabel("time, s")
        axes.set_xlim(float(estimate.time[0]), float(estimate.time[-1]))
    _key(figure, every[0], [_EKF, *_source_key(source[:, knees]), *_styles(at)])
    return figure


def middle_cycle(estimate: Estimate) -> slice:
    """Frames of the middle repetition; the whole recording where nothing repeats."""
    found = repetitions_of(estimate).items
    if not found:
        return slice(0, len(estimate.time))
    middle = found[len(found) // 2]
    return slice(middle.first, middle.last + 1)


def _reference(comparison: ComparedTrial | None, kind: str) -> Method | None:
    methods = [] if comparison is None else comparison.of_kind(kind)
    return methods[0] if methods else None


def _draw(axes: Axes, time: np.ndarray, values: np.ndarray, method: Method, zorder: float = 2.0) -> None:
    style = _style(method)
    axes.plot(time, values, color=style.colour, linewidth=style.width, linestyle=style.pattern, zorder=zorder)


def _style(method: Method) -> LineStyle:
    return method_styles([method.name])[method.name]


def _styles(method: Method | None) -> list[LineStyle]:
    return [] if method is None else [_style(method)]


_EKF = LineStyle("EKF", ESTIMATED, 1.4)


def _source_key(source: np.ndarray) -> list[LineStyle]:
    return [replace(line, colour=ESTIMATED, width=1.4) for line in source_key(source)]


def _key(
    figure: Figure,
    axes: Axes,
    styles: Sequence[LineStyle],
    *,
    band: str = "",
    what: str = BAND,
    columns: int = 4,
) -> None:
    """One line of words above the panels, each with the line that it names; ``band``: its colour."""
    handles: list[Artist] = []
    for style in styles:
        handles += axes.plot(
            [], [], color=style.colour, linewidth=style.width, linestyle=style.pattern, label=style.label
        )
    if band:
        handles.append(Patch(color=band, alpha=0.18, linewidth=0, label=what))
    figure.legend(handles=handles, loc="outside upper left", ncols=columns, borderaxespad=0.2, columnspacing=1.6)


_COLUMNS = 3


def repetitions_figure(
    estimate: Estimate, comparison: ComparedTrial | None = None, *, kind: str = "angles"
) -> Figure | None:
    """Joint angles, moments or wrench over 0 to 100 % of a repetition: mean, and one standard deviation as a band.

    As in the report: in a plane by method, in space legs and trunk, right and left over each other. Left out is what
    moves by less than a panel's axis spans at least (`least_range`).

    Args:
        kind: one of `KINDS`.
    """
    curves = estimate_curves(estimate) if comparison is None else comparison.curves()
    every = plots_by_method(estimate, curves) if estimate.planar else side_plots(estimate, curves)[0][kind]
    plots = [plot for plot in every if kind_of(plot.curves[0][1]) == kind and _shows(plot)]
    if not plots:
        return None
    rows = -(-len(plots) // _COLUMNS)
    figure = Figure(figsize=(7.2, 0.55 + 1.5 * rows), layout="constrained")
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for axes in panels[len(plots) :]:
        axes.set_visible(False)
    for plot, axes in zip(plots, panels, strict=False):
        _mean_curves(axes, plot)
        _title(axes, (plot.title, note_of(estimate, plot.curves[0][1])), 28)
    shown = [curve for plot in plots for _, curve in plot.curves]
    most = [int(curve.n.max()) for curve in shown]
    n, least = max(most), min(most)
    of = f"n = {n}" if least == n else f"n = {least} to {n}"
    figure.supxlabel(f"{percent_label(shown[0].movement)}, {of}", fontsize=8, color=QUIET)
    styles = {style.label: style for plot in plots for style, _ in plot.curves}
    named = (*(label for label in side_lines(estimate) if label in styles), *styles)
    key = [replace(styles[label], label=label or "middle") for label in dict.fromkeys(named)]
    _key(figure, panels[0], key, band=_band_colour(key) if n > 1 else "", what=ONE_SD, columns=5)
    return figure


def _band_colour(styles: Sequence[LineStyle]) -> str:
    """The one that has a band; where several have, none of theirs."""
    colours = {style.colour for style in styles if style.band}
    return colours.pop() if len(colours) == 1 else QUIET


def _shows(plot: Plot) -> bool:
    """Whether any of its curves moves by more than the panel's axis spans at least."""
    least = least_range(plot.curves[0][1])
    return any(
        np.nanmax(mean) - np.nanmin(mean) >= least for mean, _ in (drawn(c) for _, c in plot.curves if c.n.any())
    )


def _mean_curves(axes: Axes, plot: Plot) -> None:
    for style, curve in plot.curves:
        mean, sd = drawn(curve)
        axes.plot(PERCENT, mean, color=style.colour, linewidth=style.width, linestyle=style.pattern)
        if style.band:
            axes.fill_between(PERCENT, mean - sd, mean + sd, color=style.colour, alpha=0.2, linewidth=0)
    axes.set_xlim(0.0, 100.0)
    axes.set_xticks([0, 25, 50, 75, 100])
    axes.margins(y=0.1)
    axes.set_ylabel(curve_unit(plot.curves[0][1]), fontsize=7.5)
