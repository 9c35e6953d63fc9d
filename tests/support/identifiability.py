"""A simulated squat with what it tells of each parameter, and models changed in their file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynakin import Estimate, Estimator, Subject, load_model
from dynakin.identification.observability.trial import Identifiability
from dynakin.model.definition import _FOLDER
from dynakin.simulation.bodies.registry import choose_body
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.jets import sinusoids, step
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.squat import squat_movement
from dynakin.simulation.streams import Streams
from dynakin.simulation.trial import simulate

SEED, DURATION_S, MASS_KG, HEIGHT_M = 3, 12.0, 70.0, 1.75


@dataclass(frozen=True)
class Told:
    estimator: Estimator
    estimate: Estimate
    found: Identifiability


def estimated_squat(coordinate: str = "", size_deg: float = 0.0) -> tuple[Estimator, Estimate]:
    """A squat of `squat7` with the simulator's default errors, one coordinate swinging once a second on top."""

    def at(time: np.ndarray) -> Motion:
        streams = Streams(SEED)
        body = choose_body("squat7", streams, MASS_KG, HEIGHT_M, "male", Spread())
        motion = squat_movement(streams["motion"], body, DURATION_S).at(time)
        if not coordinate:
            return motion
        k = motion.names.index(coordinate)
        size, frequency = np.radians([size_deg]), np.ones(1)
        added = step(time, 0.0, 1.0) * sinusoids(time, size, frequency, np.zeros(1))
        arrays = [motion.q.copy(), motion.qd.copy(), motion.qdd.copy()]
        for values, more in zip(arrays, (added.value, added.rate, added.second), strict=True):
            values[:, k] += more
        return Motion(motion.names, *arrays)

    trial = simulate("squat7", at, SEED, DURATION_S, mass_kg=MASS_KG, height_m=HEIGHT_M)
    estimator = Estimator(load_model("squat7", Subject(mass_kg=MASS_KG, height_m=HEIGHT_M, sex="male")))
    return estimator, estimator.run(trial.recording)


def changed_model(folder: Path, *changes: tuple[str, str]) -> Path:
    """`sagittal7` with texts of its file replaced."""
    text = Path(str(_FOLDER / "sagittal7.toml")).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "changed.toml"
    path.write_text(text)
    return path
