"""What is simulated: a tree of segments with its markers, its feet on plates and the postures it knows.

Nothing here knows how many dimensions the tree moves in: planar chains and spatial trees are the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from dynakin.arrays import Array
from dynakin.simulation.bodies.markers import HipCentres, Site
from dynakin.simulation.bodies.posture import PosturePath
from dynakin.simulation.bodies.subject import SimulatedSubject
from dynakin.simulation.mechanics import Segment


@dataclass(frozen=True)
class Contact:
    """Where the person meets a force plate.

    name: "right foot"; plate: name of the plate below; segment: on which it acts, None where the tree's root
    is that contact (a chain fixed at the toe); centre: (3,) m, middle of the plate's top, ground frame; half_m: half
    the plate's length and width.
    """

    name: str
    plate: str
    segment: str | None
    centre: Array
    half_m: tuple[float, float] = (0.30, 0.20)


@dataclass(frozen=True)
class SimulatedBody:
    """A person, ready to move.

    Attributes:
        name: of the model whose coordinates it has.
        subject: mass, height, sex and the lengths drawn.
        tree: segments, parents before children.
        sites: where the markers are put on, without misplacement.
        feet: right and left foot, in this order, or one contact that carries all.
        lengths: those that the model estimates, m, by the model's names.
        joint_centres: name -> (segment, place (3,) m in it).
        paths: motion -> postures from standing to the lowest; none for a body that only follows a motion
            given from outside.
        full_change: coordinate -> change (rad) that moves the soft tissue by its full size (a full squat).
        hips: virtual hip centres, None where the recording has none.
        floor_m: y of the floor in the ground frame.
        in_space: nothing is fixed in the ground, so the ground is the laboratory's, and motions are those in space.
    """

    name: str
    subject: SimulatedSubject
    tree: tuple[Segment, ...]
    sites: tuple[Site, ...]
    feet: tuple[Contact, ...]
    lengths: Mapping[str, float] = field(default_factory=dict)
    joint_centres: Mapping[str, tuple[str, Array]] = field(default_factory=dict)
    paths: Mapping[str, PosturePath] = field(default_factory=dict)
    full_change: Mapping[str, float] = field(default_factory=dict)
    hips: HipCentres | None = None
    floor_m: float = 0.0
    in_space: bool = False

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates, each once, in the order of the tree."""
        return tuple(dict.fromkeys(axis.coordinate for segment in self.tree for axis in segment.axes))

    @property
    def translations(self) -> frozenset[str]:
        """Coordinates in m; the others are in rad."""
        return frozenset(axis.coordinate for segment in self.tree for axis in segment.axes if axis.translation)

    def parameters(self) -> dict[str, float]:
        """Lengths (m) and inertial parameters (SI) by the names of the filter's state: length/shank,
        inertia/shank/mass."""
        named = {f"length/{name}": float(value) for name, value in self.lengths.items()}
        for segment in self.tree:
            named |= {f"inertia/{segment.name}/{key}": value for key, value in ten_numbers(segment).items()}
        return named


def ten_numbers(segment: Segment) -> dict[str, float]:
    """mass (kg), first moments mx, my, mz (kg m) and the entries of the inertia tensor about the segment's
    origin (kg m^2)."""
    m, c = segment.mass, segment.com
    tensor = segment.inertia + m * (float(c @ c) * np.eye(3) - np.outer(c, c))  # parallel axes
    entries = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    first = {"mass": m, "mx": m * c[0], "my": m * c[1], "mz": m * c[2]}
    return {k: float(v) for k, v in first.items()} | {f"i{k}": float(tensor[ij]) for k, ij in entries.items()}
