"""Recordings with known truth: a subject, its motion and its sensors, built without any code of the
filter."""

from typing import TYPE_CHECKING

from dynakin.lazy import loaded_when_asked

if TYPE_CHECKING:
    from dynakin.simulation.bodies.subject import SimulatedSubject, draw_subject
    from dynakin.simulation.motions.registry import MOTIONS
    from dynakin.simulation.output import SimulatedTrial, save_trial
    from dynakin.simulation.sensors.sizes import SensorNoise, load_sensors
    from dynakin.simulation.trial import simulate, simulate_squat
    from dynakin.simulation.truth import Truth

__all__ = [
    "MOTIONS",
    "SensorNoise",
    "SimulatedSubject",
    "SimulatedTrial",
    "Truth",
    "draw_subject",
    "load_sensors",
    "save_trial",
    "simulate",
    "simulate_squat",
]

__getattr__, __dir__ = loaded_when_asked(
    __name__,
    {
        "bodies.subject": ("SimulatedSubject", "draw_subject"),
        "motions.registry": ("MOTIONS",),
        "output": ("SimulatedTrial", "save_trial"),
        "sensors.sizes": ("SensorNoise", "load_sensors"),
        "trial": ("simulate", "simulate_squat"),
        "truth": ("Truth",),
    },
)
