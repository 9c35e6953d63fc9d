"""A model as plain data, with the attribute names of the core's specification classes.

The oracle reads a specification by attribute name only, so it takes these and the core's alike; with these,
the oracle can be tested without the core.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

INERTIA_NAMES = ("mass", "mx", "my", "mz", "ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass
class Function:
    kind: str = "polynomial"  # or "spline", "piecewise_linear"
    coefficients: list[float] = field(default_factory=list)
    x: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)


@dataclass
class Axis:
    coordinate: str
    kind: str  # "rotation" or "translation"
    direction: NDArray
    coefficients: list[float] = field(default_factory=lambda: [0.0, 1.0])
    scale: str = ""
    functions: list[Function] = field(default_factory=list)


@dataclass
class Length:
    parameter: str
    direction: NDArray


@dataclass
class Segment:
    name: str
    parent: str
    rotation: NDArray = field(default_factory=lambda: np.eye(3))
    translation: NDArray = field(default_factory=lambda: np.zeros(3))
    lengths: list[Length] = field(default_factory=list)
    axes: list[Axis] = field(default_factory=list)
    inertia: NDArray = field(default_factory=lambda: np.zeros(10))
    inertia_estimated: list[bool] = field(default_factory=lambda: [False] * 10)


@dataclass
class Coordinate:
    name: str
    value: float = 0.0
    locked: bool = False


@dataclass
class Parameter:
    name: str
    value: float
    estimated: bool = True


@dataclass
class Marker:
    name: str
    segment: str
    position: NDArray
    measured: list[bool] = field(default_factory=lambda: [True] * 3)
    estimated: list[bool] = field(default_factory=lambda: [False] * 3)
    soft_tissue: list[bool] = field(default_factory=lambda: [False] * 3)


@dataclass
class Spec:
    name: str
    coordinates: list[Coordinate]
    parameters: list[Parameter]
    segments: list[Segment]
    markers: list[Marker]
    gravity: NDArray = field(default_factory=lambda: np.array([0.0, -9.80665, 0.0]))
    wrench_measured: list[bool] = field(default_factory=lambda: [True] * 6)
    wrench_offset: list[bool] = field(default_factory=lambda: [False] * 6)
    wrench_offset_point: NDArray = field(default_factory=lambda: np.zeros(3))
    wrench_delay: bool = False
    contacts: list[str] = field(default_factory=list)
