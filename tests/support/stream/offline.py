"""The offline run over the samples that a live session had."""

from __future__ import annotations

import numpy as np

from dynakin.stream.session import Live


def offline_states(
    live: Live, time: np.ndarray, names: tuple[str, ...], markers: np.ndarray, wrench: np.ndarray
) -> np.ndarray:
    """States (T, n) from the model as the session measured it.

    Args:
        markers: (T, M, 3) m. wrench: (T, 6), all plates together; both laboratory frame.
    """
    initial, offline = live.estimator.initial, live.estimator.again()
    assert initial is not None
    offline.start_from(initial)
    order = [names.index(name) for name in initial.recorded_markers]
    arrays = offline.run_arrays(
        time, initial.ground.points_to_ground(markers[:, order]), initial.ground.wrench_to_ground(wrench)
    )
    return np.asarray(arrays["state"])
