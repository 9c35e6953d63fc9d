"""Skin that follows the joints: how much of it a recording shows."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.filter.uncertainty.upright import drives, followed
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_coordinates
from dynakin.results.records import FOLLOWING

Array = npt.NDArray[np.float64]

WANDERS = 0.15
"""Part of the declared size by which skin is displaced whatever its joints do: of somebody who stands, that is all that
is found."""


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
