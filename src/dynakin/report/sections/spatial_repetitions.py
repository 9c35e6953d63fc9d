"""Repetitions of a body with two sides: mean curves, right and left in one panel."""

from __future__ import annotations

from collections.abc import Sequence

from dynakin.report.chart import Line, chart
from dynakin.report.colours import SIDE_COLOURS
from dynakin.report.labels import COMPONENT_LABELS
from dynakin.report.plot import ESTIMATED, MEASURED
from dynakin.report.sections.method_panels import curve_unit, percent_label
from dynakin.report.sections.panels import Panel
from dynakin.report.sections.section import Section
from dynakin.report.sections.spatial_sections import SIDE_LINES
from dynakin.report.sides import Joint, joints_of
from dynakin.results.estimate import COMPONENTS, Estimate
from dynakin.results.measures.mean_curves import MEASURED as MEASURED_NAME
from dynakin.results.measures.mean_curves import PERCENT, MeanCurve
from dynakin.results.measures.repetitions import Found
from dynakin.results.naming import listed


def spatial_repetition_section(estimate: Estimate, found: Found, curves: Sequence[MeanCurve]) -> Section:
    """Mean curves of legs and trunk and of the wrench, each limb over its own foot's cycles; or why there are none."""
    own = {(c.side, c.quantity): c for c in curves if c.method.startswith("EKF")}
    measured = {(c.side, c.quantity): c for c in curves if c.method == MEASURED_NAME}
    if not own:
        return Section("repetitions", "Repetitions", "", notes=(found.note,))
    joints = [joint for joint in joints_of(estimate) if joint.region in ("Legs", "Trunk and head")]
    angles = [panel for joint in joints if (panel := _panel(joint, own, ""))]
    kinetic = {joint.name.lower(): _panel(joint, own, "/moment") for joint in joints}
    moments = [panel for panel in kinetic.values() if panel]
    missing = [name for name, panel in kinetic.items() if not panel]
    sides = list(dict.fromkeys(side for side, _ in own))
    wrench = [
        _wrench_panel(own[side, name], measured.get((side, name)), many=len(sides) > 1)
        for side in sides
        for name in COMPONENTS
        if (side, name) in own and own[side, name].n.any()
    ]
    what = "squat" if found.movement == "squat" else "gait cycle of each foot"
    parts = [
        Section("repetitions-angles", "Coordinates", "", angles, lines=SIDE_LINES),
        Section("repetitions-moments", "Moments, per kg", "", moments, lines=SIDE_LINES),
        Section("repetitions-wrench", "Ground reaction, per kg", "", wrench, key=("measured", "estimated")),
    ]
    return Section(
        "repetitions",
        "Repetitions",
        f"{found.note} Each {what} from 0 to 100 % of its time: their mean, and one sample standard deviation as a "
        "band. Moments and forces are divided by the body mass; a cycle in which one is not measured in every frame is "
        "left out of its mean. All curves are in repetitions.csv."
        + (f" No cycle is left of the moments of {listed(missing, 12)}." if missing else ""),
        parts=[part for part in parts if part.panels],
    )


def _line(curve: MeanCurve, colour: str, width: float = 1.2) -> Line:
    per_kg = curve.mean_per_kg is not None
    mean, sd = (curve.mean_per_kg, curve.sd_per_kg) if per_kg else (curve.mean, curve.sd)
    assert mean is not None and sd is not None
    return Line(mean, colour, width, 0.5 * sd if curve.n.max() > 1 else None)  # a chart's band is two wide


def _panel(joint: Joint, curves: dict[tuple[str, str], MeanCurve], suffix: str) -> Panel | None:
    drawn = []
    for side in joint.columns:
        name = joint.stem + (f"_{side[0]}" if side else "") + suffix
        # squats have one cycle for both; in gait a limb has its own foot's, the trunk the right one's
        cycle = next((c for c in ("both", side or "right", "right", "left") if (c, name) in curves), None)
        if cycle is not None:
            drawn.append((side, curves[cycle, name]))
    if not any(curve.n.any() for _, curve in drawn):
        return None
    first = drawn[0][1]
    lines = [_line(curve, SIDE_COLOURS[side]) for side, curve in drawn if curve.n.any()][::-1]
    note = "; ".join(f"{f'{side}: ' if side else ''}{curve.times}" for side, curve in drawn)
    least = {"deg": 2.0, "mm": 10.0}.get(first.unit, 0.02)
    label = percent_label(first.movement)
    return chart(joint.title, curve_unit(first), PERCENT, lines, note=note, least_range=least, x_label=label)


def _wrench_panel(curve: MeanCurve, measured: MeanCurve | None, *, many: bool) -> Panel:
    title = COMPONENT_LABELS[curve.quantity][0] + (f", {curve.side} cycle" if many else "")
    lines = [_line(curve, ESTIMATED)]
    if measured is not None and measured.n.any():
        assert measured.mean_per_kg is not None
        lines.insert(0, Line(measured.mean_per_kg, MEASURED, 2.6))
    return chart(title, curve_unit(curve), PERCENT, lines, note=curve.times, x_label=percent_label(curve.movement))
