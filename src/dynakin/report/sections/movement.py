"""The report's sections: which figures, with which titles and explanations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dynakin.elements import element
from dynakin.report.chart import Bound, Line, chart
from dynakin.report.labels import COMPONENT_LABELS, is_planar, moment_note, short_marker_names, signed_percent
from dynakin.report.method_styles import DERIVED_LINE
from dynakin.report.plot import ESTIMATED
from dynakin.report.sections import panels as charts
from dynakin.report.sections.methods import methods_section
from dynakin.report.sections.observability import identifiability_section
from dynakin.report.sections.panels import Panel
from dynakin.report.sections.repetitions import repetition_section
from dynakin.report.sections.section import NOTHING, Section, needs
from dynakin.report.sections.spatial_repetitions import spatial_repetition_section
from dynakin.report.sections.spatial_sections import (
    foot_section,
    mass_centre_section,
    spatial_angle_section,
    spatial_marker_section,
    spatial_moment_section,
    spatial_wrench_section,
)
from dynakin.report.sections.work import asymmetry_section, power_section
from dynakin.results.estimate import AXES, COMPONENTS, Estimate
from dynakin.results.measures.mean_curves import MeanCurve, estimate_curves
from dynakin.results.measures.repetitions import Found, repetitions_of
from dynakin.results.measures.sources import DERIVED, UNKNOWN, moment_sources, wrench_sources
from dynakin.results.naming import number, sentence, words
from dynakin.results.records import Parameter

if TYPE_CHECKING:
    from dynakin.validation.methods import Trial


def sections(estimate: Estimate, metrics: dict[str, Any], comparison: Trial | None = None) -> list[Section]:
    """All sections in order; one without anything to show is left out.

    Args:
        comparison: this estimate beside the reference methods, for a section on them.
    """
    found = repetitions_of(estimate) if comparison is None else comparison.repetitions
    curves = estimate_curves(estimate) if comparison is None else comparison.curves()
    if not is_planar(estimate):
        every = spatial_sections(estimate, metrics, found, curves, comparison)
        return [section for section in every if not section.empty]
    every = [
        marker_section(estimate, metrics),
        wrench_section(estimate, metrics),
        angle_section(estimate),
        moment_section(estimate, metrics),
        repetition_section(estimate, found, curves),
        *([] if comparison is None else [methods_section(comparison)]),
        length_section(estimate),
        mass_section(estimate),
        identifiability_section(estimate, metrics),
    ]
    return [section for section in every if not section.empty]


def spatial_sections(
    estimate: Estimate,
    metrics: dict[str, Any],
    found: Found,
    curves: Sequence[MeanCurve],
    comparison: Trial | None = None,
) -> list[Section]:
    """Sections of a body in space: what is read most first."""
    return [
        spatial_angle_section(estimate),
        spatial_moment_section(estimate, metrics),
        foot_section(estimate, metrics),
        power_section(estimate, metrics),
        asymmetry_section(estimate, metrics),
        mass_centre_section(estimate),
        spatial_marker_section(estimate, metrics),
        spatial_wrench_section(estimate, metrics),
        spatial_repetition_section(estimate, found, curves),
        *([] if comparison is None else [methods_section(comparison)]),
        length_section(estimate),
        mass_section(estimate),
        identifiability_section(estimate, metrics),
    ]


@needs("markers", otherwise=NOTHING)
def marker_section(estimate: Estimate, metrics: dict[str, Any]) -> Section:
    """RMS a marker, paths in the plane, and every marker over time."""
    names = short_marker_names(estimate.marker_names)
    measured = estimate.data["markers_measured"].values
    estimated = estimate.data["markers_estimated"].values
    rms = {names[name]: value for name, value in metrics["markers"]["rms_mm"].items()}
    wide = [charts.rms_bars("rms", rms)]
    wide.append(charts.plane_paths("paths", list(names.values()), measured[:, :, :2], estimated[:, :, :2]))
    directions = {"x": "forward", "y": "up", "z": "right"}
    folded = [
        charts.compared(
            f"marker-{index}-{axis}",
            f"{names[name]}, {directions[axis]}",
            "mm",
            estimate.time,
            1000.0 * measured[:, index, k],
            1000.0 * estimated[:, index, k],
        )
        for index, name in enumerate(estimate.marker_names)
        for k, axis in enumerate(AXES)
        if estimate.modelled_axes()[k]
    ]
    window = metrics["window"]
    plane = " In the plane of the model." if is_planar(estimate) else ""
    return Section(
        "markers",
        "Markers",
        f"Root mean square distance between {window['start_s']:.4g} and {window['end_s']:.4g} s.{plane}",
        wide=wide,
        folded=folded,
        folded_title="Every marker over time",
        key=("measured", "estimated"),
    )


@needs("wrench", otherwise=NOTHING)
def wrench_section(estimate: Estimate, metrics: dict[str, Any]) -> Section:
    """Each modelled component, measured and estimated."""
    measured = estimate.data["wrench_measured"].values
    estimated = estimate.data["wrench_estimated"].values
    rms = metrics["wrench"]["rms"]
    panels = []
    derived = wrench_sources(estimate.data) == DERIVED
    for k, component in enumerate(COMPONENTS):
        if not np.isfinite(estimated[:, k]).any():
            continue
        title, unit = COMPONENT_LABELS[component]
        seen = measured[:, k] if np.isfinite(measured[:, k]).any() else None
        note = f"{component}, RMS difference {number(rms[component], unit)}" if component in rms else component
        panels.append(
            charts.compared(
                f"wrench-{component}",
                title,
                unit,
                estimate.time,
                seen,
                estimated[:, k],
                note=note,
                derived=derived[:, k],
            )
        )
    place = "the toe, where the model stands on the ground" if is_planar(estimate) else "the ground’s origin"
    return Section(
        "wrench",
        "Ground reaction",
        f"What the ground does to the person, in forces and the moment about {place}.",
        panels,
        key=("measured", "estimated"),
        lines=(DERIVED_LINE,) if derived[:, np.isfinite(estimated).any(axis=0)].any() else (),
    )


def angle_section(estimate: Estimate) -> Section:
    """Coordinates with their band of uncertainty."""
    panels = []
    for index, name in enumerate(estimate.coordinate_names):
        rotation = estimate.is_rotation()[index]
        factor, unit = (180.0 / np.pi, "deg") if rotation else (1000.0, "mm")
        values = factor * estimate.data["coordinates"].values[:, index]
        sd = factor * estimate.data["coordinates_sd"].values[:, index]
        moved = f"from {number(float(np.nanmin(values)))} to {number(float(np.nanmax(values)), unit)}"
        locked = not np.any(sd > 0.0)
        note = f"locked at {number(float(values[0]), unit)}" if locked else moved
        panels.append(
            charts.compared(f"angle-{name}", sentence(words(name)), unit, estimate.time, None, values, note=note, sd=sd)
        )
    return Section(
        "angles",
        "Joint angles" if estimate.is_rotation().all() else "Joint coordinates",
        "The band is two standard deviations wide on either side, as the filter itself believes. One that would hide "
        "the line is not drawn; its size (2 sd, median) stands above the panel.",
        panels,
        key=("estimated", "band"),
    )


def moment_section(estimate: Estimate, metrics: dict[str, Any]) -> Section:
    """Moments, each with what it stands for; derived ones dashed, absent ones left out."""
    panels = []
    sources = moment_sources(estimate.data)
    deviations = estimate.data["moments_sd"].values if "moments_sd" in estimate.data else None
    for index, name in enumerate(estimate.coordinate_names):
        unit = "N m" if estimate.is_rotation()[index] else "N"
        values = estimate.data["moments"].values[:, index]
        if not np.isfinite(values).any():
            continue
        panels.append(
            charts.compared(
                f"moment-{name}",
                sentence(words(name)),
                unit,
                estimate.time,
                None,
                values,
                note=moment_note(estimate, name),
                sd=deviations[:, index] if deviations is not None else None,
                derived=sources[:, index] == DERIVED,
            )
        )
    found = metrics["moments"] or UNKNOWN
    text = found["verdict"]
    if panels:
        text += " What the muscles and ligaments do about each joint, in the direction in which its coordinate grows."
    if panels and is_planar(estimate):
        text += (
            " The model has one leg and one arm for both sides, so theirs are the sums of both. At the toe there is no "
            "joint: its “moment” is the ground’s about the toe."
        )
    key = ("estimated",) if deviations is None else ("estimated", "band")
    return Section(
        "moments",
        "Joint moments",
        text,
        panels,
        key=key,
        lines=(DERIVED_LINE,) if (sources == DERIVED).any() else (),
        notes=tuple(found["reasons"]),
    )


def length_section(estimate: Estimate) -> Section:
    """Segment lengths over time between their bounds."""
    panels = [
        _parameter_panel(
            estimate, p, sentence(words(element(p.name).owner)), *((1.0, "") if p.unit == "1" else (1000.0, "mm"))
        )
        for p in estimate.parameters
        if p.kind == "length" and p.estimated
    ]
    return Section(
        "lengths",
        "Segment lengths",
        "How the filter settles on each length. A line on its bound says that the model does not fit there.",
        panels,
        key=("estimated", "band", "bound"),
    )


def mass_section(estimate: Estimate) -> Section:
    """Segment masses over time between their bounds."""
    panels = [
        _parameter_panel(estimate, p, sentence(words(p.segment)), 1.0, "kg")
        for p in estimate.parameters
        if p.kind == "inertia" and p.name.endswith("/mass") and p.estimated
    ]
    sides = " Limbs count both sides." if is_planar(estimate) else ""
    return Section(
        "masses",
        "Segment masses",
        f"From the anthropometric table to what the plates and the movement suggest.{sides} Masses are hard to "
        "tell apart from a squat alone: read them with their bands.",
        panels,
        key=("estimated", "band", "bound"),
    )


def _parameter_panel(estimate: Estimate, p: Parameter, title: str, factor: float, unit: str) -> Panel:
    element = estimate.data["state"].sel(element=p.name).values
    sd = np.hypot(estimate.data["state_sd"].sel(element=p.name).values, p.skin_sd)
    change = p.change_percent()
    note = f"{number(factor * p.initial)} to {number(factor * p.value, unit)}"
    if change is not None:
        note += f" ({signed_percent(change)})"
    if p.at_bound:
        note += ", on its bound"
    if not is_planar(estimate):
        levels = [(p.lower, "lower bound"), (p.upper, "upper bound")]
        # bounds far from the path are left out: they would press it flat
        reach = 3.0 * float(np.ptp(element)) + 2.0 * float(np.nanmax(sd))
        middle = float(np.median(element))
        bounds = [Bound(factor * v, word) for v, word in levels if v is not None and abs(v - middle) <= reach]
        line = Line(factor * element, ESTIMATED, 1.3, factor * sd)
        return chart(title, unit, estimate.time, [line], note=note, bounds=bounds)
    return charts.parameter_path(
        p.name,
        title,
        unit,
        estimate.time,
        factor * element,
        lower=None if p.lower is None else factor * p.lower,
        upper=None if p.upper is None else factor * p.upper,
        sd=factor * sd,
        note=note,
    )
