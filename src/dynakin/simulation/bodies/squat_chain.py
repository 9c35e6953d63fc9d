"""The simulated subject with the coordinates and signs of ``squat7``, the paper's chain: a hinge in the back,
straight arms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.chain import (
    BACKWARD,
    FORWARD,
    UP,
    chain,
    feet,
    legs,
    midline_centres,
    pelvis,
    toe_height,
)
from dynakin.simulation.bodies.marker_rows import PLUG_IN_GAIT
from dynakin.simulation.bodies.markers import draw_sites
from dynakin.simulation.bodies.posture import PosturePath, full_change
from dynakin.simulation.bodies.subject import (
    ANKLE_DIRECTION,
    LUMBAR_DIRECTION,
    T12_ON_TORSO,
    SimulatedSubject,
    affine,
    both_sides,
    symmetric,
)
from dynakin.simulation.mechanics import Segment

Array = NDArray[np.float64]

# The hinge lies at the level of T10, from L5/S1 up over the torso: two vertebrae of 25 mm above T12/L1.
HINGE_ON_TORSO = 0.41
# Angles (deg) while standing, and what the lowest posture adds; the hip follows from balance.
STANDING = {"toe": 0.0, "ankle": 5.0, "knee": 4.0, "lumbar": 15.0, "thoracic": -4.0, "shoulder": 5.0}
SQUAT = PosturePath(
    STANDING, {"toe": 0.0, "ankle": 28.0, "knee": 95.0, "lumbar": -11.0, "thoracic": -4.0, "shoulder": 70.0}
)
SEATED = PosturePath(
    STANDING,
    {"toe": 0.0, "ankle": 20.0, "knee": 94.0, "lumbar": -12.0, "thoracic": -4.0, "shoulder": 65.0},
    over_foot=(0.65, 1.0),
)


def back_lengths(subject: SimulatedSubject) -> tuple[float, float]:
    """L5/S1 to the hinge, and the hinge to the shoulder, m."""
    abdomen = HINGE_ON_TORSO * subject.lengths["torso"]
    return abdomen, subject.lengths["trunk"] - abdomen


def segment_bodies(subject: SimulatedSubject) -> dict[str, Array]:
    """Pseudo-inertia (4, 4) of each segment, both sides together, about its origin.

    The table's abdomen (up to T12) is one segment, its thorax and head the next, as in the model: what the
    hinge's level cuts from the thorax stays with it.
    """
    L = subject.lengths
    abdomen, _ = back_lengths(subject)
    neck = (L["torso"] - abdomen) * UP
    elbow, wrist = -L["upper_arm"] * UP, -(L["upper_arm"] + L["forearm"]) * UP
    arm = subject.parts["upper_arm"] + subject.placed("forearm", elbow) + subject.placed("hand", wrist)
    return {
        **legs(subject),
        "pelvis": pelvis(subject),
        "abdomen": symmetric(subject.placed("abdomen", T12_ON_TORSO * L["torso"] * UP)),
        "thorax": symmetric(subject.placed("thorax", neck) + subject.placed("head", neck)),
        "arm": both_sides(affine(arm, shift=0.5 * L["shoulder_width"] * np.array([0.0, 0.0, 1.0]))),
    }


def build_tree(subject: SimulatedSubject) -> tuple[Segment, ...]:
    """Segments in order from the foot; frames as in `dynakin.simulation.bodies.sagittal`."""
    L = subject.lengths
    abdomen, thorax = back_lengths(subject)
    return chain(
        segment_bodies(subject),
        (
            ("foot", None, np.zeros(3), "toe", FORWARD),
            ("shank", "foot", L["foot"] * ANKLE_DIRECTION, "ankle", FORWARD),
            ("thigh", "shank", L["shank"] * UP, "knee", BACKWARD),
            ("pelvis", "thigh", L["thigh"] * UP, "hip", FORWARD),
            ("abdomen", "pelvis", L["pelvis"] * LUMBAR_DIRECTION, "lumbar", BACKWARD),
            ("thorax", "abdomen", abdomen * UP, "thoracic", BACKWARD),
            ("arm", "thorax", thorax * UP, "shoulder", BACKWARD),
        ),
    )


def build_body(subject: SimulatedSubject, rng: np.random.Generator) -> SimulatedBody:
    """The chain with Plug-in Gait's markers; ``rng`` draws where they are put on."""
    tree, L = build_tree(subject), subject.lengths
    abdomen, thorax = back_lengths(subject)
    # Marker lists are written for a trunk and an arm in two pieces.
    attach = {
        "trunk": ("thorax", -abdomen * UP),
        "upper_arm": ("arm", np.zeros(3)),
        "forearm": ("arm", -L["upper_arm"] * UP),
    }
    return SimulatedBody(
        name="squat7",
        subject=subject,
        tree=tree,
        sites=draw_sites(rng, subject, PLUG_IN_GAIT, attach=attach, drivers={"forearm": "shoulder"}),
        feet=feet(subject),
        lengths={name: L[name] for name in ("foot", "shank", "thigh", "pelvis")}
        | {"abdomen": abdomen, "thorax": thorax},
        joint_centres=midline_centres(tree),
        paths={"squat": SQUAT, "sit-to-stand": SEATED, "sway": SQUAT},
        full_change=full_change(tree, SQUAT),
        floor_m=-toe_height(subject),
    )
