"""The synthetic estimate of the results' tests, for the report."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "results"))

from synthetic_estimate import SEGMENTS, make_estimate

from dynakin.results import Estimate

JOINTS = ("toe", "ankle", "knee", "hip", "lumbar", "shoulder", "elbow")


@pytest.fixture(scope="session")
def estimate() -> Estimate:
    """Twelve seconds of a squat, with gaps, bounds reached and a locked translation."""
    return make_estimate()


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
