"""How the model fits: markers, constants on a bound, soft tissue, joint limits."""

from __future__ import annotations

from pathlib import Path

from dynakin.report.findings.finding import Insight, Metrics
from dynakin.report.labels import parameter_label, short_marker_names
from dynakin.results.estimate import Estimate
from dynakin.results.measures.adaptation import convergence
from dynakin.results.measures.bounds import counts_in_words
from dynakin.results.measures.metrics import ADAPTATION_S
from dynakin.results.measures.soft_tissue import excess_in_words
from dynakin.results.naming import listed, number, plural, sentence, words

# RMS distance of the model's markers, mm, below which they fit: the paper's own figure.
FITTING_MM = 15.0

# What to do, in the words of a laboratory.
ADVICE = {
    "markers": "Check that the standing trial is this person's, with the same markers in the same places.",
    "limits": "Look at the film at that joint: where it does not go so far, a marker is swapped or off its place.",
    "adaptation": "Look at the film near the end: a marker that has moved, or a person who leaves the plates.",
}


def markers(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """How far the model's markers lie from the measured ones, and which stands out."""
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


def adaptation(estimate: Estimate, metrics: Metrics) -> Insight | None:
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


def constants(estimate: Estimate, metrics: Metrics) -> list[Insight]:
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
        if group.title == "lengths" and any(p.skin_sd for p in estimate.parameters):
            shrunk += ", not counting skin that follows a joint"
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


def bounds(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Constants that end on a bound, and those that touched one."""
    free = [p for p in estimate.parameters if p.estimated and p.lower is not None]
    names = short_marker_names(estimate.marker_names)
    ending = [p for p in free if p.bound_tells]
    unknown = [parameter_label(p, names) for p in free if p.at_bound and not p.bound_tells]
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
    if unknown:
        for_a_time += (
            f" The recording hardly knows {listed(unknown)}: that {'it ends' if len(unknown) == 1 else 'they end'} on "
            "a bound says nothing."
        )
    if not stuck:
        known = f"{len(free) - len(unknown)} estimated parameters{' that the recording knows' if unknown else ''}"
        return Insight("good", "Bounds", f"None of the {known} ends on its bound.{for_a_time}")
    counts = "" if unknown else f" ({counts_in_words(metrics['bounds']['by_kind'])})"
    return Insight(
        "warning",
        "Bounds",
        f"{len(stuck)} of {len(free)} estimated parameters end on a bound{counts}: {listed(stuck)}. The data ask "
        "for a value that the person cannot have, or joints lie elsewhere than the model has them: it does not fit "
        f"there.{for_a_time}",
        "Check the mass and the height, then the film for a marker of those segments off its place."
        if any(p.kind == "inertia" for p in ending)
        else "Look in film and standing trial for a marker off its place on the segments that these belong to.",
    )


def soft_tissue(estimate: Estimate, metrics: Metrics) -> Insight | None:
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


def joint_limits(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Coordinates that were held at a limit for a while."""
    names = set(estimate.coordinate_names)
    stuck = sorted({words(e.subject) for e in estimate.events if e.kind == "at_bound" and e.subject in names})
    if not stuck:
        return None
    text = f"Held at its limit for part of the time: {listed(stuck)}."
    file = Path(str(estimate.config.get("model", "")))
    own_range = f" Where it does, widen its range in {file.name}." if file.suffix else ""
    return Insight("warning", "Joint limits", text, ADVICE["limits"] + own_range)
