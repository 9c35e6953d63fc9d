"""Every kind of joint, in both versions of the format, stands and moves as in OpenSim."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.bindings import _core
from dynakin.model.opensim.definition import scale_names
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.spec import to_spec
from support.osim.files import COUNTS, COUPLER, small_model
from support.osim.states import as_state, coupled, random_motion, summed

pytest.importorskip("opensim", reason="OpenSim is not installed (pip install opensim)")
from support.osim.peer import Peer

KINDS = [*COUNTS, "CustomJoint"]


@pytest.mark.parametrize("version", [3, 4])
@pytest.mark.parametrize("kind", KINDS)
def test_poses_markers_and_moments(kind: str, version: int, tmp_path: Path) -> None:
    path = small_model(tmp_path, kind, version)
    compare(path)


@pytest.mark.parametrize("version", [3, 4])
def test_a_coupled_coordinate_is_a_function_of_the_other(version: int, tmp_path: Path) -> None:
    path = small_model(tmp_path, "CustomJoint", version, COUPLER)
    assert "w" not in [c.name for c in to_spec(read_osim(path), {}).coordinates]
    compare(path)


@pytest.mark.parametrize("name", ["NaturalCubicSpline", "natCubicSpline"])
def test_splines_under_their_older_names(name: str, tmp_path: Path) -> None:
    path = small_model(tmp_path, "CustomJoint", 3)
    path.write_text(path.read_text().replace("SimmSpline", name))
    compare(path)


def compare(path: Path) -> None:
    source, peer, rng = read_osim(path), Peer(path), np.random.default_rng(1)
    model = _core.Model(to_spec(source, scale_names(source)))
    there = [model.segment_names.index(body) for body in peer.bodies]
    for _ in range(10):
        motion = random_motion(source, rng)
        x = as_state(model, motion)
        q, qd, qdd = coupled(source, motion)
        peer.at(q, qd)
        R, origins = _core.segment_poses(model, x)
        R_peer, origins_peer = peer.poses()
        np.testing.assert_allclose(R[there], R_peer, atol=1e-12)
        np.testing.assert_allclose(origins[there], origins_peer, atol=1e-12)
        np.testing.assert_allclose(_core.marker_positions(model, x), peer.marker_places(), atol=1e-12)
        expected = summed(source, q, peer.moments(q, qd, qdd))
        moments = dict(zip(model.coordinate_names, _core.joint_moments(model, x), strict=True))
        size = max(abs(value) for value in expected.values())
        for name, value in moments.items():
            assert value == pytest.approx(expected[name], abs=1e-9 * size), name
