"""Simulated functional trials: a person who stands, then swings the right leg (hip) or bends the right knee (knee)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dynakin.arrays import Array
from dynakin.recordings.recording import Recording
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.registry import choose_body
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.jets import Jet, constant, sinusoids, step
from dynakin.simulation.mechanics import Motion, kinematics
from dynakin.simulation.motions.movement import in_order
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.streams import Streams
from dynakin.simulation.trial import simulate

STANDING = np.arange(100)
"""Frames in which the person stands."""
_REST_S, _SECONDS = 1.5, 22.0


def functional_trial(
    seed: int, joint: str, noise: SensorNoise, size: float = 1.0, markers: str = "opencap", height_m: float = 1.75
) -> tuple[Recording, Array, Array]:
    """The recording; the right hip's centre (3,) m and the right knee's axis (3,) while standing, laboratory frame.

    Args:
        joint: "hip" or "knee". size: of the motion; 1 swings the thigh through 57 by 37 deg, bends the knee to 100 deg.
    """
    body = choose_body("fullbody", Streams(seed), 70.0, height_m, "male", Spread(), markers)
    if joint == "hip":  # the thigh's skin follows the knee elsewhere, which hardly moves here
        driven = {s.name: "hip_flexion" + s.segment[-2:] for s in body.sites if s.segment.startswith("thigh")}
        body = replace(body, sites=tuple(replace(s, driver=driven.get(s.name, s.driver)) for s in body.sites))
    motion = _motion(body, joint, size)
    made = simulate(body, motion, seed=seed, duration_s=_SECONDS, noise=noise)
    segments = kinematics(body.tree, motion(made.recording.time[STANDING])).segments
    bends_about = -np.array({segment.name: segment for segment in body.tree}["shank_r"].axes[0].direction)
    centre = segments["thigh_r"].origin.mean(axis=0) + made.truth.origin_L
    return made.recording, centre, segments["thigh_r"].rotation[0] @ bends_about


def _motion(body: SimulatedBody, joint: str, size: float) -> Callable[[Array], Motion]:
    def at(time: Array) -> Motion:
        begun = step(time, _REST_S, 1.0)

        def tone(size_deg: float, frequency_hz: float, phase: float = 0.0) -> Jet:
            return sinusoids(time, np.array([np.deg2rad(size_deg)]), np.array([frequency_hz]), np.array([phase]))

        jets = {name: constant(time, 0.0) for name in body.coordinates}
        jets["pelvis_ty"] = constant(time, 0.95)
        sways = (("pelvis_tilt", 2.0), ("pelvis_list", 2.0), ("pelvis_rotation", 3.0), ("lumbar_bending", 3.0))
        for k, (name, size_deg) in enumerate(sways):
            jets[name] = begun * tone(size_deg, 0.11 + 0.04 * k, float(k))
        swing = sinusoids(time, np.ones(1), np.array([0.35]), np.zeros(1))
        if joint == "hip":  # arcs through the middle, each in another direction
            jets["hip_flexion_r"] = begun * (swing * tone(35.0 * size, 0.05, 0.5 * np.pi) + np.deg2rad(12.0 * size))
            jets["hip_adduction_r"] = begun * (swing * tone(22.0 * size, 0.05) + np.deg2rad(-12.0 * size))
            jets["hip_rotation_r"] = begun * tone(4.0, 0.13)
            jets["knee_angle_r"] = np.deg2rad(8.0) * (begun * (swing + 1.0))
        else:
            jets["knee_angle_r"] = begun * (tone(50.0 * size, 0.3, -0.5 * np.pi) + np.deg2rad(50.0 * size))
            jets["hip_flexion_r"] = begun * (tone(15.0, 0.3, -0.5 * np.pi) + np.deg2rad(15.0))
            jets["hip_rotation_r"] = begun * tone(3.0, 0.13)
        return in_order(body.coordinates, jets)

    return at
