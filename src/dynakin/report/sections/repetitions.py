"""Repetitions: how many, and mean curves over 0 to 100 %, by method or, of a body in space, right and left together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynakin.report.chart import Line, Panel, chart
from dynakin.report.labels import COMPONENT_LABELS, moment_note
from dynakin.report.sections.section import Page, Section
from dynakin.report.sides import Joint, joints_of, side_key, side_lines
from dynakin.report.styles import ESTIMATED_LINE, MEASURED_LINE, LineStyle, method_styles
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import reported, ways_of
from dynakin.results.measures.mean_curves import MEASURED, PERCENT, MeanCurve
from dynakin.results.measures.repetitions import Found
from dynakin.results.naming import listed, sentence, words
from dynakin.units import COMPONENTS

KINDS = {"angles": "Coordinates", "moments": "Moments, per kg", "wrench": "Ground reaction, per kg"}
ONE_SD = "± 1 standard deviation"


@dataclass(frozen=True)
class Plot:
    """Mean curves of one panel, the first at the bottom."""

    title: str
    note: str
    curves: list[tuple[LineStyle, MeanCurve]]


def repetition_section(page: Page) -> Section:
    """Of the page's estimate: in a plane by method, in space right and left together."""
    make = method_repetitions if page.planar else side_repetitions
    made = make(page.estimate, page.repetitions, page.curves)
    if not (made.parts and reported(page.estimate).asked):
        return made
    return replace(made, text=f"{made.text} Angles here are those of angles.sto; repetitions.csv has the model’s.")


def side_repetitions(estimate: Estimate, found: Found, curves: Sequence[MeanCurve]) -> Section:
    """The filter's curves of legs and trunk and of the wrench, each limb over its own foot's cycles; or why there are
    none."""
    if not any(curve.method.startswith("EKF") for curve in curves):
        return Section("repetitions", "Repetitions", "", notes=(found.note,))
    plots, missing = side_plots(estimate, curves)
    more = " All curves are in repetitions.csv."
    more += f" No cycle is left of the moments of {listed(missing, 12)}." if missing else ""
    keys = dict.fromkeys(KINDS, side_key(estimate)) | {"wrench": (MEASURED_LINE, ESTIMATED_LINE)}
    return _section(found, plots, keys, more=more)


def side_plots(estimate: Estimate, curves: Sequence[MeanCurve]) -> tuple[dict[str, list[Plot]], list[str]]:
    """The same by kind, and the joints of whose moments no cycle is left."""
    own = {(curve.side, curve.quantity): curve for curve in curves if curve.method.startswith("EKF")}
    joints = [joint for joint in joints_of(estimate) if joint.region in ("Legs", "Trunk and head")]
    styles, ways, grows = side_lines(estimate), reported(estimate).way, ways_of(estimate)
    angles = [_sides(joint, own, "", styles, ways) for joint in joints]
    moments = {joint.name.lower(): _sides(joint, own, "/moment", styles, grows) for joint in joints}
    wrench = [curve for curve in curves if curve.quantity in COMPONENTS and curve.method.startswith(("EKF", MEASURED))]
    plots = {
        "angles": [plot for plot in angles if plot],
        "moments": [plot for plot in moments.values() if plot],
        "wrench": plots_by_method(estimate, wrench),
    }
    return plots, [name for name, plot in moments.items() if plot is None]


def method_repetitions(
    estimate: Estimate,
    found: Found,
    curves: Sequence[MeanCurve],
    *,
    key: str = "repetitions",
    title: str = "Repetitions",
) -> Section:
    """Joint angles, moments and wrench of every method; or why there are none."""
    every = plots_by_method(estimate, curves)
    plots = {kind: [plot for plot in every if kind_of(plot.curves[0][1]) == kind] for kind in KINDS}
    return _section(found, plots, {"": _styles(curves)}, key=key, title=title)


def _section(
    found: Found,
    plots: Mapping[str, Sequence[Plot]],
    keys: Mapping[str, tuple[LineStyle, ...]],
    *,
    key: str = "repetitions",
    title: str = "Repetitions",
    more: str = "",
) -> Section:
    """``keys``: lines of each part, or "" of the whole section."""
    many = any(curve.n.max() > 1 for every in plots.values() for plot in every for _, curve in plot.curves)
    band = ONE_SD if many else ""
    parts = [
        Section(f"{key}-{kind}", KINDS[kind], "", [_panel(plot) for plot in every], lines=keys.get(kind, ()))
        for kind, every in plots.items()
        if every
    ]
    what = "squat" if found.movement == "squat" else "gait cycle of each foot"
    about = (
        f"Each {what} from 0 to 100 % of its time: their mean, and one sample standard deviation as a band. Moments "
        "and forces are divided by the body mass; a repetition in which one is not measured in every frame is left out "
        "of its mean."
    )
    return Section(
        key,
        title,
        f"{found.note} {about}{more}" if parts else "",
        notes=() if parts else (found.note,),
        parts=parts,
        lines=keys.get("", ()),
        band=band if "" in keys else "",
    )


def plots_by_method(estimate: Estimate, curves: Sequence[MeanCurve]) -> list[Plot]:
    """A plot for each quantity and side, in the order of appearance; what does not move, or is measured only, is left
    out."""
    found: dict[tuple[str, str], list[MeanCurve]] = {}
    for curve in curves:
        found.setdefault((curve.side, curve.quantity), []).append(curve)
    grows = dict(zip(estimate.coordinate_names, ways_of(estimate), strict=True))
    plots = []
    for group in found.values():
        if not any(curve.method != MEASURED and _moves(curve.mean[curve.n > 0]) for curve in group):
            continue
        first, styles = group[0], method_styles(curve.method for curve in group)
        notes = [first.times + ("" if first.n.max() > 1 else ", no standard deviation")]
        if about := note_of(estimate, first):
            notes.insert(0, about)
        plots.append(Plot(_title(first, grows), ", ".join(notes), [(styles[c.method], c) for c in _in_order(group)]))
    return plots


def _styles(curves: Sequence[MeanCurve]) -> tuple[LineStyle, ...]:
    return tuple(method_styles(dict.fromkeys(curve.method for curve in curves)).values())


def _moves(values: np.ndarray) -> bool:
    return bool(len(values) and np.ptp(values) > 0.0)


def kind_of(curve: MeanCurve) -> str:
    """One of `KINDS`."""
    return "wrench" if curve.quantity in COMPONENTS else "moments" if curve.quantity.endswith("/moment") else "angles"


def note_of(estimate: Estimate, curve: MeanCurve) -> str:
    """What a planar model's moment stands for."""
    return moment_note(estimate, curve.quantity.removesuffix("/moment")) if kind_of(curve) == "moments" else ""


def _title(curve: MeanCurve, grows: Mapping[str, str]) -> str:
    """`Knee`, with the foot where each has its own cycles."""
    name = curve.quantity.removesuffix("/moment")
    text = COMPONENT_LABELS[name][0] if name in COMPONENT_LABELS else sentence(words(name))
    text += grows.get(name, "") if kind_of(curve) == "moments" else ""
    return text if curve.side == "both" else f"{text}, {curve.side} cycle"


def _in_order(group: Sequence[MeanCurve]) -> list[MeanCurve]:
    """What is drawn, the plates' curve at the bottom, the filters' on top; AT's angles are the classical ones."""
    rank = {"measured": 0, "AT": 1, "IK": 1, "classical": 2}
    kinds = [curve.method.split(" ")[0] for curve in group]
    same = kind_of(group[0]) == "angles" and "classical" in kinds
    kept = [curve for curve, kind in zip(group, kinds, strict=True) if not (same and kind == "AT")]
    return sorted(kept, key=lambda curve: rank.get(curve.method.split(" ")[0], 3))


def _sides(
    joint: Joint,
    curves: Mapping[tuple[str, str], MeanCurve],
    suffix: str,
    styles: Mapping[str, LineStyle],
    ways: Sequence[str],
) -> Plot | None:
    drawn = []
    for side in joint.columns:
        name = joint.stem + (f"_{side[0]}" if side else "") + suffix
        # squats have one cycle for both; in gait a limb has its own foot's, the trunk the right one's
        cycle = next((c for c in ("both", side or "right", "right", "left") if (c, name) in curves), None)
        if cycle is not None:
            drawn.append((side, curves[cycle, name]))
    if not any(curve.n.any() for _, curve in drawn):
        return None
    note = "; ".join(f"{f'{side}: ' if side else ''}{curve.times}" for side, curve in drawn)
    one = next(iter(joint.columns.values()))
    title = joint.name if suffix else joint.title
    return Plot(title + ways[one], note, [(styles[side], curve) for side, curve in drawn if curve.n.any()][::-1])


def _panel(plot: Plot) -> Panel:
    lines = []
    for style, curve in plot.curves:
        mean, sd = drawn(curve)
        band = 0.5 * sd if style.band and curve.n.max() > 1 else None  # a chart's band is two wide
        lines.append(Line(mean, style.colour, style.width, band, dashes=style.dashes))
    first = plot.curves[0][1]
    label, least = percent_label(first.movement), least_range(first)
    return chart(plot.title, curve_unit(first), PERCENT, lines, note=plot.note, least_range=least, x_label=label)


def least_range(curve: MeanCurve) -> float:
    """Range of its panel's axis at least, in the curve's unit; of moments and forces N m/kg and N/kg."""
    return {"deg": 2.0, "mm": 10.0}.get(curve.unit, 0.02)


def drawn(curve: MeanCurve) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation as they are shown: moments and forces per kg of body mass."""
    mean, sd = (curve.mean, curve.sd) if curve.mean_per_kg is None else (curve.mean_per_kg, curve.sd_per_kg)
    assert sd is not None
    return mean, sd


def percent_label(movement: str) -> str:
    """What 0 to 100 % are of."""
    return "% of the squat" if movement == "squat" else "% of the gait cycle"


def curve_unit(curve: MeanCurve) -> str:
    """Unit of `drawn`."""
    return curve.unit if curve.mean_per_kg is None else f"{curve.unit}/kg"
