"""A simulated squat without any noise, once as the model measures it and once with the truth's own geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynakin
from dynakin.model.plan import Geometry
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.reference.chain import PlanarChain
from support.perfect import MASS_KG, Perfect, true_landmarks


@pytest.fixture(scope="session")
def perfect() -> Perfect:
    trial = simulate_squat(seed=2, duration_s=10.0, mass_kg=MASS_KG, noise=SensorNoise.none())
    subject = dynakin.Subject(mass_kg=MASS_KG, height_m=1.75, sex="male")
    definition = dynakin.load_model("sagittal7", subject=subject, markers="opencap")
    initial = definition.calibrate(trial.recording)
    place = {segment.name: segment.placement for segment in trial.truth.tree}
    measured = {"shank": "foot", "trunk": "pelvis"}  # placements with a direction of their own, and their lengths
    directions = dict(initial.plan.geometry.directions)
    lengths = {name: trial.truth.parameters[f"length/{name}"] for name in initial.plan.geometry.lengths}
    for segment, length in measured.items():
        lengths[length] = float(np.linalg.norm(place[segment]))
        directions[segment] = [place[segment] / lengths[length]]
    plan = replace(initial.plan, geometry=Geometry(lengths, directions, {}))
    return Perfect(trial, definition, initial, PlanarChain.of(plan), plan, true_landmarks(trial))
