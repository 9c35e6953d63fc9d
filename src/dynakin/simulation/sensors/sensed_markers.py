"""Markers as cameras and software deliver them: on moving skin, put on by somebody, with noise and faults."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.markers import Site, hip_centres, marker_positions, misplace
from dynakin.simulation.mechanics import Motion, TreeMotion
from dynakin.simulation.sensors.faults import Fault, fly_markers, occlude_markers, swap_markers
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.sensors.soft_tissue import draw_displacement
from dynakin.simulation.streams import Streams

Array = NDArray[np.float64]


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
