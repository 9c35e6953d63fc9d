"""The constants: lengths and masses over time, posterior against prior, and movements that would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from dynakin.arrays import rms
from dynakin.elements import element
from dynakin.report.bars import Bar, share_bars
from dynakin.report.chart import Bound, Line, Panel, chart
from dynakin.report.labels import parameter_label, short_marker_names, signed_percent
from dynakin.report.sections.section import Page, Section
from dynakin.report.styles import BAND, BOUND_LINE, ESTIMATED, ESTIMATED_LINE
from dynakin.report.text_tables import TextTable
from dynakin.results.estimate import Estimate
from dynakin.results.measures.posterior import JUDGEMENT_WORDS, KNOWN, NOTHING, group_of, posterior_in_words
from dynakin.results.naming import number, sentence, shown_unit, words
from dynakin.results.records import Parameter

_KEY = (ESTIMATED_LINE, BOUND_LINE)
_SETTLING = "How the filter settles on each length."
_SMOOTHED = (
    "Each length as all frames show it; it moves as far as its drift lets it. Masses, which do not drift, are one "
    "number each, in the table of parameters."
)


def length_section(page: Page) -> Section:
    """Segment lengths over time between their bounds."""
    lengths = [p for p in page.estimate.parameters if p.kind == "length" and p.estimated]
    return Section(
        "lengths",
        "Segment lengths",
        f"{_SMOOTHED if page.estimate.smoothed else _SETTLING} A line on its bound says that the model does not fit "
        "there.",
        [_path(page, p, words(element(p.name).owner), *_length_unit(p)) for p in lengths],
        lines=_KEY,
        band=BAND,
    )


def mass_section(page: Page) -> Section | None:
    """Segment masses over time between their bounds; none of a smoothed run, which has one value for all frames."""
    if page.estimate.smoothed:
        return None
    masses = [p for p in page.estimate.parameters if p.name.endswith("/mass") and p.kind == "inertia" and p.estimated]
    sides = " Limbs count both sides." if page.planar else ""
    return Section(
        "masses",
        "Segment masses",
        f"From the anthropometric table to what the plates and the movement suggest.{sides} Masses are hard "
        "to separate by a squat alone: read them with their bands.",
        [_path(page, p, words(p.segment), 1.0, "kg") for p in masses],
        lines=_KEY,
        band=BAND,
    )


def _length_unit(p: Parameter) -> tuple[float, str]:
    return (1.0, "") if p.unit == "1" else shown_unit(p.unit)


def _path(page: Page, p: Parameter, title: str, factor: float, unit: str) -> Panel:
    """A constant over time, with its band and the bounds that are near."""
    path = page.estimate.data["state"].sel(element=p.name).values
    sd = np.hypot(page.estimate.data["state_sd"].sel(element=p.name).values, p.skin_sd)
    change = p.change_percent()
    note = f"{number(factor * p.initial)} to {number(factor * p.value, unit)}"
    if change is not None:
        note += f" ({signed_percent(change)})"
    if p.at_bound:
        note += ", on its bound"
    # bounds far from the path are left out: they would press it flat
    reach, middle = 3.0 * float(np.ptp(path)) + 2.0 * float(np.nanmax(sd)), float(np.median(path))
    levels = ((p.lower, "lower bound"), (p.upper, "upper bound"))
    bounds = [Bound(factor * v, word) for v, word in levels if v is not None and abs(v - middle) <= reach]
    line = Line(factor * path, ESTIMATED, 1.3, factor * sd)
    least = 4.0 * factor * float(np.nanmax(sd))  # the whole band is seen, and a line that does not move in it
    return chart(sentence(title), unit, page.estimate.time, [line], note=note, bounds=bounds, least_range=least)


def observability_section(page: Page) -> Section | None:
    """Posterior against prior of every constant; base parameters, advice and gauges where they were looked for."""
    estimate, block = page.estimate, page.metrics.get("identifiability") or {}
    groups = _groups(estimate, block.get("parameters", {}))
    base = block.get("base_parameters", {}).get("parameters", {})
    if base:
        groups["Base parameters"] = [
            Bar(_base_label(name), entry["share"], _sizes(entry["prior_sd"], entry["sd"], _base_unit(name)))
            for name, entry in base.items()
        ]
    if not groups:
        return None
    left = {title: groups[title] for title in groups if title in ("Lengths", "Masses", "First moments")}
    left |= {title: groups[title] for title in groups if title == "Moments of inertia"}
    if not page.planar:  # in space there are nine numbers a segment, too many to look at one by one
        left = {title: rows for title, rows in groups.items() if title in ("Lengths", "Masses")}
        groups = left | {title: rows for title, rows in groups.items() if title == "Marker places"}
    right = {title: rows for title, rows in groups.items() if title not in left}
    tried = block.get("excitation", {}).get("tried") is not None
    parts = [
        Section(f"identifiability-{anchor}", title, text, notes=tuple(sentence(note) for note in notes))
        for anchor, title, text, notes in (
            ("advice", *(_TRIED if tried else _NOT_TRIED), block.get("advice", [])),
            ("gauges", "What no measurement observes", _GAUGES, block.get("gauges", {}).get("words", [])),
        )
        if notes
    ]
    if base:
        parts.insert(0, Section("identifiability-base", "Base parameters", _BASE, tables=[_base_table(base)]))
    return Section(
        "identifiability",
        "Observability",
        "Posterior against prior: the whole line is each constant’s standard deviation before the first frame, the "
        f"blue part that after the last. Up to the first mark ({KNOWN:g}) a value is the data’s, from the second "
        f"({NOTHING:g}) on it is the prior’s. {_WITHOUT_SKIN if 'Lengths' in groups else ''}A base parameter is named "
        "after one of the numbers in it.",
        wide=[_panel(rows) for rows in (left, right) if rows],
        notes=(*posterior_in_words(estimate), *_base_sentence(block)),
        parts=parts,
    )


_WITHOUT_SKIN = (
    "Of lengths it is what the filter sees: skin that follows a joint looks like a length, and is in the bands above "
    "and in the table of parameters. "
)
_BASE = (
    "The ground reaction depends on the segments’ inertia through these sums only: what leaves them as they are, no "
    "movement can identify."
)
_TRIED = (
    "Movements that would help",
    "Each motion was looked at in place of this recording’s; a factor says how much smaller the standard deviation "
    "would have ended.",
)
_NOT_TRIED = ("What the data leave open", "Why the data say nothing about these numbers.")
_GAUGES = (
    "Along these directions constants and angles’ zeros can move against each other without any change in markers or "
    "plates. Only what is known beforehand holds them."
)


def _groups(estimate: Estimate, entries: Mapping[str, Mapping[str, Any]]) -> dict[str, list[Bar]]:
    names = short_marker_names(estimate.marker_names)
    found: dict[str, list[Bar]] = {}
    of_marker: dict[str, list[Mapping[str, Any]]] = {}
    recorded = _recorded(estimate)
    for p in estimate.parameters:
        if p.name not in entries or (group := group_of(p)) is None:
            continue
        entry = entries[p.name]
        if group == "marker places":
            of_marker.setdefault(element(p.name).owner, []).append(entry)
        else:
            sizes = _sizes(entry["prior_sd"], entry["sd"], p.unit)
            found.setdefault(sentence(group), []).append(Bar(_label(p, names), entry["share"], sizes))
    for marker, axes in of_marker.items():
        prior, after = (float(rms([axis[key] for axis in axes])) for key in ("prior_sd", "sd"))
        label = names.get(recorded.get(marker, marker), marker)
        found.setdefault("Marker places", []).append(Bar(label, after / prior, _sizes(prior, after, "m")))
    return found


def _recorded(estimate: Estimate) -> dict[str, str]:
    """The model's marker names and the recording's, which stand in the same order."""
    of_model = list(dict.fromkeys(element(p.name).owner for p in estimate.parameters if p.kind == "marker"))
    return dict(zip(of_model, estimate.marker_names, strict=False))


def _label(p: Parameter, names: dict[str, str]) -> str:
    if p.kind == "length" or p.name.endswith("/mass"):
        return words(p.segment)
    return parameter_label(p, names).replace("first moment, ", "").replace("inertia zz", "").strip()


def _sizes(prior: float, after: float, unit: str) -> str:
    factor, unit = shown_unit(unit)
    return f"{number(factor * prior, digits=2)} → {number(factor * after, unit, digits=2)}"


def _base_label(name: str) -> str:
    _, segment, kind = element(name)
    short = {"mass": "mass", "mx": "forward", "my": "up", "mz": "right"}.get(kind, kind.replace("i", "inertia ", 1))
    return f"{words(segment)} {short.replace('inertia zz', 'inertia')}"


def _base_unit(name: str) -> str:
    return {"mass": "kg", "mx": "kg m", "my": "kg m", "mz": "kg m"}.get(name.rpartition("/")[2], "kg m2")


def _base_sentence(block: Mapping[str, Any]) -> list[str]:
    found = block.get("base_parameters")
    if not found:
        return []
    judgements = [entry["judgement"] for entry in found["parameters"].values()]
    return [
        f"The ground reaction depends on {found['rank']} sums of the {found['of']} inertial numbers (base parameters): "
        f"{judgements.count('known')} of them are known from the data, {judgements.count('partly')} in part, of "
        f"{judgements.count('nothing')} the data say nothing."
    ]


def _base_table(base: Mapping[str, Mapping[str, Any]]) -> TextTable:
    rows = []
    for name, entry in base.items():
        numbers = (number(entry[key]) for key in ("value", "prior_sd", "sd"))
        unit = _base_unit(name).replace("m2", "m²")
        rows.append((sentence(entry["words"]), unit, *numbers, JUDGEMENT_WORDS[entry["judgement"]]))
    headings = ("base parameter", "unit", "value", "prior sd", "posterior sd", "")
    return TextTable("The base parameters as the sums that they are", headings, rows, (2, 3, 4), folded=True)


def _panel(groups: Mapping[str, Sequence[Bar]]) -> Panel:
    titles = [title if k == 0 else title.lower() for k, title in enumerate(groups)]
    title = " and ".join([", ".join(titles[:-1]), titles[-1]] if len(titles) > 1 else titles)
    note = "standard deviation left, as a part of the prior one; prior → end"
    description = f"{title}: standard deviation at the end over that before"
    return share_bars(title, note, groups, (KNOWN, NOTHING), description)
