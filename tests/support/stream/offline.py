"""The offline run over the samples that a live session had."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynakin.filter.contacts import ContactLoads
from dynakin.filter.live.feet import LiveFeet
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import Sample
from dynakin.stream.session import Live


def offline_states(
    live: Live, time: np.ndarray, names: tuple[str, ...], markers: np.ndarray, wrench: np.ndarray
) -> np.ndarray:
    """States (T, n) from the model as the session measured it.

    Args:
        markers: (T, M, 3) m. wrench: (T, 6), all plates together, or of a whole body (T, P, 6); laboratory frame.
    """
    offline = live.tracker.fresh()
    initial = offline.calibrated
    order = [names.index(name) for name in initial.recorded_markers]
    feet = seen_live(live, time, names, markers, wrench) if wrench.ndim == 3 else None
    total = wrench.sum(axis=1) if wrench.ndim == 3 else wrench
    ground = initial.ground
    arrays = offline.run_arrays(
        Measurements(time, ground.points_to_ground(markers[:, order]), ground.wrench_to_ground(total), feet)
    )
    return np.asarray(arrays["state"])


def seen_live(
    live: Live, time: np.ndarray, names: tuple[str, ...], markers: np.ndarray, wrenches: np.ndarray
) -> ContactLoads:
    """What a session knows of the contacts, frame by frame: it looks at them from its own state before each step."""
    tracker = live.tracker.fresh()
    plates = tuple(f"plate {p + 1}" for p in range(wrenches.shape[1]))
    looking = LiveFeet(tracker.calibrated, live.estimator.noise, plates, live.estimator.plates)
    found: list[ContactLoads] = []
    for k, now in enumerate(time):
        loads = looking.look(tracker.core_model, tracker.state, float(now), wrenches[k])
        tracker.step(Sample(float(now), dict(zip(names, markers[k], strict=True))), loads)
        found.append(loads)
    arrays = [name for name, values in vars(found[0]).items() if isinstance(values, np.ndarray)]
    return replace(found[0], **{name: np.concatenate([getattr(one, name) for one in found]) for name in arrays})
