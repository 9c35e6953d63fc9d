"""Mass and height of the person where they are not told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from dynakin.errors import ModelError
from dynakin.model.frames import Trial
from dynakin.model.subject import Subject
from dynakin.recordings import GroundFrame, Recording, check_plates
from dynakin.recordings.foot_loads import foot_loads
from dynakin.units import GRAVITY_M_S2

_LEAST_FRAMES = 25


class OnPlates(Protocol):
    """A recording and its ground frame: a ``Trial``, say."""

    @property
    def recording(self) -> Recording: ...
    @property
    def ground(self) -> GroundFrame: ...


def find_mass(subject: Subject, trials: Sequence[OnPlates]) -> tuple[float, str]:
    """Mass (kg) and where it comes from: told, from the plates while standing still, from the file, or, with a
    warning, from the plates' mean over a movement.

    Raises:
        ModelError: none of these; the message says why the plates do not tell.
    """
    if subject.mass_kg is not None:
        return subject.mass_kg, f"Mass {subject.mass_kg:.2f} kg: given."
    reasons, means = [], []
    for trial in trials:
        recording = trial.recording
        if not recording.plates:
            reasons.append(f"{recording.name} has no force plates")
            continue
        check = check_plates(recording, trial.ground)
        if check.refusal is not None:
            reasons.append(f"{recording.name}: {check.refusal}")
        elif check.mass_kg_from_plates is None:
            reasons.append(f"nobody stands still on the plates of {recording.name}")
            if check.mean_mass_kg is not None:
                means.append((_of_whole_load(recording, trial.ground) or check.mean_mass_kg, recording.name))
        else:
            mass = float(check.mass_kg_from_plates)
            return mass, f"Mass {mass:.2f} kg: from the plates of {recording.name} while standing still."
    for trial in trials:
        told = trial.recording.subject.get("mass_kg")
        if told:
            return told, f"Mass {told:.2f} kg: from the file {trial.recording.name}."
    for mass, name in means:
        return mass, (
            f"Warning: mass {mass:.2f} kg from the mean vertical force of {name}, in which nobody stands still; wrong "
            "by several percent in a walk of few steps, and where anything but the plates bears the person. Give the "
            "mass if it is known."
        )
    raise ModelError(
        f"mass_kg is not given and cannot be found ({'; '.join(reasons)}); expected mass_kg of the subject"
    )


def _of_whole_load(recording: Recording, ground: GroundFrame) -> float | None:
    """Mean load (kg) of the frames in which every foot that stands is on a plate; None where these are few."""
    loads = foot_loads(recording, ground)
    push = loads.wrench[..., 1].sum(axis=1)[loads.total_known]
    push = push[np.isfinite(push)]
    return float(push.mean()) / GRAVITY_M_S2 if len(push) >= _LEAST_FRAMES else None


def find_height(subject: Subject, recordings: list[Recording], trial: Trial) -> tuple[float | None, str]:
    """Height (m) and where it comes from; None with the reason where nothing tells.

    Estimated from the marker set's ``height_marker`` (the acromion) where it is highest in the trial, over
    the lowest
    marker, divided by its fraction of the body height: a person who never stands upright comes out too
    small, and the lowest marker lies 1 to 3 cm over the floor, which makes it 1 to 2 % too small as well.
    """
    if subject.height_m is not None:
        return subject.height_m, f"Height {subject.height_m:.2f} m: given."
    for recording in recordings:
        told = recording.subject.get("height_m")
        if told:
            return told, f"Height {told:.2f} m: from the file {recording.name}."
    marker_set = trial.match.marker_set
    heights = {key: path[np.isfinite(path).all(axis=1), 1] for key, path in trial.paths.items()}
    tops = [np.percentile(y, 99.0) for key, y in heights.items() if key[0] == marker_set.height_marker and len(y)]
    if not tops or marker_set.height_fraction is None:
        return None, f"height_m is not given and {marker_set.height_marker or 'no marker'} does not tell it."
    floor = min(np.percentile(y, 1.0) for y in heights.values() if len(y))
    height = float(np.mean(tops) - floor) / marker_set.height_fraction
    return height, (
        f"Height {height:.2f} m: not given, estimated from {marker_set.height_marker} (where it is highest) "
        "over the "
        f"lowest marker, divided by {marker_set.height_fraction:g} ({marker_set.height_source})."
    )
