"""Deviations, speeds and the look ahead: what the filter says of itself."""

from __future__ import annotations

import numpy as np

from dynakin.report.findings.finding import Insight, Level, Metrics
from dynakin.report.labels import COMPONENT_LABELS, short_marker_names
from dynakin.results.estimate import Estimate
from dynakin.results.measures.consistency import Consistency, limits
from dynakin.results.measures.metrics import evaluation_window, speed_consistency, window_consistency
from dynakin.results.measures.tracking import why_lost
from dynakin.results.naming import listed, number
from dynakin.settings.lag import SMOOTHED_WITH

# Expected one frame ahead against seen: further apart than this, the estimate follows the measurements.
FOLLOWING = 4.0
# Calibrated variances this many times the declared ones are said: good trials with known truth have below 0.2, and
# cameras of 3 mm 1.3, whose deviations still hold (docs/validation/verdicts.md).
NOISY = 2.0
# A marker is named where it fits worse than half of all by this factor.
STANDS_OUT = 3.0

# What to do, in the words of a laboratory.
ADVICE = {
    "follows": "Look at --live-like estimates with care; smoothed ones (the default) do not follow single frames.",
    "follows, no smoother": "Take --preset default, which is smoothed: these settings follow single frames.",
    "conservative": "Nothing need be done. For narrower intervals fit the noise to your laboratory with dynakin tune, "
    "and give what it writes as --preset.",
    "overconfident": "Look at the film whether {worst} is loose, swapped or shifted, and leave it "
    "out if so. If none is, fit the noise to your laboratory with dynakin tune, and give what it writes as --preset.",
    "overconfident, calibrated": "Look at the film whether {worst} is loose, swapped or shifted, "
    "and leave it out if so.",
    "overconfident, fixed scales": "The scales of this preset are another recording's: put adapt = true into its table "
    "[noise], so that this one finds its own.",
    "overconfident, plates": "Look with dynakin check whether the plates lie where they should, what bears on them, "
    "and whether the mass is right.",
    "speeds": "Run it without --live-like or --lag: a live estimate steps where a measurement corrects it.",
    "speeds, no smoother": "Take --preset default, which is smoothed: with these settings an estimate steps where a "
    "measurement corrects it.",
    "speeds, smoothed": "Use angles only: speeds, accelerations and the moments that rest on them jump there. Look in "
    "the recording at these times for frames that were filled, or markers that jump.",
}


def prediction(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """How much of the fit is the model, and how much is following the measurement of the same frame."""
    ahead, fitted = metrics["prediction"]["wrench"]["rms"], metrics["wrench"]["rms"]
    ratio = {name: ahead[name] / fitted[name] for name in fitted if fitted[name] and ahead.get(name) is not None}
    markers = metrics["prediction"]["markers"]["mean_rms_mm"]
    if markers is None or not ratio:
        return None
    parts = [f"{COMPONENT_LABELS[name][0].lower()} {number(ahead[name], COMPONENT_LABELS[name][1])}" for name in ratio]
    text = (
        f"One frame ahead, before it is seen, the model misses by {number(markers, 'mm')} (markers), {listed(parts)}."
    )
    worst = max(ratio, key=lambda name: ratio[name])
    if ratio[worst] <= FOLLOWING:
        return Insight(
            "good",
            "One frame ahead",
            f"{text} At worst that is {ratio[worst]:.1f} times as far as after it is seen "
            f"({COMPONENT_LABELS[worst][0].lower()}).",
        )
    if estimate.lag_s:  # follows no single measurement
        return Insight("note", "One frame ahead", text)
    return Insight(
        "warning",
        "One frame ahead",
        f"{text} That is {ratio[worst]:.0f} times as far as after it is seen ({COMPONENT_LABELS[worst][0].lower()}): "
        "the good fit above comes from following each measurement, less from a model that explains the movement.",
        _advice("follows", estimate),
    )


def consistency(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Whether standard deviations fit the recording."""
    if why_lost(estimate) is not None:
        return None
    found = window_consistency(estimate, evaluation_window(estimate.time))
    if found.judgement is None:
        return Insight("note", "Uncertainty", found.verdict)
    levels: dict[str, Level] = {"consistent": "good", "conservative": "note", "overconfident": "warning"}
    fixed = estimate.config.get("noise", {}).get("adapt") is False
    case = _case(found, fixed)
    advice = ADVICE[case].format(worst=_worst_marker(estimate, metrics)) if case else ""
    level, text = levels[found.judgement], found.verdict
    scale = (estimate.config.get("noise_used") or {}).get("variance_scale", 1.0)
    if found.judgement == "consistent" and scale > NOISY:
        level = "note"
        text += (
            f" The noise found is {number(scale**0.5, digits=2)} times as large as declared: cameras noisier than "
            "usual, or skin that moves more. Deviations were widened to it, for angles perhaps not enough."
        )
    return Insight(level, "Uncertainty", text, advice)


def _case(found: Consistency, fixed: bool) -> str:
    """Which of `ADVICE` helps; empty where none is needed. fixed: the noise's scales are the preset's."""
    if found.judgement != "overconfident":
        return "conservative" if found.judgement == "conservative" and found.noise == "declared" else ""
    by_plates = limits()[found.noise]["moments"].overconfident.statistic.startswith("wrench")
    if by_plates and found.judgements.get("motion") != "overconfident":
        return "overconfident, plates"
    if found.noise == "declared":
        return "overconfident"
    return "overconfident, fixed scales" if fixed else "overconfident, calibrated"


def _advice(name: str, estimate: Estimate) -> str:
    """Of an estimate that is not smoothed: what can be done with the settings that it has."""
    constraint = estimate.config.get("noise", {}).get("constraint")
    return ADVICE[name if constraint in (None, *SMOOTHED_WITH) else f"{name}, no smoother"]


def _worst_marker(estimate: Estimate, metrics: Metrics) -> str:
    """The one to look at; a good one that fits a little worse than the others is not named."""
    rms = {name: value for name, value in metrics["markers"]["rms_mm"].items() if value is not None}
    if not rms or max(rms.values()) < STANDS_OUT * np.median(list(rms.values())):
        return "a marker"
    return f"{short_marker_names(estimate.marker_names)[max(rms, key=lambda name: rms[name])]}, which fits worst,"


def speeds(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Whether speeds are the derivatives of the coordinates."""
    _, verdict = speed_consistency(estimate, evaluation_window(estimate.time))
    advice = ADVICE["speeds, smoothed"] if estimate.smoothed else _advice("speeds", estimate)
    return Insight("warning", "Speeds", verdict, advice) if verdict else None
