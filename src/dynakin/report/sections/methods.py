"""A trial by several methods: Table II, the wrench, angles and moments (the paper's Figures 5 to 7) as sections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from dynakin.report.chart import Line, Panel, chart
from dynakin.report.labels import COMPONENT_LABELS, moment_note
from dynakin.report.sections.section import Page, Section
from dynakin.report.styles import LineStyle, method_styles, source_key
from dynakin.report.text_tables import table2_text
from dynakin.results.measures.angles import reported
from dynakin.results.measures.mean_curves import MEASURED
from dynakin.results.measures.sources import moment_sources, wrench_sources
from dynakin.results.naming import number, sentence, words
from dynakin.units import COMPONENTS
from dynakin.validation.differences import AngleDifference, MomentDifference, angle_differences, moment_differences
from dynakin.validation.methods import AT, CLASSICAL, ComparedTrial
from dynakin.validation.reference.inverse_dynamics import INVERSE
from dynakin.validation.table2 import Spread, table2

_Difference = TypeVar("_Difference", AngleDifference, MomentDifference)
ABOUT_TABLE2 = (
    "How far each method is from what was measured. The filter was given these markers and plates, so its small "
    "figures say that it follows them, not that its state is right; the others’ wrenches follow from the motion alone."
)
ABOUT_METHODS = (
    "AT: classical joint angles, low-passed and differentiated, on segments of constant length with the table’s "
    "inertia. Classical: the same with joints that follow their landmarks."
)
ABOUT_INVERSE = (
    "IK + ID: rigid segments laid on each frame’s markers by least squares with equal weights, angles low-passed and "
    "differentiated, inverse dynamics with the plates as measured and the model’s own inertia; what they disagree on "
    "stays at the root."
)


def methods_section(page: Page) -> Section | None:
    """All of one trial in one section: the filter's page."""
    trial = page.comparison
    if trial is None:
        return None
    seconds = trial.time[trial.window]
    title = f"Difference to what was measured, {seconds[0]:g} to {seconds[-1]:g} s"
    rows = table2([trial])
    referred = trial.reference(AT) is not None
    own = " Angles here are the model’s own, not those of angles.sto." if reported(page.estimate).asked else ""
    return Section(
        "methods",
        "Other methods",
        f"{about_methods(trial)} {ABOUT_TABLE2}{own}" if referred else "",
        tables=[table2_text(rows, title), table2_text(rows, "Every marker", single_markers=True)] if referred else [],
        notes=tuple(map(str, trial.notes)),
        parts=[part for make in PARTS if (part := make(trial, "methods")).panels] if referred else [],
    )


def about_methods(trial: ComparedTrial) -> str:
    """What the reference methods of a trial are."""
    return ABOUT_INVERSE if trial.of_kind(INVERSE) else ABOUT_METHODS


def wrench_part(trial: ComparedTrial, key: str) -> Section:
    """Figure 6: each modelled component as measured, by the filters and by AT."""
    reference = trial.reference(AT)
    methods = [*([reference] if reference else []), *trial.of_kind("EKF")]
    rms = {(row.quantity, row.method): row.rms for row in table2([trial])}
    source = wrench_sources(next(iter(trial.estimates.values())).data)
    panels = []
    for k, component in enumerate(COMPONENTS):
        if reference is None or not np.isfinite(trial.measured_wrench[:, k]).any():
            continue
        title, unit = COMPONENT_LABELS[component]
        lines = {MEASURED: trial.measured_wrench[:, k], **{method.name: method.wrench[:, k] for method in methods}}
        note = _each({method.name: rms[component, method.name] for method in reversed(methods)}, unit)
        panels.append(_overlaid(trial, title, unit, lines, f"RMS: {note}", source[:, k]))
    names = [MEASURED, *(method.name for method in methods)]
    measured = np.isfinite(trial.measured_wrench).any(axis=0)
    key_lines = (*_key(trial, names), *source_key(source[:, measured]))
    return Section(f"{key}-wrench", "Ground reaction by method", "", panels, lines=key_lines)


def angle_part(trial: ComparedTrial, key: str) -> Section:
    """Figure 5: each coordinate by the filters and by the classical method."""
    reference = trial.reference(CLASSICAL)
    methods = [*trial.of_kind("EKF"), *([reference] if reference else [])]
    panels = []
    for name, rows in _by_coordinate(angle_differences([trial])).items():
        k = trial.coordinate_names.index(name)
        if all(np.ptp(method.coordinates[:, k]) == 0.0 for method in trial.of_kind("EKF")):
            continue  # locked
        turn = bool(trial.rotation[k])
        unit, scale = ("deg", np.degrees(1.0)) if turn else ("mm", 1000.0)
        lines = {method.name: scale * method.known_coordinates()[:, k] for method in methods}
        note = f"RMS difference {_each({row.method: row.rms for row in rows}, unit)}"
        if len(rows) == 1:
            note += f", {number(rows[0].rms_about_mean.mean, unit)} about its mean"
        panels.append(_overlaid(trial, sentence(words(name)), unit, lines, note))
    return Section(
        f"{key}-angles",
        "Joint angles against the classical method",
        "A constant difference is mostly a matter of where zero is; what is left about the mean is the movement’s.",
        panels,
        lines=_key(trial, [method.name for method in methods]),
    )


def moment_part(trial: ComparedTrial, key: str) -> Section:
    """Figure 7: joint moments by the filters and by AT, knees first, the other joints folded."""
    reference = trial.reference(AT)
    methods = [*trial.of_kind("EKF"), *([reference] if reference else [])]
    against = AT if reference is None else reference.kind
    panels: dict[str, Panel] = {}
    estimate = next(iter(trial.estimates.values()))
    source = moment_sources(estimate.data)  # by the plates alone, so alike for all filters
    for name, rows in _by_coordinate(moment_differences([trial])).items():
        k = trial.coordinate_names.index(name)
        unit = rows[0].unit
        lines = {method.name: method.moments[:, k] for method in methods}
        note = f"RMS difference {_each({row.method: row.rms for row in rows}, unit)}"
        if len(rows) == 1:
            note += f", {number(rows[0].nrms_rms_percent.mean, digits=2)} % of {against}’s RMS"
        if about := moment_note(estimate, name):
            note = f"{about}; {note}"
        panels[name] = _overlaid(trial, f"{sentence(words(name))} moment", unit, lines, note, source[:, k])
    knees = [panel for name, panel in panels.items() if "knee" in name]
    others = [panel for name, panel in panels.items() if "knee" not in name]
    return Section(
        f"{key}-moments",
        f"Joint moments against {against}",
        "Nothing measures a joint moment: the difference says how much depends on the method.",
        knees or others,
        folded=others if knees else [],
        folded_title=f"The other joints’ moments against {against}",
        lines=(*_key(trial, [method.name for method in methods]), *source_key(source)),
    )


PARTS = (wrench_part, angle_part, moment_part)
"""By method over time; one without a reference method has no panels."""


def _overlaid(
    trial: ComparedTrial,
    title: str,
    unit: str,
    lines: dict[str, np.ndarray],
    note: str,
    source: np.ndarray | None = None,
) -> Panel:
    """Signals (T,) by method, the first at the bottom; a filter's shows where it comes from (T,)."""
    styles, drawn = _styles(trial), []
    for name, values in lines.items():
        own = source if styles[name].dash == "solid" and name != MEASURED else None
        drawn.append(Line(values, styles[name].colour, styles[name].width, source=own, dashes=styles[name].dashes))
    return chart(title, unit, trial.time, drawn, note=note)


def _styles(trial: ComparedTrial) -> dict[str, LineStyle]:
    return method_styles([MEASURED, *(method.name for method in trial.methods)])


def _key(trial: ComparedTrial, names: Sequence[str]) -> tuple[LineStyle, ...]:
    styles = _styles(trial)
    return tuple(styles[name] for name in names)


def _each(figures: dict[str, Spread], unit: str) -> str:
    """`12.3 N` of one method; of several each with its name, the unit at the end."""
    if len(figures) == 1:
        return number(next(iter(figures.values())).mean, unit)
    return ", ".join(f"{name} {number(value.mean)}" for name, value in figures.items()) + f" {unit}"


def _by_coordinate(rows: Sequence[_Difference]) -> dict[str, list[_Difference]]:
    found: dict[str, list[_Difference]] = {}
    for row in rows:
        found.setdefault(row.coordinate, []).append(row)
    return found
