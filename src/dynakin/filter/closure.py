"""Do the plates carry the person? Their sum against what the centre of mass needs, by the markers alone.

The filter cannot ask itself: it takes the plates for measurements, and bends accelerations to fit them. The centre of
mass is, within some mm, a fixed mean of the markers, so that Newton's second law can be checked before anything is
estimated: m (g + a) on one side, the plates' forces on the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, signal

from dynakin import _core
from dynakin.model import InitialModel
from dynakin.recordings.foot_contact import runs
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

EXCESS = 0.2
"""Part of the weight that must be missing, or too much. Well measured recordings (squats, a walk, a landing, a run at
5 m/s) stay below 0.06, the run below 0.16; a chair makes 0.5 to 1."""
EDGE = 0.06
"""Once it is there, it lasts as long as this part is missing, but no longer than `SPREAD_S` more at either end."""
SPREAD_S = 0.3
SMOOTH_S = 0.05
"""Standard deviation of the Gaussian by which the difference is smoothed: -3 dB at 2.6 Hz."""
CUTOFF_HZ = 6.0
"""Low-pass of the centre of mass before it is differentiated."""
SHORTEST_S = 0.5
"""Recordings that are shorter are not judged: the derivatives at their ends are not known."""
_END_S = 0.1
_GAP_S = 0.2
_GAP_WEIGHT = 0.05
"""Longer gaps of markers that make up more than this part of the mean are not judged."""
_MASS_WITHIN, _OFTEN = 0.15, 0.2
_POSTURES, _SPREAD_RAD = 200, 0.4


@dataclass(frozen=True, eq=False)
class Closure:
    """What the plates' sum lacks.

    Attributes:
        excess: (T, 3) N, ground axes: what the motion needs less what the plates carry, smoothed; NaN where it was not
            judged.
        moment: (T, 2) N m of the excess about the ground's origin: about X and about Z, of its vertical part, as far as
            the body does not turn.
        undeclared: (T,) frames in which something bears (or pulls) the person that no plate measures.
        load_ratio: the plates' load over that of the declared mass where they carry the person; None where that is
            within 15 % too seldom to be said.
    """

    excess: Array
    moment: Array
    undeclared: Flags
    load_ratio: float | None

    def place(self, frames: slice) -> Array:
        """Where the excess of a stretch acts, (2,) m: X and Z on the ground."""
        push = np.nan_to_num(self.excess[frames, 1])
        about = np.nan_to_num(self.moment[frames])
        return np.asarray(np.array([push @ about[:, 1], -(push @ about[:, 0])]) / max(float(push @ push), 1e-9))


def closure(initial: InitialModel, time: Array, markers: Array, wrench: Array, claimed: Flags) -> Closure | None:
    """Compare the plates' sum with the motion of the centre of mass.

    Args:
        markers: (T, M, 3) m, ground frame, NaN missing. wrench: (T, 6), the sum over the plates.
        claimed: (T,) frames in which that sum is thought to be all that bears the person; only they are judged.

    Returns:
        None where nothing can be judged.
    """
    claimed = claimed & np.isfinite(wrench).all(axis=1)
    if len(time) < 2 or time[-1] - time[0] < SHORTEST_S or not claimed.any():
        return None
    rate = (len(time) - 1) / float(time[-1] - time[0])
    found = _centre_of_mass(initial, time, markers)
    if found is None or rate < 2.5 * CUTOFF_HZ:
        return None
    centre, judged = found
    axes = np.array(initial.spec.wrench_measured[:3])
    acceleration = _second_derivative(centre, rate)
    end = round(_END_S * rate)
    judged = judged & claimed
    judged[:end] = judged[len(judged) - end :] = False
    if not judged.any():
        return None
    weight = initial.weighed_kg * GRAVITY_M_S2
    need = initial.weighed_kg * (acceleration + np.array([0.0, GRAVITY_M_S2, 0.0]))
    ratio = _load_ratio(need[judged, 1], wrench[judged, 1], weight)
    need *= 1.0 if ratio is None else ratio  # a mass that is somewhat wrong is no contact
    missing = np.where(axes, need - wrench[:, :3], 0.0)
    excess = _smooth(missing, judged, rate)
    zmp = centre - centre[:, [1]] * acceleration / (acceleration[:, [1]] + GRAVITY_M_S2).clip(1.0)
    about = np.stack([-need[:, 1] * zmp[:, 2] - wrench[:, 3], need[:, 1] * zmp[:, 0] - wrench[:, 5]], axis=1)
    size = np.abs(np.nan_to_num(excess)).max(axis=1) / weight
    return Closure(excess, _smooth(about, judged, rate), _lasting(size, judged, claimed, rate), ratio)


def plates_misfit(initial: InitialModel, time: Array, markers: Array, wrench: Array) -> float | None:
    """RMS of the excess, N, over all frames in which the wrench (T, 6) is known; None where nothing can be judged."""
    found = closure(initial, time, markers, wrench, np.ones(len(time), dtype=bool))
    if found is None:
        return None
    return float(np.sqrt(np.nanmean(np.sum(found.excess**2, axis=1))))


def _load_ratio(need: Array, have: Array, weight: float) -> float | None:
    """Mass by the plates over the declared one: the median of the frames within 15 %, if these are many."""
    loaded = need > 0.5 * weight
    ratio = have[loaded] / need[loaded]
    near = ratio[np.abs(ratio - 1.0) < _MASS_WITHIN]
    return float(np.median(near)) if len(near) > _OFTEN * len(need) else None


def _lasting(size: Array, judged: Flags, claimed: Flags, rate: float) -> Flags:
    """Frames in which the excess is large, with those before and after in which it comes and goes."""
    core = judged & (size > EXCESS)
    reach = 2 * round(SPREAD_S * rate) + 1
    near = ndimage.binary_dilation(core, structure=np.ones(reach, dtype=bool))
    found: Flags = claimed & np.asarray(ndimage.binary_propagation(core, mask=near & (~judged | (size > EDGE))))
    for first, end in runs(~judged & claimed):  # not judged: as its neighbours are
        sides = [bool(found[k]) for k in (first - 1, end) if 0 <= k < len(found)]
        found[first:end] |= bool(sides) and all(sides)
    return found


def _smooth(values: Array, judged: Flags, rate: float) -> Array:
    """Gaussian mean over the judged frames alone; NaN elsewhere."""
    weights = judged.astype(float)
    sums = ndimage.gaussian_filter1d(np.where(judged[:, None], values, 0.0), SMOOTH_S * rate, axis=0, mode="constant")
    total = ndimage.gaussian_filter1d(weights, SMOOTH_S * rate, mode="constant")
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(judged[:, None], sums / total[:, None], np.nan)


def _second_derivative(centre: Array, rate: float) -> Array:
    sos = signal.butter(2, CUTOFF_HZ / 0.802, fs=rate, output="sos")  # twice: -3 dB at the cut-off
    smooth = signal.sosfiltfilt(sos, centre, axis=0, padlen=min(len(centre) - 1, round(rate / CUTOFF_HZ)))
    return np.asarray(np.gradient(np.gradient(smooth, 1.0 / rate, axis=0), 1.0 / rate, axis=0))


def _centre_of_mass(initial: InitialModel, time: Array, markers: Array) -> tuple[Array, Flags] | None:
    """Centre of mass (T, 3) as a fixed mean of the markers, and the frames in which enough of these are seen."""
    axes = np.array(initial.spec.markers[0].measured)
    seen: Flags = np.asarray(np.isfinite(markers[:, :, axes]).all(axis=2))
    use = np.flatnonzero(seen.mean(axis=0) > 0.8)
    if len(use) < 4:
        return None
    weights = _weights(initial, use)
    centre, judged = np.zeros((len(time), 3)), np.ones(len(time), dtype=bool)
    lost = np.zeros(len(time))
    for weight, m in zip(weights, use, strict=True):
        known: Flags = seen[:, m]
        for axis in np.flatnonzero(axes):
            centre[:, axis] += weight * np.interp(time, time[known], markers[known, m, axis])
        for first, end in runs(~known):
            if time[end - 1] - time[first] > _GAP_S or first == 0 or end == len(time):
                lost[first:end] += abs(weight)
    return centre, judged & (lost <= _GAP_WEIGHT)


def _weights(initial: InitialModel, use: npt.NDArray[np.intp]) -> Array:
    """Weights (K,), of sum 1, of the markers by which they give the centre of mass, over many postures of the model.

    Least squares with a small ridge; on our models it is within 2 to 3 mm where every angle turns by 23 deg.
    """
    model = _core.Model(initial.spec)
    offset, size = model.layout.blocks["coordinates"]
    states = np.tile(initial.x0, (_POSTURES, 1))
    turned = {axis.coordinate for s in initial.spec.segments for axis in s.axes if axis.kind == "rotation"}
    turns = np.array([c.name in turned for c in initial.spec.coordinates if not c.locked])
    rng = np.random.default_rng(0)
    states[:, offset : offset + size] += rng.normal(0.0, _SPREAD_RAD, (_POSTURES, size)) * turns
    axes = np.array(initial.spec.markers[0].measured)
    places = np.stack([_core.marker_positions(model, x)[use] for x in states])[..., axes]
    centre = _core.whole_body(model, states)["mass_centre"][:, axes]
    middle = places.mean(axis=1, keepdims=True)
    A = (places - middle).transpose(0, 2, 1).reshape(-1, len(use))
    b = (centre - middle[:, 0]).reshape(-1)
    ridge = 1e-4 * len(b) * np.eye(len(use))
    found = np.linalg.solve(A.T @ A + ridge, A.T @ b)
    return np.asarray(found - found.mean() + 1.0 / len(use))
