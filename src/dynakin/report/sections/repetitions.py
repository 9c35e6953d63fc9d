"""Repetitions in the page: how many, and mean curves over 0 to 100 %."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynakin.report.labels import COMPONENT_LABELS, moment_note
from dynakin.report.method_styles import method_styles
from dynakin.report.sections.method_panels import curve_unit, repeated
from dynakin.report.sections.panels import Panel
from dynakin.report.sections.section import Section
from dynakin.results.estimate import COMPONENTS, Estimate
from dynakin.results.measures.mean_curves import MEASURED, MeanCurve
from dynakin.results.measures.repetitions import Found
from dynakin.results.naming import sentence, words


def repetition_section(
    estimate: Estimate, found: Found, curves: Sequence[MeanCurve], *, key: str = "repetitions", title: str = ""
) -> Section:
    """Mean curves of joint angles, moments and wrench with a band of one standard deviation; or why there are none."""
    styles = method_styles(dict.fromkeys(curve.method for curve in curves))
    parts = [
        Section(f"{key}-{kind}", heading, "", panels)
        for kind, heading in (
            ("angles", "Coordinates"),
            ("moments", "Moments, per kg"),
            ("wrench", "Ground reaction, per kg"),
        )
        if (panels := [_panel(estimate, key, group, kind) for group in grouped(curves) if kind_of(group) == kind])
    ]
    what = "squat" if found.movement == "squat" else "gait cycle of each foot"
    about = (
        f"Each {what} from 0 to 100 % of its time: their mean, and one sample standard deviation as a band. Moments "
        "and forces are divided by the body mass; a repetition in which one is not measured in every frame is left out "
        "of its mean."
    )
    return Section(
        key,
        title or "Repetitions",
        f"{found.note} {about}" if parts else "",
        notes=() if parts else (found.note,),
        parts=parts,
        lines=tuple(styles.values()),
        band="± 1 standard deviation" if any(curve.n.max() > 1 for curve in curves) else "",
    )


def grouped(curves: Sequence[MeanCurve]) -> list[list[MeanCurve]]:
    """Curves of one quantity and side together, in the order of appearance; what does not move, or is measured only, is
    left out."""
    found: dict[tuple[str, str], list[MeanCurve]] = {}
    for curve in curves:
        found.setdefault((curve.side, curve.quantity), []).append(curve)
    return [
        group
        for group in found.values()
        if any(curve.method != MEASURED and _moves(curve.mean[curve.n > 0]) for curve in group)
    ]


def _moves(values: np.ndarray) -> bool:
    return bool(len(values) and np.ptp(values) > 0.0)


def kind_of(group: Sequence[MeanCurve]) -> str:
    """ "angles", "moments" or "wrench"."""
    quantity = group[0].quantity
    return "wrench" if quantity in COMPONENTS else "moments" if quantity.endswith("/moment") else "angles"


def title_of(curve: MeanCurve) -> str:
    """`Knee`, with the foot where each has its own cycles."""
    name = curve.quantity.removesuffix("/moment")
    text = COMPONENT_LABELS[name][0] if name in COMPONENT_LABELS else sentence(words(name))
    return text if curve.side == "both" else f"{text}, {curve.side} cycle"


def in_order(group: Sequence[MeanCurve]) -> list[MeanCurve]:
    """What is drawn, the plates' curve at the bottom, the filters' on top; AT's angles are the classical ones."""
    rank = {"measured": 0, "AT": 1, "classical": 2}
    kinds = [curve.method.split(" ")[0] for curve in group]
    same = kind_of(group) == "angles" and "classical" in kinds
    kept = [curve for curve, kind in zip(group, kinds, strict=True) if not (same and kind == "AT")]
    return sorted(kept, key=lambda curve: rank.get(curve.method.split(" ")[0], 3))


def _panel(estimate: Estimate, key: str, group: list[MeanCurve], kind: str) -> Panel:
    first = group[0]
    styles = method_styles(curve.method for curve in group)
    notes = [first.times + ("" if first.n.max() > 1 else ", no standard deviation")]
    if kind == "moments" and (about := moment_note(estimate, first.quantity.removesuffix("/moment"))):
        notes.insert(0, about)
    name = f"{key}-{first.side}-{first.quantity.replace('/', '-')}"
    drawn = [(styles[curve.method], curve) for curve in in_order(group)]
    return repeated(name, title_of(first), curve_unit(first), drawn, note=", ".join(notes))
