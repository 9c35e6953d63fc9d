"""Whether the laboratory's axes are right-handed, by a body whose left and right, front and back are named.

A frame with one axis negated (or all three) shows a person in a mirror. Turned in any way, walking backwards or lying
down, a body stays what it is: forward, up and right of one's own are a right-handed frame.
"""

from __future__ import annotations

import numpy as np

from dynakin.errors import RecordingError
from dynakin.recordings.landmarks import plain_name
from dynakin.recordings.recording import Array, Recording

_HEEL = ("hee", "heel", "calc", "cal", "calcaneus")
_TOE = ("toe", "toetip", "tt2", "mt2", "bigtoe", "mt5", "5meta", "mfh5", "mfh1")
_FRONT = ("asi", "asis", "ias")
_BACK = ("psi", "psis", "ips")
_SACRUM = ("sacr", "sacrum", "vsacral", "s2")
_SURE = 0.3
"""Sine of the angle that the three directions span, below which they say nothing: feet in line, or crossed."""


def refuse_mirrored(recording: Recording, up: Array, vertical: str) -> None:
    """Refuse a recording in which pelvis and feet, as far as their markers are named, are all seen in a mirror.

    Args:
        up: (3,) unit vector, taken where the pelvis or the feet are not named; vertical: its axis ("+Y").

    Raises:
        RecordingError: says which axis looks negated, or that left and right may be exchanged.
    """
    found = {what: value for what, value in _witnesses(recording, up).items() if abs(value) > _SURE}
    if not found or max(found.values()) > 0.0:
        return
    if vertical.startswith("-"):
        looks = (
            f"the body points along {vertical}, so the laboratory's {vertical[1].lower()} axis looks negated (or all "
            "three are)"
        )
    else:
        level = " or ".join(axis for axis in "xyz" if axis != vertical[1].lower())
        looks = f"one level axis of the laboratory looks negated ({level}), or all names of left and right exchanged"
    raise RecordingError(
        f"{recording.path or recording.name}: the person is seen in a mirror: by the {' and the '.join(found)}, what "
        f"is named left lies on the right; {looks}, expected a right-handed frame"
    )


def _witnesses(recording: Recording, up: Array) -> dict[str, float]:
    """Median over the frames of the volume that the unit vectors forward, up and right span: near 1, or -1 mirrored."""
    roles = {
        (role, side): [name for name in recording.marker_names if _is(name, side, words)]
        for role, words in (("heel", _HEEL), ("toe", _TOE), ("front", _FRONT), ("back", _BACK))
        for side in "rl"
    }
    sacrum = [name for name in recording.marker_names if plain_name(name) in _SACRUM]
    place = {
        key: _mean(recording, names or (sacrum if key[0] == "back" else [])) for key, names in roles.items()
    }  # fmt: skip
    pelvis = [place[role, side] for role in ("front", "back") for side in "rl"]
    feet = [place[role, side] for role in ("heel", "toe") for side in "rl"]
    own_up = np.broadcast_to(up, (recording.n_frames, 3))
    if all(np.isfinite(p).all(axis=1).any() for p in (*pelvis, *feet)):
        own_up = _middle(pelvis) - _middle(feet)
    right = {
        "pelvis": place["front", "r"] - place["front", "l"],
        "feet": _middle([place["heel", "r"], place["toe", "r"]]) - _middle([place["heel", "l"], place["toe", "l"]]),
    }
    ahead = {
        "pelvis": _middle(pelvis[:2]) - _middle(pelvis[2:]),
        "feet": _middle(feet[2:]) - _middle(feet[:2]),
    }
    spanned = {what: _volume(ahead[what], own_up, right[what]) for what in ahead}
    return {what: value for what, value in spanned.items() if value is not None}


def _is(name: str, side: str, stems: tuple[str, ...]) -> bool:
    """Whether a marker's name is one of these with a side before or after it."""
    plain = plain_name(name)
    words = {"r": ("r", "right"), "l": ("l", "left")}[side]
    return any(plain in (f"{word}{stem}", f"{stem}{word}") for word in words for stem in stems)


def _mean(recording: Recording, names: list[str]) -> Array:
    """Mean (T, 3) m of some markers, NaN in frames in which one of them is not seen."""
    if not names:
        return np.full((recording.n_frames, 3), np.nan)
    return np.asarray(np.mean([recording.marker(name) for name in names], axis=0))


def _middle(places: list[Array]) -> Array:
    return np.asarray(np.mean(places, axis=0))


def _volume(ahead: Array, up: Array, right: Array) -> float | None:
    axes = np.stack([ahead, up, right], axis=1)
    axes = axes[np.isfinite(axes).all(axis=(1, 2))]
    if not len(axes):
        return None
    with np.errstate(invalid="ignore"):
        axes = axes / np.linalg.norm(axes, axis=2, keepdims=True)
    volumes = np.linalg.det(axes)
    return float(np.median(volumes[np.isfinite(volumes)])) if np.isfinite(volumes).any() else None
