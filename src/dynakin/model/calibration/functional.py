"""Hip centres and knee axes from functional trials, in place of what the markers of the standing person give."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.messages import Message, note
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.joint_motion import (
    BLOCKS,
    Centre,
    JointAxis,
    JointMotion,
    RigidMotion,
    angle_deg,
    distance_sd_m,
    joint_axis,
    joint_centre,
    off_their_line,
    rigid_motion,
)
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.markers.match import match_markers
from dynakin.recordings.companions import another_person
from dynakin.recordings.landmarks import find_marker
from dynakin.recordings.recording import Recording

SIDE_OF = {"r": "right", "l": "left"}
_SEGMENTS = {"hip": ("pelvis", "thigh"), "knee": ("thigh", "shank"), "ankle": ("shank", "foot")}
_BONES = {"thigh": ("hip", "knee"), "shank": ("knee", "ankle")}
_COMPARED = {"hip": ("hip",), "knee": ("knee", "knee_lateral", "hip")}  # landmarks of the markers' own joint
_IN_WORDS = {"hip": "hip centre", "knee": "knee centre", "knee_lateral": "lateral epicondyle"}
_FEWEST = 3  # markers that show how a segment turns
_NEAR_BONE_M = (0.015, 0.15)  # of its line: nearer are computed joint centres, farther other segments
_ALONG_BONE = (0.05, 1.10)
_MOVES_WITH_M = 0.010  # standard deviation of the distance between markers of one segment
_FLAT_M = 0.012  # a cluster less wide than this turns about its own line unseen
_DEFORMED_M = 0.015
"""Misfit of a segment's markers to their shape while standing, 90 frames of 100: 5 to 10 mm by skin. A marker whose
label is swapped with its neighbour's in a part of a trial makes 30 (lateral and medial epicondyle)."""
_HIP_DEG, KNEE_DEG = 20.0, 40.0
"""Least range of motion: of the thigh about its second axis, and of the knee. On simulated persons errors reach 10 mm
there (14 mm at 13 deg, 25 mm at 11, where it is skin that turns) and 4 deg (9 deg at half of it)."""
CENTRE_RESIDUAL_M, KNEE_RESIDUAL_DEG = 0.015, 5.0
"""Largest root mean square by which the joint moves against itself: 6 to 9 mm and 1.5 deg on simulated persons."""
_HIP_SD_M = 0.018
"""Largest standard deviation of a hip centre: 7 to 13 mm on simulated persons (seeds 401 to 414), 8 mm on a real one;
12 to 58 mm by trials of other people, mostly above 24 mm, below 18 mm of such whose size is about the same."""
_HIP_OFF_M, _KNEE_OFF_DEG = 0.06, 30.0
"""Farthest from the markers' own: beyond it a file of another joint, or landmarks that are wrong."""


def functional_landmarks(
    trials: Mapping[str, Recording],
    landmarks: Mapping[str, Array],
    finder: LandmarkFinder,
    source: MarkedTrial,
    frames: npt.NDArray[np.intp],
) -> tuple[dict[str, Array], list[Message]]:
    """Landmarks of models in space, those of the joints replaced that functional trials show, and sentences on it.

    Args:
        trials: by joint, "hip_r", "knee_l". landmarks: (3,) m in the ground frame, X forward. source, frames: where
            the person stands.

    Raises:
        ModelError: another person's trial, markers of a segment or of the joint itself are lacking, the joint moves too
            little, or not as one joint does.
    """
    found, messages = dict(landmarks), list[Message]()
    for joint in sorted(trials):  # hips first: the thigh's frame is spoken of by its new centre
        name = joint.split("_")[0]
        where = f"functional trial {trials[joint].path or trials[joint].name} for {joint}"
        if other := another_person(trials[joint], source.recording):
            raise ModelError(f"{where}: {other}; expected the person and the markers that are measured")
        _refuse_unmarked(joint, found, finder, where)
        motion, without = joint_motion(joint, trials[joint], found, source, frames, where)
        if without:
            messages.append(
                note(
                    "calibration",
                    f"{trials[joint].name}: {', '.join(without)} left out for {joint}: moved against the others of the "
                    "segment since standing (a label swapped in a part of the trial, perhaps).",
                )
            )
        turned = motion.range_deg
        if name == "hip":
            if turned[1] < _HIP_DEG:
                raise ModelError(
                    f"{where}: the thigh turns through {turned[0]:.0f} by {turned[1]:.0f} deg, expected {_HIP_DEG:g} "
                    "deg or more about two axes (swing the leg forward, sideways and between, and around)"
                )
            messages.append(
                note("calibration", _put_centre(joint_centre(motion), found, joint, turned, where, trials[joint].name))
            )
        else:
            if turned[0] < KNEE_DEG:
                raise ModelError(
                    f"{where}: the knee turns through {turned[0]:.0f} deg, expected {KNEE_DEG:g} deg or more"
                )
            messages.append(
                note(
                    "calibration",
                    _put_axis(joint_axis(motion), found, finder, joint, turned, where, trials[joint].name),
                )
            )
        put_middles(found, *(("hip",) if name == "hip" else ("knee", "knee_lateral")))
    return found, messages


def _refuse_unmarked(joint: str, found: Mapping[str, Array], finder: LandmarkFinder, where: str) -> None:
    """A joint that the markers do not place: nothing shows whether the trial is of that joint."""
    name, letter = joint.split("_")
    lacking = [point for point in _COMPARED[name] if f"{point}_{letter}" not in found]
    if lacking:
        raise ModelError(
            f"{where}: no markers of the standing person give the {SIDE_OF[letter]} "
            f"{' and '.join(_IN_WORDS[point] for point in lacking)} (marker set {finder.match.marker_set.name}) that "
            "the trial's is compared with; expected markers there, in the trial or in a static one (--static)",
            asks_for="static",
        )


def _put_centre(centre: Centre, found: dict[str, Array], joint: str, turned: Array, where: str, file: str) -> str:
    if centre.residual_m > CENTRE_RESIDUAL_M:
        raise ModelError(
            f"{where}: pelvis and thigh do not turn about one point (it moves by {1e3 * centre.residual_m:.0f} mm, "
            f"expected at most {1e3 * CENTRE_RESIDUAL_M:g} mm)"
        )
    if centre.sd_m > _HIP_SD_M:
        raise ModelError(
            f"{where}: the centre found has a standard deviation of {1e3 * centre.sd_m:.0f} mm, expected at most "
            f"{1e3 * _HIP_SD_M:g} mm (beyond it the marker set's own is better): another person's trial, or markers "
            "moved since standing"
        )
    off = centre.point - found[joint]
    if np.linalg.norm(off) > _HIP_OFF_M:
        raise ModelError(
            f"{where}: the centre found lies {1e3 * float(np.linalg.norm(off)):.0f} mm from the one by the marker set, "
            f"expected at most {1e3 * _HIP_OFF_M:g} mm: a trial of another joint, or pelvis markers misplaced"
        )
    found[joint] = centre.point
    forward, up, outward = 1e3 * off * [1.0, 1.0, 1.0 if joint.endswith("_r") else -1.0]
    return (
        f"Hip centre {SIDE_OF[joint[-1]]}: from {file} (thigh turned through {turned[0]:.0f} by {turned[1]:.0f} deg, "
        f"residual {1e3 * centre.residual_m:.1f} mm), standard deviation {1e3 * centre.sd_m:.1f} mm; "
        f"{1e3 * float(np.linalg.norm(off)):.1f} mm from the marker set's: {forward:+z.1f} forward, {up:+z.1f} up, "
        f"{outward:+z.1f} outward."
    )


def _put_axis(
    axis: JointAxis, found: dict[str, Array], finder: LandmarkFinder, joint: str, turned: Array, where: str, file: str
) -> str:
    if axis.residual_deg > KNEE_RESIDUAL_DEG:
        raise ModelError(
            f"{where}: thigh and shank do not turn about one axis (it turns by {axis.residual_deg:.1f} deg, expected "
            f"at most {KNEE_RESIDUAL_DEG:g} deg)"
        )
    letter = joint[-1]
    centre, lateral = found[joint], found[f"knee_lateral_{letter}"]
    size = float(np.linalg.norm(lateral - centre))
    before = (lateral - centre) / size
    now = axis.direction * np.sign(axis.direction @ before)
    off = angle_deg(before, now)
    if off > _KNEE_OFF_DEG:
        raise ModelError(
            f"{where}: the axis found lies {off:.0f} deg from the one by the marker set, expected at most "
            f"{_KNEE_OFF_DEG:g} deg: a trial of another joint, or markers of the knee misplaced"
        )
    own, plain = finder.of_side(joint)
    recipe = own.recipe(plain, own.side)
    if recipe is not None and recipe.offset is not None:  # the centre is led inward from the one marker
        found[joint] = lateral - size * now
    else:
        found[f"knee_lateral_{letter}"] = centre + size * now
    up = found[f"hip_{letter}"] - found[joint]
    up = up / np.linalg.norm(up)
    out = before - up * float(before @ up)
    ahead = np.cross(up, out)  # to the front on the right, to the back on the left
    inward = np.rad2deg(np.arctan2(now @ ahead, now @ out)) * (1.0 if letter == "r" else -1.0)
    raised = np.rad2deg(np.arcsin(np.clip(now @ up, -1.0, 1.0)) - np.arcsin(np.clip(before @ up, -1.0, 1.0)))
    return (
        f"Knee axis {SIDE_OF[letter]}: from {file} (knee turned through {turned[0]:.0f} deg, residual "
        f"{axis.residual_deg:.1f} deg), standard deviation {axis.sd_deg:.1f} deg; {off:.1f} deg from the marker set's: "
        f"its outer end {abs(inward):.1f} deg to the {'front' if inward > 0.0 else 'back'}, {abs(raised):.1f} deg "
        f"{'up' if raised > 0.0 else 'down'}."
    )


def put_middles(found: dict[str, Array], *names: str) -> None:
    """The middle of both sides, as ``LandmarkFinder.find_in_space`` has it."""
    for name in names:
        if all(f"{name}_{letter}" in found for letter in SIDE_OF):
            found[name] = np.mean([found[f"{name}_{letter}"] for letter in SIDE_OF], axis=0)


def joint_motion(
    joint: str,
    trial: Recording,
    landmarks: Mapping[str, Array],
    source: MarkedTrial,
    frames: npt.NDArray[np.intp],
    where: str,
) -> tuple[JointMotion, list[str]]:
    """Of both segments of a joint, and the markers that do not move with theirs; ModelError where markers do not show
    it."""
    name, letter = joint.split("_")
    motions, without = [], list[str]()
    for part in _SEGMENTS[name]:
        names = _markers_of(part, letter, trial, landmarks, source, frames, where)
        motion, left_out = _rigid_part(names, part, trial, source, frames, where)
        motions.append(motion)
        without += left_out
    good = (motions[0].misfit_m <= 2.0 * _DEFORMED_M) & (motions[1].misfit_m <= 2.0 * _DEFORMED_M)  # NaN: not seen
    if np.count_nonzero(good) < 10 * BLOCKS:
        raise ModelError(f"{where}: {np.count_nonzero(good)} frames show both segments, expected {10 * BLOCKS} or more")
    return JointMotion.between(motions[0].at(good), motions[1].at(good)), without


def _rigid_part(
    names: dict[str, str], part: str, trial: Recording, source: MarkedTrial, frames: npt.NDArray[np.intp], where: str
) -> tuple[RigidMotion, list[str]]:
    """Motion of a segment since standing by those of its markers that have kept their shape, and the others' names."""
    own, left_out = dict(names), list[str]()
    while True:
        shape = np.array([_standing(source, name, frames) for name in own])
        paths = np.stack([trial.marker(came) for came in own.values()], axis=1)
        if off_their_line(shape) < _FLAT_M:
            raise ModelError(f"{where}: the markers of the {part} ({', '.join(own.values())}) lie on a line")
        motion = rigid_motion(shape, paths)
        misfit = _usual(motion)
        if misfit <= _DEFORMED_M:
            return motion, left_out
        if len(own) <= _FEWEST:
            raise ModelError(
                f"{where}: the markers of the {part} ({', '.join(names.values())}) have moved against each other since "
                f"standing, by {1e3 * misfit:.0f} mm, expected at most {1e3 * _DEFORMED_M:g} mm: labels swapped, or "
                "markers put on anew"
            )
        others = [np.delete(np.arange(len(own)), k) for k in range(len(own))]
        worst = int(np.argmin([_usual(rigid_motion(shape[keep], paths[:, keep])) for keep in others]))
        left_out.append(own.pop(list(own)[worst]))


def _usual(motion: RigidMotion) -> float:
    """Misfit (m) that 90 frames of 100 stay below; infinite where no frame shows the segment."""
    seen = motion.misfit_m[np.isfinite(motion.misfit_m)]
    return float(np.percentile(seen, 90.0)) if len(seen) else np.inf


def _standing(source: MarkedTrial, name: str, frames: npt.NDArray[np.intp]) -> Array:
    """A marker's place (3,) m in the ground frame; NaN where it is not seen."""
    path = source.ground.points_to_ground(source.recording.marker(name)[frames])
    seen = path[np.isfinite(path).all(axis=1)]
    return np.median(seen, axis=0) if len(seen) else np.full(3, np.nan)


def _markers_of(
    part: str,
    letter: str,
    trial: Recording,
    landmarks: Mapping[str, Array],
    source: MarkedTrial,
    frames: npt.NDArray[np.intp],
    where: str,
) -> dict[str, str]:
    """Markers of a segment, name while standing -> name in the trial: the set's and, where these are too few, those
    that lie along its bone and move with them.

    Raises:
        ModelError: fewer than three.
    """
    side, marker_set = SIDE_OF[letter], source.match.marker_set
    came = match_markers(marker_set, trial.marker_names, trial.seen, str(trial.path or trial.name)).names
    sides = ("right", "left", "centre") if part == "pelvis" else (side, "centre")
    keys = [(m.name, s) for m in marker_set.markers if m.segment == part and not m.landmark_only for s in sides]
    names = {
        source.match.names[key]: came[key]
        for key in keys
        if key in came
        and key in source.match.names
        and np.isfinite(_standing(source, source.match.names[key], frames)).all()
    }
    ends = [end for point in _BONES.get(part, ()) if (end := landmarks.get(f"{point}_{letter}")) is not None]
    if len(names) < _FEWEST and len(ends) == 2:
        for own, other in _along_bone(ends[0], ends[1], trial, source, frames):
            apart = [distance_sd_m(trial.marker(other), trial.marker(member)) for member in names.values()]
            if all(sd < _MOVES_WITH_M for sd in apart):
                names[own] = other
    if len(names) < _FEWEST:
        whose = part if part == "pelvis" else f"{side} {part}"
        raise ModelError(
            f"{where}: {len(names)} markers of the {whose} are seen in it and standing ({', '.join(names) or 'none'}), "
            f"and no others move with them; expected {_FEWEST} or more, off one line"
        )
    return names


def _along_bone(
    start: Array, end: Array, trial: Recording, source: MarkedTrial, frames: npt.NDArray[np.intp]
) -> list[tuple[str, str]]:
    """Markers that the set does not place and that lie beside a bone (its ends, (3,) m) while standing, nearest first:
    name while standing, name in the trial."""
    match = source.match
    placed = {m.name for m in match.marker_set.markers if not m.landmark_only}
    taken = {recorded for (name, _), recorded in match.names.items() if name in placed}
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    near: list[tuple[float, str, str]] = []
    for own in source.recording.marker_names:
        place, other = _standing(source, own, frames), find_marker(trial, own)
        if own in taken or other is None or not np.isfinite(place).all():
            continue
        at = float((place - start) @ along)
        across = float(np.linalg.norm(place - start - at * along))
        if _ALONG_BONE[0] <= at / length <= _ALONG_BONE[1] and _NEAR_BONE_M[0] <= across <= _NEAR_BONE_M[1]:
            near.append((across, own, other))
    return [(own, other) for _, own, other in sorted(near)]
