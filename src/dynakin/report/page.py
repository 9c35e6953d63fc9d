"""Puts the report together: words, figures and tables into one HTML file."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
import tomli_w

from dynakin.report.findings.finding import Insight
from dynakin.report.insights import in_short, insights
from dynakin.report.labels import parameter_label, short_marker_names
from dynakin.report.playback import playback
from dynakin.report.sections.constants import length_section, mass_section, observability_section
from dynakin.report.sections.forces import foot_section, mass_centre_section, wrench_section
from dynakin.report.sections.joints import angle_section, moment_section
from dynakin.report.sections.markers import marker_section
from dynakin.report.sections.methods import methods_section
from dynakin.report.sections.repetitions import repetition_section
from dynakin.report.sections.section import Page, Section
from dynakin.report.sections.work import asymmetry_section, power_section
from dynakin.results.estimate import Estimate
from dynakin.results.files.config import plain, versions
from dynakin.results.measures.facing import facing
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.sources import UNKNOWN
from dynakin.results.naming import listed, number, plural, shown_unit
from dynakin.settings.lag import in_words
from dynakin.validation.methods import ComparedTrial

_BOTH = (repetition_section, methods_section, length_section, mass_section, observability_section)
SECTIONS: dict[str, tuple[Callable[[Page], Section | None], ...]] = {
    "plane": (marker_section, wrench_section, angle_section, moment_section, *_BOTH),
    "space": (
        angle_section,
        moment_section,
        foot_section,
        power_section,
        asymmetry_section,
        mass_centre_section,
        marker_section,
        wrench_section,
        *_BOTH,
    ),
}
"""The sections of a run's page in their order, by what the model moves in; one without anything to show is left out."""


def render_page(template: str, **content: Any) -> str:
    """One of the templates, with the versions, which all pages have."""
    return templates().get_template(template).render(versions=versions(), **content)


@cache
def templates() -> jinja2.Environment:
    """All templates of pages, compiled."""
    found = jinja2.Environment(
        loader=jinja2.PackageLoader("dynakin.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    for name in found.list_templates(extensions=["j2"]):
        found.get_template(name)
    return found


def render_report(
    estimate: Estimate, *, metrics: dict[str, Any] | None = None, comparison: ComparedTrial | None = None
) -> str:
    """The report of a run as one HTML text that needs nothing else.

    Args:
        comparison: this estimate against the reference methods (`dynakin.validation.trial_of`).
    """
    estimate = facing(estimate)
    metrics = metrics or compute_metrics(estimate)
    found = insights(estimate, metrics)
    preset = estimate.config.get("preset")
    return render_page(
        "report.html.j2",
        **_summary(estimate, metrics, found),
        eyebrow="dynakin report",
        chips=[
            f"model {estimate.model_name}",
            *([f"preset {preset}"] if preset else []),
            f"dynakin {versions()['dynakin']}",
        ],
        player=playback(estimate),
        sections=sections_of(Page(estimate, metrics, comparison)),
        messages=list(map(str, estimate.messages)),
        events=[event for event in estimate.events if event.kind != "missing"],
        parameters=_parameter_groups(estimate),
        configuration=tomli_w.dumps(plain(estimate.config)),
    )


def render_summary(estimate: Estimate, metrics: dict[str, Any]) -> str:
    """What the report begins with, as a piece of HTML for a notebook: what was run, its figures, warnings in full."""
    found = insights(estimate, metrics)
    content = _summary(estimate, metrics, found) | {"insights": [each for each in found if each.level == "warning"]}
    return render_page("summary.html.j2", **content)


def _summary(estimate: Estimate, metrics: dict[str, Any], found: list[Insight]) -> dict[str, Any]:
    return {
        "title": estimate.recording.name,
        "what_was_run": _what_was_run(estimate),
        "figures": _headline(estimate, metrics),
        "moments": (metrics["moments"] or UNKNOWN)["verdict"],
        "insights": found,
        "in_short": in_short(found),
    }


def sections_of(page: Page) -> list[Section]:
    """The `SECTIONS` that have something to show."""
    made = (make(page) for make in SECTIONS["plane" if page.planar else "space"])
    return [section for section in made if section is not None and not section.empty]


def write_report(
    estimate: Estimate, path: Path, *, metrics: dict[str, Any] | None = None, comparison: ComparedTrial | None = None
) -> None:
    """Write `render_report` to ``path``."""
    html = render_report(estimate, metrics=metrics, comparison=comparison)
    path.write_text(html, encoding="utf-8", newline="\n")


def _what_was_run(estimate: Estimate) -> str:
    """One sentence: the recording, the model, the data used."""
    recording, time = estimate.recording, estimate.time
    plates = plural(len(recording.plates), "force plate") if recording.plates else "no force plate"
    mass = estimate.config.get("mass_kg")
    person = f" of a person of {mass:.4g} kg" if isinstance(mass, int | float) else ""
    return (
        f"{number(float(time[-1] - time[0]), 's')}{person}: {plural(len(time), 'frame')} at "
        f"{recording.rate:.4g} Hz, {len(estimate.marker_names)} of {len(recording.marker_names)} "
        f"markers, {plates}; each frame estimated {in_words(estimate.lag_s)}."
    )


def _headline(estimate: Estimate, metrics: dict[str, Any]) -> list[dict[str, str]]:
    rms = metrics["wrench"]["rms"] if metrics["wrench"] else {}
    stuck = [p for p in estimate.parameters if p.at_bound]
    free = [p for p in estimate.parameters if p.estimated and p.lower is not None]
    mean = metrics["markers"]["mean_rms_mm"] if metrics["markers"] else None
    tiles = [{"value": number(mean, digits=2), "unit": "mm", "label": "markers, mean RMS"}]
    for letter, what, unit in (("f", "ground forces", "N"), ("m", "ground moment", "N m")):
        if names := [name for name in rms if name.startswith(letter)]:
            value = " / ".join(number(rms[name], digits=2) for name in names)
            tiles.append({"value": value, "unit": unit, "label": f"{what} {listed(names)}, RMS"})
    tiles.append({"value": f"{len(stuck)} of {len(free)}", "unit": "", "label": "parameters on a bound"})
    slow = estimate.timing.median_us >= 1000.0
    step = number(estimate.timing.median_us * (1e-3 if slow else 1.0), digits=2)
    tiles.append({"value": step, "unit": "ms" if slow else "µs", "label": "a step, median"})
    return tiles


_KINDS = {"length": "lengths", "marker": "marker places", "inertia": "masses and inertias", "plates": "plates"}


def _parameter_groups(estimate: Estimate) -> list[dict[str, Any]]:
    """One table, or, where it would be too long to find anything in, one a kind."""
    rows = _parameter_rows(estimate)
    if estimate.planar:
        return [{"title": "Every parameter", "rows": rows}]
    kinds = dict.fromkeys(row["kind"] for row in rows)
    return [
        {"title": f"Parameters: {_KINDS.get(kind, kind)}", "rows": [row for row in rows if row["kind"] == kind]}
        for kind in kinds
    ]


def _parameter_rows(estimate: Estimate) -> list[dict[str, Any]]:
    names = short_marker_names(estimate.marker_names)
    rows = []
    for p in estimate.parameters:
        cells = [p.value, p.sd, p.initial, p.table, p.lower, p.upper]
        rows.append(
            {
                "kind": p.kind,
                "label": parameter_label(p, names),
                "unit": shown_unit(p.unit)[1],
                "cells": [_cell(cell, p.unit) for cell in cells],
                "at_bound": p.at_bound,
                "estimated": p.estimated,
            }
        )
    return rows


def _cell(value: float | None, unit: str) -> str:
    factor, _ = shown_unit(unit)
    if value is None or factor == 1.0:
        return number(value)
    return f"{factor * value:z.1f}".replace("-", "−")
