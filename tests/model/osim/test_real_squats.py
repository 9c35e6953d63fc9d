"""The study's own OpenSim model on its own squats: fit beside OpenSim's least squares, and no residual."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.model.opensim.definition import load_opensim
from dynakin.settings.model import Quantity
from dynakin.settings.subject import Subject

OPENSIM_MM = 10.48
"""OpenSim's inverse kinematics with equal weights: RMS of 3-D distances, missing markers left out (`make peers`)."""
MASS_KG = 60.05


def estimator_of(folder: Path, estimate: tuple[Quantity, ...], noise: dynakin.Noise) -> dynakin.Estimator:
    definition = load_opensim(folder / "optimized_scale_and_markers.osim", Subject(mass_kg=MASS_KG))
    return dynakin.Estimator(definition, noise, estimate=estimate)


def marker_rms_mm(folder: Path, estimate: tuple[Quantity, ...]) -> float:
    """From markers alone."""
    noise = dynakin.presets.default().changed(plate_force_sd_n=0.0, plate_moment_sd_nm=0.0, plate_delay_sd_s=0.0)
    recording = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    estimator = estimator_of(folder, estimate, noise)
    tracker = estimator.start(recording)
    markers = marker_paths(recording, tracker.calibrated, gaps=True)
    wrench = total_wrench(recording, tracker.calibrated, gaps=True)
    assert markers.shape[1] == 45
    found = tracker.run_arrays(Measurements(recording.time, markers, np.full_like(wrench, np.nan)))["markers_estimated"]
    return 1000.0 * float(np.sqrt(np.nanmean(((found - markers) ** 2).sum(axis=2))))


def test_held_as_the_file_has_it_the_fit_is_that_of_least_squares(data_dir: Path) -> None:
    assert marker_rms_mm(data_dir / "opencap_subject4", ()) == pytest.approx(OPENSIM_MM, rel=0.05)


@pytest.mark.nightly
def test_calibrated_on_the_trial_it_is_closer(data_dir: Path) -> None:
    assert marker_rms_mm(data_dir / "opencap_subject4", ("lengths", "markers")) < 0.7 * OPENSIM_MM


@pytest.mark.nightly
def test_what_is_left_at_the_pelvis_is_the_declared_residual(data_dir: Path) -> None:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    everything: tuple[Quantity, ...] = ("lengths", "markers", "soft_tissue", "inertia")
    data = estimator_of(folder, everything, dynakin.presets.default()).run(recording).data
    rest = data["wrench_remainder"].values
    assert np.isfinite(rest).all()  # both feet on plates in every frame
    assert np.sqrt(np.mean(rest**2)) < 7.0 and np.abs(rest).max() < 30.0  # N, N m: the declared residual, 12 and 4
    names = [str(name) for name in data["coordinate"].values]
    pelvis = [names.index(f"pelvis_{way}") for way in ("tx", "ty", "tz", "tilt", "list", "rotation")]
    assert np.abs(data["moments"].values[:, pelvis]).max() < 1e-9
    assert 0.0 < np.abs(data["foot_adjustment"].values).max() < 30.0  # N, N m: the price, and it is shown
