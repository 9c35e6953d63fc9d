"""OpenSim itself on the same file: poses, markers, and moments by its inverse dynamics, as functions of coordinates.

Rates of our coordinates are turned into its speeds (angular velocities in ball and free joints) and its forces back.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import opensim
from numpy.typing import NDArray

from support.oracle.mechanics import axis_angle

opensim.Logger.setLevelString("error")


def angular_velocity_map(q: NDArray) -> NDArray:
    """E (3, 3) of w = E qd in the parent, for rotations about the moving axes X, Y, Z; complex numbers pass through."""
    x, y, z = np.eye(3)
    first = axis_angle(x, q[0])
    return np.stack([x + 0 * q, first @ y, first @ axis_angle(y, q[1]) @ z], axis=1)


class Peer:
    """OpenSim's model of a file, without its muscles."""

    def __init__(self, path: Path) -> None:
        model = opensim.Model(str(path))
        for collection in (model.updForceSet(), model.updControllerSet()):
            collection.clearAndDestroy()
        self.state = model.initSystem()
        self.model, self.solver = model, opensim.InverseDynamicsSolver(model)
        self.names = self._in_order_of_speeds()
        self.bodies = [body.getName() for body in model.getBodySet()]
        self.markers = [marker.getName() for marker in model.getMarkerSet()]
        self.balls = [
            [self.names.index(joint.get_coordinates(k).getName()) for k in range(3)]
            for joint in model.getJointSet()
            if joint.getConcreteClassName() in ("BallJoint", "FreeJoint")
        ]

    def _in_order_of_speeds(self) -> list[str]:
        """Coordinates as their speeds follow each other in the state: each is set by itself and looked for there."""
        found = {}
        for coordinate in self.model.getCoordinateSet():
            coordinate.setLocked(self.state, False)
            self.state.setU(opensim.Vector(self.state.getNU(), 0.0))
            coordinate.setSpeedValue(self.state, 1.0)
            found[int(np.argmax(self.state.getU().to_numpy()))] = coordinate.getName()
        return [found[k] for k in sorted(found)]

    def _array(self, values: dict[str, float]) -> NDArray:
        return np.array([values[name] for name in self.names])

    def at(self, q: dict[str, float], qd: dict[str, float]) -> None:
        """Put the model there; the values of all coordinates, coupled ones too."""
        speeds = self._array(qd)
        for three in self.balls:
            speeds[three] = angular_velocity_map(self._array(q)[three]) @ speeds[three]
        coordinates = self.model.updCoordinateSet()
        for name, speed in zip(self.names, speeds, strict=True):
            coordinate = coordinates.get(name)
            coordinate.setLocked(self.state, False)
            coordinate.setClamped(self.state, False)
            coordinate.setValue(self.state, q[name], False)
            coordinate.setSpeedValue(self.state, float(speed))
        self.model.realizeVelocity(self.state)

    def poses(self) -> tuple[NDArray, NDArray]:
        """R (B, 3, 3) and origins (B, 3) m of the bodies, ground frame."""
        frames = [self.model.getBodySet().get(name).getTransformInGround(self.state) for name in self.bodies]
        rotations = [[[f.R().get(i, j) for j in range(3)] for i in range(3)] for f in frames]
        return np.array(rotations), np.array([f.p().to_numpy() for f in frames])

    def inertia(self) -> dict[str, NDArray]:
        """Each body's mass (kg), its centre (m) and xx, yy, zz, xy, xz, yz about the centre (kg m^2), as one (10,)."""
        found = {}
        for body in self.model.getBodySet():
            tensor = [body.get_inertia().get(k) for k in range(6)]
            found[body.getName()] = np.array([body.getMass(), *body.getMassCenter().to_numpy(), *tensor])
        return found

    def marker_places(self) -> NDArray:
        """(M, 3) m, ground frame."""
        markers = self.model.getMarkerSet()
        return np.array([markers.get(name).getLocationInGround(self.state).to_numpy() for name in self.markers])

    def moments(self, q: dict[str, float], qd: dict[str, float], qdd: dict[str, float]) -> dict[str, float]:
        """Force along each coordinate, coupled ones apart; after ``at`` the same q, qd."""
        rates, accelerations = self._array(qd), self._array(qdd)
        for three in self.balls:
            place, rate, h = self._array(q)[three], rates[three], 1e-30
            map_rate = angular_velocity_map(place + 1j * h * rate).imag / h
            accelerations[three] = angular_velocity_map(place) @ accelerations[three] + map_rate @ rate
        forces = self.solver.solve(self.state, opensim.Vector.createFromMat(accelerations)).to_numpy()
        for three in self.balls:
            forces[three] = angular_velocity_map(self._array(q)[three]).T @ forces[three]
        return dict(zip(self.names, forces, strict=True))
