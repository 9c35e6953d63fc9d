"""A simulated squat without any noise, once as the model measures it and once with the truth's own geometry."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import dynakin
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.definition import ModelDefinition
from dynakin.model.plan import Geometry, ModelPlan
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import SimulatedTrial, simulate_squat
from dynakin.validation.reference.chain import Kinematics, PlanarChain

MASS_KG = 70.0


@dataclass(frozen=True)
class Perfect:
    """A trial, the model measured on it, and a chain, plan and landmarks that are the truth's."""

    trial: SimulatedTrial
    definition: ModelDefinition
    initial: CalibratedModel
    chain: PlanarChain
    plan: ModelPlan
    landmarks: dict[str, np.ndarray]

    @property
    def truth(self) -> Kinematics:
        """The true coordinates and their exact derivatives."""
        data = self.trial.truth.data
        return Kinematics(data["coordinates"].values, data["speeds"].values, data["accelerations"].values)

    def wrench(self) -> np.ndarray:
        """The true wrench (T, 6), NaN out of the plane."""
        return in_plane(self.trial.truth.data["wrench"].values)

    def parameters(self, names: tuple[str, ...]) -> np.ndarray:
        """The true inertial parameters."""
        return np.array([self.trial.truth.parameters[name] for name in names])


def in_plane(wrench: np.ndarray) -> np.ndarray:
    """The same wrench with NaN for what a planar model does not explain."""
    found = np.full(wrench.shape, np.nan)
    found[:, [0, 1, 5]] = wrench[:, [0, 1, 5]]
    return found


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


def true_landmarks(trial: SimulatedTrial) -> dict[str, np.ndarray]:
    """Joint centres and the middles of ASIS and PSIS (T, 3) m where they truly are, on the midline."""
    data = trial.truth.data
    found = {str(name): data["joint_centres"].sel(joint=name).values for name in data["joint"].values}
    for spine in ("ASIS", "PSIS"):
        names = [str(name) for name in data["marker"].values if spine in str(name)]
        found[f"mid_{spine.lower()}"] = data["markers"].sel(marker=names).values.mean(axis=1)
    return {name: path * [1.0, 1.0, 0.0] for name, path in found.items()}
