"""The simulated subject in space, with the coordinates and signs of ``fullbody``: pelvis, legs, torso, head, arms.

Frames are those that the model measures: X forward, Y up along the segment, Z to the right, origin at the joint by
which a segment hangs; the pelvis lies at the middle of its ASIS. The ground is the laboratory's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.simulation.bodies.body import Contact, SimulatedBody
from dynakin.simulation.bodies.marker_rows import SETS, draw_sites
from dynakin.simulation.bodies.markers import HipCentres, Site
from dynakin.simulation.bodies.subject import (
    ANKLE_DIRECTION,
    LUMBAR_DIRECTION,
    T12_ON_TORSO,
    SimulatedSubject,
    affine,
    mass_com_inertia,
    symmetric,
)
from dynakin.simulation.bodies.worn import worn_sites
from dynakin.simulation.mechanics import Axis, Segment

Direction = tuple[float, float, float]

SIDES = (("r", 1.0), ("l", -1.0))
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
# An average person's axes. The ankle's outer end lies 10 deg down (Inman 1976); subtalar: Rajagopal et al. 2016, IEEE
# TBME 63:2068-2079.
_KNEE = np.array([0.0, 0.0, -1.0])
_ANKLE = np.array([0.0, -0.17364818, 0.98480775])
_SUBTALAR = np.array([0.78717961, 0.60474746, -0.12094949])
# Middle of the ASIS from the middle of the hip centres, over the height: Harrington et al. (2007, J Biomech 40:595-602)
# for the pelvis of the marker lists.
_ASIS_FROM_HIPS = np.array([0.036, 0.053, 0.0])
_SHOULDER_ON_TRUNK = 0.90  # the joint centre under the acromion, over the length to it
_FOOT_LATERAL = 0.10  # of each foot from the midline, of body height, where a motion does not say
_TOE_HEIGHT = 0.025  # of the toe landmark over the floor, of body height
# From the ankle, over the height: ends of the sole, and where the foot rolls over its heel and its ball.
_SOLE = {"back": -0.045, "heel": -0.030, "ball": 0.080, "tip": 0.110}
# How far (deg) a full squat turns a joint: the change that moves the soft tissue by its full size.
FULL_CHANGE_DEG = {
    "ankle_angle": 28.0, "knee_angle": 95.0, "hip_flexion": 85.0, "arm_flex": 70.0, "elbow_flex": 60.0,
    "lumbar_extension": 20.0, "neck_extension": 30.0,
}  # fmt: skip


@dataclass(frozen=True)
class Sole:
    """The underside of a foot in its own frame, m: places (3,) of the heel and the ball over which it rolls, and x of
    its ends; the same for both feet."""

    heel: Array
    ball: Array
    back_x: float
    tip_x: float

    @classmethod
    def of(cls, subject: SimulatedSubject) -> Sole:
        """Of a flat rigid foot."""
        H, down = subject.height_m, -ankle_height(subject)
        heel, ball = (np.array([_SOLE[name] * H, down, 0.0]) for name in ("heel", "ball"))
        return cls(heel, ball, _SOLE["back"] * H, _SOLE["tip"] * H)


def ankle_height(subject: SimulatedSubject) -> float:
    """Of the ankle over the floor, foot flat, m."""
    return _TOE_HEIGHT * subject.height_m + float(ANKLE_DIRECTION[1]) * subject.lengths["foot"]


def hip_in_pelvis(subject: SimulatedSubject, sign: float) -> Array:
    """The hip centre (3,) m in the pelvis' frame; sign: 1 right, -1 left, 0 the middle of both."""
    return _regressed_hip(subject, sign) + _off_landmark(subject, "hip", sign)


def _off_landmark(subject: SimulatedSubject, joint: str, sign: float) -> Array:
    """(3,) m from where landmarks have a joint to where it is; ``sign`` as of `hip_in_pelvis`."""
    return np.asarray(subject.centres[joint] * [1.0, 1.0, sign])


def _regressed_hip(subject: SimulatedSubject, sign: float) -> Array:
    """Where the landmarks of the pelvis have it."""
    half = 0.5 * subject.lengths["hip_width"]
    return np.asarray(np.array([0.0, 0.0, sign * half]) - subject.height_m * _ASIS_FROM_HIPS)


def _lumbar_in_pelvis(subject: SimulatedSubject) -> Array:
    middle = _regressed_hip(subject, 0.0) + subject.lengths["pelvis"] * LUMBAR_DIRECTION
    return middle + _off_landmark(subject, "lumbar", 0.0)


def _below(subject: SimulatedSubject, segment: str, joint: str, sign: float) -> Array:
    """The joint (3,) m at the lower end of thigh or shank, in its frame."""
    return _off_landmark(subject, joint, sign) - subject.lengths[segment] * np.array(Y)


def _shoulder_in_torso(subject: SimulatedSubject, sign: float) -> Array:
    L = subject.lengths
    return np.array([0.0, _SHOULDER_ON_TRUNK * L["trunk"], sign * 0.5 * L["shoulder_width"]])


def _lengths(subject: SimulatedSubject) -> dict[str, float]:
    """By the model's names, the paired ones once for both sides."""
    L = subject.lengths
    return {
        "pelvis": float(np.linalg.norm(hip_in_pelvis(subject, 1.0))),
        "lumbar": float(np.linalg.norm(_lumbar_in_pelvis(subject))),
        "shoulder": float(np.linalg.norm(_shoulder_in_torso(subject, 1.0))),
        "thigh": float(np.linalg.norm(_below(subject, "thigh", "knee", 1.0))),
        "shank": float(np.linalg.norm(_below(subject, "shank", "ankle", 1.0))),
        **{name: L[name] for name in ("torso", "upper_arm", "forearm")},
    }


def _hinge(subject: SimulatedSubject, coordinate: str, mean: Array) -> tuple[str, Direction]:
    """A coordinate of the right leg about the subject's own axis."""
    own = mean + np.cross(subject.turns[coordinate], mean)
    x, y, z = own / np.linalg.norm(own)
    return coordinate, (float(x), float(y), float(z))


def _hinges(side: str, sign: float, *axes: tuple[str, Direction]) -> tuple[Axis, ...]:
    """Rotations written for the right side; a mirror turns x and y of their directions."""
    return tuple(Axis(f"{name}_{side}", (sign * x, sign * y, z)) for name, (x, y, z) in axes)


def build_tree(subject: SimulatedSubject) -> tuple[Segment, ...]:
    """15 segments from the pelvis outwards; their coordinates are those of ``fullbody``, locked ones included."""
    L = subject.lengths
    neck = L["torso"] * np.array(Y)
    lumbar = _lumbar_in_pelvis(subject)
    torso = subject.placed("abdomen", T12_ON_TORSO * neck) + subject.placed("thorax", neck)

    def segment(name: str, parent: str | None, place: Array, axes: tuple[Axis, ...], body: Array) -> Segment:
        return Segment(name, parent, place, axes, *mass_com_inertia(body))

    free = tuple(Axis(f"pelvis_t{n}", d, translation=True) for n, d in zip("xyz", (X, Y, Z), strict=True))
    turning = (Axis("pelvis_tilt", Z), Axis("pelvis_list", X), Axis("pelvis_rotation", Y))
    tree = [segment("pelvis", None, np.zeros(3), free + turning, symmetric(subject.placed("pelvis", lumbar)))]
    for side, sign in SIDES:
        part = _sided(subject, sign)
        hip = _hinges(side, sign, ("hip_flexion", Z), ("hip_adduction", X), ("hip_rotation", Y))
        knee = _hinges(side, sign, _hinge(subject, "knee_angle", _KNEE), ("knee_adduction", X))
        turns = (_hinge(subject, "ankle_angle", _ANKLE), _hinge(subject, "subtalar_angle", _SUBTALAR))
        ankle = _hinges(side, sign, ("tibial_torsion", Y), *turns)
        tree += [
            segment(f"thigh_{side}", "pelvis", hip_in_pelvis(subject, sign), hip, part["thigh"]),
            segment(f"shank_{side}", f"thigh_{side}", _below(subject, "thigh", "knee", sign), knee, part["shank"]),
            segment(f"foot_{side}", f"shank_{side}", _below(subject, "shank", "ankle", sign), ankle, part["foot"]),
        ]
    for name, parent, place, stem, body in (
        ("torso", "pelvis", lumbar, "lumbar", symmetric(torso)),
        ("head", "torso", neck, "neck", symmetric(subject.parts["head"])),
    ):
        axes = (Axis(f"{stem}_extension", Z), Axis(f"{stem}_bending", X), Axis(f"{stem}_rotation", Y))
        tree.append(segment(name, parent, place, axes, body))
    for side, sign in SIDES:
        part = _sided(subject, sign)
        shoulder = _hinges(side, sign, ("arm_flex", Z), ("arm_add", X), ("arm_rot", Y))
        elbow = _hinges(side, sign, ("elbow_flex", Z), ("pro_sup", Y))
        wrist = _hinges(side, sign, ("wrist_flex", Z), ("wrist_dev", X))
        upper, fore = (-L[name] * np.array(Y) for name in ("upper_arm", "forearm"))
        tree += [
            segment(f"upper_arm_{side}", "torso", _shoulder_in_torso(subject, sign), shoulder, part["upper_arm"]),
            segment(f"forearm_{side}", f"upper_arm_{side}", upper, elbow, part["forearm"]),
            segment(f"hand_{side}", f"forearm_{side}", fore, wrist, part["hand"]),
        ]
    return tuple(tree)


def _sided(subject: SimulatedSubject, sign: float) -> Mapping[str, Array]:
    """Pseudo-inertias of one side; the table is that of the right one."""
    return {name: affine(J, stretch=np.diag([1.0, 1.0, sign])) for name, J in subject.parts.items()}


def put_on(subject: SimulatedSubject, rng: np.random.Generator, markers: str) -> tuple[Site, ...]:
    """The sites of a marker set's markers; ``rng`` draws where each is put on.

    Args:
        markers: "opencap" or "plug-in-gait": the lists of `marker_rows`, on which the validation's tables rest; any
            other built-in set, or a .toml file: all that it names.

    Raises:
        ModelError: no such set, or a wrong file.
    """
    if markers in SETS:
        return draw_sites(rng, subject, SETS[markers])
    joints = {"hip": _regressed_hip(subject, 1.0), "shoulder": _shoulder_in_torso(subject, 1.0)}
    return worn_sites(rng, subject, load_marker_set(markers), joints)


def build_body(subject: SimulatedSubject, rng: np.random.Generator, markers: str = "opencap") -> SimulatedBody:
    """The whole body with the markers of a set; arguments and errors as of `put_on`."""
    tree, L = build_tree(subject), subject.lengths
    joints = {
        "thigh": "hip", "shank": "knee", "foot": "ankle", "torso": "lumbar", "head": "cervical",
        "upper_arm": "shoulder", "forearm": "elbow", "hand": "wrist",
    }  # fmt: skip
    centres = {}
    for segment in tree[1:]:
        stem, suffix = (
            (segment.name[:-2], segment.name[-2:]) if segment.name[-2:] in ("_r", "_l") else (segment.name, "")
        )
        centres[joints[stem] + suffix] = (segment.name, np.zeros(3))
    hips = HipCentres(
        ("r.ASIS", "L.ASIS", "r.PSIS", "L.PSIS"), ("R_HJC_reg", "L_HJC_reg"), 0.5 * L["hip_width"],
        _regressed_hip(subject, 0.0),
    )  # fmt: skip
    full = {f"{stem}_{side}": value for stem, value in FULL_CHANGE_DEG.items() for side, _ in SIDES}
    full |= {stem: FULL_CHANGE_DEG[stem] for stem in ("lumbar_extension", "neck_extension")}
    coordinates = {axis.coordinate for segment in tree for axis in segment.axes}
    return SimulatedBody(
        name="fullbody",
        subject=subject,
        tree=tree,
        sites=put_on(subject, rng, markers),
        feet=(
            Contact("right foot", "plate 1", "foot_r", np.array([0.0, 0.0, _FOOT_LATERAL * subject.height_m])),
            Contact("left foot", "plate 2", "foot_l", np.array([0.0, 0.0, -_FOOT_LATERAL * subject.height_m])),
        ),
        lengths=_lengths(subject),
        joint_centres=centres,
        full_change={name: float(np.deg2rad(value)) for name, value in full.items() if name in coordinates},
        hips=hips if markers == "opencap" else None,
        in_space=True,
    )
