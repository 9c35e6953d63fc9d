"""The simulated subject as a chain of seven hinges from the toe up, with the coordinates and signs of ``sagittal7`` or
of ``squat7``. Both have the same feet, legs and pelvis; what they have above it is a table for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dynakin.arrays import Array
from dynakin.simulation.bodies.body import Contact, SimulatedBody
from dynakin.simulation.bodies.marker_rows import OPENCAP, PLUG_IN_GAIT
from dynakin.simulation.bodies.markers import HipCentres, MarkerList, draw_sites
from dynakin.simulation.bodies.posture import PosturePath, full_change
from dynakin.simulation.bodies.subject import (
    ANKLE_DIRECTION,
    LUMBAR_DIRECTION,
    T12_ON_TORSO,
    SimulatedSubject,
    affine,
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


# From L5/S1 up over the torso: squat7's hinge lies at the level of T10, two vertebrae of 25 mm above T12/L1.
HINGE_ON_TORSO = 0.41
LEG_LENGTHS = ("foot", "shank", "thigh", "pelvis")


@dataclass(frozen=True, eq=False)
class Upper:
    """What a subject has above the pelvis.

    Attributes:
        bodies: pseudo-inertia (4, 4) of each segment, both sides together, about its origin. joints: of the same.
        lengths: m, of segments. centres: joints that no hinge has, as (segment, place (3,) m in it).
        attach, drivers: as of `draw_sites`, where marker lists name a part or a coordinate that the chain lacks.
        hips: virtual hip centres, None where the recording has none.
    """

    bodies: dict[str, Array]
    joints: tuple[Joint, ...]
    lengths: dict[str, float]
    centres: dict[str, tuple[str, Array]] = field(default_factory=dict)
    attach: Mapping[str, tuple[str, Array]] = field(default_factory=dict)
    drivers: Mapping[str, str] = field(default_factory=dict)
    hips: HipCentres | None = None


@dataclass(frozen=True, eq=False)
class Planar:
    """A planar model's simulated person: what is above the pelvis, its postures, and the markers that it wears."""

    name: str
    upper: Callable[[SimulatedSubject], Upper]
    squat: PosturePath
    seated: PosturePath
    markers: MarkerList

    def segment_bodies(self, subject: SimulatedSubject) -> dict[str, Array]:
        """Pseudo-inertia (4, 4) of each segment, both sides together, about its origin; symmetric about the sagittal
        plane."""
        return {**legs(subject), "pelvis": pelvis(subject), **self.upper(subject).bodies}

    def build_tree(self, subject: SimulatedSubject) -> tuple[Segment, ...]:
        """Segments in order from the foot. Frames: X forward, Y up along the segment at zero angles, origin at the
        lower joint (arms: the upper one); the pelvis' X runs from mid-PSIS to mid-ASIS. The root is the toe landmark,
        at the origin."""
        L = subject.lengths
        return chain(
            self.segment_bodies(subject),
            (
                ("foot", None, np.zeros(3), "toe", FORWARD),
                ("shank", "foot", L["foot"] * ANKLE_DIRECTION, "ankle", FORWARD),
                ("thigh", "shank", L["shank"] * UP, "knee", BACKWARD),
                ("pelvis", "thigh", L["thigh"] * UP, "hip", FORWARD),
                *self.upper(subject).joints,
            ),
        )

    def build_body(self, subject: SimulatedSubject, rng: np.random.Generator) -> SimulatedBody:
        """The chain with its markers; ``rng`` draws where they are put on."""
        tree, upper = self.build_tree(subject), self.upper(subject)
        return SimulatedBody(
            name=self.name,
            subject=subject,
            tree=tree,
            sites=draw_sites(rng, subject, self.markers, attach=upper.attach, drivers=upper.drivers),
            feet=feet(subject),
            lengths={name: subject.lengths[name] for name in LEG_LENGTHS} | upper.lengths,
            joint_centres=midline_centres(tree) | upper.centres,
            paths={"squat": self.squat, "sit-to-stand": self.seated, "sway": self.squat},
            full_change=full_change(tree, self.squat),
            hips=upper.hips,
            floor_m=-toe_height(subject),
        )


def _one_trunk(subject: SimulatedSubject) -> Upper:
    """One trunk, and arms with an elbow."""
    L = subject.lengths
    shoulder = 0.5 * L["shoulder_width"] * np.array([0.0, 0.0, 1.0])
    neck = L["torso"] * UP
    trunk = (
        subject.placed("abdomen", T12_ON_TORSO * L["torso"] * UP)
        + subject.placed("thorax", neck)
        + subject.placed("head", neck)
    )
    forearm = subject.parts["forearm"] + subject.placed("hand", -L["forearm"] * UP)
    return Upper(
        {
            "trunk": symmetric(trunk),
            "upper_arm": both_sides(subject.placed("upper_arm", shoulder)),
            "forearm": both_sides(affine(forearm, shift=shoulder)),
        },
        (
            ("trunk", "pelvis", L["pelvis"] * LUMBAR_DIRECTION, "lumbar", BACKWARD),
            ("upper_arm", "trunk", L["trunk"] * UP, "shoulder", BACKWARD),
            ("forearm", "upper_arm", -L["upper_arm"] * UP, "elbow", BACKWARD),
        ),
        {name: L[name] for name in ("trunk", "upper_arm")},
        centres={"wrist": ("forearm", -L["forearm"] * UP)},
        hips=HipCentres(("r.ASIS", "L.ASIS", "r.PSIS", "L.PSIS"), ("R_HJC_reg", "L_HJC_reg"), 0.5 * L["hip_width"]),
    )


def _hinged_back(subject: SimulatedSubject) -> Upper:
    """The paper's chain: a hinge in the back, straight arms.

    The table's abdomen (up to T12) is one segment, its thorax and head the next, as in the model: what the hinge's
    level cuts from the thorax stays with it.
    """
    L = subject.lengths
    abdomen = HINGE_ON_TORSO * L["torso"]  # L5/S1 to the hinge
    thorax = L["trunk"] - abdomen  # the hinge to the shoulder
    neck = (L["torso"] - abdomen) * UP
    elbow, wrist = -L["upper_arm"] * UP, -(L["upper_arm"] + L["forearm"]) * UP
    arm = subject.parts["upper_arm"] + subject.placed("forearm", elbow) + subject.placed("hand", wrist)
    return Upper(
        {
            "abdomen": symmetric(subject.placed("abdomen", T12_ON_TORSO * L["torso"] * UP)),
            "thorax": symmetric(subject.placed("thorax", neck) + subject.placed("head", neck)),
            "arm": both_sides(affine(arm, shift=0.5 * L["shoulder_width"] * np.array([0.0, 0.0, 1.0]))),
        },
        (
            ("abdomen", "pelvis", L["pelvis"] * LUMBAR_DIRECTION, "lumbar", BACKWARD),
            ("thorax", "abdomen", abdomen * UP, "thoracic", BACKWARD),
            ("arm", "thorax", thorax * UP, "shoulder", BACKWARD),
        ),
        {"abdomen": abdomen, "thorax": thorax},
        attach={"trunk": ("thorax", -abdomen * UP), "upper_arm": ("arm", np.zeros(3)), "forearm": ("arm", elbow)},
        drivers={"forearm": "shoulder"},
    )


# Angles (deg) while standing, and what the lowest posture adds; the hip follows from balance. A seat is above knee
# height, feet drawn back, arms forward: so that a lean of some 40 deg brings the centre of mass over the ankle.
_LEGS = {"toe": 0.0, "ankle": 5.0, "knee": 4.0}
_SQUATTED, _SAT = {"toe": 0.0, "ankle": 28.0, "knee": 95.0}, {"toe": 0.0, "ankle": 20.0, "knee": 94.0}
_OVER_SEATED_FOOT = (0.65, 1.0)
_ELBOW_UP = _LEGS | {"lumbar": 13.0, "shoulder": 5.0, "elbow": 15.0}
_THORAX_UP = _LEGS | {"lumbar": 15.0, "thoracic": -4.0, "shoulder": 5.0}

SAGITTAL7 = Planar(
    "sagittal7",
    _one_trunk,
    PosturePath(_ELBOW_UP, _SQUATTED | {"lumbar": -14.0, "shoulder": 70.0, "elbow": 10.0}),
    PosturePath(_ELBOW_UP, _SAT | {"lumbar": -16.0, "shoulder": 65.0, "elbow": 10.0}, over_foot=_OVER_SEATED_FOOT),
    OPENCAP,
)
SQUAT7 = Planar(
    "squat7",
    _hinged_back,
    PosturePath(_THORAX_UP, _SQUATTED | {"lumbar": -11.0, "thoracic": -4.0, "shoulder": 70.0}),
    PosturePath(_THORAX_UP, _SAT | {"lumbar": -12.0, "thoracic": -4.0, "shoulder": 65.0}, over_foot=_OVER_SEATED_FOOT),
    PLUG_IN_GAIT,
)
