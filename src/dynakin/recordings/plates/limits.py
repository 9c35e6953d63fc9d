"""What no foot does to a plate: shear beyond friction, a pressure far from the plate, a twist beyond friction's.

A channel with a wrong scale or unit shows here: everything else of such a plate may look right.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Plate, Recording

FRICTION = 1.5
"""Horizontal over vertical force. Shoes on force plates hold up to about 1, spikes to 1.2; our recordings, drop jumps
and running among them, stay below 0.8, walking below 0.5."""
TWIST_M = 0.25
"""Free moment over vertical force: what friction does at an arm of 0.17 m, more than half a foot. Ours stay below
0.03."""
BEYOND_EDGES_M = 0.30
"""A centre of pressure beyond the plate's edges by more than the plate's own error."""
FAR_M = 1.0
"""A centre of pressure away from every marker, level distance, where the plate's edges are not known."""
LASTING = 0.1
"""Part of a plate's load, newton seconds, above the limit: at heel strike and toe-off the load is small, so that a few
frames of an impact do not count for much."""
_AXES = ("x", "y", "z")


def beyond_limits(plate: Plate, recording: Recording, ground: GroundFrame) -> str | None:
    """Why a plate is refused that is beyond a limit for a lasting part of its load, with component and factor.

    All frames count, not only those in which somebody stands. One reason is given: a wrong force moves the centre of
    pressure, a wrong centre of pressure changes the free moment.
    """
    force = ground.vectors_to_ground(plate.force)
    load = np.where(np.nan_to_num(force[:, 1]) > JUDGED_N, force[:, 1], 0.0)
    loaded = load > 0.0
    if not loaded.any():
        return None
    up = np.abs(ground.rotation[1])

    def worst(vectors: Array, level: bool) -> str:
        """Laboratory's axis along which vectors (T, 3) are largest, of the level ones or of all."""
        size = np.median(np.abs(np.nan_to_num(vectors[loaded])), axis=0)
        return _AXES[int(np.argmax(np.where((up > 0.5) & level, -1.0, size)))]

    def beyond_friction(size: Array, limit: float) -> tuple[npt.NDArray[np.bool_], Array] | None:
        """Loaded frames in which ``size`` (T,) over the load is above a limit, and the ratio; None: not for long."""
        over = np.divide(size, load, out=np.zeros(len(load)), where=loaded)
        frames = loaded & (over > limit)
        return (frames, over[frames]) if _lasts(frames, load) else None

    if found := beyond_friction(np.hypot(force[:, 0], force[:, 2]), FRICTION):
        frames, over = found
        axis = worst(plate.force, True)
        return (
            f"{plate.name}: the horizontal force, mostly its {axis} component, is {_times(over)} times the "
            f"vertical one in {_share(frames, loaded)} of the loaded frames, expected at most {FRICTION:g} (friction "
            f"holds no more): wrong unit or scale of F{axis}?"
        )
    away, limit, what = _distance(plate, recording, ground)
    away = np.where(loaded, np.nan_to_num(away, posinf=0.0), 0.0)  # no marker in sight: nothing to say
    if _lasts(away > limit, load):
        frames = loaded & (away > limit)
        return (
            f"{plate.name}: the centre of pressure lies {float(np.median(away[frames])):.3g} m beyond {what} in "
            f"{_share(frames, loaded)} of the loaded frames, expected at most {limit:g} m: wrong unit or scale of a "
            "moment, or of the plate's place?"
        )
    twist = np.linalg.norm(np.nan_to_num(plate.free_moment), axis=1)
    if found := beyond_friction(twist, TWIST_M):
        frames, over = found
        axis = worst(plate.free_moment, False)
        return (
            f"{plate.name}: the free moment, mostly its {axis} component, is {float(np.median(twist[frames])):.3g} N m "
            f"in {_share(frames, loaded)} of the loaded frames, {_times(over / TWIST_M)} times what friction "
            f"can do there: wrong unit or scale of M{axis}?"
        )
    return None


def _lasts(beyond: npt.NDArray[np.bool_], load: Array) -> bool:
    return float(load[beyond].sum()) > LASTING * float(load.sum())


def _times(factors: Array) -> str:
    return f"{float(np.median(factors)):.2g}" if np.median(factors) < 100.0 else f"{float(np.median(factors)):.0f}"


def _share(frames: npt.NDArray[np.bool_], loaded: npt.NDArray[np.bool_]) -> str:
    return f"{100.0 * frames.sum() / loaded.sum():.0f} %"


def _distance(plate: Plate, recording: Recording, ground: GroundFrame) -> tuple[Array, float, str]:
    """Level distance (T,) m of the centre of pressure from the plate, or from the nearest marker; the limit; words."""
    cop = ground.points_to_ground(plate.cop)[:, [0, 2]]
    if plate.corners is not None:
        corners = ground.points_to_ground(plate.corners)[:, [0, 2]]
        return distance_to_hull(cop, corners), BEYOND_EDGES_M, "the plate's edges"
    if not recording.marker_names:
        return np.zeros(len(cop)), FAR_M, ""
    markers = ground.points_to_ground(recording.markers)[..., [0, 2]]
    away = np.linalg.norm(markers - cop[:, None], axis=2)
    return np.min(np.where(np.isfinite(away), away, np.inf), axis=1), FAR_M, "the nearest marker"
