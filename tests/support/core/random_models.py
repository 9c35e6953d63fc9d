"""Random trees, states and trials, from a seed, as the oracle's plain data."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from support.oracle import measurement
from support.oracle.spec import Axis, Coordinate, Function, Length, Marker, Parameter, Segment, Spec
from support.oracle.state import Layout

PLANE = [True, True, False]
PLANAR_INERTIA = [True, True, True, False, False, False, True, False, False, False]
PLANAR_WRENCH = [True, True, False, False, False, True]


def unit_vector(rng: Generator) -> NDArray:
    """Any direction; one time in two along a frame's axis, in either sense."""
    if rng.random() < 0.5:
        return np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def rotation(rng: Generator) -> NDArray:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def inertia(rng: Generator, mass: float | None = None) -> NDArray:
    """Ten numbers of a body that can exist: those of a dozen point masses about the segment's origin."""
    weights = rng.uniform(0.1, 1.0, 12)
    weights *= (rng.uniform(1.0, 12.0) if mass is None else mass) / weights.sum()
    points = rng.uniform(-0.1, 0.1, 3) + rng.normal(size=(12, 3)) * [0.10, 0.15, 0.12]
    first = weights @ points
    x, y, z = points.T
    tensor = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    return np.array([weights.sum(), *first, *(weights @ t for t in tensor)])


def spatial_model(seed: int, nonlinear: bool = True) -> Spec:
    """A tree in space. ``nonlinear``: axis functions that are polynomials, scaled or share a coordinate."""
    rng = np.random.default_rng(seed)
    n_segments = int(rng.integers(3, 8))
    parameters = [
        Parameter(f"l{k}", rng.uniform(0.2, 0.5), rng.random() < 0.75) for k in range(int(rng.integers(2, 5)))
    ]
    names = [p.name for p in parameters]
    coordinates: list[Coordinate] = []
    segments: list[Segment] = []
    markers: list[Marker] = []
    for k in range(n_segments):
        n_axes = int(rng.integers(0, 4)) if k else int(rng.choice([0, 1, 3, 6]))
        axes: list[Axis] = []
        for _ in range(n_axes):
            axis = Axis("", str(rng.choice(["rotation", "rotation", "translation"])), unit_vector(rng))
            if nonlinear and coordinates and rng.random() < 0.3:
                axis.coordinate = coordinates[rng.integers(len(coordinates))].name
            else:
                axis.coordinate = f"q{len(coordinates)}"
                locked = bool(rng.random() < 0.15)
                coordinates.append(Coordinate(axis.coordinate, rng.uniform(-0.5, 0.5), locked))
            if nonlinear and rng.random() < 0.6:
                degree = int(rng.integers(1, 5))
                axis.coefficients = [*rng.uniform(-0.3, 0.3, degree), float(rng.uniform(0.2, 0.8))]
                if rng.random() < 0.5:
                    axis.scale = str(rng.choice(names))
            axes.append(axis)
        segments.append(
            Segment(
                f"s{k}",
                "ground" if k == 0 or rng.random() < 0.1 else f"s{rng.integers(k)}",
                rotation(rng) if rng.random() < 0.7 else np.eye(3),
                rng.uniform(-0.3, 0.3, 3),
                [
                    Length(str(rng.choice(names)), rng.uniform(0.5, 1.5) * unit_vector(rng))
                    for _ in range(int(rng.integers(0, 3)))
                ],
                axes,
                inertia(rng),
                [bool(b) for b in rng.random(10) < rng.choice([0.0, 0.6, 1.0])],
            )
        )
        for _ in range(int(rng.integers(0, 4))):
            measured = [True] * 3 if rng.random() < 0.7 else [bool(b) for b in rng.random(3) < 0.6]
            estimated = [bool(b) for b in rng.random(3) < 0.6]
            markers.append(Marker(f"m{len(markers)}", f"s{k}", rng.uniform(-0.2, 0.2, 3), measured, estimated))
    if not coordinates or all(c.locked for c in coordinates):
        coordinates.append(Coordinate(f"q{len(coordinates)}", 0.1))
        segments[-1].axes.append(Axis(coordinates[-1].name, "rotation", unit_vector(rng)))
    if not markers:
        markers.append(Marker("m0", segments[-1].name, rng.uniform(-0.2, 0.2, 3)))
    measured = [True] * 6 if rng.random() < 0.7 else [bool(b) for b in rng.random(6) < 0.6]
    gravity = np.array([0.0, -9.80665, 0.0]) if rng.random() < 0.7 else rng.normal(size=3) * 6
    return Spec(f"spatial {seed}", coordinates, parameters, segments, markers, gravity, measured)


def planar_model(seed: int, n_segments: int = 0) -> Spec:
    """A tree of hinges about Z, like the paper's; out-of-plane numbers neither measured nor estimated.

    ``n_segments``: 0 for a random tree, else an upright chain of so many segments, two markers each.
    """
    rng = np.random.default_rng(seed)
    chain = n_segments > 0
    n = n_segments or int(rng.integers(3, 8))
    parameters = [Parameter(f"l{k}", rng.uniform(0.25, 0.45), chain or rng.random() < 0.8) for k in range(n)]
    coordinates = [Coordinate(f"q{k}", rng.uniform(-0.3, 0.3)) for k in range(n)]
    for coordinate in coordinates[1:]:
        coordinate.locked = bool(not chain and rng.random() < 0.15)
    segments: list[Segment] = []
    markers: list[Marker] = []
    for k in range(n):
        parent = "ground" if k == 0 else f"s{k - 1 if chain else rng.integers(k)}"
        upward = np.array([0.0, 1.0, 0.0])
        sideways = np.array([rng.normal(), rng.normal(), 0.0])
        terms = [Length(f"l{k - 1}", upward if chain else sideways)] if k else []
        if not chain and rng.random() < 0.3:
            terms.append(Length(f"l{rng.integers(n)}", upward))
        angle = 0.0 if chain else rng.uniform(-1, 1)
        c, s = np.cos(angle), np.sin(angle)
        segments.append(
            Segment(
                f"s{k}",
                parent,
                np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]),
                np.zeros(3) if chain else np.array([*rng.uniform(-0.2, 0.2, 2), 0.0]),
                terms,
                [Axis(f"q{k}", "rotation", np.array([0.0, 0.0, 1.0]))],
                inertia(rng),
                list(PLANAR_INERTIA),
            )
        )
        for _ in range(2 if chain else int(rng.integers(1, 4))):
            place = rng.uniform(-0.2, 0.2, 3)
            estimated = list(PLANE) if not chain or len(markers) % 3 else [False] * 3
            markers.append(Marker(f"m{len(markers)}", f"s{k}", place, list(PLANE), estimated))
    name = f"planar {seed}"
    return Spec(name, coordinates, parameters, segments, markers, wrench_measured=list(PLANAR_WRENCH))


FEET = ("left_2", "right_2")
ROOT = ("tx", "ty", "tz", "rx", "ry", "rz")


def floating_model(seed: int, feet: int = 2) -> Spec:
    """A body whose root has all six freedoms, with a leg of three segments a foot (`FEET`) and two that hang free."""
    rng = np.random.default_rng(seed)
    parameters = [Parameter(f"l{k}", rng.uniform(0.2, 0.5), rng.random() < 0.75) for k in range(3)]
    coordinates = [Coordinate(name, rng.uniform(-0.3, 0.3)) for name in ROOT]
    kinds = ["translation"] * 3 + ["rotation"] * 3
    axes = [Axis(name, kind, np.eye(3)[k % 3]) for k, (name, kind) in enumerate(zip(ROOT, kinds, strict=True))]
    segments = [Segment("root", "ground", np.eye(3), np.zeros(3), [], axes, inertia(rng), [True] * 10)]
    limbs = [f"{side}_{k}" for side in ("left", "right")[:feet] for k in range(3)] + ["trunk", "arm"]
    for name in limbs:
        first = name == "trunk" or name.endswith("_0")
        own = []
        side, _, place = name.partition("_")
        for k in range(int(rng.integers(1, 4))):
            label = f"leg{place}_{k}_{side[0]}" if place else f"{name}_{k}"
            coordinates.append(Coordinate(label, rng.uniform(-0.5, 0.5), bool(rng.random() < 0.1)))
            own.append(Axis(coordinates[-1].name, "rotation", unit_vector(rng)))
            if rng.random() < 0.3:
                own[-1].coefficients = [0.1, float(rng.uniform(0.5, 1.2)), float(rng.uniform(-0.3, 0.3))]
        segments.append(
            Segment(
                name,
                "root" if first else segments[-1].name,
                rotation(rng),
                rng.uniform(-0.2, 0.2, 3),
                [Length(f"l{rng.integers(3)}", unit_vector(rng))],
                own,
                inertia(rng),
                [bool(b) for b in rng.random(10) < 0.7],
            )
        )
    markers = [
        Marker(f"m{k}", s.name, rng.uniform(-0.2, 0.2, 3), [True] * 3, [bool(b) for b in rng.random(3) < 0.4])
        for k, s in enumerate(s for s in segments for _ in range(3))
    ]
    return Spec(f"floating {seed}", coordinates, parameters, segments, markers)


def with_slow_errors(spec: Spec, seed: int, delay: bool = True) -> Spec:
    """The same model with soft tissue under some markers' axes, and plates that err slowly and come late."""
    spec, rng = deepcopy(spec), np.random.default_rng(seed)
    for marker in spec.markers:
        in_plane = marker.measured if marker.measured == PLANE else [True] * 3
        marker.soft_tissue = [bool(axis and rng.random() < 0.7) for axis in in_plane]
    spec.markers[0].soft_tissue = list(spec.markers[0].measured)
    spec.wrench_offset = [bool(seen and rng.random() < 0.8) for seen in spec.wrench_measured]
    spec.wrench_offset_point = np.array([-0.1, 0.05, 0.2])
    spec.wrench_delay = delay
    return spec


def with_contacts(spec: Spec, names: tuple[str, ...] = ("left", "right")) -> Spec:
    """The same model with the states of so many contacts."""
    spec = deepcopy(spec)
    spec.contacts = list(names)
    spec.name += " with contacts"
    return spec


def random_function(rng: Generator) -> Function:
    """A polynomial, or a gentle function through some points."""
    kind = str(rng.choice(["polynomial", "spline", "spline", "piecewise_linear"]))
    if kind == "polynomial":
        return Function(kind, [*rng.uniform(-0.3, 0.3, int(rng.integers(1, 4))), float(rng.uniform(0.3, 0.8))])
    n = int(rng.integers(2, 8))
    x = np.cumsum(rng.uniform(0.2, 0.5, n)) - 0.15 * n
    return Function(kind, [], list(x), list(0.5 * np.sin(2.0 * x) + rng.uniform(-0.1, 0.1, n)))


def with_functions(spec: Spec, seed: int) -> Spec:
    """The same model with functions, one or two in a chain, in front of the polynomials of some of its axes."""
    spec, rng = deepcopy(spec), np.random.default_rng(seed)
    axes = [axis for segment in spec.segments for axis in segment.axes]
    for k, axis in enumerate(axes):
        if k == 0 or rng.random() < 0.6:
            axis.functions = [random_function(rng) for _ in range(int(rng.integers(1, 3)))]
    spec.name += " with functions"
    return spec


def random_state(layout: Layout, rng: Generator) -> NDArray:
    """A state far from rest, with parameters somewhat away from the specification's."""
    x = layout.initial_state()
    for block, size in (("coordinates", 1.0), ("speeds", 2.0), ("accelerations", 10.0), ("markers", 0.02)):
        here = layout.block(block)
        x[here] += rng.uniform(-size, size, x[here].size)
    x[layout.block("soft_tissue")] = rng.normal(size=layout.blocks["soft_tissue"][1]) * 0.02
    plates = layout.block("plates")
    x[plates] = [0.03 if name == "plates/delay" else 20.0 * rng.normal() for name in layout.names[plates]]
    x[layout.block("contacts")] = rng.normal(size=layout.blocks["contacts"][1])
    for block, size in (("lengths", 0.1), ("inertia", 0.02)):  # a body of 2 % other numbers can still exist
        here = layout.block(block)
        x[here] *= rng.uniform(1 - size, 1 + size, x[here].size)
    return x


@dataclass
class Trial:
    """Simulated measurements of a spec, and a start for the filter that knows them only roughly."""

    time: NDArray
    markers: NDArray  # (T, M, 3)
    wrench: NDArray  # (T, 6)
    x0: NDArray
    P0: NDArray
    truth: NDArray  # (T, n)
    wrench_covariance: NDArray | None = None  # (T, 6, 6) where the model has contacts
    wrench_effects: NDArray | None = None  # (T, 6, 6 C)

    @property
    def given(self) -> dict[str, NDArray]:
        """How the total wrench is measured, as ``run`` takes it."""
        if self.wrench_covariance is None or self.wrench_effects is None:
            return {}
        return {"wrench_covariance": self.wrench_covariance, "wrench_effects": self.wrench_effects}

    def run(self, run: Callable[..., dict[str, Any]], **options: Any) -> dict[str, Any]:
        """What a filter's ``run`` or ``run_smoothed`` makes of it."""
        return run(self.time, self.markers, self.wrench, **self.given, **options)

    def at(self, k: int) -> tuple[NDArray, ...]:
        """What a filter's update takes of frame k."""
        return (self.markers[k], self.wrench[k], *(values[k] for values in self.given.values()))

    def first(self, frames: int | None) -> Trial:
        """The first so many frames."""
        names = ("time", "markers", "wrench", *self.given)
        return replace(self, **{name: getattr(self, name)[:frames] for name in names})


def wrench_models(spec: Spec, frames: int, seed: int) -> tuple[NDArray, NDArray]:
    """(T, 6, 6) and (T, 6, 6 C): errors that grow and shrink, and contacts that come, change and go, at last all."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(2, 6, 6)) * 0.8
    swing = 1.0 + np.sin(np.linspace(0.0, 9.0, frames))[:, None, None]
    covariance = root[0] @ root[0].T + swing * (root[1] @ root[1].T) + np.diag([4.0, 4.0, 4.0, 1.0, 1.0, 1.0])
    effects, C = np.zeros((frames, 6, len(spec.contacts), 6)), len(spec.contacts)
    for k in range(C):
        stance = slice(k * frames // (C + 2), (k + 2) * frames // (C + 2))
        ends = rng.normal(size=(2, 6, 6)) * np.array([20.0, 20.0, 20.0, 8.0, 8.0, 8.0])[:, None]
        part = np.linspace(0.0, 1.0, frames)[stance, None, None]
        effects[stance, :, k] = (1.0 - part) * ends[0] + part * ends[1]
    return covariance, effects.reshape(frames, 6, 6 * C)


def trial(spec: Spec, seed: int, frames: int = 300, uneven: bool = True, gaps: bool = True) -> Trial:
    """Smooth motion at about 100 Hz with noise, and (``gaps``) missing markers and wrench components."""
    rng = np.random.default_rng(seed)
    layout = Layout(spec)
    steps = rng.uniform(0.006, 0.014, frames) if uneven else np.full(frames, 0.01)
    time = np.cumsum(steps)
    truth = np.tile(layout.initial_state(), (frames, 1))
    nq = layout.blocks["coordinates"][1]
    amplitude, omega = rng.uniform(0.05, 0.2, nq), rng.uniform(1.0, 4.0, nq)
    phase = np.outer(time, omega) + rng.uniform(0, 6, nq)
    truth[:, layout.block("coordinates")] += amplitude * np.sin(phase)
    truth[:, layout.block("speeds")] = amplitude * omega * np.cos(phase)
    truth[:, layout.block("accelerations")] = -amplitude * omega**2 * np.sin(phase)
    for block, relative in (("lengths", 0.05), ("inertia", 0.08)):
        here = layout.block(block)
        truth[:, here] *= rng.uniform(1 - relative, 1 + relative, layout.blocks[block][1])
    here = layout.block("markers")
    truth[:, here] += rng.normal(size=layout.blocks["markers"][1]) * 0.01
    slow = np.array([*layout.names[layout.block("soft_tissue")], *layout.names[layout.block("plates")]])
    amplitude = np.array([0.005 if name.startswith("soft") else 3.0 for name in slow])
    wave = amplitude * np.sin(np.outer(time, rng.uniform(1, 3, slow.size)) + rng.uniform(0, 6, slow.size))
    wave[:, slow == "plates/delay"] = 0.008
    n_tissue = layout.blocks["soft_tissue"][1]
    truth[:, layout.block("soft_tissue")], truth[:, layout.block("plates")] = wave[:, :n_tissue], wave[:, n_tissue:]
    markers = measurement.marker_positions(layout, truth)
    markers = markers + rng.normal(size=markers.shape) * 0.002
    given: tuple[NDArray, ...] = ()
    wrench = measurement.plates(layout, truth) + rng.normal(size=(frames, 6)) * 2.0
    if spec.contacts:
        given = wrench_models(spec, frames, seed)
        there, own = layout.block("contacts"), np.random.default_rng(seed + 1)
        rate, phase = own.uniform(2, 5, layout.blocks["contacts"][1]), own.uniform(0, 6, layout.blocks["contacts"][1])
        truth[:, there] = np.sqrt(2.0) * np.sin(np.outer(time, rate) + phase)
        errors = np.linalg.cholesky(given[0]) @ own.normal(size=(frames, 6, 1))
        wrench = measurement.plates(layout, truth) - (given[1] @ truth[:, there, None] - errors)[..., 0]
    if gaps:
        for k in range(len(spec.markers)):
            start = int(rng.integers(frames))
            markers[start : start + int(rng.integers(5, 40)), k] = np.nan
        markers[rng.random(markers.shape[:2]) < 0.02] = np.nan
        wrench[rng.random(wrench.shape) < 0.03] = np.nan
        wrench[frames // 2 : frames // 2 + 5] = np.nan
        markers[frames // 2 + 2 : frames // 2 + 3] = np.nan  # one frame in which only the mass, if that, is left
    x0 = truth[0].copy()
    spread = prior_sd(layout)
    x0 += rng.normal(size=layout.size) * spread * 0.3
    for block in ("lengths", "markers", "inertia"):
        x0[layout.block(block)] = layout.initial_state()[layout.block(block)]
    return Trial(time, markers, wrench, x0, np.diag(spread**2), truth, *given)


def prior_sd(layout: Layout) -> NDArray:
    """Finite prior standard deviations of the size that the model layer declares."""
    sd = np.empty(layout.size)
    start = layout.initial_state()
    for block, size in (("coordinates", 0.05), ("speeds", 0.3), ("accelerations", 2.0), ("markers", 0.02)):
        sd[layout.block(block)] = size
    sd[layout.block("soft_tissue")] = 0.005
    plates = layout.block("plates")
    sd[plates] = [0.01 if name == "plates/delay" else 3.0 for name in layout.names[plates]]
    sd[layout.block("contacts")] = 1.0
    for block in ("lengths", "inertia"):
        here = layout.block(block)
        sd[here] = 0.05 * np.abs(start[here]) + 0.01
    return sd


def settings(spec: Spec, seed: int, bounds: bool = True, total_mass: bool = True) -> dict:
    """Keyword arguments for the FilterSettings of the core and of the oracle: a filter that stays stable."""
    rng = np.random.default_rng(seed)
    layout = Layout(spec)
    process = np.zeros(layout.size)
    variances = {"coordinates": 1e-6, "speeds": 1e-3, "accelerations": 1.0, "markers": 1e-9}
    for block, variance in variances.items():
        process[layout.block(block)] = variance * rng.uniform(0.5, 2.0, layout.blocks[block][1])
    root = rng.normal(size=(6, 6)) * 0.8
    start = layout.initial_state()
    lower, upper = np.full(layout.size, -np.inf), np.full(layout.size, np.inf)
    if bounds:
        for block in ("lengths", "markers", "inertia"):
            here = layout.block(block)
            half = rng.uniform(0.05, 0.3, start[here].size) * np.abs(start[here]) + 0.01
            half[rng.random(half.size) < 0.6] = np.inf
            lower[here], upper[here] = start[here] - half, start[here] + half
        first = layout.block("coordinates").start
        lower[first], upper[first] = start[first] - 0.1, start[first] + 0.06
    mass = float(sum(s.inertia[0] for s in spec.segments))
    return {
        "process_variance": process,
        "marker_variance": rng.uniform(0.5, 4.0, len(spec.markers)) * 1e-5,
        "wrench_covariance": root @ root.T + np.diag([4.0, 4.0, 4.0, 1.0, 1.0, 1.0]),
        "reference_point": np.array([0.3, 0.05, -0.2]),
        "total_mass": mass * 1.01 if total_mass else None,
        "total_mass_variance": 1e-2,
        "lower": lower,
        "upper": upper,
        "constraint": "gain",
    }


def continuous(spec: Spec, seed: int, constraint: str = "none", **changes) -> dict:
    """Settings with white jerk and slow errors that decay, known by their spectral densities."""
    rng = np.random.default_rng(seed)
    layout = Layout(spec)
    density, decay = np.zeros(layout.size), np.zeros(layout.size)
    density[layout.block("accelerations")] = 100.0 * rng.uniform(0.5, 2.0, layout.blocks["accelerations"][1])
    sd = prior_sd(layout)
    for block in ("soft_tissue", "plates"):
        for k in np.arange(layout.size)[layout.block(block)]:
            if layout.names[k] != "plates/delay":
                decay[k] = rng.uniform(0.5, 3.0)
                density[k] = 2.0 * sd[k] ** 2 * decay[k]
    here = layout.block("contacts")
    decay[here] = rng.uniform(2.0, 5.0, layout.blocks["contacts"][1])
    density[here] = 2.0 * decay[here]  # of unit variance
    return (
        settings(spec, seed)
        | {
            "process_variance": np.zeros(layout.size),
            "process_density": density,
            "decay_rate": decay,
            "constraint": constraint,
        }
        | changes
    )
