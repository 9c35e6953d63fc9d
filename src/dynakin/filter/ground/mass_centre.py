"""Where the centre of mass is and how it accelerates, by the markers alone: no filter, no plates."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags, rms, runs
from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.schema import kinds_of
from dynakin.model.spec import free_names
from dynakin.recordings.resampling import low_pass
from dynakin.recordings.times import rate_of
from dynakin.units import GRAVITY_M_S2

CUTOFF_HZ = 6.0
"""Low-pass of the path before it is differentiated."""
REACH_S = 0.25 / CUTOFF_HZ
"""How far beyond a stance that leads what the stance needs. Farther off, half a sine of 2.6 times the weight in 0.22 s
leaves 0.06 of the weight and less, 0.3 before."""
LEAST_MARKERS = 4
_END_S = 0.1
"""Derivatives at the ends of a stretch are not known."""
_BRIDGED_S = 0.2
"""Longest gap of a marker that a straight line crosses; over a longer one the others give the centre."""
_LED_S = 0.3
"""How far a stretch without some marker is led into its neighbours, so that its derivatives are known at its ends."""
_POSTURES, _SPREAD_RAD = 200, 0.4
_UNSEEN_RAD = 0.1
"""The same of the root's turns where a trunk that is not marked is held to it: a mean of the pelvis' markers, which lie
in one plane, cannot follow what stands on them, nor would the trunk lean as far as the pelvis does."""
_WORST_M, _WORST_UNSEEN_M = 0.015, 0.025
"""Remainder, RMS, from which a set of markers does not give the centre of mass; of a trunk without markers, whose own
motion is more than that: Plug-in Gait's 16 of the lower body leave 16 mm."""


@dataclass(frozen=True, eq=False)
class MassCentre:
    """Path (T, 3) m and acceleration (T, 3) m/s^2 of the centre of mass, ground axes; counts where ``known`` (T,)."""

    path: Array
    acceleration: Array
    known: Flags

    def needed_force(self, mass_kg: float) -> Array:
        """(T, 3) N of all that pushes the person: m (g + a)."""
        return np.asarray(mass_kg * (self.acceleration + np.array([0.0, GRAVITY_M_S2, 0.0])))


def mass_centre(initial: CalibratedModel, time: Array, markers: Array) -> MassCentre | None:
    """The centre of mass as a fixed mean of the markers, over each stretch that shows the same ones.

    Args:
        markers: (T, M, 3) m, ground frame, NaN missing.

    Returns:
        None where no stretch is long enough, or too slowly sampled.
    """
    rate = rate_of(time)
    if not rate >= 2.5 * CUTOFF_HZ:
        return None
    axes = np.array(initial.spec.markers[0].measured)
    bridged, seen = _bridged(time, markers, axes, rate)
    weights = CentreWeights(initial)
    found = MassCentre(np.zeros((len(time), 3)), np.zeros((len(time), 3)), np.zeros(len(time), dtype=bool))
    reach, end = round(_LED_S * rate), round(_END_S * rate)
    for first, last in _pieces(time, rate):
        changes = np.flatnonzero((seen[first + 1 : last] != seen[first : last - 1]).any(axis=1)) + first + 1
        edges = [first, *changes.tolist(), last]
        for a, b in pairwise(edges):
            use = np.flatnonzero(seen[a])
            own = weights.of(use)
            if own is None:
                continue
            whole: Flags = np.array(seen[first:last][:, use].all(axis=1))
            lo, hi = a, b
            while lo > max(first, a - reach) and whole[lo - 1 - first]:
                lo -= 1
            while hi < min(last, b + reach) and whole[hi - first]:
                hi += 1
            if hi - lo <= 2 * end + 2:
                continue
            path = np.einsum("m,tma->ta", own, bridged[lo:hi][:, use])
            inner = slice(max(a, lo + end), min(b, hi - end))
            found.path[a:b] = path[a - lo : b - lo]
            found.acceleration[a:b] = second_derivative(path, rate)[a - lo : b - lo]
            found.known[inner] = True
    return found if found.known.any() else None


def _pieces(time: Array, rate: float) -> list[tuple[int, int]]:
    """Stretches [first, end) without a pause in the times."""
    pauses = np.flatnonzero(np.diff(time) > 1.5 / rate) + 1
    edges = [0, *pauses.tolist(), len(time)]
    return list(pairwise(edges))


def _bridged(time: Array, markers: Array, axes: Flags, rate: float) -> tuple[Array, Flags]:
    """Markers with short gaps crossed by a line, zero on axes not measured; and (T, M) where they are known."""
    filled = np.where(axes, markers, 0.0)
    known: Flags = np.array(np.isfinite(filled).all(axis=2))
    for m in range(known.shape[1]):
        for first, end in runs(~known[:, m]):
            if first == 0 or end == len(time) or end - first > _BRIDGED_S * rate:
                continue
            for axis in range(3):
                ends = filled[[first - 1, end], m, axis]
                filled[first:end, m, axis] = np.interp(time[first:end], time[[first - 1, end]], ends)
            known[first:end, m] = True
    return filled, known


def second_derivative(path: Array, rate: float) -> Array:
    """Of a path (T, ...), low-passed before it is differentiated."""
    return np.asarray(np.gradient(np.gradient(low_passed(path, rate), 1.0 / rate, axis=0), 1.0 / rate, axis=0))


def low_passed(values: Array, rate: float) -> Array:
    """Values (T, C), to be compared with such derivatives: as the path is."""
    return low_pass(values, rate, CUTOFF_HZ)


class CentreWeights:
    """Weights, of sum 1, by which markers give the centre of mass: least squares over many postures of the model.

    With all markers of our models it is within 2 to 3 mm where every angle turns by 23 deg.
    """

    def __init__(self, initial: CalibratedModel) -> None:
        model = _core.Model(initial.spec)
        offset, size = model.layout.blocks["coordinates"]
        states = np.tile(initial.x0, (_POSTURES, 1))
        kinds = kinds_of(initial.spec.segments)
        free = free_names(initial.spec)
        turns = np.array([kinds.get(name) == "rotation" for name in free])
        spread = np.random.default_rng(0).normal(0.0, _SPREAD_RAD, (_POSTURES, size)) * turns
        if initial.unseen_kg:
            roots = initial.tree.roots
            root = {a.coordinate for s in initial.spec.segments if s.name in roots for a in s.axes}
            spread *= np.where(np.isin(free, list(root)), _UNSEEN_RAD / _SPREAD_RAD, 1.0)
        states[:, offset : offset + size] += spread
        axes = np.array(initial.spec.markers[0].measured)
        self._places = np.stack([_core.marker_positions(model, x) for x in states])[..., axes]
        self._centre = _core.whole_body(model, states)["mass_centre"][:, axes]
        self._worst_m = _WORST_UNSEEN_M if initial.unseen_kg else _WORST_M
        self._found: dict[bytes, Array | None] = {}

    def of(self, use: npt.NDArray[np.intp]) -> Array | None:
        """(K,) of the K markers; None where they do not give it."""
        key = use.tobytes()
        if key not in self._found:
            self._found[key] = self._solved(use)
        return self._found[key]

    def _solved(self, use: npt.NDArray[np.intp]) -> Array | None:
        if len(use) < LEAST_MARKERS:
            return None
        places = self._places[:, use]
        middle = places.mean(axis=1, keepdims=True)
        A = (places - middle).transpose(0, 2, 1).reshape(-1, len(use))
        b = (self._centre - middle[:, 0]).reshape(-1)
        ridge = 1e-4 * len(b) * np.eye(len(use))
        weights = np.linalg.solve(A.T @ A + ridge, A.T @ b)
        weights = weights - weights.mean() + 1.0 / len(use)
        left = np.einsum("m,sma->sa", weights, places) - self._centre
        return np.asarray(weights) if rms(left) < self._worst_m else None
