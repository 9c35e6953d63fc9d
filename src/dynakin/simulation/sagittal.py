"""The simulated subject as a chain of seven hinges from the toe up, with the coordinates and signs of
``sagittal7``."""

from __future__ import annotations

import numpy as np

from dynakin.simulation.mechanics import Axis, Segment
from dynakin.simulation.subject import ANKLE_DIRECTION, LUMBAR_DIRECTION, SimulatedSubject, mass_com_inertia

COORDINATES = ("toe", "ankle", "knee", "hip", "lumbar", "shoulder", "elbow")

BACKWARD = (
    0.0,
    0.0,
    1.0,
)  # the top of the child leans backward: knee flexion, lumbar extension, arm and elbow flexion
FORWARD = (0.0, 0.0, -1.0)  # it leans forward: heel rise, dorsiflexion, hip flexion


def build_tree(subject: SimulatedSubject) -> tuple[Segment, ...]:
    """Segments in order from the foot. Frames: X forward, Y up along the segment at zero angles, origin at
    the lower joint (arms: the upper one); the pelvis' X runs from mid-PSIS to mid-ASIS. The root is the toe
    landmark, at the origin."""
    L, up = subject.lengths, np.array([0.0, 1.0, 0.0])
    joints = (
        ("foot", None, np.zeros(3), "toe", FORWARD),
        ("shank", "foot", L["foot"] * ANKLE_DIRECTION, "ankle", FORWARD),
        ("thigh", "shank", L["shank"] * up, "knee", BACKWARD),
        ("pelvis", "thigh", L["thigh"] * up, "hip", FORWARD),
        ("trunk", "pelvis", L["pelvis"] * LUMBAR_DIRECTION, "lumbar", BACKWARD),
        ("upper_arm", "trunk", L["trunk"] * up, "shoulder", BACKWARD),
        ("forearm", "upper_arm", -L["upper_arm"] * up, "elbow", BACKWARD),
    )
    return tuple(
        Segment(name, parent, placement, (Axis(coordinate, direction),), *mass_com_inertia(subject.bodies[name]))
        for name, parent, placement, coordinate, direction in joints
    )
