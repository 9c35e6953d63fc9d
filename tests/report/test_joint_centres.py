"""The joint centres of a real run: where the model has its joints, as far apart as its lengths say."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from dynakin import Estimator, Subject, load_model, read
from dynakin.report.playback import playback
from dynakin.results.estimate import Estimate


@pytest.fixture(scope="module")
def run(data_dir: Path) -> Estimate:
    folder = data_dir / "opencap_subject4"
    recording = read(folder / "squats1.trc", folder / "squats1_grf.mot").window(0.0, 3.0)
    return Estimator(load_model("sagittal7", Subject(mass_kg=60.05), markers="opencap")).run(recording)


def test_joints_are_as_far_apart_as_the_lengths(run: Estimate) -> None:
    data = run.data
    assert list(data["joint"].values) == ["toe", "ankle", "knee", "hip", "lumbar", "shoulder", "elbow"]
    assert list(data["joint_parent"].values) == [-1, 0, 1, 2, 3, 4, 5]
    centres = data["joint_centres"].transpose("joint", "time", "axis").values
    assert np.abs(centres[0]).max() < 1e-12  # the toe is the ground's origin
    for k, segment in enumerate(data["joint_segment"].values[:-1]):
        length = data["state"].sel(element=f"length/{segment}").values
        np.testing.assert_allclose(np.linalg.norm(centres[k + 1] - centres[k], axis=1), length, atol=1e-9)


def test_player_shows_all_segments_and_both_arrows(run: Estimate) -> None:
    found = playback(run)
    bones, arrows = (json.loads(str(found.data))[name] for name in ("bones", "arrows"))
    assert bones[-1][2] == found.colours["forearm"] and len(bones) == 7 and len(arrows) == 2
    assert found.has_reaction and len(set(found.colours.values())) == 7
