"""Joint centres and other landmarks at every frame, by the recipes of the marker set."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.frames import Trial
from dynakin.model.calibration.landmarks import SIDES, LandmarkFinder
from dynakin.model.definition import ModelDefinition
from dynakin.model.markers.marker_set import choose_marker_set, match_markers
from dynakin.recordings.recording import Recording

Array = npt.NDArray[np.float64]


def landmark_paths(recording: Recording, initial: CalibratedModel, definition: ModelDefinition) -> dict[str, Array]:
    """Every landmark (T, 3) m in the ground frame of ``initial`` (z = 0 in a planar model), NaN where one of its
    markers is missing.

    The limb markers are those of the side that the model was measured with. For "both" a landmark is the middle of
    the two sides wherever both are known in the recording, and NaN where one is lost for a while: the mean of one
    side would be a jump.

    Args:
        definition: the model that ``initial`` was measured from (it holds the marker set and the sex of the subject).

    Raises:
        ModelError: the recording's markers fit no marker set.
    """
    marker_set = definition.marker_set or choose_marker_set(recording.marker_names)
    seen = [bool(np.isfinite(recording.marker(name)).all(axis=1).any()) for name in recording.marker_names]
    match = match_markers(marker_set, recording.marker_names, seen, str(recording.path or recording.name))
    trial = Trial.of(recording, match, initial.ground)
    sides = SIDES if initial.side == "both" else (initial.side,)
    finders = [
        LandmarkFinder(match, side, definition.subject.sex, initial.measured_plan().model.planar) for side in sides
    ]
    each = [_one_side(finder, trial) for finder in finders]
    names = dict.fromkeys(name for paths in each for name in paths)
    return {name: np.mean([paths[name] for paths in each if name in paths], axis=0) for name in names}


def _one_side(finder: LandmarkFinder, trial: Trial) -> dict[str, Array]:
    names = [name for name in finder.match.marker_set.landmarks if finder.known(name)]
    paths = {name: np.full((trial.recording.n_frames, 3), np.nan) for name in names}
    for frame in range(trial.recording.n_frames):
        for name, point in finder.find({key: path[frame] for key, path in trial.paths.items()}).items():
            paths[name][frame] = point
    return paths
