"""Do plates press where the estimated movement needs them to?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynakin.arrays import Array, filled
from dynakin.bindings import _core
from dynakin.filter.ground.carried import says_carried
from dynakin.filter.ground.ground import Ground
from dynakin.filter.uncertainty.mass_centres import unseen_limbs
from dynakin.messages import Message, about, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.results.naming import listed
from dynakin.settings.contacts import SEAT
from dynakin.units import GRAVITY_M_S2

OFF_PLACE_M, OFF_PLACE_S = 0.03, 0.15
"""How far, over so long at least, the estimated movement may have the force from where the plates do: 3 to 19 mm in 11
real recordings of a whole body, each plate alone, 18 and less in simulated ones. Of an error the movement, which is
bent by it, shows half to all."""
OFF_UNSEEN_M = 0.1
"""So much more by the part of the mass that no marker shows: at 0.38 of it 12 to 57 mm, at 0.07 up to 24. Arms that
no marker shows may be stretched out all the time."""
STEADIED_M = 0.03
"""So much more where a declared contact bears nothing that shows: `STATED` of the weight, a metre up."""
BEARS = 0.3
"""Part of the weight from which the plates' load shows where it acts."""


def off_place(
    ground: Ground, initial: CalibratedModel, model: _core.Model, states: Array, measured: Array, names: Sequence[str]
) -> Message | None:
    """A warning where the plates' sum presses beside where the estimated movement needs it, None where it does not: all
    of them, or one while it bears alone (opposite errors leave no sum).

    The movement is that of the inertia before the first frame: the estimated one makes up for plates off their place.

    Args:
        states: (T, n). measured: (T, 6) total wrench by the plates. names: of the plates.
    """
    loads, weight = ground.loads, initial.weighed_kg * GRAVITY_M_S2
    if loads is None or not names or about(ground.notes, "rate") or says_carried(ground.notes):
        return None
    limbs = sum(sum(limb.values()) for limb in unseen_limbs(initial))
    limit = OFF_PLACE_M + (OFF_UNSEEN_M * initial.unseen_kg + limbs) / initial.weighed_kg
    limit += STEADIED_M * any(name != SEAT and name not in loads.others for name in initial.contacts)
    inertia = [k for k, name in enumerate(initial.names) if name.startswith("inertia/")]
    posed = states.copy()
    posed[:, inertia] = initial.x0[inertia]
    apart = np.full((len(measured), 2), np.nan)
    known = np.isfinite(states).all(axis=1) & np.isfinite(measured).all(axis=1)
    for k in np.flatnonzero(known & (measured[:, 1] > BEARS * weight)):
        needed = _core.wrench(model, posed[k])
        if needed[1] > BEARS * weight:
            apart[k] = np.subtract(*pressed_at(np.stack([measured[k], needed])))
    bears = np.isfinite(apart).all(axis=1)
    alone = bears & (loads.on.any(axis=1).sum(axis=1) == 1)
    for own in loads.others.values():
        alone &= ~filled(own).any(axis=1)
    cases = {names[p]: alone & loads.on[:, :, p].any(axis=1) for p in range(len(names))}
    whole = "the plates together" if len(names) > 1 else names[0]
    by_name = {name: _apart(apart[own], loads.soles.rate, limit) for name, own in {whole: bears, **cases}.items()}
    found = {name: by for name, by in by_name.items() if by is not None}
    if not found:
        return None
    if whole in found:
        found = {whole: found[whole]}
    said = [f"{name} by {np.hypot(*by):.2f} m (X {by[0]:+z.2f}, Z {by[1]:+z.2f})" for name, by in found.items()]
    return warning(
        "place",
        f"by the movement the force does not act where the plates have it: {listed(said)}, ground frame, expected "
        f"within {limit:.2f} m. Either the plates lie elsewhere than the file says (corners, origin, centres of "
        "pressure), or something else steadies the person.",
    )


def _apart(apart: Array, rate: float, limit: float) -> tuple[float, float] | None:
    """Mean or median of distances (K, 2) m, the smaller one, where they are many and it is far: a mean leaves nothing
    of the angular momentum that the model lacks, a median nothing of impacts."""
    if not len(apart) >= max(OFF_PLACE_S * rate, 1.0):  # a rate that is NaN, too
        return None
    x, z = min(apart.mean(axis=0), np.median(apart, axis=0), key=np.linalg.norm)
    return (float(x), float(z)) if np.hypot(x, z) > limit else None
