"""OpenSim poses a model with ``coordinates.mot``: its markers lie where ``markers.trc`` has them, in one frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from dynakin import read
from dynakin.filter.estimator import Estimator
from dynakin.filter.tracker import Tracker
from dynakin.model.definition import Definition, load_model
from dynakin.model.identified import read_constants
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.model.opensim.export import of_definition, of_initial
from dynakin.model.opensim.write import write_osim
from dynakin.pipeline.result import Result
from dynakin.results.estimate import Estimate
from dynakin.settings import presets
from dynakin.settings.subject import Subject

opensim: Any = pytest.importorskip("opensim", reason="OpenSim is not installed (pip install opensim)")
pytestmark = pytest.mark.peers
Array = npt.NDArray[np.float64]

SCALED = "opencap_subject4/optimized_scale_and_markers.osim"
TRIALS = [
    ("opencap_subject4/squats1", SCALED, 60.05),
    ("opencap_subject4/walking1", SCALED, 63.0),
    ("opencap_subject4/walking1", "fullbody", 63.0),
    ("plugin_gait/S1_FlywheelSquat", "fullbody", 78.6),  # Z up, looks along -x, y
]


def estimated(folder: Path, name: str, model: str, mass: float, out: Path) -> tuple[Definition, Estimate, Tracker]:
    """Half a second, saved into ``out``; lengths as they end, for all frames, and no skin on top of them."""
    trial = folder / f"{name}.trc"
    recording = read(trial, folder / f"{name}_grf.mot") if trial.exists() else read(folder / f"{name}.c3d")
    recording = recording.window(recording.time[0], recording.time[0] + 0.5)
    definition = load_model(folder / model if model.endswith(".osim") else model, Subject(mass_kg=mass, height_m=1.74))
    noise = presets.default().changed(length_drift_density_m2_s=0.0)
    estimator = Estimator(definition, noise, estimate=("lengths", "markers", "inertia"))
    estimate, tracker = estimator.track(recording, lag_s=np.inf)
    Result(estimate).save(out)
    return definition, estimate, tracker


def exported(definition: Definition, estimate: Estimate, tracker: Tracker, path: Path) -> Any:
    """The model that the run ended with, as OpenSim loads it."""
    found = read_constants(path.with_name("out") / "parameters.json")
    if isinstance(definition, OpenSimDefinition):
        write_osim(of_definition(definition, found, estimate.mass_kg), path)
    else:
        write_osim(of_initial(tracker.calibrated, found), path)
    return opensim.Model(str(path))


def posed(model: Any, motion: Path, names: list[str]) -> Array:
    """Places (T, M, 3) m of markers, ground frame, at each row of a file of coordinates."""
    state = model.initSystem()
    table = opensim.TimeSeriesTable(str(motion))
    values, columns = table.getMatrix().to_numpy(), list(table.getColumnLabels())
    found = np.empty((len(values), len(names), 3))
    for t, row in enumerate(values):
        for name, value in zip(columns, row, strict=True):
            coordinate = model.getCoordinateSet().get(name)
            turns = coordinate.getMotionType() != opensim.Coordinate.Translational
            if not coordinate.getLocked(state):
                coordinate.setValue(state, float(np.radians(value) if turns else value), False)
        model.realizePosition(state)
        for k, name in enumerate(names):
            found[t, k] = model.getMarkerSet().get(name).getLocationInGround(state).to_numpy()
    return found


@pytest.mark.parametrize(("name", "model", "mass"), TRIALS)
def test_markers_of_the_posed_model_are_those_of_the_file(
    name: str, model: str, mass: float, data_dir: Path, tmp_path: Path
) -> None:
    definition, estimate, tracker = estimated(data_dir, name, model, mass, tmp_path / "out")
    own = [marker.name for marker in tracker.calibrated.spec.markers]
    places = posed(
        exported(definition, estimate, tracker, tmp_path / "m.osim"), tmp_path / "out" / "coordinates.mot", own
    )
    table = opensim.TimeSeriesTableVec3(str(tmp_path / "out" / "markers.trc"))
    flat = table.flatten()  # kept: what it gives out is a view of it
    written = flat.getMatrix().to_numpy().reshape(places.shape)
    written = written / (1000.0 if estimate.recording.length_unit == "mm" else 1.0)
    away = np.linalg.norm(places - written, axis=2)
    assert np.nanmax(away) < 1e-6  # 0.1: 9, 29, 29 and, where z is up, 2982 mm


def test_a_laboratory_with_y_up_is_the_frame_of_all_files(data_dir: Path, tmp_path: Path) -> None:
    _, estimate, _ = estimated(data_dir, "opencap_subject4/walking1", SCALED, 63.0, tmp_path / "out")
    recording = estimate.recording
    measured = np.stack([recording.marker(name) for name in estimate.marker_names], axis=1)
    written = estimate.data["markers_estimated"].values
    assert np.nanmedian(np.linalg.norm(measured - written, axis=2)) < 0.015
    total = recording.total_wrench()
    known = np.isfinite(estimate.data["wrench_measured"].values).all(axis=1)
    assert known.any()
    np.testing.assert_allclose(estimate.data["wrench_measured"].values[known], total[known], atol=1e-9)
    for file in ("coordinates.mot", "wrench.sto", "centre_of_mass.sto", "feet.sto", "joint_reactions.sto"):
        assert "laboratory frame." in (tmp_path / "out" / file).read_text(encoding="utf-8")[:2000], file
