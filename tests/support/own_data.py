"""Trials drawn from the filter's own model: what the settings say of noise is exactly so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynakin.bindings import _core
from dynakin.filter.augment import continuous_noise, initial_covariance
from dynakin.filter.core_filter import core_filter
from dynakin.filter.noise import wrench_covariance
from dynakin.model.spec import free_names
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.studies.tuning.trial import TuningTrial

Array = np.ndarray
RATE_HZ, FRAMES = 50.0, 150


def own_noise(**changes: float) -> Noise:
    """Small motion, so that what is tested is statistics and not how well a tangent stands for a curve."""
    values = {
        "jerk_density_rad2_s5": 0.02,
        "translation_jerk_density_m2_s5": 0.001,
        "length_drift_density_m2_s": 0.0,
        "soft_tissue_sd_fraction": 0.3,
        "soft_tissue_least_sd_m": 0.0,
        "soft_tissue_time_s": 0.5,
        "marker_sd_m": 0.001,
        "force_variance_n2": 4.0,
        "moment_variance_n2_m2": 1.0,
        "plate_force_sd_n": 3.0,
        "plate_moment_sd_nm": 2.0,
        "plate_time_s": 1.0,
        "plate_delay_sd_s": 0.0,
        "iterate_beyond_sd": None,
        "constraint": "none",
        "reference_point_m": (0.0, 0.0, 0.0),
        "plate_load_tolerance": None,
    }
    return presets.default().changed(**(values | changes))


def own_trial(like: TuningTrial, noise: Noise, seed: int) -> TuningTrial:
    """A trial whose state starts within its prior and moves as ``noise`` says.

    Args:
        like: gives the measured model; its motion's priors are narrowed.
    """
    rng = np.random.default_rng(seed)
    motion = 3 * len(free_names(like.initial.spec))
    sd0 = like.initial.sd0.copy()
    sd0[:motion] = 0.05
    sd0[motion:] *= 0.2  # constants that stay possible
    measured = replace(like.initial, sd0=sd0)
    initial, model, _ = core_filter(measured, noise)
    density, decay = continuous_noise(initial, noise, model.layout)
    dt, n = 1.0 / RATE_HZ, motion // 3
    x = initial.x0 + np.linalg.cholesky(initial_covariance(initial, noise)) @ rng.normal(size=len(initial.x0))
    jerk_Q = np.array(
        [[dt**5 / 20, dt**4 / 8, dt**3 / 6], [dt**4 / 8, dt**3 / 3, dt**2 / 2], [dt**3 / 6, dt**2 / 2, dt]]
    )
    root = np.linalg.cholesky(jerk_Q)
    offsets = [k for k, name in enumerate(initial.names) if name.startswith("plates/")]
    wanted = [("fx", "fy", "fz", "mx", "my", "mz").index(initial.names[k].split("/")[1]) for k in offsets]
    markers, wrench = [], []
    for k in range(FRAMES):
        if k > 0:
            q, qd, qdd = x[:n], x[n : 2 * n], x[2 * n : motion]
            drawn = np.sqrt(density[2 * n : motion])[:, None] * (rng.normal(size=(n, 3)) @ root.T)
            moved = [q + dt * qd + 0.5 * dt**2 * qdd, qd + dt * qdd, qdd]
            x[:motion] = np.concatenate([part + drawn[:, i] for i, part in enumerate(moved)])
            slow = decay > 0.0
            kept = np.exp(-decay[slow] * dt)
            spread = np.sqrt(density[slow] * (1.0 - kept**2) / (2.0 * decay[slow]))
            x[slow] = kept * x[slow] + spread * rng.normal(size=slow.sum())
        markers.append(
            _core.marker_positions(model, x) + noise.marker_sd_m * rng.normal(size=(len(like.initial.spec.markers), 3))
        )
        force = np.array(_core.wrench(model, x)) + np.sqrt(np.diag(wrench_covariance(noise))) * rng.normal(size=6)
        force[wanted] += x[offsets]
        wrench.append(force)
    time = np.arange(FRAMES) * dt
    return TuningTrial(f"own {seed}", measured, time, np.array(markers), np.array(wrench), 5, FRAMES, 5)
