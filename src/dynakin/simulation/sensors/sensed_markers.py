"""Markers as cameras and software deliver them: put on by somebody, on skin and flesh that move over the bones, with
noise, gaps, swapped names and reflections taken for markers."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.markers import Site, hip_centres, marker_positions, misplace
from dynakin.simulation.mechanics import Motion, TreeMotion
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.streams import Streams

RANDOM_BAND_HZ = (0.05, 0.5)  # of the wandering part
RANDOM_TONES = 8


@dataclass(frozen=True)
class Region:
    """A region of the body: size of the displacement at full squat (m), and the coordinate that drives it."""

    amplitude_m: float
    coordinate: str
    source: str


@cache
def regions() -> Mapping[str, Region]:
    """The list in soft_tissue.toml."""
    text = (resources.files("dynakin.results.measures") / "soft_tissue.toml").read_text(encoding="utf-8")
    return {
        name: Region(1e-3 * row["amplitude_mm"], row["coordinate"], row["source"])
        for name, row in tomllib.loads(text).items()
    }


def draw_displacement(
    rng: np.random.Generator,
    time: Array,
    motion: Motion,
    sites: Sequence[Site],
    full_change: Mapping[str, float],
    random_share: float,
) -> Array:
    """Displacements (T, M, 3) m in the segments' frames.

    At full squat, where a coordinate has changed by ``full_change`` (rad) since the first frame, the
    displacement's root mean square over draws is the region's amplitude: ``random_share`` of it wanders (root
    mean square), the rest, taken so that the squares add up, follows the angle.

    Raises:
        ConfigError: a site's region is not in the list, or what drives it is no coordinate of the body.
    """
    following_share = np.sqrt(1.0 - random_share**2)
    result = np.empty((len(time), len(sites), 3))
    for k, site in enumerate(sites):
        region = _region(site)
        driver = site.driver or region.coordinate
        if driver not in motion.names or driver not in full_change:
            raise ConfigError(
                f"soft tissue: marker {site.name!r} is driven by {driver!r}, expected a coordinate of the body with a "
                f"full change: {', '.join(full_change) or 'none'}"
            )
        j = motion.names.index(driver)
        change = (motion.q[:, j] - motion.q[0, j]) / full_change[driver]
        direction = rng.standard_normal(3)
        direction = direction / np.linalg.norm(direction)
        frequencies = rng.uniform(*RANDOM_BAND_HZ, RANDOM_TONES)
        phases = rng.uniform(0.0, 2.0 * np.pi, (3, RANDOM_TONES))
        tones = np.sin(2.0 * np.pi * np.multiply.outer(time, frequencies)[:, None, :] + phases)  # (T, 3, tones)
        wander = tones.sum(axis=2) * np.sqrt(2.0 / (3.0 * RANDOM_TONES))  # norm of root mean square 1
        result[:, k] = region.amplitude_m * (following_share * np.outer(change, direction) + random_share * wander)
    return result


def _region(site: Site) -> Region:
    if site.region not in regions():
        raise ConfigError(
            f"soft tissue: marker {site.name!r} lies in region {site.region!r}, expected one of {', '.join(regions())}"
        )
    return regions()[site.region]


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


@dataclass(frozen=True)
class SensedMarkers:
    """names (M); markers (T, M, 3) m, ground frame, virtual ones last; sites: where the real ones truly are; skin:
    (T, sites, 3) m, their displacement in the segments' frames; faults: what went wrong."""

    names: tuple[str, ...]
    markers: Array
    sites: tuple[Site, ...]
    skin: Array
    faults: tuple[Fault, ...]


def sense_markers(
    streams: Streams, body: SimulatedBody, time: Array, motion: Motion, moving: TreeMotion, noise: SensorNoise
) -> SensedMarkers:
    """What is recorded of the body's markers. Virtual hip centres are computed from the markers as recorded, as a
    laboratory's software does: a pelvis marker that is lost, swapped or misplaced spoils them too."""
    sites = misplace(streams["misplacement"], body.sites, noise.misplacement_sd_m)
    names = tuple(site.name for site in sites)
    if noise.soft_tissue > 0.0:
        rng, share = streams["soft_tissue"], noise.soft_tissue_random
        skin = noise.soft_tissue * draw_displacement(rng, time, motion, sites, body.full_change, share)
    else:  # a body of a user's own need not say what moves its skin
        skin = np.zeros((len(time), len(sites), 3))
    seen = marker_positions(sites, moving, skin)
    seen = seen + noise.marker_sd_m * streams["marker_noise"].standard_normal(seen.shape)
    faults = swap_markers(streams["swap"], time, names, seen, noise)
    faults += fly_markers(streams["flying"], time, names, seen, noise)
    faults += occlude_markers(streams["occlusion"], time, names, seen, noise)
    if body.hips is not None:
        error = noise.hip_regression_sd_m * streams["hip_regression"].standard_normal((2, 3))
        seen = np.concatenate([seen, hip_centres(body.hips, body.sites, seen, error)], axis=1)
        names += body.hips.names
    return SensedMarkers(names, seen, sites, skin, tuple(faults))
