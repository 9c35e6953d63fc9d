"""What was recorded, and the run: gaps, what was left out or not made, what is locked, how long a step took."""

from __future__ import annotations

import numpy as np

from dynakin.recordings.times import step_of
from dynakin.report.findings.finding import Insight, Level, Metrics
from dynakin.report.labels import short_marker_names
from dynakin.results.estimate import Estimate
from dynakin.results.failures import LOG
from dynakin.results.measures.soft_tissue import marker_sites
from dynakin.results.measures.sources import floating_root, out_of_sight, taken_back, unseen_in_words
from dynakin.results.naming import listed, number, sentence, words
from dynakin.results.records import REFUSED

# A sensor that is refused for less than this, s, is a note.
BRIEF_S = 0.1

# What to do, in the words of a laboratory.
ADVICE = {
    "unseen": "Do not use the angles and moments of these segments' joints there, or fill the gap from what you know.",
    "markers": "Look at the film at these times: correct labels that are swapped, delete what is no marker.",
    "plates": "Look at the plates at these times: a foot on an edge, on two plates or half beside one, something else "
    "on a plate; else their zero, and whether their clock is the markers'.",
}


def missing(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Gaps; a warning where no marker of a segment is seen for so long that its joints are carried on, not measured."""
    if said := _unseen(estimate):
        return Insight("warning", "Unseen", said, ADVICE["unseen"])
    gaps: dict[str, int] = metrics["events"]["missing_frames"]
    if not gaps:
        return Insight("good", "Gaps", "Every marker in use was measured in every frame.")
    names, frames = short_marker_names(estimate.marker_names), len(estimate.time)
    text = [
        f"{names[name]} ({100 * gap / frames:.2g} % of the frames)" if gap < frames else f"{names[name]} (always)"
        for name, gap in sorted(gaps.items(), key=lambda item: -item[1])
    ]
    return Insight("note", "Gaps", f"Markers missing for part of the recording: {listed(text)}.")


def _unseen(estimate: Estimate) -> str:
    """On segments none of whose markers is seen for some time although some are at other times."""
    segments, time = estimate.marker_segments, estimate.time
    owners = [segments.get(site, "") for _, site in marker_sites(estimate)]
    seen, root = np.isfinite(estimate.values("markers_measured")).any(axis=2), floating_root(estimate.data)
    if "verdict" in estimate.data:
        seen = taken_back(seen, estimate.values("verdict")[:, :-1] == REFUSED)
    return unseen_in_words(out_of_sight(seen, owners, time, root), time, root)


def gated(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Sensors that were refused, and motion that was found again."""
    refused = [event for event in estimate.events if event.kind in ("gated", "reset")]
    if not refused:
        return None
    shown = [e.message if not e.subject or e.subject in e.message else f"{e.subject} {e.message}" for e in refused]
    sensors = all(event.kind == "gated" and event.subject != "motion" for event in refused)
    level: Level = "note" if sensors and _briefly(estimate) else "warning"
    plates = [event.subject == "plates" for event in refused]
    advice = [ADVICE["markers"]] * (not all(plates)) + [ADVICE["plates"]] * any(plates)
    return Insight(level, "Left out or reset", f"{listed(shown, 4)}.", " ".join(advice))


def _briefly(estimate: Estimate) -> bool:
    """Whether no sensor was refused for `BRIEF_S` or more, all its stretches together."""
    if "verdict" not in estimate.data:
        return False
    frame_s = step_of(estimate.time)
    refused = (estimate.values("verdict") == REFUSED).sum(axis=0)
    return bool(refused.max() * frame_s < BRIEF_S)


def failed(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Stages that failed after the estimate."""
    said = [message.text for message in estimate.messages if message.level == "failure"]
    if not said:
        return None
    return Insight("warning", "Not made", " ".join(said), f"{LOG} has the details; please report them.")


def locked(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Coordinates that are held still."""
    free = {str(name) for name in estimate.data["element"].values}
    held = [words(name) for name in estimate.coordinate_names if name not in free]
    if not held:
        return None
    verb = "is" if len(held) == 1 else "are"
    return Insight("note", "Locked", f"{sentence(listed(held))} {verb} held still; the notes below say why.")


def step_time(estimate: Estimate, metrics: Metrics) -> Insight:
    """How long a step took."""
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
