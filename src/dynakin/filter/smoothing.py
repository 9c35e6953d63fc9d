"""Offline smoothing: each frame's estimate from all frames, those after it too.

One run forwards identifies the constants, and the way back (modified Bryson-Frazier, docs/derivations.md) carries what
later frames told, of constants and motion alike, to every frame before them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.errors import ConfigError
from dynakin.results.records import NOT_SMOOTHED
from dynakin.settings.noise import Noise

Array = npt.NDArray[np.float64]

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


def can_smooth(noise: Noise) -> bool:
    """Whether bounds are kept in a way that has a smoother."""
    return noise.constraint in ("projection", "none")


def whether_to_smooth(asked: bool | None, noise: Noise) -> tuple[bool, list[str]]:
    """Whether a recording is smoothed: as asked, else wherever these settings have a smoother; a sentence where not.

    Raises:
        ConfigError: it was asked for, and these settings have no smoother.
    """
    if asked:
        check_can_smooth(noise)
    if asked is not None or can_smooth(noise):
        return asked is not False, []
    return False, [
        f"{NOT_SMOOTHED} bounds are kept by constraint {noise.constraint!r}, which has no smoother; each frame is "
        "estimated from the frames until then, as it would be live."
    ]


def check_can_smooth(noise: Noise) -> None:
    """
    Raises:
        ConfigError: these settings keep bounds in a way that has no smoother.
    """
    if not can_smooth(noise):
        raise ConfigError(
            f"smooth: bounds are kept by constraint {noise.constraint!r}, which changes the covariance; expected "
            "'projection' or 'none' (preset default)"
        )
