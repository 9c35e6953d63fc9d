"""Markers that move as one: how a group of them turns and moves, and which keep their distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.recordings.recording import Array

_FEWEST = 3


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """Where a shape goes: x -> rotations x + translations. (T, 3, 3), (T, 3) m; misfit_m: (T,) root mean square of the
    distances that are left. NaN in frames with fewer than three of its markers."""

    rotations: Array
    translations: Array
    misfit_m: Array

    def at(self, frames: npt.NDArray[np.bool_]) -> RigidMotion:
        """Only these frames (T,)."""
        return RigidMotion(self.rotations[frames], self.translations[frames], self.misfit_m[frames])


def nearest_rotation(covariance: Array) -> Array:
    """Rotations (..., 3, 3) that turn sources onto targets best, no mirror image, from sum target source^T (..., 3, 3)
    (Soderkvist & Wedin 1993, J Biomech 26:1473-1477)."""
    u, _, vt = np.linalg.svd(covariance)
    u[..., 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    return np.asarray(u @ vt)


def rigid_motion(shape: Array, paths: Array) -> RigidMotion:
    """The rotations and translations by which a shape (K, 3) m fits its markers' paths (T, K, 3) m best, gaps NaN."""
    seen: npt.NDArray[np.bool_] = np.asarray(np.isfinite(paths + shape).all(axis=2))
    count = np.maximum(seen.sum(axis=1), 1)[:, None]
    weight = seen[..., None]
    where, of = np.where(weight, paths, 0.0), np.where(weight, shape, 0.0)
    centre, middle = where.sum(axis=1) / count, of.sum(axis=1) / count
    a, b = (where - centre[:, None]) * weight, (of - middle[:, None]) * weight
    rotations = nearest_rotation(np.swapaxes(a, 1, 2) @ b)
    left = a - b @ np.swapaxes(rotations, 1, 2)
    misfit = np.sqrt((left**2).sum(axis=(1, 2)) / count[:, 0])
    translations = centre - (rotations @ middle[:, :, None])[:, :, 0]
    few = seen.sum(axis=1) < _FEWEST
    rotations[few], translations[few], misfit[few] = np.nan, np.nan, np.nan
    return RigidMotion(rotations, translations, misfit)


def distance_sd_m(a: Array, b: Array) -> float:
    """Standard deviation (m) of the distance between two paths (T, 3) m; infinite where they are never seen together
    for long."""
    apart = np.linalg.norm(a - b, axis=1)
    apart = apart[np.isfinite(apart)]
    return float(apart.std()) if len(apart) >= _FEWEST else np.inf
