"""The simulated subject as a chain of seven hinges from the toe up, with the coordinates and signs of
``sagittal7``."""

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
from dynakin.simulation.bodies.marker_rows import OPENCAP
from dynakin.simulation.bodies.markers import HipCentres, draw_sites
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

# Angles (deg) while standing, and what the lowest posture adds; the hip follows from balance.
STANDING = {"toe": 0.0, "ankle": 5.0, "knee": 4.0, "lumbar": 13.0, "shoulder": 5.0, "elbow": 15.0}
SQUAT = PosturePath(
    STANDING, {"toe": 0.0, "ankle": 28.0, "knee": 95.0, "lumbar": -14.0, "shoulder": 70.0, "elbow": 10.0}
)
# A seat above knee height, feet drawn back, arms forward: so that a lean of some 40 deg brings the centre of mass over
# the ankle.
SEATED = PosturePath(
    STANDING,
    {"toe": 0.0, "ankle": 20.0, "knee": 94.0, "lumbar": -16.0, "shoulder": 65.0, "elbow": 10.0},
    over_foot=(0.65, 1.0),
)
LENGTHS = ("foot", "shank", "thigh", "pelvis", "trunk", "upper_arm")


def segment_bodies(subject: SimulatedSubject) -> dict[str, Array]:
    """Pseudo-inertia (4, 4) of each segment, both sides together, about its origin; symmetric about the sagittal
    plane."""
    L = subject.lengths
    shoulder = 0.5 * L["shoulder_width"] * np.array([0.0, 0.0, 1.0])
    neck = L["torso"] * UP
    trunk = (
        subject.placed("abdomen", T12_ON_TORSO * L["torso"] * UP)
        + subject.placed("thorax", neck)
        + subject.placed("head", neck)
    )
    forearm = subject.parts["forearm"] + subject.placed("hand", -L["forearm"] * UP)
    return {
        **legs(subject),
        "pelvis": pelvis(subject),
        "trunk": symmetric(trunk),
        "upper_arm": both_sides(subject.placed("upper_arm", shoulder)),
        "forearm": both_sides(affine(forearm, shift=shoulder)),
    }


def build_tree(subject: SimulatedSubject) -> tuple[Segment, ...]:
    """Segments in order from the foot. Frames: X forward, Y up along the segment at zero angles, origin at
    the lower joint (arms: the upper one); the pelvis' X runs from mid-PSIS to mid-ASIS. The root is the toe
    landmark, at the origin."""
    L = subject.lengths
    return chain(
        segment_bodies(subject),
        (
            ("foot", None, np.zeros(3), "toe", FORWARD),
            ("shank", "foot", L["foot"] * ANKLE_DIRECTION, "ankle", FORWARD),
            ("thigh", "shank", L["shank"] * UP, "knee", BACKWARD),
            ("pelvis", "thigh", L["thigh"] * UP, "hip", FORWARD),
            ("trunk", "pelvis", L["pelvis"] * LUMBAR_DIRECTION, "lumbar", BACKWARD),
            ("upper_arm", "trunk", L["trunk"] * UP, "shoulder", BACKWARD),
            ("forearm", "upper_arm", -L["upper_arm"] * UP, "elbow", BACKWARD),
        ),
    )


def build_body(subject: SimulatedSubject, rng: np.random.Generator) -> SimulatedBody:
    """The chain with the markers of the ``opencap`` recordings; ``rng`` draws where they are put on."""
    tree, L = build_tree(subject), subject.lengths
    return SimulatedBody(
        name="sagittal7",
        subject=subject,
        tree=tree,
        sites=draw_sites(rng, subject, OPENCAP),
        feet=feet(subject),
        lengths={name: L[name] for name in LENGTHS},
        joint_centres=midline_centres(tree) | {"wrist": ("forearm", -L["forearm"] * UP)},
        paths={"squat": SQUAT, "sit-to-stand": SEATED, "sway": SQUAT},
        full_change=full_change(tree, SQUAT),
        hips=HipCentres(("r.ASIS", "L.ASIS", "r.PSIS", "L.PSIS"), ("R_HJC_reg", "L_HJC_reg"), 0.5 * L["hip_width"]),
        floor_m=-toe_height(subject),
    )
