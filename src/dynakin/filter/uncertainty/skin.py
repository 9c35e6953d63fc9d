"""Skin that follows the joints: what it does to what is estimated, and how much of it a recording shows."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.uncertainty.frames import Frame, differences
from dynakin.filter.uncertainty.geometry import Geometry, Parts
from dynakin.filter.uncertainty.upright import drives, floats, followed
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.joint_motion import SKIN_ANGLE_RAD
from dynakin.model.spec import free_coordinates
from dynakin.model.state_priors import COMMON_SKIN
from dynakin.results.records import FOLLOWING

ROOT_SKIN = 4.0
"""Times as much skin as elsewhere counts on the segment that floats (the pelvis): what its markers do together no other
segment contradicts. By `truth3d` its rotation was said to a third of its error (0.18 of 0.53 deg in walks)."""
WANDERS = 0.15
"""Part of the declared size by which skin is displaced whatever its joints do: of somebody who stands, that is all that
is found."""


class Skin:
    """Kind "skin": in all frames the same part of what a marker is displaced by with its segment's joints."""

    def __init__(self, geometry: Geometry, calibrated: CalibratedModel) -> None:
        self._geometry, spec = geometry, calibrated.spec
        on_root = np.array([floats(spec.segments[k]) for k in geometry.segment], dtype=bool)
        self._declared = np.repeat(np.where(on_root, ROOT_SKIN, 1.0) * calibrated.soft_tissue_m, 3)
        members = np.equal.outer(geometry.segment, np.arange(len(spec.segments))).astype(float)
        self._members = np.kron(members, np.eye(3))
        self._drives = drives(spec, geometry.free)

    def variances(self, frame: Frame) -> Parts:
        """Of angles, speeds, accelerations and moments, in one frame."""
        q, qd, qdd = frame.motion
        Tq, Tv, Ta = frame.moments_by_motion
        s = np.tanh((q - self._geometry.reference) / SKIN_ANGLE_RAD)
        slope = (1.0 - s * s) / SKIN_ANGLE_RAD
        rates = np.array([s, slope * qd, slope * qdd - 2.0 * s * slope / SKIN_ANGLE_RAD * qd * qd])  # (3, K)
        products = (rates[:, None] * rates[None]) @ self._drives.T  # (3, 3, segments)
        segment = self._geometry.segment
        weights = np.repeat(np.concatenate([products[:, :, segment], products], axis=-1), 3, axis=-1)
        gains = differences([gain for _, gain, _ in frame.around])
        G, Gd, Gdd = (self._displaced(values) for values in gains)
        T0, T1, T2 = Tq @ G + Tv @ Gd + Ta @ Gdd, Tv @ G + 2.0 * Ta @ Gd, Ta @ G
        found = []
        for by_rate in ((G,), (Gd, G), (Gdd, 2.0 * Gd, G), (T0, T1, T2)):  # what goes with skin, its speed, ...
            pairs = [(a, b) for a in range(len(by_rate)) for b in range(len(by_rate))]
            found.append(sum((by_rate[a] * by_rate[b] @ weights[a, b] for a, b in pairs), np.zeros(1)))
        return {"skin": self._geometry.blocks(*found)}

    def _displaced(self, values: Array) -> Array:
        """(., 3 M + 3 S): effects of each marker's own share of the displacement and of each segment's common one."""
        own = values * self._declared
        return np.hstack([np.sqrt(1.0 - COMMON_SKIN) * own, np.sqrt(COMMON_SKIN) * own @ self._members])


def skin_found(calibrated: CalibratedModel, arrays: dict[str, Array]) -> float:
    """How far skin was displaced of what is declared for joints that turn as theirs did: root of the ratio of sums of
    squares, of displacements about their means over the declared sizes times `followed` about its mean. Of the bone's
    own motion, which markers that move together hide, as much is to be expected: what is common to them and what is not
    are the same skin. 0 where there are no displacements.

    Args:
        calibrated: with the states that the filter has. arrays: as `Tracker.run_arrays` gives them.
    """
    spec = calibrated.spec
    place = {name: k for k, name in enumerate(calibrated.names)}
    used = (arrays["tracking"] == FOLLOWING) & np.isfinite(arrays["state"]).all(axis=1)
    state = arrays["state"][used]
    if len(state) < 2:
        return 0.0
    free = np.array(free_coordinates(spec))
    turned = drives(spec, free) @ followed(state[:, : len(free)], calibrated).var(axis=0)
    names = [segment.name for segment in spec.segments]
    found = usual = 0.0
    for marker, declared in zip(spec.markers, calibrated.soft_tissue_m, strict=True):
        columns = [place[n] for n in (f"soft_tissue/{marker.name}/{axis}" for axis in "xyz") if n in place]
        found += state[:, columns].var(axis=0).sum()
        usual += len(columns) * declared**2 * (turned[names.index(marker.segment)] + WANDERS**2)
    return float(np.sqrt(found / usual)) if usual else 0.0
