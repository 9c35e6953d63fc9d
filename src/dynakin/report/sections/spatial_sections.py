"""The report's sections of a whole body in space: right and left over each other, each foot on its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from dynakin.report.body import marker_segments
from dynakin.report.chart import Line, chart
from dynakin.report.colours import SIDE_COLOURS
from dynakin.report.labels import COMPONENT_LABELS, short_marker_names
from dynakin.report.method_styles import DERIVED_LINE, LineStyle
from dynakin.report.plot import ESTIMATED, MEASURED
from dynakin.report.sections.panels import Panel, band_is_too_wide, rms_bars
from dynakin.report.sections.section import NOTHING, Section, needs
from dynakin.report.sides import REGIONS, Joint, joints_of
from dynakin.report.text_tables import TextTable
from dynakin.results.estimate import AXES, COMPONENTS, Estimate
from dynakin.results.measures.angles import convention_of
from dynakin.results.measures.feet import ROUNDING, foot_sources
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.measures.power import root_coordinates
from dynakin.results.measures.pressure import centre_of_pressure, floor_height
from dynakin.results.measures.sources import DERIVED, UNKNOWN, measured_only, moment_sources, wrench_sources
from dynakin.results.measures.sources import MEASURED as MOMENT_MEASURED
from dynakin.results.measures.stances import compared_stances
from dynakin.results.naming import listed, number, sentence, words

Array = npt.NDArray[np.float64]

SIDE_LINES = tuple(LineStyle(side, SIDE_COLOURS[side], 1.4) for side in ("right", "left"))
_DIRECTIONS = {"x": "forward", "y": "up", "z": "to the right"}
_AXIS_COLOURS = {"x": "#0072B2", "y": "#009E73", "z": "#CC79A7"}


@needs("markers", otherwise=NOTHING)
def spatial_marker_section(estimate: Estimate, metrics: dict[str, Any]) -> Section:
    """RMS a marker, and how far each is from where it was measured, over time."""
    names = short_marker_names(estimate.marker_names)
    difference = 1000.0 * (_of(estimate, "markers_estimated", "marker") - _of(estimate, "markers_measured", "marker"))
    rms = {names[name]: value for name, value in metrics["markers"]["rms_mm"].items()}
    folded = [
        chart(
            names[name],
            "mm",
            estimate.time,
            [Line(difference[:, k, i], _AXIS_COLOURS[axis], 0.9) for i, axis in enumerate(AXES)],
            note="RMS " + number(rms[names[name]], "mm"),
            least_range=10.0,
        )
        for k, name in enumerate(estimate.marker_names)
    ]
    window = metrics["window"]
    order = sorted(rms, key=lambda name: -(rms[name] or 0.0))
    halves = [order[: -(-len(order) // 2)], order[-(-len(order) // 2) :]]
    most = max((value for value in rms.values() if value is not None), default=None)
    bars = [rms_bars(f"rms-{k}", {name: rms[name] for name in half}, most) for k, half in enumerate(halves) if half]
    titled = [Panel("RMS distance, largest first", b.note, b.svg) if k == 0 else b for k, b in enumerate(bars)]
    titled[1:] = [Panel("RMS distance, continued", b.note, b.svg) for b in titled[1:]]
    return Section(
        "markers",
        "Markers",
        f"Root mean square distance in space between {window['start_s']:.4g} and {window['end_s']:.4g} s. Where soft "
        "tissue is estimated, an estimated marker holds its displacement: how far each moves on its segment says how "
        "well a rigid body fits.",
        tables=[_displacements(estimate, metrics)]
        if metrics["soft_tissue"] and metrics["soft_tissue"]["markers"]
        else [],
        wide=titled,
        folded=folded,
        folded_title="Every marker over time: estimated less measured",
        lines=tuple(LineStyle(_DIRECTIONS[axis], _AXIS_COLOURS[axis], 1.2) for axis in AXES),
    )


def _displacements(estimate: Estimate, metrics: dict[str, Any]) -> TextTable:
    names, carriers = short_marker_names(estimate.marker_names), marker_segments(estimate)
    found = metrics["soft_tissue"]["markers"]
    order = sorted(found, key=lambda name: -(found[name]["max_mm"] or 0.0))
    rows: list[tuple[str, ...]] = [
        (
            names.get(name, name),
            words(carriers.get(name, "")),
            number(found[name]["rms_mm"], digits=2),
            number(found[name]["max_mm"], digits=2),
            number(found[name]["declared_mm"], digits=2),
        )
        for name in order
    ]
    headings = ("marker", "segment", "RMS, mm", "largest, mm", "declared, mm")
    return TextTable("Movement of each marker on its segment", headings, rows, (2, 3, 4), folded=True)


@needs("wrench", otherwise=NOTHING)
def spatial_wrench_section(estimate: Estimate, metrics: dict[str, Any]) -> Section:
    """The total of all plates, measured and estimated."""
    measured, estimated = _of(estimate, "wrench_measured", "component"), _of(estimate, "wrench_estimated", "component")
    derived = wrench_sources(estimate.data) == DERIVED
    panels = []
    for k, component in enumerate(COMPONENTS):
        if not np.isfinite(measured[:, k]).any():
            continue
        title, unit = COMPONENT_LABELS[component]
        rms = metrics["wrench"]["rms"].get(component)
        note = f"{component}, RMS difference {number(rms, unit)}" if rms is not None else component
        lines = [
            Line(measured[:, k], MEASURED, 2.6),
            Line(estimated[:, k], ESTIMATED, 1.0, dashed=derived[:, k]),
        ]
        panels.append(chart(title, unit, estimate.time, lines, note=note))
    return Section(
        "wrench",
        "Ground reaction",
        "What the ground does to the person in all, in forces and the moment about the ground’s origin. Where a foot "
        "stands off the plates the total is not measured.",
        panels,
        key=("measured", "estimated"),
        lines=(DERIVED_LINE,) if panels and derived.any() else (),
    )


def foot_section(estimate: Estimate, metrics: dict[str, Any]) -> Section:
    """Each foot's wrench as measured and as adjusted, and how large the adjustment is."""
    if not estimate.foot_names or metrics["feet"] is None:
        return Section("feet", "Feet", "")
    parts = [_foot_part(estimate, foot) for foot in estimate.foot_names]
    derived = bool((foot_sources(estimate.data) == DERIVED).any())
    return Section(
        "feet",
        "Feet",
        metrics["feet"]["verdict"],
        key=("measured",),
        lines=(*SIDE_LINES, *((DERIVED_LINE,) if derived else ())),
        tables=[adjustment for adjustment in (_adjustments(metrics["feet"]),) if adjustment.rows],
        parts=[part for part in parts if part.panels],
    )


def _adjustments(figures: dict[str, Any]) -> TextTable:
    rows = []
    for foot, rms in figures["adjustment_rms"].items():
        cells = tuple("–" if rms is None else number(rms[name], digits=2) for name in COMPONENTS)
        rows.append((f"{sentence(foot)} foot, adjustment", *cells))
    if figures["remainder_rms"] is not None:
        cells = tuple(number(figures["remainder_rms"][name], digits=2) for name in COMPONENTS)
        rows.append((f"In flight, left over ({figures['flight_frames']} frames)", *cells))
    headings = ("RMS", *(f"{name}, {COMPONENT_LABELS[name][1]}" for name in COMPONENTS))
    return TextTable("What was changed, in place of a residual", headings, rows, tuple(range(1, 7)))


def _foot_part(estimate: Estimate, foot: str) -> Section:
    colour = SIDE_COLOURS.get(foot, ESTIMATED)
    wrenches = {
        kind: estimate.data[name].sel(foot=foot).transpose("time", "component").values
        for kind, name in (("measured", "foot_wrench_measured"), ("adjusted", "foot_wrench"))
    }
    contact = estimate.data["foot_contact"].sel(foot=foot).values
    source = foot_sources(estimate.data)[:, estimate.foot_names.index(foot)]
    derived = source == DERIVED
    panels = []

    def add(title: str, unit: str, measured: Array, adjusted: Array, note: str = "", least: float = 0.0) -> None:
        if np.isfinite(adjusted).any():
            lines = [Line(measured, MEASURED, 2.6), Line(adjusted, colour, 1.1, dashed=derived)]
            panels.append(chart(title, unit, estimate.time, lines, note=note, least_range=least))

    for k, component in enumerate(COMPONENTS[:3]):
        title, unit = COMPONENT_LABELS[component]
        note = _peak(estimate, foot, measured_only(wrenches["adjusted"][:, k], source), unit)
        add(title, unit, wrenches["measured"][:, k], wrenches["adjusted"][:, k], note)
    pressed = {kind: centre_of_pressure(wrench, floor_height(estimate)) for kind, wrench in wrenches.items()}
    for axis, k in (("forward", 0), ("to the right", 2)):
        each = {kind: 1000.0 * point[:, k] for kind, (point, _) in pressed.items()}
        add(f"Centre of pressure, {axis}", "mm", each["measured"], each["adjusted"], least=20.0)
    add("Free moment about the vertical", "N m", pressed["measured"][1], pressed["adjusted"][1], least=2.0)
    shares = [
        f"{share} in {number(100.0 * float(np.mean(contact == code)), '%', digits=2)} of the frames"
        for code, share in ((0, "In the air"), (1, "measured"), (2, "on the ground but not measured"))
        if (contact == code).any()
    ]
    return Section(f"foot-{foot}", f"{sentence(foot)} foot", sentence(", ".join(shares)) + ".", panels)


def _peak(estimate: Estimate, foot: str, values: Array, unit: str) -> str:
    """The largest of the whole measured stances, or, of who stays on the feet, of the time after the adaptation."""
    window = evaluation_window(estimate.time)
    stances = compared_stances(estimate, window)
    parts = [values[window]] if stances is None else [values[part] for part in stances[foot]]
    known = [part for part in parts if np.isfinite(part).all()]
    if not known:
        return "no stance measured from end to end, so no peak"
    peak = max(float(np.abs(part).max()) for part in known)
    per_kg = f", {number(peak / estimate.mass_kg, 'N/kg')}" if estimate.mass_kg else ""
    return f"peak {number(peak, unit)}{per_kg}"


def mass_centre_section(estimate: Estimate) -> Section:
    """The whole body's centre of mass and its velocity."""
    if "mass_centre" not in estimate.data:
        return Section("mass-centre", "Centre of mass", "")
    panels = []
    for variable, factor, unit, words_ in (
        ("mass_centre", 1000.0, "mm", "Place"),
        ("mass_centre_velocity", 1.0, "m/s", "Velocity"),
    ):
        values = factor * estimate.data[variable].transpose("time", "axis").values
        for k, axis in enumerate(AXES):
            if np.isfinite(values[:, k]).any():
                moved = f"over {number(float(np.ptp(values[np.isfinite(values[:, k]), k])), unit)}"
                lines = [Line(values[:, k], ESTIMATED)]
                title = f"{words_} {_DIRECTIONS[axis]}"
                panels.append(chart(title, unit, estimate.time, lines, note=moved, least_range=0.01 * factor))
    return Section("mass-centre", "Centre of mass", "Of the whole body, in the ground frame.", panels)


def spatial_angle_section(estimate: Estimate) -> Section:
    """Coordinates, right and left in one panel, with their bands of uncertainty."""
    values, sd = _of(estimate, "coordinates", "coordinate"), _of(estimate, "coordinates_sd", "coordinate")
    offset, clinical = np.zeros(values.shape[1]), False
    about = "Each in the direction in which the model counts, from the model’s zero."
    if "zero_offset" in estimate.data:
        offset = estimate.data["zero_offset"].values
        clinical = estimate.data.attrs["angle_signs"] == "clinical"
        zero = "from the standing zero" if np.any(offset) else "from the model’s zero"
        about = f"As in angles.sto: {zero}, {'clinical' if clinical else 'OpenSim’s'} signs."

    def draw(joint: Joint) -> Panel:
        factor, unit = (180.0 / np.pi, "deg") if joint.rotation else (1000.0, "mm")
        name = estimate.coordinate_names[next(iter(joint.columns.values()))]
        found = convention_of(name) if joint.rotation else None
        sign = found[0].sign if clinical and found else 1
        ranges, lines = [], []
        for side, k in joint.columns.items():
            own = sign * factor * (values[:, k] - offset[k])
            wide = band_is_too_wide(own, factor * sd[:, k])
            lines.append(Line(own, SIDE_COLOURS[side], 1.2, None if wide else factor * sd[:, k]))
            ranges.append(f"{f'{side} ' if side else ''}{number(np.nanmin(own))} to {number(np.nanmax(own))}")
            if wide:
                ranges[-1] += f" (2 sd {number(2.0 * factor * float(np.median(sd[:, k])), digits=2)})"
        title = joint.title
        if found:
            way = found[0].positive if sign == found[0].sign else found[0].negative
            title = f"{title} (+ {way})"
        least = 2.0 if joint.rotation else 10.0
        return chart(title, unit, estimate.time, lines[::-1], note="; ".join(ranges), least_range=least)

    return Section(
        "angles",
        "Joint angles",
        f"{about} The band is two standard deviations wide on either side, as the filter itself believes; one that "
        "would hide the line is not drawn, its size stands above the panel.",
        lines=SIDE_LINES,
        band="± 2 standard deviations",
        parts=_by_region("angles", joints_of(estimate), draw),
    )


def spatial_moment_section(estimate: Estimate, metrics: dict[str, Any]) -> Section:
    """Moments over the body mass, right and left in one panel; what is derived is dashed, what is absent left out."""
    mass = estimate.mass_kg
    moments = _of(estimate, "moments", "coordinate") / (mass or 1.0)
    sd = _of(estimate, "moments_sd", "coordinate") / (mass or 1.0) if "moments_sd" in estimate.data else None
    source, peaks = moment_sources(estimate.data), metrics["peak_moments_per_kg"]
    found = metrics["moments"] or UNKNOWN

    def draw(joint: Joint) -> Panel | None:
        unit = ("N m" if joint.rotation else "N") + ("/kg" if mass else "")
        notes, lines = [], []
        for side, k in joint.columns.items():
            who = f"{side} " if side else ""
            if not np.isfinite(moments[:, k]).any():
                notes.append(f"{who}absent")
                continue
            derived = source[:, k] == DERIVED
            own_sd = None if sd is None else np.where(derived, np.nan, sd[:, k])
            wide = own_sd is not None and band_is_too_wide(moments[:, k], own_sd)
            lines.append(Line(moments[:, k], SIDE_COLOURS[side], 1.2, None if wide else own_sd, derived))
            if own := (peaks or {}).get(estimate.coordinate_names[k]):
                notes.append(f"{who}{_two_digits(own['smallest'])} to {_two_digits(own['largest'])}")
            elif mass and peaks is not None:
                notes.append(f"{who}no whole measured stance")
        return (
            chart(joint.name, unit, estimate.time, lines[::-1], note="; ".join(notes), least_range=0.02)
            if lines
            else None
        )

    joints = [joint for joint in joints_of(estimate) if joint.region != "Whole body"]
    parts = _by_region("moments", joints, draw)
    absent = [
        f"{side} {joint.name.lower()}".strip()
        for joint in joints
        for side, k in joint.columns.items()
        if not np.isfinite(moments[:, k]).any()
    ]
    text = [found["verdict"]]
    if parts:
        about = "What muscles and ligaments do about each joint, in the direction in which its coordinate grows"
        text.append(f"{about}, over the body mass." if mass else f"{about}.")
        text += _left_at_root(estimate, source)
    if (source == DERIVED).any():
        text.append("Derived moments are dashed, and no peak, work or mean curve holds them.")
    if absent:
        text.append(f"Absent in every frame: {listed(absent, 12)}.")
    return Section(
        "moments",
        "Joint moments",
        " ".join(text),
        lines=(*SIDE_LINES, *((DERIVED_LINE,) if (source == DERIVED).any() else ())) if parts else (),
        band="" if sd is None or not parts else "± 2 standard deviations",
        notes=tuple(found["reasons"]),
        parts=parts,
    )


def _left_at_root(estimate: Estimate, source: npt.NDArray[np.uint8]) -> list[str]:
    """What the model needs at its root and nothing gives, in the frames in which that is measured; in words."""
    root = [k for k, name in enumerate(estimate.coordinate_names) if name in root_coordinates(estimate)]
    known = _of(estimate, "moments", "coordinate")[:, root][(source[:, root] == MOMENT_MEASURED).all(axis=1)]
    if not known.size or not np.isfinite(known).any():
        return []
    most = float(np.nanmax(np.abs(known)))
    left = "nothing" if most <= ROUNDING else f"at most {number(most, 'N or N m', digits=2)}"
    return [f"At the root {left} is left in the {len(known)} frames in which every contact is measured."]


def _two_digits(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "−")


def _by_region(key: str, joints: list[Joint], draw: Callable[[Joint], Panel | None]) -> list[Section]:
    """Legs open, the rest folded: a page of twenty-five panels hides what is asked for most."""
    parts = []
    for region in REGIONS:
        panels = [panel for joint in joints if joint.region == region and (panel := draw(joint)) is not None]
        if not panels:
            continue
        anchor = f"{key}-{region.split()[0].lower()}"
        if region == "Legs":
            parts.append(Section(anchor, region, "", panels))
        else:
            parts.append(Section(anchor, "", "", folded=panels, folded_title=region))
    return parts


def _of(estimate: Estimate, name: str, second: str) -> Array:
    dims = ("time", second, "axis") if second == "marker" else ("time", second)
    return np.asarray(estimate.data[name].transpose(*dims).values, dtype=float)
