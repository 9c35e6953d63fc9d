"""A simulated trial: a subject, its motion, its sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.messages import note
from dynakin.recordings.recording import Recording
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.registry import choose_body
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.contacts import mechanical_state
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.movement import Movement
from dynakin.simulation.motions.rail import hold_rail
from dynakin.simulation.motions.registry import choose_movement
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.plates import sense_plates
from dynakin.simulation.sensors.sensed_markers import sense_markers
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.streams import Streams
from dynakin.simulation.support import PLATES, one_plate, plates_that_measure
from dynakin.simulation.truth import Truth, all_parameters, label_arrays

GROUND_IN_LABORATORY = (-0.12, -0.60)  # x and z (m) of the ground origin; the floor is y = 0
SYNTHETIC_S = 20.0  # duration of a motion that has no end of its own
# Of walking across a laboratory, on a belt, over steps, of one jump.
USUAL_S = {"gait": 4.0, "belt": 10.0, "steps": 5.0, "steps-down": 5.0, "drop-jump": 5.0}
LONGEST_FRAMES = 2_000_000


def simulate(
    model: str | SimulatedBody = "sagittal7",
    motion: str | Path | Movement | Callable[[Array], Motion] = "squat",
    seed: int = 1,
    duration_s: float | None = None,
    rate_hz: float = 100.0,
    mass_kg: float = 70.0,
    height_m: float = 1.75,
    sex: str | None = "male",
    *,
    noise: SensorNoise | None = None,
    spread: Spread | None = None,
    motion_cutoff_hz: float = CUTOFF_HZ,
    markers: str | None = None,
    plates: str = "feet",
    rail: float = 0.0,
) -> SimulatedTrial:
    """A trial of a subject who does not exist, so that all that is to be estimated is known.

    Same arguments, same arrays. Subject, motion, markers' places and each sensor draw from streams of their
    own: to switch one sensor's noise off leaves the rest of the trial as it is.

    Args:
        model: "sagittal7", "squat7" or "fullbody", drawn around the table; or a body of your own, planar or spatial,
            whose subject then stands for mass, height, sex and spread.
        motion: "squat", "sit-to-stand" or "sway", of "fullbody" "squat", "gait", "belt", "steps", "sit" or
            "drop-jump"; a coordinates file (.mot, .sto) with the model's coordinate names; or a function of times
            (T,) s that gives a `Motion`.
        seed: of everything that is drawn.
        duration_s, rate_hz: length and frame rate; the first frame is at 0 s. None: 20 s, or all of a file, or as
            long as the motion takes.
        mass_kg, height_m, sex: "male", "female" or None (mean of both), as for `dynakin.Subject`.
        noise: of the sensors; None: `SensorNoise()`, ``SensorNoise.none()`` for perfect ones.
        spread: of the subject around the anthropometric table; None: `Spread()`.
        motion_cutoff_hz: of the low-pass on a coordinates file.
        markers: set that "fullbody" wears, "opencap" where None, any built-in one or a .toml file; the others have one
            each.
        plates: of "fullbody", what has one: "feet" (each its own), "all" (the seat too), "shared" (one below both
            feet), "right" or "left" (one foot only) or "none". Belts of "belt" are plates: one a foot, or "shared".
        rail: of "fullbody", how hard hands push on a rail that no plate measures, over body weight, 0 to 0.3.

    Raises:
        ConfigError: a value that makes no trial; the message names the argument.
    """
    asked_s = USUAL_S.get(str(motion), SYNTHETIC_S) if duration_s is None else duration_s
    for key, value in (("rate_hz", rate_hz), ("duration_s", asked_s)):
        if not 0.0 < value < np.inf:
            raise ConfigError(f"simulation: {key} is {value:g}, expected a positive number")
    _frames(asked_s, rate_hz)  # refuses too many before a motion of that length is drawn
    noise, spread = noise or SensorNoise(), spread or Spread()
    streams = Streams(seed)
    body = choose_body(model, streams, mass_kg, height_m, sex, spread, markers)
    movement = choose_movement(motion, body, streams["motion"], asked_s, motion_cutoff_hz)
    movement = _on_plates(movement, plates)
    if rail != 0.0:
        movement = hold_rail(movement, body, streams["rail"], rail, asked_s)
    time = _frames(_length(duration_s, movement, asked_s), rate_hz)
    state = mechanical_state(body, movement, time)
    seen = sense_markers(streams, body, time, state.motion, state.moving, noise)
    x, z = (0.0, 0.0) if body.in_space else GROUND_IN_LABORATORY
    origin_L = np.array([x, -body.floor_m, z])
    late = state if noise.plate_lag_s == 0.0 else mechanical_state(body, movement, time - noise.plate_lag_s)
    sensed, errors = sense_plates(streams, late.plates, time, origin_L, noise)
    if movement.support is not None:
        measure = plates_that_measure(movement.footings, plates)  # after drawing: what is left keeps its noise
        sensed = tuple(plate for plate in sensed if plate.name in measure)
        errors = {name: error for name, error in errors.items() if name in measure}
    recording = Recording(
        name=f"simulated_{movement.name.replace('-', '_')}_{seed}",
        path=None,
        time=time,
        marker_names=seen.names,
        markers=origin_L + seen.markers,
        plates=sensed,
        length_unit="m",
        notes=(note("recording", f"Simulated {body.name}, seed {seed}: {movement.description or movement.name}."),),
        subject={"mass_kg": body.subject.mass_kg, "height_m": body.subject.height_m},
    )
    truth = Truth(
        data=label_arrays(body, time, state, seen.sites, seen.skin),
        parameters=all_parameters(body, seen.sites),
        origin_L=origin_L,
        subject=body.subject,
        tree=body.tree,
        sites=seen.sites,
        faults=seen.faults,
        plate_errors=errors,
        repetitions=movement.repetitions,
        contacts=state.segments,
    )
    settings: dict[str, Any] = {
        "model": body.name,
        "motion": movement.name,
        "seed": int(seed),
        "duration_s": float(time[-1]),
        "rate_hz": float(rate_hz),
        "mass_kg": float(body.subject.mass_kg),
        "height_m": float(body.subject.height_m),
        "sex": body.subject.sex,
        "spread": None if isinstance(model, SimulatedBody) else dict(vars(spread)),
        "sensors": noise.as_dict(),
    }
    if body.in_space:
        settings |= {"plates": plates, "rail": float(rail), "belt_m_s": float(movement.belt_m_s)}
    return SimulatedTrial(recording, truth, settings)


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
    """Squats of ``sagittal7``: `simulate` with its first two arguments settled."""
    return simulate("sagittal7", "squat", seed, duration_s, rate_hz, mass_kg, height_m, sex, noise=noise, spread=spread)


def _on_plates(movement: Movement, plates: str) -> Movement:
    if plates not in PLATES:
        raise ConfigError(f"simulation: plates is {plates!r}, expected one of {', '.join(PLATES)}")
    if movement.support is None:
        if plates != "feet":
            raise ConfigError(f"simulation: plates is {plates!r}, expected 'feet' but for the motions of fullbody")
        return movement
    return replace(movement, footings=one_plate(movement.footings)) if plates == "shared" else movement


def _length(duration_s: float | None, movement: Movement, otherwise_s: float) -> float:
    if duration_s is None:
        return otherwise_s if movement.end_s is None else movement.end_s
    if movement.end_s is not None and duration_s > movement.end_s + 1e-9:
        raise ConfigError(
            f"simulation: duration_s is {duration_s:g}, expected at most the {movement.end_s:g} s of {movement.name!r}"
        )
    return duration_s


def _frames(duration_s: float, rate_hz: float) -> Array:
    """Times (T,) from 0, the last one not after the end."""
    count = int(np.floor(duration_s * rate_hz + 1e-6)) + 1
    if not 2 <= count <= LONGEST_FRAMES:
        raise ConfigError(
            f"simulation: duration_s {duration_s:g} at rate_hz {rate_hz:g} makes {count} frames, expected 2 to "
            f"{LONGEST_FRAMES}"
        )
    return np.arange(count) / rate_hz
