"""Does a low-pass of the plates take away what the feet did to them?"""

from __future__ import annotations

import numpy as np

from dynakin.messages import Message, warning
from dynakin.recordings.plates.pressure import JUDGED_N
from dynakin.recordings.recording import Recording

TAKEN_AWAY = 0.06
"""Part of a plate's mean load, RMS, by which a filter may change it. At 6 Hz it is 1 to 5 % of walks and squats, at 3
Hz 6 to 14 % of walks, whose moments are then up to 27 N m off; impacts of a drop jump lose 10 % even at 10 Hz."""
_LEAST = 10  # loaded frames


def cuts_into_loads(raw: Recording, filtered: Recording, cutoff_hz: float) -> Message | None:
    """A warning where plates that were low-passed differ from what they were by more than noise."""
    worst, name = 0.0, ""
    for before, after in zip(raw.plates, filtered.plates, strict=True):
        up = int(np.argmax(np.nansum(np.abs(before.force), axis=0)))
        push = np.abs(before.force[:, up])
        loaded = (push > JUDGED_N) & np.isfinite(after.force).all(axis=1)
        if np.count_nonzero(loaded) < _LEAST:
            continue
        change = np.linalg.norm(after.force[loaded] - before.force[loaded], axis=1)
        part = float(np.sqrt(np.mean(change**2)) / push[loaded].mean())
        if part > worst:
            worst, name = part, before.name
    if worst <= TAKEN_AWAY:
        return None
    return warning(
        "plates",
        f"the low-pass at {cutoff_hz:g} Hz (plate_filter_hz) takes {100.0 * worst:.0f} % of {name}'s load away or "
        f"smears it (RMS, expected at most {100.0 * TAKEN_AWAY:.0f} %): moments are off by more than their standard "
        "deviations. Leave it out, or give a higher frequency.",
    )
