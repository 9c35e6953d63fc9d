"""The synthetic estimate of the results' tests, for the report."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynakin.messages import note
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.measures.repetitions import repetitions_of
from dynakin.validation.methods import ComparedTrial, Method
from support.estimates.synthetic import SEGMENTS

JOINTS = ("toe", "ankle", "knee", "hip", "lumbar", "shoulder", "elbow")


@pytest.fixture(scope="session")
def jointed(estimate: Estimate) -> Estimate:
    """The same with joint centres, one above the other, and the knee moving forward by 1 cm each second."""
    return with_joints(estimate)


def with_joints(estimate: Estimate) -> Estimate:
    centres = np.zeros((len(estimate.time), len(JOINTS), 3))
    centres[:, :, 1] = 0.2 * np.arange(len(JOINTS))
    centres[:, 2, 0] = 0.01 * estimate.time
    data = estimate.data.assign(joint_centres=(("time", "joint", "axis"), centres)).assign_coords(
        joint=list(JOINTS),
        joint_parent=("joint", np.arange(-1, len(JOINTS) - 1)),
        joint_segment=("joint", list(SEGMENTS)),
    )
    return replace(estimate, data=data)


@pytest.fixture(scope="session")
def comparison(jointed: Estimate) -> ComparedTrial:
    """The jointed estimate beside made references: five degrees, 10 N m of moment and 20 of each wrench component
    off."""
    return made_comparison(jointed)


def made_comparison(estimate: Estimate) -> ComparedTrial:
    data = estimate.data
    measured = data["markers_measured"].values
    arrays = (data["coordinates"].values, data["moments"].values, data["markers_estimated"].values)
    wrench = np.where(np.isfinite(data["wrench_estimated"].values), data["wrench_measured"].values + 20.0, np.nan)
    shifted = (arrays[0] + np.radians(5.0), arrays[1] + 10.0, measured + 0.01, wrench)
    return ComparedTrial(
        name=estimate.recording.name,
        time=estimate.time,
        window=evaluation_window(estimate.time),
        marker_names=tuple(estimate.marker_names),
        coordinate_names=tuple(estimate.coordinate_names),
        measured_markers=measured,
        measured_wrench=data["wrench_measured"].values,
        axes=estimate.modelled_axes(),
        rotation=estimate.is_rotation(),
        repetitions=repetitions_of(estimate),
        mass_kg=60.05,
        methods=(
            Method("EKF (paper)", "EKF", *arrays, data["wrench_estimated"].values, data),
            Method("AT (6 Hz)", "AT", *shifted, data),
            Method("classical (6 Hz)", "classical", *shifted, data),
        ),
        notes=(note("method", "AT: a sentence on AT."),),
        estimates={"paper": estimate},
    )
