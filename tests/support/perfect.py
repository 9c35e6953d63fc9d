"""A simulated squat without any noise, with the truth's own geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.model.calibration.initial import InitialModel
from dynakin.model.definition import ModelDefinition
from dynakin.model.plan import ModelPlan
from dynakin.simulation.output import SimulatedTrial
from dynakin.validation.reference.chain import Kinematics, PlanarChain

MASS_KG = 70.0


@dataclass(frozen=True)
class Perfect:
    """A trial, the model measured on it, and a chain, plan and landmarks that are the truth's."""

    trial: SimulatedTrial
    definition: ModelDefinition
    initial: InitialModel
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


def true_landmarks(trial: SimulatedTrial) -> dict[str, np.ndarray]:
    """Joint centres and the middles of ASIS and PSIS (T, 3) m where they truly are, on the midline."""
    data = trial.truth.data
    found = {str(name): data["joint_centres"].sel(joint=name).values for name in data["joint"].values}
    for spine in ("ASIS", "PSIS"):
        names = [str(name) for name in data["marker"].values if spine in str(name)]
        found[f"mid_{spine.lower()}"] = data["markers"].sel(marker=names).values.mean(axis=1)
    return {name: path * [1.0, 1.0, 0.0] for name, path in found.items()}


PLANE = [0, 1, 5]


def lively(chain_size: int, frames: int = 400, seed: int = 1) -> Kinematics:
    """Every coordinate moves, each at its own pace; exact derivatives."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames) / 100.0
    a, w, p = rng.uniform(0.3, 0.9, (3, chain_size))
    w = 2.0 * np.pi * w
    angle = np.outer(time, w) + 6.0 * p
    return Kinematics(a * np.sin(angle), a * w * np.cos(angle), -a * w**2 * np.sin(angle))
