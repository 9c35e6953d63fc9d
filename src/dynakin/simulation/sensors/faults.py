"""What goes wrong with markers on their way to the file: gaps, swapped names, reflections taken for markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynakin.simulation.sensors.sizes import SensorNoise

Array = NDArray[np.float64]

_NEAR_M = 0.30  # cameras swap markers that are no farther apart than this
_NEIGHBOURS = 3
_JITTER = 0.1  # of a flying marker's distance, white: a reflection is no steady point


@dataclass(frozen=True)
class Fault:
    """kind: "occluded", "swapped" or "flying"; the markers concerned; from start to end (s), end not included."""

    kind: str
    markers: tuple[str, ...]
    start_s: float
    end_s: float


def swap_markers(
    rng: np.random.Generator, time: Array, names: Sequence[str], markers: Array, noise: SensorNoise
) -> list[Fault]:
    """Exchange near markers for a while, in place; markers (T, M, 3) m."""
    faults = []
    for start, end in _spans(rng, time, noise.swap_per_min, noise.swap_mean_s):
        first, choice = int(rng.integers(len(names))), int(rng.integers(_NEIGHBOURS))
        away = np.linalg.norm(markers[start] - markers[start, first], axis=1)
        nearest = [int(k) for k in np.argsort(away, kind="stable") if k != first and away[k] <= _NEAR_M]
        if not nearest:
            continue
        other = nearest[min(choice, len(nearest) - 1)]
        markers[start:end, [first, other]] = markers[start:end, [other, first]]
        faults.append(_fault("swapped", (names[first], names[other]), time, start, end))
    return faults


def fly_markers(
    rng: np.random.Generator, time: Array, names: Sequence[str], markers: Array, noise: SensorNoise
) -> list[Fault]:
    """Let single markers jump off for a while, in place; markers (T, M, 3) m."""
    faults = []
    for start, end in _spans(rng, time, noise.flying_per_min, noise.flying_mean_s):
        which, distance = int(rng.integers(len(names))), noise.flying_distance_m * rng.uniform(0.1, 1.0)
        direction = rng.standard_normal(3)
        jitter = _JITTER * distance * rng.standard_normal((end - start, 3))
        markers[start:end, which] += distance * direction / np.linalg.norm(direction) + jitter
        faults.append(_fault("flying", (names[which],), time, start, end))
    return faults


def occlude_markers(
    rng: np.random.Generator, time: Array, names: Sequence[str], markers: Array, noise: SensorNoise
) -> list[Fault]:
    """Lose markers for a while, in place: NaN; markers (T, M, 3) m."""
    faults = []
    for k, name in enumerate(names):
        for start, end in _spans(rng, time, noise.occlusion_per_min, noise.occlusion_mean_s):
            markers[start:end, k] = np.nan
            faults.append(_fault("occluded", (name,), time, start, end))
    return faults


def _spans(rng: np.random.Generator, time: Array, per_min: float, mean_s: float) -> list[tuple[int, int]]:
    """Frames [start, end) of events that come at a constant rate and last for exponentially distributed times, at
    least a frame; in order."""
    length_s = float(time[-1] - time[0])
    count = int(rng.poisson(per_min * length_s / 60.0))
    starts = np.sort(time[0] + length_s * rng.random(count))
    lasting = mean_s * rng.standard_exponential(count)
    first = np.minimum(np.searchsorted(time, starts), len(time) - 1)
    last = np.maximum(np.searchsorted(time, starts + lasting), first + 1)
    return [(int(a), int(b)) for a, b in zip(first, last, strict=True)]


def _fault(kind: str, markers: tuple[str, ...], time: Array, start: int, end: int) -> Fault:
    step = float(time[1] - time[0])
    return Fault(kind, markers, float(time[start]), float(time[end - 1]) + step)
