"""What reading, calibration, plates and filter warned of: every warning is part of one finding, by its topic."""

from __future__ import annotations

from typing import NamedTuple

from dynakin.messages import TOPICS, Topic, warnings_of
from dynakin.report.findings.finding import Insight, Metrics
from dynakin.results.estimate import Estimate
from dynakin.results.naming import sentence


class _Kind(NamedTuple):
    """A finding's title, what it takes together, and what to do, in the words of a laboratory."""

    title: str
    topics: tuple[Topic, ...]
    advice: str


_KINDS = (
    _Kind(
        "Lost",
        ("lost",),
        "Look at the first of these times: markers swapped or off, or a movement that the start does not fit.",
    ),
    _Kind("Guessed marker places", ("guessed",), "Correct the places that are wrong, and give that marker set."),
    _Kind(
        "Held knees",
        ("held",),
        "Use the set that names the markers of thighs and shanks (dynakin markers new), or record some there.",
    ),
    _Kind(
        "Joint centres",
        ("joints",),
        "Give a standing trial that shows the markers of pelvis, knees and ankles (--static), under names that the "
        "marker set knows.",
    ),
    _Kind(
        "Mass",
        ("weight",),
        "Give the mass as weighed, with all that is worn; what is carried is declared ([[loads]] in a configuration, "
        "docs/models.md), what else bears or pulls the person by --contact.",
    ),
    _Kind("Subject", ("mass", "height", "sex"), "Give the mass and the height as measured (--mass, --height)."),
    _Kind(
        "Physique",
        ("physique",),
        "Identify the person's own inertia from several movements (dynakin identify) and give it (--parameters); until "
        "then use knees and ankles alone.",
    ),
    _Kind(
        "Model scaling",
        ("scaling",),
        "Unlock in the model's file what is held still and moves, else scale the model to the person again, by a "
        "standing trial, or run without --model: fullbody measures its own.",
    ),
    _Kind(
        "Model's masses",
        ("masses",),
        "Correct these masses in the model's file (a prosthesis may rightly be light), or run without --model: "
        "fullbody has a table's.",
    ),
    _Kind(
        "Identified parameters",
        ("identified",),
        "Identify again on trials without a warning, or run without --parameters.",
    ),
    _Kind(
        "Ankle angles",
        ("ankles",),
        "Give a standing trial with flat feet (--static), or take these ankles' angles by their changes alone.",
    ),
    _Kind(
        "Standing posture",
        ("standing",),
        "Record the person standing upright with straight knees, and give that (--static).",
    ),
    _Kind(
        "Low-passed markers",
        ("low-passed",),
        "Export the markers without a filter (raw), and run them; of these use angles, and the moments of legs on "
        "plates.",
    ),
    _Kind("Rate", ("rate",), "Look at which rates the cameras and the plates recorded, and whether the files say so."),
    _Kind(
        "Load in the hands",
        ("carried",),
        "Declare what is carried ([[loads]] in a configuration, docs/models.md), and give the mass of the person "
        "without it (--mass); or use moments of knees and ankles alone.",
    ),
    _Kind(
        "Plates' clock",
        ("in step",),
        "Record plates and markers with one clock (a common trigger); moments of this trial hold what is left of it.",
    ),
    _Kind(
        "Plates' zero",
        ("zero",),
        "Zero the plates with nobody on them before each trial; what is not said to be taken off, take off by "
        "[[plate_loads]] in a configuration (docs/models.md).",
    ),
    _Kind(
        "Plates' gain",
        ("gain",),
        "Weigh something of known mass on each plate, and correct the calibration (or the unit) in the file of the "
        "forces; if by the film something else bears the person there, declare it (--contact).",
    ),
    _Kind(
        "Plates' vertical moment",
        ("free moment",),
        "Zero the plates with nobody on them; if it is not that, correct the sign, the unit or the calibration of "
        "their moment about the vertical (Mz) in the file of the forces.",
    ),
    _Kind(
        "Plates' noise",
        ("plate noise",),
        "Look for what disturbs or shakes these plates (a loose plug, a missing ground, a belt's motor) before the "
        "next trial; of this one use means over repetitions.",
    ),
    _Kind(
        "Plates' horizontal forces",
        ("vertical only",),
        "Export the horizontal forces as well, or record with plates that measure them.",
    ),
    _Kind(
        "Plates' place",
        ("place",),
        "Correct where the file has the plates (corners, origin, centres of pressure), or declare what else steadies "
        "the person (--contact).",
    ),
    _Kind(
        "Force plates",
        ("plates", "sum of the plates"),
        "Look with dynakin check which plates are read, where they lie, and what bears on them; declare what else does "
        "(--contact), or give it a plate of its own.",
    ),
    _Kind("Model's ranges", ("range",), "Widen them in the file, or give --forward, before OpenSim takes the angles."),
    _Kind(
        "Pelvis angles",
        ("angles",),
        "Give what is asked for (--forward, or more markers on the pelvis), or take the pelvis' and the hips' angles "
        "elsewhere only.",
    ),
)
_OTHER = _Kind(
    "Recording",
    tuple(topic for topic in TOPICS if all(topic not in kind.topics for kind in _KINDS)),
    "Correct it in the file, or look at the film at these times, before you use what lies there.",
)


def warned(estimate: Estimate, metrics: Metrics) -> list[Insight]:
    """The findings that are warnings of the estimate, what is said twice once."""
    found = []
    for title, topics, advice in (*_KINDS, _OTHER):
        own = [message.text for message in warnings_of(estimate.messages) if message.topic in topics]
        if own:
            found.append(Insight("warning", title, " ".join(map(sentence, dict.fromkeys(own))), advice, topics))
    return found
