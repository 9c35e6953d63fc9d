"""Bodies of an OpenSim model from real trials: the file's own segments, some of which stay as they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.identification.subject import identify_subject
from dynakin.model.inertia import RigidBody
from dynakin.model.opensim.definition import load_opensim
from dynakin.settings.subject import Subject


@pytest.mark.nightly
def test_squats_and_standing(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    squats, standing = (dynakin.read(folder / f"{n}.trc", folder / f"{n}_grf.mot") for n in ("squats1", "static1"))
    definition = load_opensim(folder / "optimized_scale_and_markers.osim", Subject(mass_kg=60.05))
    trials = [squats.window(0.0, 5.0), standing]
    found = identify_subject(dynakin.Estimator(definition), trials, static=standing)
    batch = found.subject.batch
    bodies = [RigidBody.from_vector(vector) for vector in np.array(batch.values).reshape(-1, 10)]
    table = found.posterior.unknowns.inertial
    assert all(body.possible() for body in bodies)
    assert sum(body.mass for body in bodies) == pytest.approx(table.total, rel=1e-9)
    held = 60.05 - table.total  # hands, toes and what else the file has of its own
    assert 0.0 < held < 6.0
    assert found.decision.rms["bodies"].shape == (4, 6)
    # The filter takes them, as `run --parameters` does, whatever was decided.
    used = dynakin.Estimator(definition, parameters=found.subject.model_copy(update={"use": "bodies"}))
    initial = used.start(replace(squats, plates=()), static=standing).calibrated
    at = {name: k for k, name in enumerate(initial.names)}
    assert initial.x0[[at[name] for name in batch.names]] == pytest.approx(batch.values, rel=1e-9)
