"""A simulated squat: a subject, its motion, its sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynakin.errors import ConfigError
from dynakin.recordings import Plate, Recording
from dynakin.simulation.markers import draw_sites, hip_centres, marker_positions
from dynakin.simulation.mechanics import Segment, dynamics, kinematics
from dynakin.simulation.plates import measure, split_wrench
from dynakin.simulation.sagittal import build_tree
from dynakin.simulation.sensors import SensorNoise
from dynakin.simulation.soft_tissue import draw_displacement
from dynakin.simulation.squat import FULL, balanced_hip, draw_repetitions, squat_motion
from dynakin.simulation.subject import Spread, draw_subject
from dynakin.simulation.truth import Truth, label_truth

Array = NDArray[np.float64]

TOE_HEIGHT = 0.025  # of the toe landmark over the floor, of body height
FOOT_LATERAL = 0.115  # of each foot's middle beside the midline, of body height
TOE_IN_LABORATORY = (-0.12, -0.60)  # x and z (m) of the toe landmark; the floor is y = 0


@dataclass(frozen=True)
class SimulatedTrial:
    """The recording, as a reader would return it, and the truth behind it."""

    recording: Recording
    truth: Truth


def simulate_squat(
    seed: int = 1,
    duration_s: float = 20.0,
    rate_hz: float = 100.0,
    mass_kg: float = 70.0,
    height_m: float = 1.75,
    sex: str | None = "male",
    *,
    noise: SensorNoise | None = None,
    spread: Spread | None = None,
) -> SimulatedTrial:
    """A squat of a subject who does not exist, so that all that is to be estimated is known.

    Same arguments, same arrays. Subject, motion, markers' places and each sensor draw from streams of their
    own: to switch one sensor's noise off leaves the rest of the trial as it is.

    Args:
        seed: of everything that is drawn.
        duration_s, rate_hz: length and frame rate; the first frame is at 0 s.
        mass_kg, height_m, sex: "male", "female" or None (mean of both), as for `dynakin.Subject`.
        noise: of the sensors; None: `SensorNoise()`, ``SensorNoise.none()`` for perfect ones.
        spread: of the subject around the anthropometric table; None: `Spread()`.

    Raises:
        ConfigError: a value that makes no trial; the message names the argument.
    """
    if not 0.0 < rate_hz < np.inf:
        raise ConfigError(f"simulated squat: rate_hz is {rate_hz:g}, expected a positive number")
    noise = noise or SensorNoise()
    rng = [np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(6)]
    subject = draw_subject(rng[0], mass_kg, height_m, sex, spread)
    tree = build_tree(subject)
    repetitions = draw_repetitions(rng[1], duration_s)
    time = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    motion = squat_motion(rng[1], tree, time, repetitions)
    moving = kinematics(tree, motion)
    forces = dynamics(tree, motion, moving)
    sites = draw_sites(rng[2], subject)
    skin = noise.soft_tissue * draw_displacement(
        rng[3], time, motion, sites, full_squat_change(tree), noise.soft_tissue_random
    )
    seen = marker_positions(sites, moving, skin)
    seen = seen + noise.marker_sd_m * rng[4].standard_normal(seen.shape)
    virtual = hip_centres(subject, sites, seen)
    origin_L = np.array([TOE_IN_LABORATORY[0], TOE_HEIGHT * height_m, TOE_IN_LABORATORY[1]])
    recording = Recording(
        name=f"simulated_squat_{seed}",
        path=None,
        time=time,
        marker_names=(*(site.name for site in sites), *virtual),
        markers=origin_L + np.concatenate([seen, np.stack(list(virtual.values()), axis=1)], axis=1),
        plates=_plates(rng[5], forces.wrench, height_m, origin_L, noise),
        length_unit="m",
        notes=(f"Simulated squat, seed {seed}, {len(repetitions)} repetitions.",),
        subject={"mass_kg": mass_kg, "height_m": height_m},
    )
    truth = label_truth(subject, tree, time, motion, moving, forces, sites, skin, origin_L)
    return SimulatedTrial(recording, truth)


def full_squat_change(tree: Sequence[Segment]) -> dict[str, float]:
    """How far each coordinate goes (rad) from standing to a full squat."""
    change = {name: float(np.deg2rad(value)) for name, value in FULL.items()}
    change["hip"] = float(np.sum(balanced_hip(tree)[1:]))
    return change


def _plates(
    rng: np.random.Generator, wrench: Array, height_m: float, toe: Array, noise: SensorNoise
) -> tuple[Plate, ...]:
    """A plate under each foot: "plate 1" the right, "plate 2" the left one."""
    lateral = FOOT_LATERAL * height_m
    plates = []
    for name, side, foot in zip(("plate 1", "plate 2"), (1.0, -1.0), split_wrench(wrench, lateral), strict=True):
        centre = np.array([toe[0] - 0.10, 0.0, toe[2] + side * lateral])
        plates.append(measure(rng, foot, name, centre, toe, noise.plate_force_sd_n, noise.plate_moment_sd_nm))
    return tuple(plates)
