"""What was recorded: names, gaps, frames that were filled, what was left out."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import runs
from dynakin.report.findings.finding import Insight, Level, Metrics
from dynakin.report.labels import short_marker_names
from dynakin.results.estimate import Estimate
from dynakin.results.measures.soft_tissue import marker_sites
from dynakin.results.measures.sources import out_of_sight
from dynakin.results.naming import listed, sentence, words
from dynakin.results.records import (
    CARRIED,
    LOW_PASSED,
    MISPLACED,
    NEVER_FLAT,
    NOT_UPRIGHT,
    NOT_ZEROED,
    OFF_PLACE,
    OFF_RATE,
    REFUSED,
    SHEAR_GAIN,
    WARNING,
    doubts_mass,
    warnings_of,
)

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
_SUBJECT = ("mass ", "height ")
# A sensor that is refused for less than this, s, is a note.
BRIEF_S = 0.1

# What to do, in the words of a laboratory.
ADVICE = {
    "plates": "Look with dynakin check which plates are read, where they lie, and what bears on them; declare what "
    "else does (--contact).",
    "unseen": "Do not use the angles and moments of these segments' joints there, or fill the gap from what you know.",
    "recording": "Correct it in the file, or look at the film at these times, before you use what lies there.",
    "subject": "Give the mass and the height as measured (--mass, --height).",
    "scaling": "Scale the model to the person again, by a standing trial, or run without --model: fullbody measures "
    "its own.",
    "ankles": "Give a standing trial with flat feet (--static), or take these ankles' angles by their changes alone.",
    "upright": "Record the person standing upright with straight knees, and give that (--static).",
    "low-passed": "Export the markers without a filter (raw), and run them; of these use angles, and the moments of "
    "legs on plates.",
    "place": "Correct where the file has the plates (corners, origin, centres of pressure), or declare what else "
    "steadies the person (--contact).",
    "zero": "Zero the plates with nobody on them before each trial; of this one take off what they read then "
    "([[plate_loads]] in a configuration, docs/models.md).",
    "gain": "Correct the calibration of the plates' horizontal channels (or its unit) in the file of the forces.",
    "carried": "Declare what is carried ([[loads]] in a configuration, docs/models.md), and give the mass of the "
    "person without it (--mass); or use moments of knees and ankles alone.",
    "rate": "Look at which rate the cameras recorded, and whether the files say so.",
    "left out": "Look at the film at these times: correct labels that are swapped, delete what is no marker.",
}


def guessed(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Places that no name says: joint centres and all that rests on them are as wrong as these may be."""
    if estimate.marker_places != "guessed":
        return None
    text = (
        "Names of this recording are in no marker set: where markers with these names sit on the body is guessed from "
        "the names and from where they lie. Joint centres, angles and moments are as wrong as a place that is guessed "
        "wrongly."
    )
    return Insight("warning", "Guessed marker places", text, "Look at them: dynakin markers new TRIAL -o my.toml.")


def unmarked(estimate: Estimate, metrics: Metrics) -> Insight | None:
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


def warned(estimate: Estimate, metrics: Metrics) -> list[Insight]:
    """What the reading, the calibration and the plates warned of, and no other finding says."""
    warnings = [text.removeprefix(WARNING) for text in warnings_of(estimate.messages)]
    warnings = [text for text in dict.fromkeys(warnings) if not (doubts_mass(text) or _said_elsewhere(text))]
    found = []
    for title, advice, belongs in (
        ("Subject", "subject", lambda text: text.startswith(_SUBJECT)),
        ("Model scaling", "scaling", lambda text: text.startswith(MISPLACED)),
        ("Ankle angles", "ankles", lambda text: text.startswith(NEVER_FLAT)),
        ("Standing posture", "upright", lambda text: text.startswith(NOT_UPRIGHT)),
        ("Low-passed markers", "low-passed", lambda text: text.startswith(LOW_PASSED)),
        ("Rate", "rate", lambda text: text.startswith(OFF_RATE)),
        ("Load in the hands", "carried", lambda text: text.startswith(CARRIED)),
        ("Plates' zero", "zero", lambda text: text.startswith(NOT_ZEROED)),
        ("Plates' gain", "gain", lambda text: text.startswith(SHEAR_GAIN)),
        ("Plates' place", "place", lambda text: text.startswith(OFF_PLACE)),
        ("Force plates", "plates", lambda text: "plate" in text),
        ("Recording", "recording", lambda text: True),
    ):
        own = [text for text in warnings if belongs(text)]
        warnings = [text for text in warnings if text not in own]
        if own:
            found.append(Insight("warning", title, " ".join(sentence(text) for text in own), ADVICE[advice]))
    return found


def _said_elsewhere(text: str) -> bool:
    """A mass or height that was measured is no doubt, either."""
    measured = text.startswith(_SUBJECT) and " assumed, " not in text
    return measured or any(part in text for part in _SAID_ELSEWHERE)


def missing(estimate: Estimate, metrics: Metrics) -> Insight | None:
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
    segments, time = estimate.marker_segments, estimate.time
    owners = [segments.get(site, "") for _, site in marker_sites(estimate)]
    hidden = out_of_sight(np.isfinite(estimate.values("markers_measured")).any(axis=2), owners, time)
    spans = {name: [f"{time[a]:.2f} to {time[b - 1]:.2f} s" for a, b in runs(own)] for name, own in hidden.items()}
    return {name: listed(own, 3) for name, own in spans.items() if own}


def gated(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Sensors that were refused, and motion that was found again."""
    refused = [event for event in estimate.events if event.kind in ("gated", "reset")]
    if not refused:
        return None
    shown = [e.message if not e.subject or e.subject in e.message else f"{e.subject} {e.message}" for e in refused]
    sensors = all(event.kind == "gated" and event.subject != "motion" for event in refused)
    level: Level = "note" if sensors and _briefly(estimate) else "warning"
    return Insight(level, "Left out or reset", f"{listed(shown, 4)}.", ADVICE["left out"])


def _briefly(estimate: Estimate) -> bool:
    """Whether no sensor was refused for `BRIEF_S` or more, all its stretches together."""
    if "verdict" not in estimate.data:
        return False
    frame_s = float(np.median(np.diff(estimate.time)))
    refused = (estimate.values("verdict") == REFUSED).sum(axis=0)
    return bool(refused.max() * frame_s < BRIEF_S)
