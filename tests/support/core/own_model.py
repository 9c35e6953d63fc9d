"""Trials drawn from the filter's own model: what it assumes of noise is exactly so.

A planar chain with white jerk, Gauss-Markov soft tissue, slow plate errors and a delay; lengths, places and inertia are
drawn from the prior. Angles stay within 23 deg (RMS 4) and constants within a few per cent, so that what is tested is
the filter's statistics and not how well a tangent stands for a curve (the extended Kalman filter's own approximation).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from support.core.random_models import planar_model
from support.oracle import measurement, process
from support.oracle.sensors import carried_to_origin
from support.oracle.spec import Spec
from support.oracle.state import Layout

JERK = 0.01  # rad^2/s^5
TISSUE_SD, TISSUE_RATE = 0.004, 2.0  # m, 1/s
PLATE_SD, PLATE_RATE = 3.0, 1.0  # N and N m, 1/s
MARKER_SD = 0.002  # m
WRENCH_COVARIANCE = np.diag([4.0, 4.0, 4.0, 1.0, 1.0, 1.0])
REFERENCE_POINT = np.array([0.2, 0.0, 0.1])


def chain() -> Spec:
    """Three segments upright, two markers each, all of them on skin that moves."""
    spec = planar_model(7, n_segments=3)
    for coordinate in spec.coordinates:
        coordinate.value = 0.0
    for marker in spec.markers:
        marker.soft_tissue = [True, True, False]
    spec.wrench_offset = list(spec.wrench_measured)
    spec.wrench_delay = True
    return spec


def prior_sd(layout: Layout) -> NDArray:
    start = layout.initial_state()
    sd = np.empty(layout.size)
    for block, size in (("coordinates", 0.03), ("speeds", 0.05), ("accelerations", 0.05), ("lengths", 0.005)):
        sd[layout.block(block)] = size
    sd[layout.block("markers")], sd[layout.block("soft_tissue")] = 0.005, TISSUE_SD
    here = layout.block("inertia")
    sd[here] = 0.02 * np.abs(start[here]) + 0.002
    sd[layout.block("plates")] = [
        0.003 if n == "plates/delay" else PLATE_SD for n in layout.names[layout.block("plates")]
    ]
    return sd


def settings(layout: Layout, **changes) -> dict:
    density, decay = np.zeros(layout.size), np.zeros(layout.size)
    density[layout.block("accelerations")] = JERK
    for prefix, sd, rate in (("soft_tissue/", TISSUE_SD, TISSUE_RATE), ("plates/", PLATE_SD, PLATE_RATE)):
        for k, name in enumerate(layout.names):
            if name.startswith(prefix) and name != "plates/delay":
                density[k], decay[k] = 2 * sd**2 * rate, rate
    return {
        "process_variance": np.zeros(layout.size),
        "process_density": density,
        "decay_rate": decay,
        "marker_variance": np.full(len(layout.spec.markers), MARKER_SD**2),
        "wrench_covariance": WRENCH_COVARIANCE,
        "reference_point": REFERENCE_POINT,
        "total_mass": None,
        "total_mass_variance": 1.0,
        "lower": np.full(layout.size, -np.inf),
        "upper": np.full(layout.size, np.inf),
        "constraint": "none",
    } | changes


@dataclass
class Draws:
    time: NDArray  # (T,) s
    truth: NDArray  # (seeds, T, n)
    markers: NDArray  # (seeds, T, M, 3)
    wrench: NDArray  # (seeds, T, 6)
    x0: NDArray
    P0: NDArray


def draw(spec: Spec, seeds: int, frames: int) -> Draws:
    layout, rng = Layout(spec), np.random.default_rng(2024)
    s, sd = settings(layout), prior_sd(layout)
    x0 = layout.initial_state()
    time = np.cumsum(rng.uniform(0.006, 0.014, frames))  # uneven
    truth = np.empty((seeds, frames, layout.size))
    truth[:, 0] = x0 + sd * rng.normal(size=(seeds, layout.size))
    for k in range(1, frames):
        F, Q = process.transition(layout, s["process_density"], s["decay_rate"], time[k] - time[k - 1])
        values, vectors = np.linalg.eigh(Q)
        root = vectors * np.sqrt(np.clip(values, 0, None))
        truth[:, k] = truth[:, k - 1] @ F.T + rng.normal(size=(seeds, layout.size)) @ root.T
    markers = measurement.marker_positions(layout, truth)
    markers = markers + MARKER_SD * rng.normal(size=markers.shape)
    carried = np.linalg.cholesky(carried_to_origin(WRENCH_COVARIANCE, REFERENCE_POINT))
    wrench = measurement.plates(layout, truth) + rng.normal(size=(seeds, frames, 6)) @ carried.T
    markers[rng.random(markers.shape[:3]) < 0.05] = np.nan  # gaps that have nothing to do with the motion
    return Draws(time, truth, markers, wrench, x0, np.diag(sd**2))
