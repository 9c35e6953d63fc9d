"""What the ground does to the person: the total of all plates, each foot's own, and what moves by it."""

from __future__ import annotations

from typing import Any

import numpy as np

from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, SHARED_PLATE, UNMEASURED
from dynakin.report.chart import Line, chart
from dynakin.report.labels import COMPONENT_LABELS, since
from dynakin.report.sections.section import Page, Section
from dynakin.report.sides import side_key
from dynakin.report.styles import BAND, ESTIMATED, ESTIMATED_LINE, MEASURED, MEASURED_LINE, SIDE_COLOURS, source_key
from dynakin.report.text_tables import TextTable
from dynakin.results.estimate import AXES, Estimate
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.measures.pressure import centre_of_pressure, support_height
from dynakin.results.measures.sources import measured_only, needed_wrench, wrench_sources
from dynakin.results.measures.stances import compared_stances
from dynakin.results.naming import number, sentence
from dynakin.units import COMPONENTS

DIRECTIONS = {"x": "forward", "y": "up", "z": "to the right"}


def wrench_section(page: Page) -> Section | None:
    """The total of all plates, measured and estimated."""
    if page.metrics["wrench"] is None:
        return None
    measured, estimated = page.estimate.values("wrench_measured"), needed_wrench(page.estimate.data)
    source = wrench_sources(page.estimate.data)
    # a planar model's wrench is its own, plates or not; of a body in space only what is measured is compared
    shown = np.isfinite(estimated if page.planar else measured).any(axis=0)
    panels = []
    for k in np.flatnonzero(shown):
        component = COMPONENTS[k]
        title, unit = COMPONENT_LABELS[component]
        rms = page.metrics["wrench"]["rms"].get(component)
        note = component if rms is None else f"{component}, RMS difference {number(rms, unit)}"
        lines = [Line(measured[:, k], MEASURED, 2.6), Line(estimated[:, k], ESTIMATED, 1.0, source=source[:, k])]
        panels.append(chart(title, unit, page.estimate.time, lines, note=note))
    return Section(
        "wrench",
        "Ground reaction",
        (_IN_A_PLANE if page.planar else _IN_SPACE) + since(page.estimate),
        panels,
        lines=(MEASURED_LINE, ESTIMATED_LINE, *source_key(source[:, shown])),
    )


_IN_A_PLANE = (
    "What the ground does to the person, in forces and the moment about the toe, where the model stands on the ground."
)
_IN_SPACE = (
    "What the ground does to the person in all, as the plates measure it and as the movement needs it by the model, in "
    "forces and the moment about the ground’s origin: how well the two agree. Where a foot stands off the plates the "
    "total is not measured."
)


def foot_section(page: Page) -> Section | None:
    """Each foot's wrench as measured and as adjusted, and how large the adjustment is."""
    estimate, figures = page.estimate, page.metrics["feet"]
    if not estimate.foot_names or figures is None:
        return None
    return Section(
        "feet",
        "Feet",
        figures["verdict"] + since(estimate),
        lines=(MEASURED_LINE, *side_key(estimate), *source_key(foot_sources(estimate.data))),
        band=BAND if "foot_wrench_sd" in estimate.data else "",
        tables=[table for table in (_adjustments(figures),) if table.rows],
        parts=[part for foot in estimate.contact_names if (part := _foot_part(estimate, foot)).panels],
    )


def _adjustments(figures: dict[str, Any]) -> TextTable:
    each = {f"{sentence(foot)} foot, adjustment": rms for foot, rms in figures["adjustment_rms"].items()}
    if figures["remainder_rms"] is not None:
        each[f"In flight, residual ({figures['flight_frames']} frames)"] = figures["remainder_rms"]
    rows = [
        (what, *(number(rms[name], digits=2) for name in COMPONENTS)) for what, rms in each.items() if rms is not None
    ]
    headings = ("RMS", *(f"{name}, {COMPONENT_LABELS[name][1]}" for name in COMPONENTS))
    return TextTable("What was changed, in place of a residual", headings, rows, tuple(range(1, 7)))


_CONTACTS = {
    NO_CONTACT: "in the air",
    ON_PLATE: "measured",
    SHARED_PLATE: "on one plate with another contact, so that only the sum is measured",
    UNMEASURED: "on the ground but not measured",
}
_NO_FOOT = {NO_CONTACT: "no contact", UNMEASURED: "in contact but not measured"}


def _foot_part(estimate: Estimate, foot: str) -> Section:
    k = estimate.contact_names.index(foot)
    measured, adjusted = (estimate.values(name)[:, k] for name in ("foot_wrench_measured", "foot_wrench"))
    sd = estimate.values("foot_wrench_sd")[:, k] if "foot_wrench_sd" in estimate.data else None
    contact, source = estimate.data["foot_contact"].sel(foot=foot).values, foot_sources(estimate.data)[:, k]
    panels = []

    def add(
        title: str,
        unit: str,
        seen: np.ndarray,
        made: np.ndarray,
        note: str = "",
        least: float = 0.0,
        made_sd: np.ndarray | None = None,
    ) -> None:
        if np.isfinite(made).any():
            own = Line(made, SIDE_COLOURS.get(foot, ESTIMATED), 1.1, made_sd, source)
            lines = [Line(seen, MEASURED, 2.6), own]
            panels.append(chart(title, unit, estimate.time, lines, note=note, least_range=least))

    for j, component in enumerate(COMPONENTS[:3]):
        title, unit = COMPONENT_LABELS[component]
        note = _peak(estimate, foot, measured_only(adjusted[:, j], source), unit)
        add(title, unit, measured[:, j], adjusted[:, j], note, made_sd=None if sd is None else sd[:, j])
    support = support_height(estimate, measured)
    (seen, seen_free), (made, made_free) = (centre_of_pressure(wrench, support) for wrench in (measured, adjusted))
    for axis, j in (("forward", 0), ("to the right", 2)):
        add(f"Centre of pressure, {axis}", "mm", 1000.0 * seen[:, j], 1000.0 * made[:, j], least=20.0)
    add("Free moment about the vertical", "N m", seen_free, made_free, least=2.0)
    is_foot = foot in estimate.foot_names
    shares = [
        f"{share} in {number(100.0 * float(np.mean(contact == code)), '%', digits=2)} of the frames"
        for code, share in (_CONTACTS if is_foot else _CONTACTS | _NO_FOOT).items()
        if (contact == code).any()
    ]
    title = f"{sentence(foot)} foot" if is_foot else sentence(foot)
    return Section(f"foot-{foot}", title, sentence(", ".join(shares)) + ".", panels)


def _peak(estimate: Estimate, foot: str, values: np.ndarray, unit: str) -> str:
    """The largest of the whole measured stances, or, of who stays on the feet, of the time after the adaptation."""
    window = evaluation_window(estimate.time)
    stances = compared_stances(estimate, window)
    own = None if stances is None else stances.get(foot)
    parts = [values[window]] if own is None else [values[part] for part in own]
    known = [part for part in parts if np.isfinite(part).all()]
    if not known:
        return "no stance measured from end to end, so no peak"
    peak = max(float(np.abs(part).max()) for part in known)
    per_kg = f", {number(peak / estimate.mass_kg, 'N/kg')}" if estimate.mass_kg else ""
    return f"peak {number(peak, unit)}{per_kg}"


def mass_centre_section(page: Page) -> Section | None:
    """The whole body's centre of mass and its velocity."""
    if "mass_centre" not in page.estimate.data:
        return None
    panels = []
    for variable, factor, unit, what in (
        ("mass_centre", 1000.0, "mm", "Place"),
        ("mass_centre_velocity", 1.0, "m/s", "Velocity"),
    ):
        for values, axis in zip(factor * page.estimate.values(variable).T, AXES, strict=True):
            if np.isfinite(values).any():
                moved = f"over {number(float(np.ptp(values[np.isfinite(values)])), unit)}"
                lines, title = [Line(values, ESTIMATED)], f"{what} {DIRECTIONS[axis]}"
                panels.append(chart(title, unit, page.estimate.time, lines, note=moved, least_range=0.01 * factor))
    return Section("mass-centre", "Centre of mass", "Of the whole body, in the ground frame.", panels)
