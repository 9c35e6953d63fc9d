"""Angles and moments of the joints: right and left over each other, in a plane each coordinate by itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dynakin.report.chart import Line, Panel, band_is_too_wide, chart
from dynakin.report.labels import moment_note, since
from dynakin.report.sections.section import Page, Section
from dynakin.report.sides import REGIONS, Joint, joints_of, normalising_mass, side_key, side_lines
from dynakin.report.styles import BAND, source_key
from dynakin.results.measures.angles import reported, ways_of
from dynakin.results.measures.sources import DERIVED, MEASURED, PRIOR, UNKNOWN, moment_sources
from dynakin.results.naming import listed, number, sentence


def angle_section(page: Page) -> Section:
    """Coordinates with their bands of uncertainty."""
    estimate, lines_of = page.estimate, side_lines(page.estimate)
    sign, offset, _, asked = shown = reported(estimate)
    values, sd = shown.of(estimate.known("coordinates")), estimate.values("coordinates_sd")
    ways = ways_of(estimate, sign)
    about = "Each in the direction in which the model counts, from the model’s zero."
    if asked:
        clinical = estimate.data.attrs["angle_signs"] == "clinical"
        zero = "from the standing zero" if np.any(offset) else "from the model’s zero"
        about = f"As in angles.sto: {zero}, {'clinical' if clinical else 'OpenSim’s'} signs."

    def draw(joint: Joint) -> Panel:
        factor, unit = (180.0 / np.pi, "deg") if joint.rotation else (1000.0, "mm")
        one = next(iter(joint.columns.values()))
        ranges, lines = [], []
        for side, k in joint.columns.items():
            own = factor * values[:, k]
            if not np.isfinite(own).any():
                ranges.append(f"{f'{side} ' if side else ''}not known")
                continue
            low, high = float(np.nanmin(own)), float(np.nanmax(own))
            band, wide = _band(own, factor * sd[:, k])
            lines.append(Line(own, lines_of[side].colour, 1.2, band))
            moved = f"{number(low)} to {number(high)}" if high > low else f"locked at {number(low, unit)}"
            ranges.append(f"{f'{side} ' if side else ''}{moved}{wide}")
        least = 2.0 if joint.rotation else 10.0
        return chart(
            joint.title + ways[one], unit, estimate.time, lines[::-1], note="; ".join(ranges), least_range=least
        )

    panels, parts = _by_region("angles", joints_of(estimate), draw)
    return Section(
        "angles",
        "Joint angles",
        f"{about} The band is two standard deviations wide on either side, as the filter itself believes. How far that "
        "zero lies from another model’s, or from a bone’s, is not in it: a degree or more, the same in all frames. A "
        "band that would hide the line is not drawn, its size stands above the panel.",
        panels,
        lines=side_key(estimate),
        band=BAND,
        parts=parts,
    )


def moment_section(page: Page) -> Section:
    """Moments, in space over the body mass; what is derived is dashed, a prior dotted, what is absent left out."""
    estimate, lines_of = page.estimate, side_lines(page.estimate)
    mass = normalising_mass(estimate)
    moments = estimate.values("moments") / (mass or 1.0)
    sd = estimate.values("moments_sd") / (mass or 1.0) if "moments_sd" in estimate.data else None
    source, peaks = moment_sources(estimate.data), page.metrics["peak_moments_per_kg"] if mass else None
    found, ways = page.metrics["moments"] or UNKNOWN, ways_of(estimate)

    def draw(joint: Joint) -> Panel | None:
        unit = ("N m" if joint.rotation else "N") + ("/kg" if mass else "")
        notes, lines = [], []
        for side, k in joint.columns.items():
            who, name = f"{side} " if side else "", estimate.coordinate_names[k]
            if not np.isfinite(moments[:, k]).any():
                notes.append(f"{who}absent")
                continue
            band, wide = _band(moments[:, k], None if sd is None else sd[:, k], source[:, k])
            lines.append(Line(moments[:, k], lines_of[side].colour, 1.2, band, source[:, k]))
            if peaks and name in peaks:
                notes.append(f"{who}{_two_digits(peaks[name]['smallest'])} to {_two_digits(peaks[name]['largest'])}")
            elif peaks is not None:
                notes.append(f"{who}no whole measured stance")
            elif about := f"{moment_note(estimate, name)}{wide}".strip():
                notes.append(about)
        if not lines:
            return None
        return chart(joint.name + ways[k], unit, estimate.time, lines[::-1], note="; ".join(notes), least_range=0.02)

    joints = [joint for joint in joints_of(estimate) if joint.region != "Whole body"]
    panels, parts = _by_region("moments", joints, draw)
    absent = [
        f"{side} {joint.name.lower()}".strip()
        for joint in joints
        for side, k in joint.columns.items()
        if not np.isfinite(moments[:, k]).any()
    ]
    text = [found["verdict"]]
    if shown := bool(panels or parts):
        about = "What muscles and ligaments do about each joint, in the direction in which its coordinate grows"
        text.append(f"{about}, over the body mass." if mass else f"{about}.")
        text += [_IN_A_PLANE] if page.planar else []
    words = {DERIVED: "derived moments are dashed", PRIOR: "those that take a prior are dotted"}
    if marked := [how for code, how in words.items() if (source == code).any()]:
        text.append(f"{sentence(listed(marked))}; no peak, work or mean curve holds them.")
    if absent:
        text.append(f"Absent in every frame: {listed(absent, 12)}.")
    return Section(
        "moments",
        "Joint moments",
        " ".join(text) + (since(estimate) if peaks else ""),
        panels,
        lines=(*side_key(estimate), *source_key(source)) if shown else (),
        band=BAND if sd is not None and shown else "",
        notes=tuple(found["reasons"]),
        parts=parts,
    )


_IN_A_PLANE = (
    "The model has one leg and one arm for both sides, so theirs are the sums of both. At the toe there is no joint: "
    "its “moment” is the ground’s about the toe."
)


def _band(values: np.ndarray, sd: np.ndarray | None, source: np.ndarray | None = None) -> tuple[np.ndarray | None, str]:
    """The deviation to draw; where the band of what is measured would press the line flat none, and its size in words.
    Of derived values and priors it may: it says how little they say."""
    measured = sd if sd is None or source is None else np.where(source == MEASURED, sd, np.nan)
    if sd is None or measured is None or not band_is_too_wide(values, measured):
        return sd, ""
    return None, f" (2 sd {number(2.0 * float(np.nanmedian(measured)), digits=2)})"


def _two_digits(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "−")


def _by_region(
    key: str, joints: list[Joint], draw: Callable[[Joint], Panel | None]
) -> tuple[list[Panel], list[Section]]:
    """Legs open, the rest folded: a page of twenty-five panels hides what is asked for most. Without regions all are
    open."""
    drawn = [(joint.region, panel) for joint in joints if (panel := draw(joint)) is not None]
    parts = []
    for region in REGIONS:
        panels = [panel for its, panel in drawn if its == region]
        anchor = f"{key}-{region.split()[0].lower()}"
        if panels and region == "Legs":
            parts.append(Section(anchor, region, "", panels))
        elif panels:
            parts.append(Section(anchor, "", "", folded=panels, folded_title=region))
    return [panel for its, panel in drawn if not its], parts
