"""Which motions there are by name; otherwise a coordinates file or a function of time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.files import is_file
from dynakin.settings.strict import nearest
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.drop_jump import drop_jump
from dynakin.simulation.motions.gait import belt_movement, gait_movement
from dynakin.simulation.motions.motion_file import file_movement
from dynakin.simulation.motions.movement import Movement
from dynakin.simulation.motions.sit_in_space import sit_in_space
from dynakin.simulation.motions.sit_to_stand import sit_to_stand_movement
from dynakin.simulation.motions.squat import squat_movement, sway_movement
from dynakin.simulation.motions.squat_in_space import squat_in_space
from dynakin.simulation.motions.steps import steps_down, steps_up

MOTIONS: dict[str, Callable[[np.random.Generator, SimulatedBody, float], Movement]] = {
    "squat": squat_movement,
    "sit-to-stand": sit_to_stand_movement,
    "sway": sway_movement,
}
"""Motions of the planar chains by name: drawn for a body and a duration (s)."""
MOTIONS_IN_SPACE: dict[str, Callable[[np.random.Generator, SimulatedBody, float], Movement]] = {
    "squat": squat_in_space,
    "gait": gait_movement,
    "belt": belt_movement,
    "sit": sit_in_space,
    "steps": steps_up,
    "steps-down": steps_down,
    "drop-jump": drop_jump,
}
"""Those of the whole body in space."""


def choose_movement(
    motion: str | Path | Movement | Callable[[Array], Motion],
    body: SimulatedBody,
    rng: np.random.Generator,
    duration_s: float,
    cutoff_hz: float,
) -> Movement:
    """The motion of that name, of that file, or as given; checked to have the body's coordinates.

    Raises:
        ConfigError: no such motion or file, or the body does not know the motion; the message names it.
    """
    if isinstance(motion, Movement):
        return _checked(motion, body)
    if callable(motion):
        return _checked(Movement("motion", motion, "a motion given as a function of time"), body)
    if str(motion) in {**MOTIONS, **MOTIONS_IN_SPACE}:
        if str(motion) not in (MOTIONS_IN_SPACE if body.in_space else body.paths):
            known = ", ".join(MOTIONS_IN_SPACE if body.in_space else body.paths) or "none of them"
            raise ConfigError(
                f"simulation: motion is {str(motion)!r}, but {body.name} knows {known}; expected one of them, a file "
                "or a function of time"
            )
        return (MOTIONS_IN_SPACE if body.in_space else MOTIONS)[str(motion)](rng, body, duration_s)
    path = Path(motion)
    if path.suffix.casefold() in (".mot", ".sto") and is_file(path):
        return file_movement(path, body, cutoff_hz)
    every = tuple(MOTIONS_IN_SPACE if body.in_space else MOTIONS)
    raise ConfigError(
        f"simulation: motion is {str(motion)!r}{nearest(str(motion), every)}, expected {', '.join(every)} or a .mot or "
        ".sto file that exists"
    )


def _checked(movement: Movement, body: SimulatedBody) -> Movement:
    """The movement, if it has the body's coordinates, all and no others."""
    first = movement.at(np.zeros(1))
    where = f"simulation: motion {movement.name!r}"
    if not isinstance(first, Motion):
        raise ConfigError(f"{where} gives {type(first).__name__}, expected a function of times that gives a Motion")
    if set(first.names) != set(body.coordinates):
        odd = sorted(set(first.names) ^ set(body.coordinates))[0]
        word = "no coordinate" if odd in body.coordinates else "a coordinate of no axis,"
        raise ConfigError(f"{where} has {word} {odd!r}, expected {', '.join(body.coordinates)}")
    return movement
