"""What the planar chains have in common: legs and pelvis from the toe up, and two feet on two plates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from dynakin.arrays import Array
from dynakin.simulation.bodies.body import Contact
from dynakin.simulation.bodies.subject import (
    ANKLE_DIRECTION,
    LUMBAR_DIRECTION,
    SimulatedSubject,
    both_sides,
    mass_com_inertia,
    symmetric,
)
from dynakin.simulation.mechanics import Axis, Segment

Direction = tuple[float, float, float]
Joint = tuple[str, str | None, Array, str, Direction]  # segment, parent, placement in it, coordinate, direction

UP = np.array([0.0, 1.0, 0.0])
# The top of the child leans backward: knee flexion, lumbar extension, arm and elbow flexion.
BACKWARD: Direction = (0.0, 0.0, 1.0)
# It leans forward: heel rise, dorsiflexion, hip flexion.
FORWARD: Direction = (0.0, 0.0, -1.0)

_TOE_HEIGHT = 0.025  # of the toe landmark over the floor, of body height
_FOOT_LATERAL = 0.115  # of each foot's middle from the midline, of body height
_PLATE_BEHIND_TOE_M = 0.10


def chain(bodies: Mapping[str, Array], joints: Sequence[Joint]) -> tuple[Segment, ...]:
    """Segments that hang on each other by one hinge each, from pseudo-inertias (4, 4) by segment."""
    return tuple(
        Segment(name, parent, placement, (Axis(coordinate, direction),), *mass_com_inertia(bodies[name]))
        for name, parent, placement, coordinate, direction in joints
    )


def legs(subject: SimulatedSubject) -> dict[str, Array]:
    """Foot, shank and thigh, right and left together, about the toe, the ankle and the knee."""
    L = subject.lengths
    hip = 0.5 * L["hip_width"] * np.array([0.0, 0.0, 1.0])
    return {
        "foot": both_sides(subject.placed("foot", L["foot"] * ANKLE_DIRECTION + hip)),
        "shank": both_sides(subject.placed("shank", L["shank"] * UP + hip)),
        "thigh": both_sides(subject.placed("thigh", L["thigh"] * UP + hip)),
    }


def pelvis(subject: SimulatedSubject) -> Array:
    """The pelvis about the hip centres' middle."""
    return symmetric(subject.placed("pelvis", subject.lengths["pelvis"] * LUMBAR_DIRECTION))


def toe_height(subject: SimulatedSubject) -> float:
    """Height of the toe landmark over the floor, m."""
    return _TOE_HEIGHT * subject.height_m


def feet(subject: SimulatedSubject) -> tuple[Contact, ...]:
    """A plate under each foot: "plate 1" the right, "plate 2" the left one; both act through the chain's root."""
    lateral, floor = _FOOT_LATERAL * subject.height_m, -toe_height(subject)
    return (
        Contact("right foot", "plate 1", None, np.array([-_PLATE_BEHIND_TOE_M, floor, lateral])),
        Contact("left foot", "plate 2", None, np.array([-_PLATE_BEHIND_TOE_M, floor, -lateral])),
    )


def midline_centres(tree: Sequence[Segment]) -> dict[str, tuple[str, Array]]:
    """Each joint, named as its coordinate, lies at the origin of the segment that hangs there."""
    return {segment.axes[0].coordinate: (segment.name, np.zeros(3)) for segment in tree}
