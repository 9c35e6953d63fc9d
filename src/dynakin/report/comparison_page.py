"""The page of a comparison: Table II first, then what lies behind it, then what no method had seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import tomli_w

from dynakin.messages import Message, warnings_of
from dynakin.report.findings.finding import Insight
from dynakin.report.page import render_page
from dynakin.report.sections.methods import ABOUT_TABLE2, about_methods, angle_part, moment_part, wrench_part
from dynakin.report.sections.repetitions import method_repetitions
from dynakin.report.sections.section import Section
from dynakin.report.text_tables import angle_text, moment_text, name_of, table2_text, truth_text, unseen_text
from dynakin.results.files.config import plain, versions
from dynakin.results.naming import listed, number, plural, sentence
from dynakin.units import COMPONENTS
from dynakin.validation.methods import ComparedTrial
from dynakin.validation.table2 import MARKERS, Row
from dynakin.validation.unseen import UnseenRow

_FREE = ("persistence", "linear")
"""Methods that cost nothing."""
ABOUT_TRUTH = "The recording is simulated, so that what every method is to find is known."
ABOUT_HELD_OUT = (
    "Parameters identified on one trial, frozen, and the other trial’s wrench predicted from its markers alone; its "
    "plates only judge. A filter that identified well is better than the table on the same markers, and better than "
    "persistence, which costs nothing."
)
ABOUT_UNSEEN = (
    "What cannot be had by following: plates withheld (parameters of the first half, wrench of the second), one marker "
    "left out at a time after the adaptation, and the state carried ahead without a measurement. Persistence holds the "
    "last value, linear extrapolation the last slope."
)


def render_comparison(
    trials: Sequence[ComparedTrial],
    tables: Mapping[str, Sequence[Any]],
    settings: Sequence[Mapping[str, Any]],
    names: Sequence[str],
    notes: Sequence[Message] = (),
) -> str:
    """A comparison as one HTML text that needs nothing else.

    Args:
        trials: what all methods made of each; none where only parameters were judged (``held_out``).
        tables: rows by the name of their file, as `dynakin.validation.save_comparison` takes them.
        settings: of each recording that was read. names: theirs.
        notes: sentences on what was left out, in addition to the trials' own.
    """
    judged = not trials and len(names) == 2
    title = f"{names[0]} → {names[1]}" if judged else names[0] if len(names) == 1 else f"{len(names)} trials"
    said = [note.of(trial.name) if len(trials) > 1 else note for trial in trials for note in trial.notes]
    said += notes
    models = dict.fromkeys(str(entry.get("model")) for entry in settings)
    presets = dict.fromkeys(name for entry in settings for name in entry.get("presets", {}))
    return render_page(
        "comparison.html.j2",
        eyebrow="dynakin comparison",
        title=title,
        what_was_run=_what_was_compared(trials, names),
        chips=[
            *(f"model {name}" for name in models),
            *(f"preset {name}" for name in presets),
            f"dynakin {versions()['dynakin']}",
        ],
        insights=[*_warned(said), *_findings(tables)],
        sections=_sections(trials, tables),
        messages=list(map(str, said)),
        configuration="\n".join(
            f"# {name}\n{tomli_w.dumps(plain(dict(entry)))}" for name, entry in zip(names, settings, strict=True)
        ),
    )


def _what_was_compared(trials: Sequence[ComparedTrial], names: Sequence[str]) -> str:
    if not trials:
        return f"Identified on {names[0]}, judged on {names[1]} from markers alone."
    methods = list(dict.fromkeys(method.name for trial in trials for method in trial.methods))
    if len(trials) > 1:
        return f"{plural(len(trials), 'trial')} by {listed(methods)}; mean ± standard deviation over trials."
    seconds = trials[0].time[trials[0].window]
    who = f"a person of {trials[0].mass_kg:.4g} kg"
    return f"{seconds[0]:g} to {seconds[-1]:g} s of one trial of {who} by {listed(methods)}."


def _sections(trials: Sequence[ComparedTrial], tables: Mapping[str, Sequence[Any]]) -> list[Section]:
    found = []
    over = "" if len(trials) == 1 else f", mean ± standard deviation over {len(trials)} trials"
    if rows := tables.get("table2"):
        shown = [
            table2_text(rows, f"Difference to what was measured{over}", of=len(trials)),
            table2_text(rows, "Every marker", single_markers=True),
        ]
        parts = [part for part in (wrench_part(trials[0], "table2"),) if part.panels] if len(trials) == 1 else []
        found.append(
            Section("table2", "Table II", f"{about_methods(trials[0])} {ABOUT_TABLE2}", tables=shown, parts=parts)
        )
    for name, title, make, part_of in (
        ("angles", "Joint angles", angle_text, angle_part),
        ("moments", "Joint moments", moment_text, moment_part),
    ):
        if rows := tables.get(name):
            part = part_of(trials[0], name)
            alone = len(trials) == 1
            found.append(
                Section(
                    name,
                    title,
                    part.text,
                    part.panels if alone else [],
                    folded=part.folded if alone else [],
                    folded_title=part.folded_title,
                    lines=part.lines if alone else (),
                    tables=[make(rows)],
                )
            )
    if rows := tables.get("truth"):
        found.append(Section("truth", "Truth", ABOUT_TRUTH, tables=[truth_text(rows)]))
    if rows := tables.get("held_out"):
        shown = [table2_text(rows, "Wrench from markers alone")]
        found.append(Section("held-out", "Held out", ABOUT_HELD_OUT, tables=shown))
    if rows := tables.get("unseen"):
        found.append(Section("unseen", "Not seen", ABOUT_UNSEEN, tables=[unseen_text(rows)]))
    for k, trial in enumerate(trials):
        estimate = next(iter(trial.estimates.values()))
        title = "Repetitions" if len(trials) == 1 else f"Repetitions of {trial.name}"
        key = f"repetitions-{k + 1}"
        found.append(method_repetitions(estimate, trial.repetitions, trial.curves(), key=key, title=title))
    return [section for section in found if not section.empty]


def _warned(said: Sequence[Message]) -> list[Insight]:
    """What makes all figures of a trial doubtful, before them."""
    text = " ".join(sentence(message.text) for message in warnings_of(said))
    if not text:
        return []
    return [Insight("warning", "Recordings", text, "Look at these trials with dynakin check or run first.")]


def _findings(tables: Mapping[str, Sequence[Any]]) -> list[Insight]:
    """The tables in words: the fit of each method, and what the unseen adds to it."""
    found = []
    table2: Sequence[Row] = tables.get("table2", ())
    each = []
    for quantity in (MARKERS, *COMPONENTS):
        rows = [row for row in table2 if row.quantity == quantity]
        if rows:
            each.append(_in_words(quantity, rows))
    if each:
        about = "The filter was given what it is judged by here: this says that it follows, not that it is right."
        found.append(Insight("note", "Fit, RMS", " ".join([*each, about])))
    held_out: Sequence[Row] = tables.get("held_out", ())
    found += _against_nothing("Held out", [row for row in held_out if row.quantity in COMPONENTS])
    unseen: Sequence[UnseenRow] = tables.get("unseen", ())
    for yardstick in dict.fromkeys(row.yardstick for row in unseen):
        kept = [row for row in unseen if row.yardstick == yardstick and row.quantity in (MARKERS, *COMPONENTS)]
        found += _against_nothing(yardstick[:1].upper() + yardstick[1:], kept)
    return found


def _against_nothing(title: str, rows: Sequence[Row] | Sequence[UnseenRow]) -> list[Insight]:
    """Each quantity by the filter and by the next best method, against what costs nothing."""
    sentences, worse = [], []
    for quantity in dict.fromkeys(row.quantity for row in rows):
        known = [row for row in rows if row.quantity == quantity and row.rms.mean is not None]
        free = [row for row in known if row.method.startswith(_FREE)]
        filters = [row for row in known if row.method.startswith("EKF")]
        filters = [row for row in filters if row.method.endswith("identified")] or filters
        if not free or not filters:
            continue
        chosen = [_least(filters), _least(free)]
        if (best := _least(known)) not in chosen:
            chosen.insert(1, best)
        sentences.append(_in_words(quantity, chosen))
        if (chosen[0].rms.mean or 0.0) > (chosen[-1].rms.mean or 0.0):
            worse.append(name_of(quantity))
    if not sentences:
        return []
    verdict = [f"The filter is worse than what costs nothing in {listed(worse)}."] if worse else []
    level: Literal["warning", "good"] = "warning" if worse else "good"
    return [Insight(level, f"{title}, RMS", " ".join([*sentences, *verdict]))]


def _in_words(quantity: str, rows: Sequence[Row | UnseenRow]) -> str:
    figures = "; ".join(f"{number(row.rms.mean, row.unit, digits=2)} by {row.method}" for row in rows)
    return f"{sentence(name_of(quantity))}: {figures}."


def _least(rows: Sequence[Row | UnseenRow]) -> Row | UnseenRow:
    return min(rows, key=lambda row: np.inf if row.rms.mean is None else row.rms.mean)
