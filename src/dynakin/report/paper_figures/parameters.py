"""Figures 8 and 9 of the paper: how lengths, masses and inertias settle, each segment in its colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from dynakin.report.body import colours_of
from dynakin.report.figure import Figure
from dynakin.report.labels import signed_percent
from dynakin.report.styles import LIMIT, QUIET, thin
from dynakin.results.estimate import Estimate
from dynakin.results.naming import listed, number, shown_unit, words
from dynakin.results.records import Parameter
from dynakin.validation.methods import ComparedTrial

_PANEL_IN = 2.35
_LABEL_PT = 7.5
_INERTIAS = {f"i{a}{b}": f"{a}{b}" for a, b in ("xx", "yy", "zz")}


def lengths_and_masses_figure(estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure | None:
    """Figure 8: change of each segment's length and mass from its start, in per cent, with its band and bounds."""
    groups = {
        "Segment lengths": [p for p in estimate.parameters if p.kind == "length" and p.estimated],
        "Segment masses": [p for p in _inertial(estimate) if p.name.endswith("/mass")],
    }
    return _figure(estimate, groups)


def inertias_figure(estimate: Estimate, comparison: ComparedTrial | None = None) -> Figure | None:
    """Figure 9: change of each estimated moment of inertia, about the segment's origin, in per cent.

    Products of inertia start close to zero: a change in per cent of them says nothing, so they are left out.
    """
    groups = {
        f"Moments of inertia {label}": [p for p in _inertial(estimate) if p.name.endswith(f"/{key}")]
        for key, label in _INERTIAS.items()
    }
    return _figure(estimate, groups)


def _inertial(estimate: Estimate) -> list[Parameter]:
    return [p for p in estimate.parameters if p.kind == "inertia" and p.estimated]


def _figure(estimate: Estimate, groups: dict[str, list[Parameter]]) -> Figure | None:
    groups = {title: kept for title, every in groups.items() if (kept := [p for p in every if p.initial != 0.0])}
    if not groups:
        return None
    figure = Figure(figsize=(7.2, 0.35 + (_PANEL_IN + 0.65) * len(groups)), layout="constrained")
    for axes, (title, parameters) in zip(
        figure.subplots(len(groups), 1, squeeze=False).ravel(), groups.items(), strict=True
    ):
        _changes(axes, estimate, parameters)
        axes.set_title(f"{title}, change from the start in %; at the end with ± 2 standard deviations")
        axes.set_xlabel("time, s")
    return figure


def _changes(axes: Axes, estimate: Estimate, parameters: list[Parameter]) -> None:
    colours, labels = colours_of(estimate), []
    bounds: list[tuple[float, Parameter]] = []
    reached = 1.0
    changes: list[tuple[Parameter, np.ndarray, np.ndarray, np.ndarray]] = []
    for p in parameters:
        scale = 100.0 / abs(p.initial)
        path = estimate.data["state"].sel(element=p.name).values
        sd = np.hypot(estimate.data["state_sd"].sel(element=p.name).values, p.skin_sd)
        time, change = thin(estimate.time, scale * (path - p.initial))
        half = 2.0 * scale * np.interp(time, estimate.time, sd)
        changes.append((p, time, change, half))
        reached = max(reached, float(np.nanmax(np.abs(change))))
    for p, time, change, half in changes:
        scale = 100.0 / abs(p.initial)
        low, high = (-np.inf if p.lower is None else p.lower), (np.inf if p.upper is None else p.upper)
        colour = colours[p.segment]
        if np.median(half) < reached:  # a band that fills the panel shows nothing; the label has its number
            axes.fill_between(
                time,
                np.maximum(change - half, scale * (low - p.initial)),
                np.minimum(change + half, scale * (high - p.initial)),
                color=colour,
                alpha=0.1,
                linewidth=0,
            )
        axes.plot(time, change, color=colour, linewidth=1.4)
        bounds += [(scale * (bound - p.initial), p) for bound in (p.lower, p.upper) if bound is not None]
        labels.append((_label(p), float(change[-1]), colour))
    axes.set_xlim(float(estimate.time[0]), float(estimate.time[-1]))
    axes.set_ylim(-1.18 * reached, 1.18 * reached)
    _draw_bounds(axes, [(bound, p) for bound, p in bounds if abs(bound) <= 1.05 * reached])
    axes.axhline(0.0, color=QUIET, linewidth=0.6)
    _label_ends(axes, labels)


def _draw_bounds(axes: Axes, bounds: Sequence[tuple[float, Parameter]]) -> None:
    """Dashed lines; those that lie so near each other that their words would overprint have one label. Call it after
    the limits are set."""
    low, high = axes.get_ylim()
    gap = 1.6 * _LABEL_PT / 72.0 / _PANEL_IN * (high - low)
    near: list[list[tuple[float, Parameter]]] = []
    for bound, p in sorted(bounds, key=lambda each: each[0]):
        axes.axhline(bound, color=LIMIT, linewidth=0.9, linestyle=(0, (5, 3)))
        if near and bound - near[-1][0][0] < gap:
            near[-1].append((bound, p))
        else:
            near.append([(bound, p)])
    for group in near:
        up = group[0][0] > 0.0
        ends = dict.fromkeys(f"{bound:+z.0f}".replace("-", "−") for bound in (group[0][0], group[-1][0]))
        whose = listed(list(dict.fromkeys(words(p.segment) for _, p in group)), 4)
        axes.annotate(
            f"bound {' to '.join(ends)} %: {whose}",
            (0.01, group[-1 if up else 0][0]),
            xycoords=("axes fraction", "data"),
            xytext=(0, 2 if up else -2),
            textcoords="offset points",
            va="bottom" if up else "top",
            color=LIMIT,
            fontsize=7,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5},
        )


def _label(p: Parameter) -> str:
    change = signed_percent(p.change_percent() or 0.0)
    factor, unit = shown_unit(p.unit)
    band = number(2.0 * factor * p.sd, unit, digits=2)
    return f"{words(p.segment)} {number(factor * p.value)} ± {band} ({change})"


def _label_ends(axes: Axes, labels: Sequence[tuple[str, float, str]]) -> None:
    """Write (text, y in data, colour) to the right of the axes, pushed apart; call it after the limits are set."""
    low, high = axes.get_ylim()
    gap = 1.25 * _LABEL_PT / 72.0 / _PANEL_IN  # of the axes' height
    wanted = np.array([(y - low) / (high - low) for _, y, _ in labels])
    for (text, _, colour), y, start in zip(labels, spread(wanted, gap), wanted, strict=True):
        axes.annotate(
            text,
            (1.0, float(np.clip(start, 0.0, 1.0))),
            xycoords="axes fraction",
            xytext=(1.05, y),
            textcoords="axes fraction",
            va="center",
            color=colour,
            fontsize=_LABEL_PT,
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": colour,
                "linewidth": 0.5,
                "shrinkA": 1,
                "shrinkB": 0,
                "relpos": (0.0, 0.5),
            },
        )


def spread(wanted: np.ndarray, gap: float) -> np.ndarray:
    """Places as near as they get to ``wanted`` that keep their order and are at least ``gap`` apart."""
    order = np.argsort(np.round(wanted / gap, 2), kind="stable")  # those at one place stay in the order given
    groups = [(float(wanted[k]), 1) for k in order]  # middle, members
    merged: list[tuple[float, int]] = []
    for group in groups:
        merged.append(group)
        while len(merged) > 1 and merged[-1][0] - merged[-2][0] < 0.5 * gap * (merged[-1][1] + merged[-2][1]):
            (b, n), (a, m) = merged.pop(), merged.pop()
            merged.append(((a * m + b * n) / (m + n), m + n))
    placed = np.empty_like(wanted)
    at = 0
    for middle, members in merged:
        placed[order[at : at + members]] = middle + gap * (np.arange(members) - 0.5 * (members - 1))
        at += members
    return placed
