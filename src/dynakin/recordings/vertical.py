"""Which axis of the laboratory points up."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dynakin.errors import ConfigError, RecordingError
from dynakin.recordings.landmarks import FacingPairs, mean_position, present_pairs
from dynakin.recordings.recording import Array, Recording

AXES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")
_MIN_SHARE = 0.8  # how much of a direction an axis must hold to be taken for it (37 deg)


def axis_vector(axis: str) -> Array:
    """Unit vector (3,) of "+X", "-Y", ... ("Z" alone is "+Z").

    Raises:
        ConfigError: no such axis.
    """
    word = axis.strip().upper()
    word = word if word[:1] in "+-" else "+" + word
    if word not in AXES:
        raise ConfigError(f"found axis {axis!r}, expected one of {', '.join(AXES)}")
    vector = np.zeros(3)
    vector["XYZ".index(word[1])] = 1.0 if word[0] == "+" else -1.0
    return vector


def find_vertical(recording: Recording, pairs: FacingPairs) -> tuple[str, list[str]]:
    """The laboratory axis that points up, and sentences on how it was found.

    Witnesses, the first that speaks decides and the others are heard: the body itself (pelvis above heels),
    the plates (they push upwards), the longer side of the markers' box (an axis without its sign), what the
    file says of its screen (can be wrong: it is often left over from another laboratory).

    Raises:
        RecordingError: no witness.
    """
    witnesses: list[tuple[str, Callable[[], str | None]]] = [
        ("the pelvis above the feet", lambda: _from_body(recording, pairs)),
        ("the plates' force", lambda: _from_plates(recording)),
        ("the longer side of the markers' box", lambda: _from_spread(recording)),
        ("the file's Y_SCREEN", lambda: _from_screen(recording)),
    ]
    found = [(why, axis) for why, witness in witnesses if (axis := witness())]
    if not found:
        where = recording.path or recording.name
        raise RecordingError(f"{where}: vertical axis not found, expected it to be given")
    why, vertical = found[0]
    agree = [other for other, axis in found[1:] if axis == vertical]
    how = [f"Vertical {vertical}: {why}" + (f"; so say {', '.join(agree)}." if agree else ".")]
    for other, axis in found:
        if axis != vertical:
            how.append(f"Vertical: {other} says {axis}, not {vertical}; not followed.")
    return vertical, how


def _name(direction: Array) -> str | None:
    """The axis nearest to a direction, None where none is near."""
    length = float(np.linalg.norm(direction))
    if not np.isfinite(length) or length < 1e-9:
        return None
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) < _MIN_SHARE * length:
        return None
    return ("+" if direction[k] > 0 else "-") + "XYZ"[k]


def _from_body(recording: Recording, pairs: FacingPairs) -> str | None:
    everything = slice(None)
    feet = [name for pair in present_pairs(recording, pairs.heel_toe) for name in pair]
    pelvis = [name for pair in present_pairs(recording, pairs.pelvis) for name in pair]
    low, high = (mean_position(recording, names, everything) for names in (feet, pelvis))
    return None if low is None or high is None else _name(high - low)


def _from_plates(recording: Recording) -> str | None:
    if not recording.plates:
        return None
    force = np.sum([plate.force for plate in recording.plates], axis=0)
    force = force[np.isfinite(force).all(axis=1)]
    return _name(force.mean(axis=0)) if len(force) and np.abs(force).max() > 50 else None


def _from_spread(recording: Recording) -> str | None:
    """The axis along which the markers of one frame span most (median over frames), if it is clearly the
    longest.

    Its sign: the markers lie on the positive side of the laboratory's floor.
    """
    seen = np.isfinite(recording.markers).any(axis=(1, 2)) if recording.marker_names else np.array([False])
    if not seen.any():
        return None
    markers = recording.markers[seen]
    span = np.median(np.nanmax(markers, axis=1) - np.nanmin(markers, axis=1), axis=0)
    k = int(np.argmax(span))
    if span[k] < max(0.5, 1.3 * np.sort(span)[1]):
        return None
    return ("+" if np.nanmedian(markers[:, :, k]) > 0 else "-") + "XYZ"[k]


def _from_screen(recording: Recording) -> str | None:
    word = recording.hints.get("Y_SCREEN", "").strip().upper()
    word = word if word[:1] in ("+", "-") else "+" + word
    return word if word in AXES else None
