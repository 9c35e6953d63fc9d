"""Mass and height of the person where they are not given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from dynakin.arrays import Array, rms, runs
from dynakin.errors import ModelError
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.completion import Proportions
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.mirroring import SIDES
from dynakin.recordings.checks import check_plates
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.feet.zero_offset import without_blanks, without_offsets
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Recording
from dynakin.recordings.weight import CONVERT, FORCE_UNITS_N, likely_unit, while_loaded
from dynakin.settings.subject import Subject
from dynakin.units import GRAVITY_M_S2

_LEAST_S = 5.0
"""Of a movement that is to weigh a person: its mean force is the weight but for the momentum gained, and 2 m/s gained
over 5 s are 4 %."""
_STEADY = 0.3
"""Part of its mean by which the load may vary: squats do by a quarter. Running, a seat that bears part of the weight,
a step off the plates or onto a box does by more."""
_STRETCH_S, _SPEED_S = 0.15, 0.02
"""Shortest stretch whose impulse counts: 0.05 m/s that the centre of mass gains relative to the pelvis are 3 % of it;
and the smoothing before the pelvis' path is differentiated."""
_APART = 0.15
"""Part of the weight, RMS, by which the load may differ from what the pelvis' motion needs: walks and stairs differ by
0.03 to 0.08."""
_BODY_MASS_INDEX = (10.0, 60.0)
"""kg/m2; what lies beyond is no weight of a person of that height who stood on the plates."""
_OTHER_LEVEL_M = 0.08  # a heel that has left the floor, or a toe that dips, is nearer
_STANDS_M_S = 0.1
"""Speed of the lowest marker below which a foot stands: in the air it points down, which adds 0.2 m to a height."""

_HEIGHT_BY = ("asis", "hip", "knee_lateral", "knee")
"""Landmarks that give a height by the proportions, the best first."""
MEAN_HEIGHT_M, MEAN_BODY_MASS_INDEX = 1.70, 23.0


def find_mass(
    subject: Subject,
    trials: Sequence[tuple[Recording, GroundFrame]],
    foot_markers: Mapping[str, Sequence[str]],
    pelvis: Sequence[str] = (),
    height_m: float | None = None,
) -> tuple[float, list[Message]]:
    """Mass (kg) and where it comes from: given, from the plates while standing still, from the file, or from
    the plates' mean over a movement that is long and steady enough, or from their impulse while they bear all of the
    person.

    Args:
        pelvis: the recordings' names of the markers on it; its vertical speed stands for that of the centre of mass.
        height_m: for a mean adult's mass, with a warning, where no trial has plates, and nothing is weighed; None: such
            trials are refused.

    Raises:
        ModelError: none of these; the message says why the plates do not show it.
    """
    if subject.mass_kg is not None:
        return subject.mass_kg, [note("mass", f"Mass {subject.mass_kg:.2f} kg: given.")]
    reasons, means, refused = [], [], False
    for recording, ground in trials:
        if not recording.plates:
            reasons.append(f"{recording.name} has no force plates")
            continue
        recording, _ = without_blanks(recording, ground, foot_markers)
        recording, _ = without_offsets(recording, ground, foot_markers)
        loads = foot_loads(recording, ground, foot_markers)
        check = check_plates(recording, ground, None, foot_markers, loads)
        if check.refusal is not None:
            refused = True
            reasons.append(f"{recording.plates_file}: {check.refusal}")
        elif unit := _other_unit(recording, ground):
            refused = True
            reasons.append(f"{recording.plates_file}: {CONVERT.format(unit).replace('The', 'the', 1)}")
        elif check.mass_kg_from_plates is None:
            mean, why = steady_load(recording, loads)
            reasons.append(f"nobody stands still on the plates of {recording.name}, and {why}")
            if mean is not None:
                means.append((mean, f"the mean vertical force of {recording.name}, in which nobody stands still"))
            elif (found := impulse_load(recording, ground, loads, pelvis)) is not None:
                mean, seconds = found
                text = (
                    f"the plates' impulse over the {seconds:.1f} s of {recording.name} in which they bear all of the "
                )
                means.append((mean, f"{text}person, and the speed that the pelvis gains"))
        else:
            mass = float(check.mass_kg_from_plates)
            return mass, [
                note("mass", f"Mass {mass:.2f} kg: from the plates of {recording.name} while standing still.")
            ]
    for recording, _ in trials:
        mass_kg = recording.subject.get("mass_kg")
        if mass_kg:
            return mass_kg, [note("mass", f"Mass {mass_kg:.2f} kg: from the file {recording.name}.")]
    for mass, name in means:
        text = f"Mass {mass:.2f} kg: from {name}; wrong where anything but the plates bears the person."
        return mass, [note("mass", text)]
    if height_m is not None and not any(recording.plates for recording, _ in trials):
        mass = MEAN_BODY_MASS_INDEX * height_m**2
        doubt = (
            f"mass {mass:.1f} kg assumed, of a mean adult of {height_m:.2f} m: it is not given, and there are no "
            "plates. Forces and moments grow with it. Give the mass if it is known."
        )
        return mass, [note("mass", f"Mass {mass:.1f} kg: assumed."), warning("mass", doubt)]
    action = "expected mass_kg of the subject (--mass)"
    if refused:
        action = "correct the forces first; --mass alone does not help"
    raise ModelError(
        f"mass_kg is not given and cannot be found ({'; '.join(reasons)}); {action}",
        asks_for="mass_kg",
    )


def _other_unit(recording: Recording, ground: GroundFrame) -> str:
    """In which unit plates may be that carry next to nothing as N; "" where in none."""
    total = np.sum([plate.force for plate in recording.plates], axis=0)
    push = ground.vectors_to_ground(total)[:, 1]
    return likely_unit(while_loaded(push)) if 0.0 < np.nan_to_num(push).max(initial=0.0) < JUDGED_N else ""


def impulse_load(
    recording: Recording, ground: GroundFrame, loads: FootLoads, pelvis: Sequence[str]
) -> tuple[float, float] | None:
    """Mass (kg) that the plates' impulse says over the stretches in which every foot that stands is on a plate, and
    their seconds: of force it takes m (g T + gained speed). None where these are too few or the pelvis is not seen."""
    push = loads.wrench[..., 1].sum(axis=1)
    names = [name for name in pelvis if name in recording.marker_names]
    if not names or recording.n_frames < 2 or not loads.aloft.any(axis=0).all():
        return None  # who does not step may pull at something all the time
    height = ground.points_to_ground(np.stack([recording.marker(name) for name in names], axis=1))[..., 1].mean(axis=1)
    seen = np.isfinite(height)
    if np.count_nonzero(seen) < 2:
        return None
    path = np.interp(recording.time, recording.time[seen], height[seen])
    speed = np.gradient(scipy.ndimage.gaussian_filter1d(path, _SPEED_S * recording.rate), recording.time)
    known = loads.total_known & np.isfinite(push) & seen & (loads.on.any(axis=(1, 2)))
    impulse, need, seconds = 0.0, 0.0, 0.0
    pushes, accelerations = list[Array](), list[Array]()
    acceleration = np.gradient(speed, recording.time)
    for first, end in runs(known):
        lasts = float(recording.time[end - 1] - recording.time[first])
        if lasts < _STRETCH_S:
            continue
        impulse += float(np.trapezoid(push[first:end], recording.time[first:end]))
        need += GRAVITY_M_S2 * lasts + float(speed[end - 1] - speed[first])
        seconds += lasts
        pushes.append(push[first:end])
        accelerations.append(acceleration[first:end])
    if not (seconds > 0.0 and impulse > 0.0 and need > 0.0):
        return None
    mass = impulse / need
    apart = np.concatenate(pushes) - mass * (GRAVITY_M_S2 + np.concatenate(accelerations))
    if rms(apart) > _APART * mass * GRAVITY_M_S2:
        return None
    return mass, seconds


def steady_load(recording: Recording, loads: FootLoads) -> tuple[float | None, str]:
    """Mean load (kg) of the frames in which every foot that stands is on a plate, and why it is no weight; None where
    these are few, or it varies too much."""
    push = loads.wrench[..., 1].sum(axis=1)[loads.total_known]
    push = push[np.isfinite(push)]
    seconds = len(push) / recording.rate
    if seconds < _LEAST_S or not push.mean() > 0.0:
        return None, f"{seconds:.1f} s of a movement on them are too short to weigh the person, expected {_LEAST_S:g} s"
    low, high = np.percentile(push, (5.0, 95.0)) / push.mean()
    if low < 1.0 - _STEADY or high > 1.0 + _STEADY:
        return None, f"their load goes from {100.0 * low:.0f} to {100.0 * high:.0f} % of its mean, which is no weight"
    return float(push.mean()) / GRAVITY_M_S2, "its mean is used"


def check_body_mass(subject: Subject, mass_kg: float, height_m: float | None) -> None:
    """
    Raises:
        ModelError: a mass that was not given is none of a person of that height, or a height none of that mass.
    """
    if height_m is None or (subject.mass_kg is not None and subject.height_m is not None):
        return
    index, (low, high) = mass_kg / height_m**2, _BODY_MASS_INDEX
    if not low <= index <= high:
        if subject.mass_kg is not None:
            raise ModelError(
                f"height_m is not given, and {height_m:.2f} m by markers or file is no height of a person of "
                f"{mass_kg:.1f} kg ({index:.0f} kg/m2, expected {low:g} to {high:g}); expected height_m of the subject "
                "(--height)"
            )
        unit = likely_unit(mass_kg * GRAVITY_M_S2)
        action = f". {CONVERT.format(unit)}" if unit else "; expected mass_kg of the subject (--mass)"
        perhaps = min(FORCE_UNITS_N, key=lambda name: abs(np.log(index * FORCE_UNITS_N[name] / MEAN_BODY_MASS_INDEX)))
        if not unit and low <= index * FORCE_UNITS_N[perhaps] <= high:
            action += (
                f", or the plates' forces in N: in {perhaps} they would be {mass_kg * FORCE_UNITS_N[perhaps]:.0f} kg"
            )
        raise ModelError(
            f"mass_kg is not given, and {mass_kg:.1f} kg by plates or file is no mass of a person of {height_m:.2f} m "
            f"({index:.0f} kg/m2, expected {low:g} to {high:g}){action}",
            asks_for="mass_kg",
        )


def find_height(
    subject: Subject, recordings: list[Recording], trial: MarkedTrial, finder: LandmarkFinder | None = None
) -> tuple[float | None, list[Message]]:
    """Height (m) and where it comes from; None with the reason where nothing gives it.

    Args:
        finder: of a model in space, which needs a height: where that marker does not give one, the highest landmark of
            the proportions that is seen over a foot does, and without any it is a mean adult's, with a warning.

    Estimated from the marker set's ``height_marker`` (the acromion) where it is highest over the lowest marker of the
    recording, divided by its fraction of the body height: a person who never stands upright comes out too small, and
    the lowest marker lies 1 to 3 cm over the floor, which makes it 1 to 2 % too small as well. Where that marker is on
    another level than the foot that stands (a box, stairs), the lowest one of the same frame takes its place.
    """
    if subject.height_m is not None:
        return subject.height_m, [note("height", f"Height {subject.height_m:.2f} m: given.")]
    for recording in recordings:
        height_m = recording.subject.get("height_m")
        if height_m:
            return height_m, [note("height", f"Height {height_m:.2f} m: from the file {recording.name}.")]
    marker_set = trial.match.marker_set
    tops = [
        path
        for key, path in trial.paths.items()
        if key[0] == marker_set.height_marker and np.isfinite(path).all(axis=1).any()
    ]
    over = _over_the_foot(trial, tops) if tops else np.empty(0)
    if not len(over) or marker_set.height_fraction is None:
        if finder is not None:
            return _by_proportions(trial, finder)
        return None, [
            note("height", f"height_m is not given and {marker_set.height_marker or 'no marker'} does not show it.")
        ]
    height, lowest = _over_lowest(trial, tops, over)
    height /= marker_set.height_fraction
    text = (
        f"Height {height:.2f} m: not given, estimated from {marker_set.height_marker} (where it is highest) "
        f"over the {lowest}, divided by {marker_set.height_fraction:g} "
        f"({marker_set.height_source})."
    )
    return height, [note("height", text)]


TOO_SMALL, TOO_LARGE = 0.15, 0.2
"""Parts of the height by markers by which one that is given may be less, or more: a shoulder shows it to some per cent,
less high of who stands with bent legs."""


def doubtful_height(subject: Subject, trial: MarkedTrial, stands: bool) -> list[Message]:
    """A warning where a height that is given is none of who wears the markers.

    Args:
        stands: the person stands or walks in the trial: else the markers show only what the height is at least.
    """
    given, marker_set = subject.height_m, trial.match.marker_set
    if given is None or marker_set.height_fraction is None:
        return []
    tops = [path for key, path in trial.paths.items() if key[0] == marker_set.height_marker]
    tops = [path for path in tops if np.isfinite(path).all(axis=1).any()]
    over = _over_the_foot(trial, tops) if tops else np.empty(0)
    if not len(over):
        return []
    shown = _over_lowest(trial, tops, over)[0] / marker_set.height_fraction
    if given > (1.0 - TOO_SMALL) * shown and not (stands and given > (1.0 + TOO_LARGE) * shown):
        return []
    text = (
        f"the height is given as {given:.2f} m, but the markers show about {shown:.2f} m ({marker_set.height_marker} "
        "over the feet): lengths and inertia that no marker shows follow the height. Correct --height."
    )
    return [warning("height", text)]


def _by_proportions(trial: MarkedTrial, finder: LandmarkFinder) -> tuple[float, list[Message]]:
    """Height (m) from the highest landmark that needs no height itself, over a foot that stands."""
    feet = [name for names in trial.match.foot_markers.values() for name in names]
    for name in _HEIGHT_BY if feet else ():
        keys = [key for key in finder.markers_of(name) if np.isfinite(trial.paths[key]).all(axis=1).any()]
        tops = [trial.paths[key] for key in keys]
        over = _over_the_foot(trial, tops) if tops else np.empty(0)
        if not len(over):
            continue
        reach, lowest = _over_lowest(trial, tops, over)
        template = Proportions.load().landmarks
        fraction = float(template[f"{name}_r"][1] - template["heel_r"][1])
        text = (
            f"Height {reach / fraction:.2f} m: not given, estimated from {name} (where it is highest) over the "
            f"{lowest}, divided by {fraction:g} (proportions of an adult)."
        )
        return reach / fraction, [note("height", text)]
    doubt = (
        f"height {MEAN_HEIGHT_M:.2f} m assumed, of a mean adult: it is not given and no markers show it. What no "
        "markers measure is of this size. Give the height if it is known."
    )
    return MEAN_HEIGHT_M, [note("height", f"Height {MEAN_HEIGHT_M:.2f} m: assumed."), warning("height", doubt)]


def _over_lowest(trial: MarkedTrial, tops: list[Array], over: Array) -> tuple[float, str]:
    """Height (m) of markers over the lowest one, where they are highest, and which one that is."""
    top, lowest = np.mean([np.nanpercentile(path[:, 1], 99.0) for path in tops]), "lowest marker"
    reach = float(top - np.nanmin([np.nanpercentile(path[:, 1], 1.0) for path in _seen(trial)]))
    if reach - np.percentile(over, 99.0) > _OTHER_LEVEL_M:
        reach, lowest = float(np.percentile(over, 99.0)), "lowest marker of the same frame"
    return reach, lowest


def _seen(trial: MarkedTrial) -> list[Array]:
    return [path for path in trial.paths.values() if np.isfinite(path).all(axis=1).any()]


def _over_the_foot(trial: MarkedTrial, tops: list[Array]) -> Array:
    """Heights (K,) m of the mean of markers (T, 3) over the lowest one, in the frames in which that one stands still,
    or in all where it never does, as on a treadmill."""
    time, places = trial.recording.time, np.stack(list(trial.paths.values()), axis=1)
    heights = np.where(np.isfinite(places[..., 1]), places[..., 1], np.inf)
    lowest = heights.argmin(axis=1)
    over = np.mean(tops, axis=0)[:, 1] - heights.min(axis=1)
    seen = np.isfinite(over)
    if len(time) < 2:
        return np.asarray(over[seen])
    speed = np.linalg.norm(np.gradient(places, time, axis=0), axis=2)[np.arange(len(time)), lowest]
    still = seen & (speed < _STANDS_M_S)  # NaN next to a gap: not known to be still
    return np.asarray(over[still if still.any() else seen])


def joint_widths(entries: list[Recording], finder: LandmarkFinder) -> tuple[dict[str, float], list[Message]]:
    """Widths (m) of knee and ankle by joint and side ("knee_r") as recordings say them, and a sentence where used."""
    keys = {f"{joint}_{side[0]}": side for joint in ("knee", "ankle") for side in SIDES}
    found: dict[str, float] = {}
    for key in keys:
        joint, side = key.split("_")
        given = [e.subject[f"{joint}_width_m_{side}"] for e in entries if f"{joint}_width_m_{side}" in e.subject]
        recipe = finder.recipe(joint, keys[key])
        if given and recipe is not None and recipe.offset is not None and recipe.offset.width == joint:
            found[key] = given[0]
    if not found:
        return {}, []
    words = ", ".join(f"{keys[key]} {key.split('_')[0]} {1000.0 * width:.0f} mm" for key, width in found.items())
    return found, [note("calibration", f"Joint widths: the recording's own ({words}).")]
