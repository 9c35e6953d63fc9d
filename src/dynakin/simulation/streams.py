"""A random stream of its own for each thing that is drawn."""

from __future__ import annotations

import numpy as np

from dynakin.errors import ConfigError

# New ones go to the end: a stream's numbers follow from the seed and its place here.
NAMES = (
    "subject",
    "motion",
    "sites",
    "soft_tissue",
    "marker_noise",
    "plate_noise",
    "misplacement",
    "hip_regression",
    "occlusion",
    "swap",
    "flying",
    "plate_gain",
    "plate_drift",
    "rail",
)


class Streams:
    """Generators by name, all from one seed.

    Raises:
        ConfigError: the seed is no whole number from 0.
    """

    def __init__(self, seed: int) -> None:
        if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
            raise ConfigError(f"simulation: seed is {seed!r}, expected a whole number from 0")
        children = np.random.SeedSequence(int(seed)).spawn(len(NAMES))
        self._by_name = {name: np.random.default_rng(child) for name, child in zip(NAMES, children, strict=True)}

    def __getitem__(self, name: str) -> np.random.Generator:
        return self._by_name[name]
