"""Standing and swaying: more than quiet standing, the feet flat."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.posture import balance, posture_jets
from dynakin.simulation.jets import Jet, constant, sinusoids, step
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.movement import STANDING_S, Movement, in_order

SHORTEST_S = 3.0
# Root mean square of each coordinate's sway, deg: ankle and hip strategies together, the arms hanging loosely.
SIZE_DEG = {"ankle": 0.7, "knee": 0.6, "hip": 1.5, "lumbar": 1.2, "shoulder": 2.0, "elbow": 2.0}
BAND_HZ = (0.05, 0.6)
QUIET = 0.1  # part of it during the quiet standing before
_TONES = 6


def sway_movement(rng: np.random.Generator, body: SimulatedBody, duration_s: float) -> Movement:
    """Sway about standing in balance, each coordinate on its own, an analytic function of time.

    Raises:
        ConfigError: too short.
    """
    if not duration_s >= SHORTEST_S:
        raise ConfigError(f"simulated sway: duration_s is {duration_s:g}, expected at least {SHORTEST_S:g} s")
    path = body.paths["sway"]
    balanced = balance(body.tree, path)
    names = [name for name in body.coordinates if name in SIZE_DEG]
    frequencies = rng.uniform(*BAND_HZ, (len(names), _TONES))
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(names), _TONES))

    def at(time: Array) -> Motion:
        rest = constant(time, 0.0)
        jets = posture_jets(path, balanced, rest, rest)
        envelope = (1.0 - QUIET) * step(time, STANDING_S, 1.0) + QUIET
        for k, name in enumerate(names):
            jets[name] = jets[name] + envelope * _tones(time, SIZE_DEG[name], frequencies[k], phases[k])
        return in_order(body.coordinates, jets)

    return Movement("sway", at, "standing and swaying")


def _tones(time: Array, size_deg: float, frequencies: Array, phases: Array) -> Jet:
    amplitude = np.deg2rad(size_deg) * np.sqrt(2.0 / _TONES)
    return sinusoids(time, np.full(_TONES, amplitude), frequencies, phases)
