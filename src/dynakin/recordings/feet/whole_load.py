"""Where the plates alone bear the person: what they carry then is what they carry of who stands on nothing else.

A foot that is held still, its toes near the floor, looks like one that stands beside the plates. What it would bear,
these lack.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.recording import Array
from dynakin.units import GRAVITY_M_S2

Flags = npt.NDArray[np.bool_]

LACKS = 0.03
"""Part of the weight that plates may lack under a foot that bears nothing; the part of a movement is taken off by how
fast the markers rise. Pirouettes, a throw and a kick (simulated, one seed), which chose, lack -0.02 to 0.02; of others
a foot that hovers in `functional` 0.00 to 0.04, steps off the plates (12, real and simulated) 0.35 to 1."""
SHOWN_S, LEAST_S = 0.5, 0.2
"""How long the plates must bear the person for their load to be the weight, and a foot must rest for it to be judged:
the markers' rise is known to some cm/s."""


def plates_bear_all(plates: Sequence[GroundPlate], on: Flags, off: Flags, rises: Array, rate: float) -> Flags:
    """Those of the frames (T,) in which a foot seems to stand off the plates through whose run these carry as much, in
    every half second, as in any in which none does.

    Args:
        on: (T, F, P) this foot stands on this plate: what is nobody's may be the foot's that seems to stand beside.
        off: (T, F) feet that seem to stand off the plates. rises: (T,) m/s upwards, of the body.
    """
    found = np.zeros(len(off), dtype=bool)
    known: Flags = np.asarray(np.all([plate.known for plate in plates], axis=0) & np.isfinite(rises))
    if not np.isfinite(rate) or not round(LEAST_S * rate) > 1:
        return found
    push = (np.stack([plate.push for plate in plates], axis=1) * on.any(axis=1)).sum(axis=1)
    window = round(SHOWN_S * rate)

    def steady(first: int, end: int) -> list[float]:
        """What the plates would carry of who does not rise or fall, N on average over each half second, or all."""
        loads = []
        for at in range(first, max(end - window, first) + 1, max(window // 5, 1)):
            to = min(at + window, end)
            gains = (rises[to - 1] - rises[at]) * rate / (to - 1 - at) / GRAVITY_M_S2
            loads.append(float(push[at:to].mean() / max(1.0 + gains, 0.5)))
        return loads

    alone = [load for a, b in runs(known & ~off.any(axis=1)) if b - a >= window for load in steady(a, b)]
    weight = max(alone, default=np.inf)
    for first, end in runs(np.asarray(off.any(axis=1))):
        start = first if end < len(off) else min(first, max(0, end - round(LEAST_S * rate)))  # it may just set down
        if end - start >= LEAST_S * rate and known[start:end].all():
            loads = steady(start, end)
            found[first:end] = min(loads) > (1.0 - LACKS) * weight
    return found
