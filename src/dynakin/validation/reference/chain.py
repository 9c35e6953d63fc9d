"""The planar chain that the reference methods work on: what an initialisation measured, without the core."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.model.inertia import RigidBody
from dynakin.model.plan import ModelPlan
from dynakin.model.schema import ModelFile
from dynakin.model.schema import Segment as SegmentEntry
from dynakin.simulation import mechanics

Tree = tuple[mechanics.Segment, ...]

_Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Coordinates (rad) and their first two derivatives (rad/s, rad/s^2), each (T, C), in the model's order; NaN
    where not known.

    hinges: places of the S hinges in their parents' frames (m) and the first two derivatives, (3, T, S, 2), where they
    follow the landmarks from frame to frame; None: constant, the chain's own.
    """

    coordinates: Array
    speeds: Array
    accelerations: Array
    hinges: Array | None = None


@dataclass(frozen=True, eq=False)
class Link:
    """A segment and its hinge: it is turned about Z (right) by ``offset + slope * coordinate`` against its parent."""

    name: str
    parent: str | None
    placement: Array  # (3,) m, the hinge in the parent's frame
    coordinate: str | None  # None: rigidly fixed to the parent
    offset: float  # rad
    slope: float  # -1 where the coordinate's positive direction is a turn from Y to X
    body: RigidBody  # the table's, about the hinge, in the segment's frame


@dataclass(frozen=True, eq=False)
class PlanarChain:
    """Links, parents first, with lengths and joint places as they were measured while standing."""

    links: tuple[Link, ...]
    coordinates: tuple[str, ...]  # all of the model, locked ones too
    locked: Mapping[str, float]  # rad

    @classmethod
    def of(cls, plan: ModelPlan) -> PlanarChain:
        """The chain of a measured model.

        Raises:
            ModelError: the model is no tree of hinges about Z under the usual gravity; the segment is named.
        """
        model, geometry = plan.model, plan.geometry
        if not model.planar:
            raise ModelError(f"model {model.name}: the reference methods need a planar model (planar = true)")
        if not np.allclose(model.gravity, mechanics.GRAVITY):
            raise ModelError(f"model {model.name}: gravity is {model.gravity}, expected {tuple(mechanics.GRAVITY)}")
        links = tuple(
            Link(
                s.name,
                None if s.parent == "ground" else s.parent,
                geometry.placement(s),
                *_hinge(model, s),
                plan.inertia[s.name],
            )
            for s in model.segments
        )
        return cls(links, tuple(c.name for c in model.coordinates), geometry.locked)

    def tree(self, inertia: Mapping[str, RigidBody] | None = None, *, sliding: bool = False) -> Tree:
        """The same chain for `dynakin.simulation.mechanics`; ``inertia`` instead of the table's where given.

        The hinge's axis has the link's name. With ``sliding`` it is carried along the parent's X and Y first, by axes
        named link/x and link/y.
        """
        segments = []
        for link in self.links:
            body = (inertia or {}).get(link.name, link.body)
            com = body.centre if body.mass != 0.0 else np.zeros(3)  # least squares may find negative masses
            central = body.inertia - body.mass * (com @ com * np.eye(3) - np.outer(com, com))
            slides = tuple(mechanics.Axis(name, d, translation=True) for name, d in _slides(link)) if sliding else ()
            place = np.zeros(3) if sliding else link.placement
            axes = (*slides, mechanics.Axis(link.name, _Z))
            segments.append(mechanics.Segment(link.name, link.parent, place, axes, body.mass, com, central))
        return tuple(segments)

    def motion(self, kinematics: Kinematics) -> mechanics.Motion:
        """The motion of the tree's axes: the hinges' by link, then, where hinges slide, link/x and link/y."""
        frames, names = len(kinematics.coordinates), [link.name for link in self.links]
        turns = np.zeros((3, frames, len(self.links)))
        for k, link in enumerate(self.links):
            turns[0, :, k] = link.offset
            if link.coordinate is not None:
                c = self.coordinates.index(link.coordinate)
                for d, values in enumerate((kinematics.coordinates, kinematics.speeds, kinematics.accelerations)):
                    turns[d, :, k] += link.slope * values[:, c]
        if kinematics.hinges is not None:
            names += [name for link in self.links for name, _ in _slides(link)]
            turns = np.concatenate([turns, kinematics.hinges.reshape(3, frames, -1)], axis=2)
        return mechanics.Motion(tuple(names), *turns)

    def moving(self, kinematics: Kinematics) -> mechanics.TreeMotion:
        """Poses and motions of all links."""
        return mechanics.kinematics(self.tree(sliding=kinematics.hinges is not None), self.motion(kinematics))

    def generalised(self, hinge_moments: Array) -> Array:
        """Moments (T, C) of the coordinates from those about +Z at each hinge, (T, S) or more columns, N m."""
        found = np.zeros((len(hinge_moments), len(self.coordinates)))
        for k, link in enumerate(self.links):
            if link.coordinate is not None:
                found[:, self.coordinates.index(link.coordinate)] += link.slope * hinge_moments[:, k]
        return found


def _slides(link: Link) -> tuple[tuple[str, tuple[float, float, float]], ...]:
    return (f"{link.name}/x", (1.0, 0.0, 0.0)), (f"{link.name}/y", (0.0, 1.0, 0.0))


def _hinge(model: ModelFile, segment: SegmentEntry) -> tuple[str | None, float, float]:
    """Coordinate, offset and slope of a segment's turn about Z."""
    where = f'model {model.name}, segments "{segment.name}"'
    R = np.array(segment.rotation)
    fixed = float(np.arctan2(R[1, 0], R[0, 0]))
    if not np.allclose(R[2], _Z):
        raise ModelError(f"{where}: its joint is turned out of the plane; the reference methods need hinges about Z")
    if not segment.axes:
        return None, fixed, 0.0
    axis = segment.axes[0]
    z = axis.direction[2]
    hinge = axis.kind == "rotation" and abs(abs(z) - 1.0) < 1e-9 and len(axis.coefficients) == 2 and not axis.scale
    if len(segment.axes) > 1 or not hinge:
        raise ModelError(f"{where}: expected one hinge about Z with two coefficients, for the reference methods")
    return axis.coordinate, fixed + z * axis.coefficients[0], z * axis.coefficients[1]
