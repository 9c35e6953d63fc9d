"""Powers, work and how alike the sides are: sections of a body with a right and a left."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dynakin.report.chart import Line, Panel, chart
from dynakin.report.labels import since
from dynakin.report.sections.section import Page, Section
from dynakin.report.sides import Joint, joints_of, normalising_mass, side_key, side_lines
from dynakin.report.styles import source_key
from dynakin.report.text_tables import TextTable
from dynakin.results.estimate import Estimate
from dynakin.results.measures.sources import moment_sources
from dynakin.results.naming import listed, number


def power_section(page: Page) -> Section | None:
    """Power of the joints over the body mass, and the work of each coordinate."""
    estimate, work, mass = page.estimate, page.metrics["work"], normalising_mass(page.estimate)
    if work is None:
        return None
    powers = estimate.powers() / (mass or 1.0)
    drawn = np.asarray((np.nan_to_num(powers) != 0.0).any(axis=0))
    joints = [
        joint
        for joint in joints_of(estimate)
        if joint.region != "Whole body" and any(drawn[k] for k in joint.columns.values())
    ]
    if not joints:
        return None
    unit = "W/kg" if mass else "W"
    source = moment_sources(estimate.data)
    legs: list[Panel] = []
    others: list[Panel] = []
    colours = {side: line.colour for side, line in side_lines(estimate).items()}
    for joint in joints:
        lines = [Line(powers[:, k], colours[side], source=source[:, k]) for side, k in joint.columns.items()]
        note = "; ".join(
            f"{f'{side} ' if side else ''}peak {number(own['peak_w'] / (mass or 1.0), unit, digits=2)}"
            for side, k in joint.columns.items()
            if (own := work.get(_name(estimate, k)))
        )
        shown = chart(joint.name, unit, estimate.time, lines[::-1], note=note, least_range=0.05)
        (legs if joint.region == "Legs" else others).append(shown)
    window = page.metrics["window"]
    seconds = f"{window['start_s']:.4g} to {window['end_s']:.4g} s"
    return Section(
        "powers",
        "Powers and work",
        "Moment times speed: positive where energy is added to the body. Work is the sum of its positive and of its "
        "negative parts. Peaks and work are those of measured moments: where a leg’s are not measured throughout, of "
        f"its stances and swings that are measured from end to end.{since(estimate)}",
        legs or others,
        folded=others if legs else [],
        folded_title="Powers of trunk and arms",
        lines=(*side_key(estimate), *source_key(source)),
        tables=[table for table in (_work_table(estimate, joints, work, f"Work, {seconds}"),) if table.rows],
    )


def _work_table(estimate: Estimate, joints: list[Joint], work: Mapping[str, Any], title: str) -> TextTable:
    rows: list[tuple[str, ...]] = []
    for joint in joints:
        for side, k in joint.columns.items():
            own = work.get(_name(estimate, k))
            if own is None:
                continue
            cells = [number(own[key], digits=3) for key in ("positive_j", "negative_j")]
            cells += [number(own[key], digits=2) for key in ("positive_j_per_kg", "negative_j_per_kg")]
            cells += [number(own[key], digits=3) for key in ("peak_w", "lowest_w")] + [str(own["frames"])]
            first = not rows or joint.name not in [row[0] for row in rows]
            rows.append((joint.name if first else "", side or "–", *cells))
    headings = ("", "side", "positive, J", "negative, J", "positive, J/kg", "negative, J/kg", "peak, W", "lowest, W")
    return TextTable(title, (*headings, "frames"), rows, tuple(range(2, 9)), folded=len(rows) > 12)


def asymmetry_section(page: Page) -> Section | None:
    """Symmetry indices of legs, and folded of arms."""
    estimate, metrics = page.estimate, page.metrics
    found = metrics["asymmetry"]
    if found is None or metrics["work"] is None:
        return None
    joints = [joint for joint in joints_of(estimate) if len(joint.columns) == 2]
    keys = ("range", "peak_moment", "positive_work", "negative_work")
    tables = []
    for region, folded in (("Legs", False), ("Arms", True)):
        rows = []
        for joint in joints:
            if joint.region == region and joint.stem in found["coordinates"]:
                own = found["coordinates"][joint.stem]
                rows.append(
                    (joint.name, *(_percent(own[key], key in found["small"].get(joint.stem, ())) for key in keys))
                )
        if rows:
            headings = ("", "range", "peak moment", "positive work", "negative work")
            tables.append(TextTable(f"{region}: symmetry index, %", headings, rows, (1, 2, 3, 4), folded))
    if found["feet"] is not None:
        row = ("Feet", *(_percent(found["feet"][key]) for key in ("peak_vertical_force", "impulse")))
        tables.insert(0, TextTable("Feet: symmetry index, %", ("", "peak vertical force", "impulse"), [row], (1, 2)))
    return Section(
        "asymmetry",
        "Right and left",
        "Right less left over their mean, in per cent (Robinson, Herzog and Nigg 1987): positive where the right is "
        "larger, 0 where they are alike. In brackets where both are small, so that the ratio says little."
        + _compared(found),
        tables=tables,
    )


def _compared(found: Mapping[str, Any]) -> str:
    """What the sides’ moments and forces were compared over, or why they were not."""
    stances, reason = found["stances"], found["reason"]
    how = ""
    if stances is not None and all(stances.values()):
        each = listed([f"{count} of the {foot} foot" for foot, count in stances.items()])
        how = f" Moments, work and forces of the legs are means over whole measured stances: {each}."
    return how + (f" {reason}" if reason else "")


def _percent(value: float | None, small: bool = False) -> str:
    if value is None:
        return "–"
    text = f"{value:+z.0f}".replace("-", "−")
    text = "0" if text == "+0" else text
    return f"({text})" if small else text


def _name(estimate: Estimate, k: int) -> str:
    return estimate.coordinate_names[k]
