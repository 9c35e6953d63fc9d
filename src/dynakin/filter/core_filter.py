"""From a measured model and noise settings to the core's filter, ready for its first frame, and its arrays once it has
looked back."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.errors import ConfigError
from dynakin.filter.augment import continuous_noise, extended, initial_covariance
from dynakin.filter.noise import (
    SOUGHT_SD,
    gate_limits,
    limit_sd,
    marker_variance,
    process_variance,
    wrench_covariance,
)
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.settings.model import QUANTITIES, Quantity
from dynakin.settings.noise import Noise


def core_filter(
    initial: CalibratedModel, noise: Noise, estimate: Collection[Quantity] = QUANTITIES
) -> tuple[CalibratedModel, _core.Model, _core.Filter]:
    """The model with the states that these settings ask for, compiled, and a filter that starts from it.

    Args:
        estimate: kinds of parameters to estimate.

    Raises:
        ConfigError: the settings name a marker that the model does not use.
    """
    initial = extended(initial, noise, estimate)
    model = _core.Model(initial.spec)
    settings = filter_settings(initial, noise, model.layout, estimate)
    return initial, model, _core.Filter(model, settings, initial.x0, initial_covariance(initial, noise))


def filter_settings(
    initial: CalibratedModel, noise: Noise, layout: _core.StateLayout, estimate: Collection[Quantity] = QUANTITIES
) -> _core.FilterSettings:
    """The core's settings for a measured model: this noise, the marker set's variances, the bounds of (9).

    Raises:
        ConfigError: as `core_filter`.
    """
    unknown = set(noise.marker_variance_m2) - set(initial.recorded_markers)
    if unknown:
        raise ConfigError(
            f"noise.marker_variance_m2: {', '.join(sorted(unknown))} not among the markers used; expected some of "
            f"{', '.join(initial.recorded_markers)}"
        )
    point = noise.reference_point_m
    unseen = limit_sd(noise, noise.unseen_sd)
    sought = {f"{name}_sd": limit_sd(noise, sd) for name, sd in SOUGHT_SD.items()}
    recovery = _core.RecoverySettings(blind_s=noise.blind_s, unseen_sd=unseen, **sought) if noise.recover else None
    density, decay = continuous_noise(initial, noise, layout)
    return _core.FilterSettings(
        process_variance=process_variance(noise, layout),
        process_density=density,
        decay_rate=decay,
        marker_variance=marker_variance(initial, noise, estimate),
        wrench_covariance=wrench_covariance(noise),
        reference_point=initial.plate_centre if point == "auto" else np.array(point, dtype=float),
        total_mass=initial.weighed_kg if noise.total_mass_use == "frame" else None,
        total_mass_variance=noise.total_mass_variance_kg2,
        lower=initial.lower,
        upper=initial.upper,
        constraint=noise.constraint,
        marker_gate=gate_limits(noise.marker_gate, noise.variance_scale),
        wrench_gate=gate_limits(noise.wrench_gate),
        wrench_needs_markers=noise.recover,
        iterate_beyond=limit_sd(noise, noise.iterate_beyond_sd),
        recovery=recovery,
    )


# Arrays of the forward run -> those of the way back that take their places. Predictions and innovations stay.
_PLACES = {
    "state": "smoothed_state",
    "state_sd": "smoothed_state_sd",
    "markers_estimated": "smoothed_markers",
    "markers_sd": "smoothed_markers_sd",
    "wrench_estimated": "smoothed_wrench",
    "wrench_sd": "smoothed_wrench_sd",
    "moments": "smoothed_moments",
    "moments_sd": "smoothed_moments_sd",
    "foot_wrench": "smoothed_foot_wrench",
    "foot_wrench_sd": "smoothed_foot_wrench_sd",
    "foot_adjustment": "smoothed_foot_adjustment",
    "remainder": "smoothed_remainder",
    "moment_source": "smoothed_moment_source",
}


def smoothed(arrays: dict[str, Array]) -> dict[str, Array]:
    """`_core.Filter.run_smoothed`'s arrays with the smoothed ones in the places of the filtered."""
    kept = {name: values for name, values in arrays.items() if not name.startswith("smoothed_")}
    return kept | {name: arrays[source] for name, source in _PLACES.items() if source in arrays}
