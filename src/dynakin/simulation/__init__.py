"""Recordings with known truth: a subject, its motion and its sensors, built without any code of the
filter."""

from dynakin.simulation.sensors import SensorNoise
from dynakin.simulation.subject import SimulatedSubject, Spread, draw_subject
from dynakin.simulation.trial import SimulatedTrial, simulate_squat
from dynakin.simulation.truth import Truth

__all__ = [
    "SensorNoise",
    "SimulatedSubject",
    "SimulatedTrial",
    "Spread",
    "Truth",
    "draw_subject",
    "simulate_squat",
]
