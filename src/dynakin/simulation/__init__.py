"""Recordings with known truth: a subject, its motion and its sensors, built without any code of the
filter."""

from dynakin.simulation.bodies import BODIES
from dynakin.simulation.body import Contact, SimulatedBody
from dynakin.simulation.faults import Fault
from dynakin.simulation.markers import Site
from dynakin.simulation.mechanics import Axis, Motion, Segment
from dynakin.simulation.motions import MOTIONS, MOTIONS_IN_SPACE
from dynakin.simulation.movement import Movement, Repetition
from dynakin.simulation.output import TRIAL_FILES, check_trial_folder, save_trial
from dynakin.simulation.sensors import SensorNoise, load_sensors
from dynakin.simulation.subject import SimulatedSubject, Spread, draw_subject
from dynakin.simulation.trial import SimulatedTrial, simulate, simulate_squat
from dynakin.simulation.truth import Truth

__all__ = [
    "BODIES",
    "MOTIONS",
    "MOTIONS_IN_SPACE",
    "TRIAL_FILES",
    "Axis",
    "Contact",
    "Fault",
    "Motion",
    "Movement",
    "Repetition",
    "Segment",
    "SensorNoise",
    "SimulatedBody",
    "SimulatedSubject",
    "SimulatedTrial",
    "Site",
    "Spread",
    "Truth",
    "check_trial_folder",
    "draw_subject",
    "load_sensors",
    "save_trial",
    "simulate",
    "simulate_squat",
]
