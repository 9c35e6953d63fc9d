"""Recordings with known truth: a subject, its motion and its sensors, built without any code of the
filter."""

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
