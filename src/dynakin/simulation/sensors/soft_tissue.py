"""Skin and flesh that move over the bones: a smooth displacement of each marker in its segment's frame.

Not the filter's own noise model: one part follows a joint angle (so it repeats with each squat, as skin
does), another wanders slowly; both in directions of their own for each marker.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from dynakin.errors import ConfigError
from dynakin.simulation.bodies.markers import Site
from dynakin.simulation.mechanics import Motion

Array = NDArray[np.float64]

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
