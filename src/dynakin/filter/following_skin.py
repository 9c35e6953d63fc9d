"""Skin that follows the joints: what of its displacement a first pass shows, taken off the markers of the next.

The filter's displacements of skin and flesh fade (Gauss-Markov); what follows a joint's angle does not, so that the
filter puts part of it into the posture, above all into knees that bend deeply. Displacement = coefficient x angle with
a prior on the coefficients (Bonnet et al. 2017), fitted to the displacements of the first pass and known in the next
([derivations](derivations.md), section 18).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.noise import soft_tissue_time_s
from dynakin.filter.tracker import Tracker
from dynakin.filter.uncertainty.upright import drives, followed
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_coordinates
from dynakin.recordings.times import step_of
from dynakin.results.records import FOLLOWING
from dynakin.settings.noise import Noise


@dataclass(frozen=True)
class FollowingSkin:
    """Displacements of a recording's T frames.

    Attributes:
        model: of the filter. segment: (M,) place of each marker's segment. columns: (M, 3) of the filter's own
            displacements in the state, -1 where it has none.
        local_m: (T, M, 3) in the axes of the marker's segment. shift_m: (T, M, 3) the same in the ground's.
    """

    model: _core.Model
    segment: npt.NDArray[np.intp]
    columns: npt.NDArray[np.intp]
    local_m: Array
    shift_m: Array

    def put_back(self, arrays: dict[str, Array]) -> dict[str, Array]:
        """Arrays of a run over markers less `shift_m`, as if over the markers themselves: displacements and markers are
        whole, innovations and deviations as they were."""
        state = arrays["state"].copy()
        moves = self.columns >= 0
        state[:, self.columns[moves]] += self.local_m[:, moves]
        estimated = arrays["markers_estimated"] + _turned(self.model, state, self.segment, self.local_m)
        return arrays | {
            "state": state,
            "markers_estimated": estimated,
            "markers_predicted": arrays["markers_predicted"] + self.shift_m,
        }


def may_follow(calibrated: CalibratedModel, noise: Noise) -> bool:
    """Whether there are displacements of skin, and what follows the joints of them is wanted."""
    skin = any(name.startswith("soft_tissue/") for name in calibrated.names)
    return bool(noise.following_skin_fraction and calibrated.feet and skin)


def following_skin(tracker: Tracker, arrays: dict[str, Array], time: Array) -> FollowingSkin | None:
    """What follows the joints of the displacements that a run found; None where there are none or none is wanted.

    Angles are taken about their means over the recording: what skin is displaced by on average is in the markers'
    places.

    Args:
        tracker: of that run. arrays: of it, as `Tracker.run_arrays` gives them. time: (T,) s.
    """
    calibrated, noise, model = tracker.calibrated, tracker.noise, tracker.core_model
    spec = calibrated.spec
    place = {name: k for k, name in enumerate(model.layout.names)}
    columns = np.array([[place.get(f"soft_tissue/{m.name}/{a}", -1) for a in "xyz"] for m in spec.markers])
    used = (arrays["tracking"] == FOLLOWING) & np.isfinite(arrays["state"]).all(axis=1)
    if not (may_follow(calibrated, noise) and used.sum() > 1):
        return None
    names = [segment.name for segment in spec.segments]
    segment = np.array([names.index(marker.segment) for marker in spec.markers])
    free = np.array(free_coordinates(spec))
    followed_by = followed(arrays["state"][:, : len(free)], calibrated)
    followed_by = np.nan_to_num(followed_by - followed_by[used].mean(axis=0))
    # the filter's displacements: independent every two time constants
    step_s = step_of(time)
    independent = 2.0 * soft_tissue_time_s(noise, calibrated) / step_s
    ridge = independent * (noise.soft_tissue_sd_fraction / noise.following_skin_fraction) ** 2
    local = np.zeros((len(time), *columns.shape))
    for k, chosen in enumerate(drives(spec, free).astype(bool)):
        markers = (segment == k)[:, None] & (columns >= 0)
        if not (chosen.any() and markers.any()):
            continue
        phi = followed_by[:, chosen]
        found = arrays["state"][:, columns[markers]][used]
        normal = phi[used].T @ phi[used] + ridge * np.eye(phi.shape[1])
        local[:, markers] = phi @ cho_solve(cho_factor(normal), phi[used].T @ (found - found.mean(axis=0)))
    shift = np.nan_to_num(_turned(model, arrays["state"], segment, local))
    return FollowingSkin(model, segment, columns, local, shift)


def _turned(model: _core.Model, state: Array, segment: npt.NDArray[np.intp], local: Array) -> Array:
    """(T, M, 3) of the markers' segments' axes to the ground's."""
    R = np.asarray(_core.whole_body(model, np.ascontiguousarray(state))["orientations"])[:, segment]
    return np.asarray(np.einsum("tmij,tmj->tmi", R, local))
