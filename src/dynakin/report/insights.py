"""The report's summary in words: what was run, how well it fits, and what a reader should know before using it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from dynakin.arrays import runs
from dynakin.filter.tracker import SMOOTHED_WITH
from dynakin.report.labels import COMPONENT_LABELS, parameter_label, short_marker_names
from dynakin.results.estimate import Estimate
from dynakin.results.failures import FAILED, LOG
from dynakin.results.measures.adaptation import convergence
from dynakin.results.measures.bounds import counts_in_words
from dynakin.results.measures.consistency import Consistency, limits
from dynakin.results.measures.metrics import ADAPTATION_S, evaluation_window, speed_consistency, window_consistency
from dynakin.results.measures.soft_tissue import excess_in_words, marker_sites
from dynakin.results.measures.tracking import why_lost
from dynakin.results.naming import listed, number, plural, sentence, words
from dynakin.results.records import REFUSED, doubts_mass
from dynakin.units import GRAVITY_M_S2

# RMS distance of the model's markers, mm, below which they fit: the paper's own figure.
FITTING_MM = 15.0
# Expected one frame ahead against seen: further apart than this, the estimate follows the measurements.
FOLLOWING = 4.0

# Calibrated variances this many times the declared ones are said: good trials with known truth have below 0.2, and
# cameras of 3 mm 1.3, whose deviations still hold (docs/validation/verdicts.md).
NOISY = 2.0
# A marker is named where it fits worse than half of all by this factor.
STANDS_OUT = 3.0
# Part of the weight that no contact gives, from which it is said: good recordings leave 0.03 to 0.16 for a frame, one
# frame that was filled 0.4.
LEFT = 0.25
# Words of warnings that a finding of their own says, or that are no doubt of the estimate.
_SAID_ELSEWHERE = (
    "no marker set has these names",
    "no marker shows ",
    "frames are no estimate",
    "EKF (",
    "left out: ",
    "tilt and rotation cannot be separated",
    " clamps them",
)
# Longest time, s, without any marker of a segment over which its motion is carried on: by truth a foot in a walk is 20
# to 30 deg off after 0.3 s.
UNSEEN_S = 0.2
# A sensor that is refused for less than this, s, is a note.
BRIEF_S = 0.1

Level = Literal["good", "note", "warning"]
Metrics = dict[str, Any]


# How the sentences begin that a run says of its plates as a whole.
PLATE_WORDS = ("The plates are ", "By the motion of the centre of mass the plates are ")

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
    "plates": "Look with dynakin check which plates are read, where they lie, and what bears on them; declare what "
    "else does (--contact).",
    "unseen": "Do not use the angles and moments of these segments' joints there, or fill the gap from what you know.",
    "recording": "Correct it in the file, or look at the film at these times, before you use what lies there.",
    "subject": "Give the mass and the height as measured (--mass, --height).",
    "left": "Look in the recording at that time for markers that jump or frames that were filled; moments there are "
    "wrong.",
    "markers": "Check that the standing trial is this person's, with the same markers in the same places.",
    "limits": "Look at the film at that joint: where it does not go so far, a marker is swapped or off its place.",
    "left out": "Look at the film at these times: correct labels that are swapped, delete what is no marker.",
    "adaptation": "Look at the film near the end: a marker that has moved, or a person who leaves the plates.",
}


@dataclass(frozen=True)
class Insight:
    """One finding: how much it matters, a short title, a sentence or two, and what to try, where something helps."""

    level: Level
    title: str
    text: str
    advice: str = ""


def in_short(found: list[Insight]) -> str:
    """One sentence for who reads no further: what holds, and what does not."""
    titles = [insight.title[:1].lower() + insight.title[1:] for insight in found if insight.level == "warning"]
    if not titles:
        return "Nothing in this run speaks against using it."
    return f"{sentence(plural(len(titles), 'finding'))} to look at before using this run: {listed(titles, 8)}."


def insights(estimate: Estimate, metrics: Metrics) -> list[Insight]:
    """All findings, in the order of the report; one whose blocks of ``metrics`` are None, because the stage that makes
    them failed (`dynakin.results.failures`), is left out."""
    found: list[Insight] = []
    for make, blocks in FINDINGS:
        if all(metrics[block] is not None for block in blocks) and (made := make(estimate, metrics)):
            found += made if isinstance(made, list) else [made]
    return found


def _moments(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Why moments are not measured, and what that leaves out; how many are is said before all findings."""
    found = metrics["moments"]
    if all(count["measured"] == found["frames"] for count in found["legs"].values()):
        return None
    text = ["Peaks, work, symmetry and mean curves are of measured moments only."]
    if any(count["absent"] for count in found["legs"].values()):
        text.append("Absent moments, powers and joint reactions are nan in the files.")
    flagged = {"derived": "derived ones (dashed in the figures)", "prior": "those that take a prior (dotted)"}
    if shown := [how for meaning, how in flagged.items() if any(count[meaning] for count in found["legs"].values())]:
        text.append(f"{sentence(listed(shown))} are in the files with their flag (moments_source.sto).")
    text += found["reasons"][:3]
    if len(found["reasons"]) > 3:
        text.append(f"{plural(len(found['reasons']) - 3, 'more reason')} under Joint moments.")
    advice = "Give the forces of every contact (--forces), and plates under every step that is to be judged."
    # steps off the plates are usual and flagged; a leg without a measured frame is not what was recorded for
    missed = any(not count["measured"] for count in found["legs"].values())
    return Insight("warning" if missed else "note", "Joint moments", " ".join(text), advice)


def _mass(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Plates that contradict the mass: forces, moments and inertia are all wrong then."""
    doubts = [text.removeprefix("Warning: ") for text in estimate.messages if doubts_mass(text)]
    if not doubts:
        return None
    return Insight("warning", "Mass", sentence(" ".join(doubts)), "Give the mass as weighed, with all that is worn.")


def _warned(estimate: Estimate, metrics: Metrics) -> list[Insight]:
    """What the reading, the calibration and the plates warned of, and no other finding says."""
    warnings = [text.removeprefix("Warning: ") for text in estimate.messages if text.startswith("Warning: ")]
    elsewhere = {text for text in warnings if doubts_mass(text) or any(part in text for part in _SAID_ELSEWHERE)}
    warnings = [text for text in dict.fromkeys(warnings) if text not in elsewhere]
    found = []
    for title, advice, belongs in (
        ("Subject", "subject", lambda text: text.startswith(("mass ", "height "))),
        ("Force plates", "plates", lambda text: "plate" in text),
        ("Recording", "recording", lambda text: True),
    ):
        own = [text for text in warnings if belongs(text)]
        warnings = [text for text in warnings if text not in own]
        if title == "Subject":
            own = [text for text in own if " assumed, " in text]  # one that was measured is said, and no doubt
        if own:
            found.append(Insight("warning", title, " ".join(sentence(text) for text in own), ADVICE[advice]))
    return found


def _left(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """A force that no contact gives while the feet are on plates: a jump in the motion, as a filled frame makes one."""
    feet = metrics["feet"]
    largest = feet and feet["left_at_root"]["grounded"]
    weight = GRAVITY_M_S2 * (estimate.mass_kg or 0.0)
    if not largest or not weight or largest["force_n"] < LEFT * weight:
        return None
    text = (
        f"At one time the motion needs {number(largest['force_n'], 'N')} more or less than the feet's plates give "
        f"({number(100.0 * largest['force_n'] / weight, '%', digits=2)} of the weight)."
    )
    return Insight("warning", "Left at the pelvis", text, ADVICE["left"])


def _guessed(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Places that no name says: joint centres and all that rests on them are as wrong as these may be."""
    if estimate.marker_places != "guessed":
        return None
    text = (
        "No marker set has the names of this recording: where the markers sit on the body is guessed from their names "
        "and from where they lie. Joint centres, angles and moments are as wrong as a place that is guessed wrongly."
    )
    return Insight("warning", "Guessed marker places", text, "Look at them: dynakin markers new TRIAL -o my.toml.")


def _unmarked(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Joints that are known to centimetres."""
    if not estimate.unmarked_joints:
        return None
    names = listed([words(name) for name in estimate.unmarked_joints])
    text = (
        f"No marker shows {names}: they are where the movement, or else the proportions of an adult who stands, has "
        "them, to one or two centimetres. The zeros of the legs' angles may be 10 deg off, and moments at knee and "
        "ankle are two to five times less sure; the deviations say so."
    )
    return Insight(
        "warning", "Joint centres", text, "Give a standing trial with markers on knees and ankles (--static)."
    )


def _failed(estimate: Estimate, metrics: Metrics) -> Insight | None:
    failed = [message.removeprefix(FAILED).strip() for message in estimate.messages if message.startswith(FAILED)]
    if not failed:
        return None
    return Insight("warning", "Not made", " ".join(failed), f"{LOG} has the details; please report them.")


def _tracking(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Frames that are no estimate; nothing is said where there are none."""
    found = metrics["tracking"]
    if not found or not found["lost_frames"]:
        return None
    whole = " The trial as a whole is no estimate." if found["trial_lost"] else ""
    advice = "Look at the first of these times: markers swapped or off, or a movement that the start does not fit."
    return Insight("warning", "Lost", found["verdict"] + whole, advice)


def _markers(estimate: Estimate, metrics: Metrics) -> Insight | None:
    mean = metrics["markers"]["mean_rms_mm"]
    if mean is None:
        return None
    rms = {name: value for name, value in metrics["markers"]["rms_mm"].items() if value is not None}
    worst = max(rms, key=lambda name: rms[name])
    names = short_marker_names(estimate.marker_names)
    middle = sorted(rms.values())[len(rms) // 2]
    apart = [names[name] for name, value in rms.items() if value > max(10.0, 2.5 * middle)]
    stand = "stands" if len(apart) == 1 else "stand"
    good = mean < FITTING_MM
    advice = "" if good else ADVICE["markers"]
    if apart:
        advice = (
            f"{listed(apart)} {stand} out: look at the film whether swapped, loose, or on another segment than the "
            "marker set says."
        )
    return Insight(
        "good" if good else "warning",
        "Markers",
        f"The model’s markers lie {number(mean, 'mm')} from the measured ones (RMS, mean of "
        f"{plural(len(rms), 'marker')}); worst is {names[worst]} with {number(rms[worst], 'mm')}. "
        "This is the fit to what the filter was given, not the accuracy of angles or moments.",
        advice,
    )


def _wrench(estimate: Estimate, metrics: Metrics) -> Insight | None:
    rms = metrics["wrench"]["rms"]
    about_plates = [text for text in estimate.messages if text.startswith(PLATE_WORDS) and not doubts_mass(text)]
    if not rms:
        why = " ".join(about_plates) or "No wrench was compared: none was measured, or none is modelled."
        return Insight("note", "Force plates", why)
    text = [
        f"{COMPONENT_LABELS[name][0].lower()} {number(value, COMPONENT_LABELS[name][1])}"
        + (f" ({number(share, digits=2)} %)" if (share := metrics["wrench"]["nrms_percent"][name]) is not None else "")
        for name, value in rms.items()
    ]
    return Insight(
        "note",
        "Force plates",
        f"RMS difference between the model’s wrench and the plates’: {listed(text)}; percent of the measured RMS."
        + "".join(f" {sentence}" for sentence in about_plates),
    )


def _prediction(estimate: Estimate, metrics: Metrics) -> Insight | None:
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


def _consistency(estimate: Estimate, metrics: Metrics) -> Insight | None:
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


def _speeds(estimate: Estimate, metrics: Metrics) -> Insight | None:
    _, verdict = speed_consistency(estimate, evaluation_window(estimate.time))
    advice = ADVICE["speeds, smoothed"] if estimate.smoothed else _advice("speeds", estimate)
    return Insight("warning", "Speeds", verdict, advice) if verdict else None


def _constants(estimate: Estimate, metrics: Metrics) -> list[Insight]:
    """What became of lengths, masses and moments of inertia."""
    names = short_marker_names(estimate.marker_names)
    found, groups = [], convergence(estimate)
    if moving := [group for group in groups if group.verdict == "moving"]:
        still = [parameter_label(p, names) for group in moving for p in group.moving]
        verb = "was" if len(still) == 1 else "were"
        text = f"Not settled: {listed(still)} {verb} still moving in the last quarter of the recording."
        found.append(Insight("warning", "Constants", text, "A longer recording, or one with more repetitions."))
    for group in (group for group in groups if group not in moving):
        title, change = sentence(group.title), number(group.largest_change_percent, digits=2)
        shrunk = f"the standard deviations ended at {100.0 * group.sd_left:.0f} % of where they began"
        if group.verdict == "untaught":
            source = "measured at the start" if group.title == "lengths" else "of the anthropometric table"
            text = (
                f"These are the values {source}, not identified ones: none of {group.count} changed by more than "
                f"{change} %, and {shrunk}."
            )
            advice = "" if group.title == "lengths" else "A livelier movement, with the arms too."
            found.append(Insight("note", title, text, advice))
        else:
            how = "Estimated from all frames" if estimate.smoothed else "Settled"
            text = f"{how}: {group.count}, changed from the start by up to {change} %; {shrunk}."
            found.append(Insight("good", title, text))
    return found


def _bounds(estimate: Estimate, metrics: Metrics) -> Insight | None:
    free = [p for p in estimate.parameters if p.estimated and p.lower is not None]
    names = short_marker_names(estimate.marker_names)
    ending = [p for p in free if p.at_bound]
    stuck = [parameter_label(p, names) for p in ending]
    passing = {n: entry for n, entry in metrics["bounds"]["parameters"].items() if not entry["at_end"]}
    for_a_time = ""
    if passing:
        most = max(passing, key=lambda name: passing[name]["share_of_time"])
        label = next(parameter_label(p, names) for p in free if p.name == most)
        share = number(100.0 * passing[most]["share_of_time"], "%", digits=2)
        for_a_time = (
            f" {plural(len(passing), 'other')} touched a bound and left it (longest: {label}, {share} of the time)."
        )
    if not stuck:
        return Insight("good", "Bounds", f"None of the {len(free)} estimated parameters ends on its bound.{for_a_time}")
    counts = counts_in_words(metrics["bounds"]["by_kind"], "at_end")
    return Insight(
        "warning",
        "Bounds",
        f"{len(stuck)} of {len(free)} estimated parameters end on a bound ({counts}): {listed(stuck)}. The data ask "
        "for a value that the person cannot have, or joints lie elsewhere than the model has them: it does not fit "
        f"there.{for_a_time}",
        "Check the mass and the height, then the film for a marker of those segments off its place."
        if any(p.kind == "inertia" for p in ending)
        else "Look in film and standing trial for a marker off its place on the segments that these belong to.",
    )


def _adaptation(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """When the estimate settled, against the time from which the figures are taken."""
    found = metrics["adaptation"]
    if not found["verdict"]:
        return None
    if found["after_s"] is None:
        lost = any(misfit["after_s"] is None for misfit in found["misfits"].values())
        return Insight("warning" if lost else "note", "Adaptation", found["verdict"], ADVICE["adaptation"] * lost)
    if found["after_s"] <= ADAPTATION_S:
        return Insight("good", "Adaptation", found["verdict"])
    return Insight(
        "note",
        "Adaptation",
        f"{found['verdict']} The figures of this page are taken from {metrics['window']['start_s']:.4g} s on and hold "
        "part of that.",
    )


def _soft_tissue(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Markers that move on their segments further than skin does."""
    names = short_marker_names(estimate.marker_names)
    markers = {names[name]: found for name, found in metrics["soft_tissue"]["markers"].items()}
    moved = {name: found["max_mm"] for name, found in markers.items() if found["max_mm"] is not None}
    if not moved:
        return None
    text = excess_in_words(markers)
    if text:
        return Insight(
            "warning",
            "Soft tissue",
            text,
            "Look at the film whether each sits on the segment that the marker set says, and is not loose. If so, the "
            "segment bends (a trunk) and the angles of its joints are the less certain.",
        )
    most = max(moved, key=lambda name: moved[name])
    expected = markers[most]["expected_mm"]
    size = "" if expected is None else f", where {number(expected, 'mm', digits=2)} is usual"
    return Insight(
        "good",
        "Soft tissue",
        f"No marker moves more than twice as far on its segment as is usual for skin there; furthest is {most} with "
        f"{number(moved[most], 'mm', digits=2)}{size}.",
    )


def _joint_limits(estimate: Estimate, metrics: Metrics) -> Insight | None:
    names = set(estimate.coordinate_names)
    stuck = sorted({words(e.subject) for e in estimate.events if e.kind == "at_bound" and e.subject in names})
    if not stuck:
        return None
    text = f"Held at its limit for part of the time: {listed(stuck)}."
    return Insight("warning", "Joint limits", text, ADVICE["limits"])


def _missing(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Gaps; a warning where no marker of a segment is seen for so long that its joints are carried on, not measured."""
    unseen = _unseen(estimate)
    if unseen:
        whose = listed([f"{words(segment)} from {times}" for segment, times in unseen.items()])
        return Insight("warning", "Unseen", f"No marker is seen of {whose}.", ADVICE["unseen"])
    gaps: dict[str, int] = metrics["events"]["missing_frames"]
    if not gaps:
        return Insight("good", "Gaps", "Every marker in use was measured in every frame.")
    names, frames = short_marker_names(estimate.marker_names), len(estimate.time)
    text = [
        f"{names[name]} ({100 * gap / frames:.2g} % of the frames)" if gap < frames else f"{names[name]} (always)"
        for name, gap in sorted(gaps.items(), key=lambda item: -item[1])
    ]
    return Insight("note", "Gaps", f"Markers missing for part of the recording: {listed(text)}.")


def _unseen(estimate: Estimate) -> dict[str, str]:
    """Segments, and the times in which none of their markers is seen although some are at other times."""
    carriers = dict(zip(estimate.marker_names, (site for _, site in marker_sites(estimate)), strict=True))
    seen = np.isfinite(estimate.data["markers_measured"].transpose("time", "marker", "axis").values).any(axis=2)
    owners = np.array([estimate.marker_segments.get(carriers[name], "") for name in estimate.marker_names])
    found: dict[str, str] = {}
    for segment in dict.fromkeys(owners[owners != ""]):
        hidden = ~seen[:, owners == segment].any(axis=1)
        spans = [
            f"{estimate.time[a]:.2f} to {estimate.time[b - 1]:.2f} s"
            for a, b in runs(hidden)
            if estimate.time[b - 1] - estimate.time[a] > UNSEEN_S
        ]
        if spans and not hidden.all():
            found[str(segment)] = listed(spans, 3)
    return found


def _gated(estimate: Estimate, metrics: Metrics) -> Insight | None:
    gated = [event for event in estimate.events if event.kind in ("gated", "reset")]
    if not gated:
        return None
    shown = [e.message if not e.subject or e.subject in e.message else f"{e.subject} {e.message}" for e in gated]
    sensors = all(event.kind == "gated" and event.subject != "motion" for event in gated)
    level: Level = "note" if sensors and _briefly(estimate) else "warning"
    return Insight(level, "Left out or reset", f"{listed(shown, 4)}.", ADVICE["left out"])


def _briefly(estimate: Estimate) -> bool:
    """Whether no sensor was refused for `BRIEF_S` or more, all its stretches together."""
    if "verdict" not in estimate.data:
        return False
    frame_s = float(np.median(np.diff(estimate.time)))
    refused = (estimate.data["verdict"].transpose("time", "sensor").values == REFUSED).sum(axis=0)
    return bool(refused.max() * frame_s < BRIEF_S)


def _locked(estimate: Estimate, metrics: Metrics) -> Insight | None:
    free = {str(name) for name in estimate.data["element"].values}
    locked = [words(name) for name in estimate.coordinate_names if name not in free]
    if not locked:
        return None
    verb = "is" if len(locked) == 1 else "are"
    return Insight("note", "Locked", f"{sentence(listed(locked))} {verb} held still; the notes below say why.")


def _step_time(estimate: Estimate, metrics: Metrics) -> Insight:
    timing = estimate.timing
    factor, unit = (1e-3, "ms") if timing.median_us >= 1000.0 else (1.0, "µs")
    times = number(timing.realtime_factor, digits=2)
    speed = f"{times} times faster than" if timing.realtime_factor >= 1.0 else f"only {times} times as fast as"
    return Insight(
        "note",
        "Time of a step",
        f"A step took {number(factor * timing.median_us, unit)} (median; 99 of 100 within "
        f"{number(factor * timing.p99_us, unit)}), {speed} the recording went.",
    )


FINDINGS: tuple[tuple[Callable[[Estimate, Metrics], Insight | list[Insight] | None], tuple[str, ...]], ...] = (
    (_guessed, ()),
    (_unmarked, ()),
    (_mass, ()),
    (_warned, ()),
    (_left, ("feet",)),
    (_failed, ()),
    (_tracking, ()),
    (_moments, ("moments",)),
    (_markers, ("markers",)),
    (_wrench, ("wrench",)),
    (_prediction, ("prediction", "wrench")),
    (_consistency, ("consistency", "markers")),
    (_speeds, ()),
    (_adaptation, ("adaptation",)),
    (_constants, ()),
    (_bounds, ("bounds",)),
    (_soft_tissue, ("soft_tissue",)),
    (_joint_limits, ()),
    (_missing, ("events",)),
    (_gated, ()),
    (_locked, ()),
    (_step_time, ()),
)
"""What looks for each finding, and the blocks of the metrics that it needs."""
