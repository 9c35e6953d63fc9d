"""The recordings' two whole-body models: poses, markers, joint moments and total wrench equal OpenSim's.

OpenSim's inverse dynamics is not its own model's where one coordinate turns all three axes of a custom joint (the
knee here): its forces that go with the speed squared contradict its kinetic energy. So they are compared with that
knee at rest, and, with all in motion, with Lagrange's equations on OpenSim's own mass matrix.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from dynakin.bindings import _core
from dynakin.model.opensim.definition import scale_names
from dynakin.model.opensim.description import OpenSimModel
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.spec import to_spec
from support.osim.states import Motion, as_state, coupled, random_motion, summed

pytest.importorskip("opensim", reason="OpenSim is not installed (pip install opensim)")
from support.osim.peer import Peer

FILES = ["optimized_scale_and_markers.osim", "unscaled_generic.osim"]
KNEES = ("knee_angle_r", "knee_angle_l")


class Pair:
    """A model here and there."""

    def __init__(self, path: Path) -> None:
        self.source: OpenSimModel = read_osim(path)
        self.core = _core.Model(to_spec(self.source, scale_names(self.source)))
        self.peer = Peer(path)

    def theirs(self, motion: Motion) -> dict[str, float]:
        q, qd, qdd = coupled(self.source, motion)
        self.peer.at(q, qd)
        return summed(self.source, q, self.peer.moments(q, qd, qdd))

    def by_energy(self, motion: Motion) -> dict[str, float]:
        """Lagrange: statics + M qdd + d/dt (M) qd - d/dq (qd' M qd) / 2, by differences of fourth order."""
        q, qd, qdd = motion
        rest = dict.fromkeys(q, 0.0)
        expected = self.theirs((q, rest, qdd))

        def momentum(place: dict[str, float]) -> NDArray:
            with_mass, statics = self.theirs((place, rest, qd)), self.theirs((place, rest, rest))
            return np.array([with_mass[name] - statics[name] for name in q])

        def along(direction: dict[str, float]) -> NDArray:
            h = 2e-3
            at = {k: momentum({n: q[n] + k * h * direction[n] for n in q}) for k in (-2, -1, 1, 2)}
            return np.asarray((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h))

        forward, speeds = along(qd), np.array(list(qd.values()))
        for k, name in enumerate(q):
            expected[name] += forward[k] - 0.5 * speeds @ along(rest | {name: 1.0})
        return expected


@pytest.fixture(scope="module", params=FILES)
def pair(request: pytest.FixtureRequest, data_dir: Path) -> Pair:
    return Pair(data_dir / "opencap_subject4" / request.param)


def moments(pair: Pair, x: NDArray) -> dict[str, float]:
    return dict(zip(pair.core.coordinate_names, _core.joint_moments(pair.core, x), strict=True))


def check(found: dict[str, float], expected: dict[str, float], relative: float) -> None:
    size = max(abs(value) for value in expected.values())
    for name, value in found.items():
        assert value == pytest.approx(expected[name], abs=relative * size), name


def test_poses_markers_moments_and_wrench(pair: Pair) -> None:
    rng = np.random.default_rng(3)
    there = [pair.core.segment_names.index(body) for body in pair.peer.bodies]
    sites = [pair.core.marker_names.index(name) for name in pair.peer.markers]
    for _ in range(25):
        motion = random_motion(pair.source, rng)
        motion[1].update(dict.fromkeys(KNEES, 0.0))
        x = as_state(pair.core, motion)
        expected = pair.theirs(motion)
        R, origins = _core.segment_poses(pair.core, x)
        R_peer, origins_peer = pair.peer.poses()
        np.testing.assert_allclose(R[there], R_peer, atol=1e-12)
        np.testing.assert_allclose(origins[there], origins_peer, atol=1e-12)
        np.testing.assert_allclose(_core.marker_positions(pair.core, x)[sites], pair.peer.marker_places(), atol=1e-12)
        check(moments(pair, x), expected, 1e-6)
        wrench = base_wrench(motion[0], expected)
        size = np.abs(wrench).max()
        np.testing.assert_allclose(_core.wrench(pair.core, x), wrench, rtol=0, atol=1e-6 * size)


def test_moments_with_all_in_motion_are_those_of_the_energy(pair: Pair) -> None:
    rng = np.random.default_rng(4)
    for _ in range(3):
        motion = random_motion(pair.source, rng)
        found = moments(pair, as_state(pair.core, motion))
        check(found, pair.by_energy(motion), 1e-7)
        check(found, pair.theirs(motion), 1e-4)  # how far OpenSim's inverse dynamics is off


def base_wrench(q: dict[str, float], forces: dict[str, float]) -> NDArray:
    """(6,) about the ground's origin from the forces along the pelvis' six coordinates (turned about Z, X, Y)."""
    tilt, side = q["pelvis_tilt"], q["pelvis_list"]
    c, s = np.cos(tilt), np.sin(tilt)
    turned_x = np.array([c, s, 0.0])
    turned_y = np.cos(side) * np.array([-s, c, 0.0]) + np.sin(side) * np.array([0.0, 0.0, 1.0])
    axes = np.array([[0.0, 0.0, 1.0], turned_x, turned_y])
    moment = np.linalg.solve(axes, [forces[n] for n in ("pelvis_tilt", "pelvis_list", "pelvis_rotation")])
    names = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
    force, place = np.array([forces[n] for n in names]), np.array([q[n] for n in names])
    return np.concatenate([force, moment + np.cross(place, force)])
