"""The standard deviation that is reported: of the filter's own variance the part that holds for this movement, and the
systematic errors (`systematic`) of their sizes."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.uncertainty.frames import Frames
from dynakin.filter.uncertainty.geometry import Blocks, Parts
from dynakin.filter.uncertainty.sizes import BY_PLACES, KINDS, Sizes
from dynakin.results.measures.sources import MEASURED, PRIOR

Factors = dict[str, tuple[float, float]]
OWN_LATE: Factors = {"coordinates": (1.0, 0.0), "accelerations": (0.12, 0.04)}
"""Factor on the filter's own variance of a block where later frames helped: the first number, and the second times the
`movement_intensity`. One density of jerk serves all movements: in theory half of a speed's variance is what such jerk
leaves unseen, and five sixths of an acceleration's; a calm movement has none of it, an intense one more. Speeds
and moments have `STILL` and `Sizes.own_speeds`, `own_moments`."""
STILL = 0.25
STILL_TO_S = 0.01
"""Frames that are no further apart than this leave `STILL` of a moment's variance; further apart, by the square of
that, until all of it is left: between them jerk of any kind goes unseen. Hips of simulated walks err 9 N m at 50 Hz and
less, said to 5.6 before; chosen at 50 Hz (83 and 81 % held, then 89 and 87), 33 Hz (79, 85) judges."""
VIGOROUS_GROWS, VIGOROUS_S = 5.0, 0.03
"""What a late moment's factor grows by beyond the intensity ``Sizes.vigorous``, in multiples of that, and how long
before and after such a moment it does: smoothing spreads an impact. Runs, hops, side-steps and landings by an
independent truth were 2 to 4 times as far off as said, with an .osim most of all; chosen, with ``Sizes.vigorous``, on
`truth3d`'s seeds 1, 2, a run, a side-step, a jump and one-leg hops (docs/validation/deviations.md)."""
OWN_AT_ENDS = 3.0
"""How many times, and in full, the filter's own variance of smoothed speeds, accelerations and moments counts
`at_the_ends` of a recording. By truth hips of walks with an .osim were 8 to 12 N m off there, said to 4."""
OWN_AT_ONCE: Factors = {
    "coordinates": (1.0, 0.0),
    "speeds": (STILL, 0.4),
    "accelerations": (STILL, 0.4),
    "moments": (0.08, 0.17),
}
"""The same without later frames."""


def movement_intensity(acceleration: Array, sd: Array) -> Array:
    """(...,) mean square of accelerations (..., K) over the filter's own deviations of them, of what moves."""
    moves = sd > 0.0
    ratio = np.divide(acceleration, sd, out=np.zeros_like(sd), where=moves)
    return np.asarray(np.square(ratio).sum(axis=-1) / np.maximum(moves.sum(axis=-1), 1))


def beyond_vigorous(intensity: Array, vigorous: float, step_s: float) -> Array:
    """(...,) how many times ``vigorous`` the largest intensity (...,) of these moments lies beyond it, 0 below."""
    most = np.array(intensity, dtype=float)
    reach = int(VIGOROUS_S / step_s + 1e-6) if most.ndim and step_s > 0.0 else 0
    for k in range(1, reach + 1):
        most[k:] = np.fmax(most[k:], intensity[:-k])
        most[:-k] = np.fmax(most[:-k], intensity[k:])
    return np.maximum(most / vigorous - 1.0, 0.0)


def reported(frames: Frames, sizes: Sizes, parts: Parts, intensity: Array, moved_m: Array) -> Blocks:
    """Standard deviations that are reported: block -> (T, C).

    Args:
        frames: the filter's own part of moments that rest on a prior counts in full, because how a jerk is seen has no
            part in that. parts: variances as of `Systematic.parts`.
        intensity: (T,) as of `movement_intensity`. moved_m: (T,) as of `Systematic.moved_m`.
    """
    apart = float(np.fmax(frames.step_s, STILL_TO_S)) / STILL_TO_S
    by_sizes = {
        "speeds": (STILL, sizes.own_speeds),
        "moments": (min(STILL * apart**2, 1.0), sizes.own_moments),
    }
    factors = OWN_LATE | by_sizes if frames.late else OWN_AT_ONCE
    farther = np.maximum(moved_m / sizes.placed, 1.0)[..., None]
    found = {}
    for block, sd in frames.sd.items():
        still, moving = factors[block]
        factor = still + moving * intensity[..., None]
        if frames.late and block != "coordinates":
            factor = np.where(frames.ends[:, None], OWN_AT_ENDS * np.maximum(factor, 1.0), factor)
        if frames.late and block == "moments":
            factor = factor + VIGOROUS_GROWS * beyond_vigorous(intensity, sizes.vigorous, frames.step_s)[..., None]
        if block == "moments":
            measured = sizes.own_off_plates / frames.variance_scale if frames.late and frames.off_plates else 0.0
            least = np.select([frames.sources == PRIOR, frames.sources == MEASURED], [1.0, measured], 0.0)
            factor = np.maximum(factor, least)
        variance = factor * np.square(sd)
        for kind in KINDS:
            size = getattr(sizes, kind) * (farther if kind in BY_PLACES else 1.0)
            variance = variance + size**2 * parts[kind][block]
        if sizes.inertia:  # the filter's own part has so much of it already
            variance = variance + np.maximum(1.0 - factor * frames.variance_scale, 0.0) * parts["inertia"][block]
        found[block] = np.sqrt(variance)
    return found
