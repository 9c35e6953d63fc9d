"""Force plates that measure what the simulated person's motion takes, with the errors that plates have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.pushes import UNLOADED_N
from dynakin.recordings.recording import Plate
from dynakin.simulation.bodies.body import Contact
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.streams import Streams


@dataclass(frozen=True)
class PlateErrors:
    """What is wrong with a plate for the whole trial: factors (6,) on its channels [fx, fy, fz, and mx, my, mz about
    the plate's centre], and their drift (6,) in N/s and N m/s."""

    gain: Array
    drift: Array


def draw_plate_errors(gains: np.random.Generator, drifts: np.random.Generator, noise: SensorNoise) -> PlateErrors:
    """The errors of one plate; gains and drifts draw from streams of their own."""
    per_min = np.repeat([noise.plate_drift_n_per_min, noise.plate_drift_nm_per_min], 3)
    return PlateErrors(1.0 + noise.plate_gain_sd * gains.standard_normal(6), per_min / 60.0 * drifts.standard_normal(6))


def sense_plates(
    streams: Streams,
    loads: Sequence[tuple[Contact, Array]],
    time: Array,
    origin_L: Array,
    noise: SensorNoise,
) -> tuple[tuple[Plate, ...], dict[str, PlateErrors]]:
    """A plate below each contact, which presses with a wrench (T, 6); and what is wrong with it, by the plate's
    name."""
    plates, errors = [], {}
    for contact, wrench in loads:
        own = draw_plate_errors(streams["plate_gain"], streams["plate_drift"], noise)
        centre_L = contact.centre + origin_L
        plates.append(
            measure(
                streams["plate_noise"], time, wrench, contact.plate, centre_L, origin_L, own, noise, contact.half_m
            ),
        )
        errors[contact.plate] = own
    return tuple(plates), errors


def measure(
    rng: np.random.Generator,
    time: Array,
    wrench: Array,
    name: str,
    centre: Array,
    origin: Array,
    errors: PlateErrors,
    noise: SensorNoise,
    half_m: tuple[float, float],
) -> Plate:
    """The plate's signals in the laboratory frame: gain, drift, white noise and rounding on its six channels.

    wrench: (T, 6) true, about the ground origin; centre, origin: (3,) m, the middle of the plate's top and the
    ground origin, laboratory; half_m: half the plate's length and width.
    """
    about_centre = wrench[:, 3:] + cross(origin - centre, wrench[:, :3])
    channels = np.hstack([wrench[:, :3], about_centre]) * errors.gain + np.outer(time - time[0], errors.drift)
    force = channels[:, :3] + noise.plate_force_sd_n * rng.standard_normal((len(wrench), 3))
    about_centre = channels[:, 3:] + noise.plate_moment_sd_nm * rng.standard_normal((len(wrench), 3))
    force, about_centre = _rounded(force, noise.plate_step_n), _rounded(about_centre, noise.plate_step_nm)
    moment = about_centre + cross(centre, force)
    corners = centre + np.array([[x * half_m[0], 0.0, z * half_m[1]] for x, z in ((1, 1), (1, -1), (-1, -1), (-1, 1))])
    return plate_from_wrench(
        name,
        force,
        moment,
        Surface(centre, np.array([0.0, 1.0, 0.0])),
        corners=corners,
        threshold_n=UNLOADED_N,
        zero_unloaded=False,
    )


def _rounded(values: Array, step: float) -> Array:
    return values if step == 0.0 else np.round(values / step) * step
