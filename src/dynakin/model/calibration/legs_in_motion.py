"""Knees and ankles that no marker shows: from the movement itself, or, of who stands still, as an adult has them.

Clusters of three markers and more on thigh and shank show about what these turn against each other, as in a functional
trial: the knee's axis (SARA) and the line on which the knee lies (SCoRE). How far out along the axis that is they do
not show: the leg is taken to be straight seen from the front, the knee in the plane through hip and ankle that the axis
stands on. Knees stand within 3 deg of that (Moreland et al. 1987, J Bone Joint Surg 69-A:745-749), 20 mm of a knee's
place. The ankle is where a foot of usual shape has it, laid on heel and toes; forward and up, where shank and foot turn
against each other counts as well, each by its variance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.completion import Completed, Proportions, laid
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.functional import (
    CENTRE_RESIDUAL_M,
    KNEE_DEG,
    KNEE_RESIDUAL_DEG,
    SIDE_OF,
    joint_motion,
    put_middles,
)
from dynakin.model.calibration.joint_motion import Centre, JointMotion, joint_axis, joint_centre
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.calibration.sites import Candidate
from dynakin.model.markers.fit import LEG
from dynakin.model.markers.match import MarkerMatch
from dynakin.model.markers.recognise import CORRECT
from dynakin.recordings.recording import Recording
from dynakin.results.naming import listed, words

LEG_JOINTS = ("knee_r", "knee_l", "ankle_r", "ankle_l")
_RANGE_DEG = {"knee": KNEE_DEG, "ankle": 15.0}
"""Least range of motion."""
_AXIS_SD_DEG = 20.0
"""How well a knee's axis must be known; that of functional trials is read by people."""
_TURNED_RAD = np.radians(10.0)
"""Frames in which a knee is turned less from the calibration frames say nothing of its axis; a person who stands for
most of a trial has many."""
_LISTED = 8  # names in a sentence
_BONE = 0.25
"""How far thigh and shank may be from the length that an adult of this height has, as a part of it."""
_FOOT_SD_M = 0.015
"""How far an ankle is from where a foot of usual shape has it, on top of what the movement says of its own error:
standing people have it 9 to 50 mm off, but the movement says half of its own error."""


@dataclass
class Legs:
    """Landmarks with those that were found, the joints among these, a sentence for each leg that has some, and why
    others have none."""

    landmarks: dict[str, Array]
    joints: list[str] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)


def legs_in_motion(
    landmarks: Mapping[str, Array],
    moving: Recording,
    source: MarkedTrial,
    frames: npt.NDArray[np.intp],
    height_m: float,
) -> Legs:
    """Knees and ankles that are lacking.

    Args:
        landmarks: (3,) m in the ground frame, X forward, as frames of the source show them. moving: the recording
            that is estimated.
    """
    found = Legs(dict(landmarks))
    for letter, side in SIDE_OF.items():
        lacking = [name for name in LEG_JOINTS if name.endswith(f"_{letter}") and name not in landmarks]
        if not lacking or not {"hip_r", "hip_l"} <= landmarks.keys():
            continue
        names = f"{side} {' and '.join(name.split('_')[0] for name in lacking)}"
        leg = _Leg(landmarks, letter, moving, source, frames, height_m)
        try:
            places, said = leg.places()
        except ModelError as error:
            found.failed.append(f"The movement does not show the {names}: {error.message}.")
            ankle = leg.ankle_at_rest()
            places = {} if ankle is None else {f"ankle_{letter}": ankle}
        else:
            found.messages.append(
                note(
                    "calibration",
                    f"{names.capitalize()}: where the segments turn against each other in the movement, with a leg "
                    f"that is straight seen from the front.{said}",
                )
            )
        found.landmarks |= places
        found.joints += [n for n in lacking if n in places and (n.startswith("knee") or leg.marked_ankle() is None)]
    put_middles(found.landmarks, "knee", "knee_lateral", "ankle")
    return found


@dataclass(frozen=True, eq=False)
class _Leg:
    """One leg of `legs_in_motion`, with its arguments."""

    landmarks: Mapping[str, Array]
    letter: str
    moving: Recording
    source: MarkedTrial
    frames: npt.NDArray[np.intp]
    height_m: float

    def places(self) -> tuple[dict[str, Array], str]:
        """Knee, its outer end and ankle, those that are known as they are, and what did not help."""
        knee, lateral, ankle = self._known("knee"), self._known("knee_lateral"), self.marked_ankle()
        below = self.ankle_at_rest()
        if below is None:
            raise ModelError("no markers show heel and toes")
        if knee is not None and lateral is not None:
            across = (lateral - knee) / np.linalg.norm(lateral - knee)
        else:
            motion, across = self._knee_axis()
            knee = self._knee(motion, across, below) if knee is None else knee
        said = ""
        if ankle is None:
            try:
                ankle = self._ankle(across, below)
            except ModelError as error:
                ankle, said = below, f" The ankle is that of a foot of usual shape: {error.message}."
            self._check_bone(ankle, knee, ("knee_r", "ankle_r"), "shank")
        lateral = knee + self._usual("knee_lateral_r", "knee_r") * across if lateral is None else lateral
        found = {"knee": knee, "knee_lateral": lateral, "ankle": ankle}
        return {f"{name}_{self.letter}": place for name, place in found.items()}, said

    def marked_ankle(self) -> Array | None:
        """As the markers have it; between the malleoli, whose recipe asks for the knee, where that is lacking."""
        ankle = self._known("ankle")
        return self._known("malleoli") if ankle is None else ankle

    def ankle_at_rest(self) -> Array | None:
        """As marked, else that of a foot of usual shape laid on the markers' heel and toes; None where these are not
        marked either."""
        if (ankle := self.marked_ankle()) is not None:
            return ankle
        shape = {name: self.height_m * place for name, place in Proportions.load().landmarks.items()}
        names = [f"{name}_{self.letter}" for name in ("heel", "toe", "metatarsals")]
        shown = [name for name in names if name in self.landmarks]
        if names[0] not in shown or len(shown) < 2:
            return None
        source, target = (np.array([places[name] for name in shown]) for places in (shape, self.landmarks))
        turn, shift = laid(source, target, np.ones(len(shown)), np.eye(3), self.height_m)
        return np.asarray(turn @ shape[f"ankle_{self.letter}"] + shift)

    def _known(self, name: str) -> Array | None:
        return self.landmarks.get(f"{name}_{self.letter}")

    def _motion(self, joint: str) -> JointMotion:
        """Of a joint that turns far enough."""
        own, where = f"{joint}_{self.letter}", f"{SIDE_OF[self.letter]} {joint}"
        motion, _ = joint_motion(own, self.moving, self.landmarks, self.source, self.frames, where)
        turned, least = motion.range_deg[0], _RANGE_DEG[joint]
        if turned < least:
            raise ModelError(f"the {joint} turns through {turned:.2f} deg, expected {least:g} deg or more")
        return motion

    def _knee_axis(self) -> tuple[JointMotion, Array]:
        """The knee's motion where it is turned, and its axis outwards."""
        motion = self._motion("knee")
        motion = motion.part(motion.angles_rad() > _TURNED_RAD)
        axis = joint_axis(motion)
        if axis.residual_deg > KNEE_RESIDUAL_DEG:
            raise ModelError(
                f"thigh and shank do not turn about one axis (it turns by {axis.residual_deg:.1f} deg, expected at "
                f"most {KNEE_RESIDUAL_DEG:g})"
            )
        if axis.sd_deg > _AXIS_SD_DEG:
            raise ModelError(f"its axis is known to {axis.sd_deg:.1f} deg, expected {_AXIS_SD_DEG:g} or better")
        outward = (self.landmarks["hip_r"] - self.landmarks["hip_l"]) * (1.0 if self.letter == "r" else -1.0)
        return motion, axis.direction * np.sign(axis.direction @ outward)

    def _knee(self, motion: JointMotion, across: Array, ankle: Array) -> Array:
        """On the axis, in the plane through hip and ankle."""
        hip = self.landmarks[f"hip_{self.letter}"]
        line = (ankle - hip) / np.linalg.norm(ankle - hip)
        upright = across - line * float(across @ line)
        centre = joint_centre(motion, (upright / np.linalg.norm(upright), hip))
        _check_residual(centre, "thigh")
        self._check_bone(centre.point, hip, ("hip_r", "knee_r"), "thigh")
        return centre.point

    def _ankle(self, across: Array, by_foot: Array) -> Array:
        """By the foot's shape, and along the plane across the leg's axis by the movement as well."""
        centre = joint_centre(self._motion("ankle"), (across, by_foot))
        _check_residual(centre, "shank")
        part = _FOOT_SD_M**2 / (_FOOT_SD_M**2 + centre.sd_m**2)
        apart = centre.point - by_foot
        return np.asarray(by_foot + part * (apart - across * float(across @ apart)))

    def _usual(self, start: str, end: str) -> float:
        """The distance (m) of two landmarks of an adult of this height."""
        places = Proportions.load().landmarks
        return self.height_m * float(np.linalg.norm(places[start] - places[end]))

    def _check_bone(self, below: Array, above: Array, ends: tuple[str, str], bone: str) -> None:
        usual, length = self._usual(*ends), float(np.linalg.norm(below - above))
        if abs(length / usual - 1.0) > _BONE:
            raise ModelError(
                f"the {bone} would be {length:.2f} m long, expected {usual:.2f} m give or take {_BONE:.0%}"
            )


def _check_residual(centre: Centre, bone: str) -> None:
    if centre.residual_m > CENTRE_RESIDUAL_M:
        raise ModelError(
            f"the segments below and above the {bone}'s lower end do not turn about one point (it moves by "
            f"{1e3 * centre.residual_m:.0f} mm, expected at most {1e3 * CENTRE_RESIDUAL_M:g} mm)"
        )


_BACK = ("PSI", "SACR")
_SHOWING = ("pelvis", *LEG)
"""Segments whose markers show knees and ankles: with one marker on a joint, those of the pelvis too."""


def supposed_legs(found: Completed, legs: Legs, chosen: Sequence[Candidate]) -> list[str]:
    """Knees and ankles of marked segments that are where an adult who stands has them."""
    marked = {candidate.segment for candidate in chosen}
    return [n for n in LEG_JOINTS if n not in legs.landmarks and n in found.added and found.added[n] in marked]


def no_legs(
    supposed: Sequence[str], source: MarkedTrial, static: Recording | None, legs: Legs, finder: LandmarkFinder
) -> ModelError:
    """Of legs that, laid out as those of an adult who stands, are tens of degrees off where nobody does."""
    expected = "a standing trial with markers on knees and ankles (--static)"
    if static is not None:
        expected = "another one, of the person standing still with markers on knees and ankles (--static)"
    said = f"no marker shows {listed([words(name) for name in supposed])}, and nobody stands still in it"
    match = source.match
    on_legs = [why for (name, _), why in match.left_out.items() if match.marker_set.marker(name).segment in _SHOWING]
    whys = (why.removesuffix(f": {CORRECT}") for why in on_legs)
    if reasons := "; ".join(dict.fromkeys(whys)):
        text = f"{match.where}: {said}, because markers are left out: {reasons}; expected the labels corrected."
        return ModelError(text)
    if short := _one_short(supposed, finder):
        text = f"{match.where}: {short}, and nobody stands still in it; expected it, or {expected}."
    else:
        text = " ".join([f"{match.where}: {said}; expected {expected}.", *legs.failed])
    text += not_understood(match, "TRIAL")
    return ModelError(text, asks_for="static")


def not_understood(match: MarkerMatch, file: str) -> str:
    """A sentence on names that a marker set does not know, which may show what nothing else does; "" without any."""
    unknown = match.unexplained
    if not unknown:
        return ""
    more = f" and {len(unknown) - _LISTED} more" if len(unknown) > _LISTED else ""
    return (
        f" Marker set {match.marker_set.name} does not know {', '.join(unknown[:_LISTED])}{more}: if they mark "
        f"what lacks, say so in a set of your own (dynakin markers new {file} -o my.toml)."
    )


def unmarked_legs(unmarked: Sequence[str], source: MarkedTrial, static: Recording | None) -> Message:
    """Of knees and ankles that are where the movement or proportions have them, and what would show them."""
    joints = listed([words(name) for name in sorted(unmarked)])
    text = (
        f"no marker shows {joints}: they are where the movement, or else the proportions of an adult who stands, has "
        "them, to one or two centimetres. The zeros of the legs' angles may be 10 deg off, and moments at knee and "
        "ankle are two to five times less sure; the deviations say so."
    )
    if static is None:
        return warning("joints", f"{text} Give a standing trial with markers on knees and ankles (--static).")
    unknown = not_understood(source.match, str(static.path or static.name))
    instead = (
        f" The standing trial {static.name} has none that is used there; give one with markers on knees and ankles."
    )
    return warning("joints", text + (unknown or instead))


def _one_short(supposed: Sequence[str], finder: LandmarkFinder) -> str:
    """Which marker each of these joints lacks, where it is one marker of any of them."""
    lacks: dict[str, list[str]] = {}
    for name in supposed:
        joint, side = name.split("_")[0], "right" if name.endswith("_r") else "left"
        ways = finder.lacking(joint, side)
        if {len(way) for way in ways} != {1} or not finder.touched(joint, side):
            return ""
        lacks[words(name)] = list(dict.fromkeys(marker for way in ways for marker in way))
    set_ = finder.match.marker_set
    backs = {a for m in set_.markers if m.name in _BACK for a in (*m.right, *m.left, *m.centre)}
    of_all = [
        one for one in next(iter(lacks.values()), []) if one in backs and all(one in own for own in lacks.values())
    ]
    if len(lacks) > 1 and of_all:
        where = f"a marker on the back of the pelvis (PSIS or sacrum; {set_.name}: {', '.join(of_all)})"
        return f"without {where} the hips, and with them {listed(list(lacks))}, are not known"
    return " and ".join(f"{name} is not known without {' or '.join(own)}" for name, own in lacks.items())
