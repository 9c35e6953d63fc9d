"""Where forward is in a laboratory, its axes by name, and whether they are right-handed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynakin.arrays import Array, mean_seen
from dynakin.errors import ConfigError, RecordingError
from dynakin.recordings.landmarks import FacingPairs, mean_position, plain_name, present_pairs
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window

FACING_WINDOW_S = 1.0
WALKS_M = 0.7
"""Horizontal way of the markers' mean from which the person is said to walk (a squat moves it by 0.3 m at
most)."""
_MAX_DISAGREEMENT_DEG = 30.0


def find_forward(recording: Recording, up: Array, pairs: FacingPairs) -> tuple[Array, list[str]]:
    """Horizontal unit vector (3,), laboratory frame, in which the person faces, and sentences on how it was
    found.

    From heel to toe, mean direction of each foot over the first standing second (the first second where
    nobody stands), both feet with equal weight so that turned-out feet cancel; else from the back of the
    pelvis to its front, both sides; else square to the line from right to left; else from heel to toe of one
    foot, which may be turned out; else by one side of the pelvis; else the walking direction. The others are
    compared, and a difference beyond 30 deg is said.

    Raises:
        RecordingError: no foot or pelvis pair, no pair of sides, and the person does not walk.
    """
    walk, way = _walking(recording, up)
    known = _forward_by_body(recording, up, pairs)
    if walk is not None:
        known.append((f"the walking direction ({way:.2g} m)", walk))
    if not known:
        raise RecordingError(
            f"{recording.path or recording.name}: facing direction not found "
            "(no heel and toe, no pelvis markers, no right and left of one place, the "
            f"person walks {way:.2g} m only), expected it to be given"
        )
    why, forward = known[0]
    written = ", ".join(f"{value:.3f}" for value in forward + 0.0)
    how = [f"Forward ({written}) in the laboratory: {why}."]
    for other, direction in known[1:]:
        angle = _apart_deg(forward, direction)
        verdict = "agrees" if angle <= _MAX_DISAGREEMENT_DEG else "DISAGREES, check the marker names"
        how.append(f"Forward: {other} {verdict} ({angle:.0f} deg).")
    return forward, how


def against_forward(recording: Recording, up: Array, given: Array, pairs: FacingPairs) -> tuple[str, bool]:
    """How the body contradicts a forward direction that is given, "" where it does not; and whether feet and pelvis, or
    the like, agree on that. Where the person walks is no witness: one may walk backwards."""
    known = _forward_by_body(recording, up, pairs)
    if not known or any(_apart_deg(given, direction) <= _CONTRADICTS_DEG for _, direction in known):
        return "", False
    why, found = known[0]
    written = ", ".join(f"{value:.2f}" for value in found + 0.0)
    agree = len(known) > 1 and all(_apart_deg(found, other) <= _MAX_DISAGREEMENT_DEG for _, other in known[1:])
    return f"({written}) {why}, {_apart_deg(given, found):.0f} deg off", agree


def _apart_deg(one: Array, other: Array) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1, 1))))


def _forward_by_body(recording: Recording, up: Array, pairs: FacingPairs) -> list[tuple[str, Array]]:
    """What of the body shows where the person faces, and that direction; the surest first."""
    frames = _window(recording)
    feet, n_feet = _mean_direction(recording, pairs.heel_toe, up, frames)
    pelvis, n_sides = _mean_direction(recording, pairs.pelvis, up, frames)
    leftward, _ = _mean_direction(recording, pairs.across, up, frames)
    found = [
        ("from heel to toe (both feet)", feet if n_feet > 1 else None),
        ("from the back of the pelvis to its front", pelvis if n_sides > 1 else None),
        ("square to the line from right to left", None if leftward is None else np.cross(leftward, up)),
        ("from heel to toe (one foot only)", feet if n_feet == 1 else None),
        ("from the back of the pelvis to its front (one side only)", pelvis if n_sides == 1 else None),
    ]
    return [(why, direction) for why, direction in found if direction is not None]


def horizontal(direction: Array, up: Array) -> Array | None:
    """Unit vector of the horizontal part of a direction, None where it has none."""
    flat = direction - (direction @ up) * up
    length = float(np.linalg.norm(flat))
    return flat / length if np.isfinite(length) and length > 1e-9 else None


def _window(recording: Recording) -> slice:
    standing = standing_window(recording)
    start = standing.start if standing else 0
    stop = standing.stop if standing else recording.n_frames
    last = int(np.searchsorted(recording.time, recording.time[start] + FACING_WINDOW_S, side="right"))
    return slice(start, max(min(stop, last), start + 1))


def _mean_direction(
    recording: Recording, pairs: tuple[tuple[str, str], ...], up: Array, frames: slice
) -> tuple[Array | None, int]:
    directions = []
    for back, front in present_pairs(recording, pairs):
        vectors = recording.marker(front) - recording.marker(back)
        seen = np.asarray(np.isfinite(vectors).all(axis=1))
        part = vectors[frames][seen[frames]]
        direction = horizontal((part if len(part) else vectors[seen]).mean(axis=0), up)
        if direction is not None:
            directions.append(direction)
    return (horizontal(np.sum(directions, axis=0), up) if directions else None), len(directions)


def walks(recording: Recording, up: Array) -> bool:
    """Whether the person goes somewhere, and so is upright."""
    return _walking(recording, up)[0] is not None


def _walking(recording: Recording, up: Array) -> tuple[Array | None, float]:
    """Horizontal direction and length (m) of the way of the markers that are seen at both ends."""
    size = max(1, min(round(0.1 * recording.rate), recording.n_frames // 4)) if recording.n_frames > 1 else 1
    ends = [
        [mean_position(recording, [name], part) for part in (slice(0, size), slice(-size, None))]
        for name in recording.marker_names
    ]
    ways = [last - first for first, last in ends if first is not None and last is not None]
    if not ways:
        return None, 0.0
    way = np.mean(ways, axis=0)
    way = way - (way @ up) * up
    length = float(np.linalg.norm(way))
    return (way / length if length >= WALKS_M else None), length


_CONTRADICTS_DEG = 60.0
"""Between a forward direction that is given and what each part of the body shows: an axis of the laboratory is given
for who faces it within 45 deg."""
AXES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")


def nearest_axis(direction: Array) -> str:
    """The laboratory axis, by its name, that is nearest to a direction (3,)."""
    k = int(np.argmax(np.abs(direction)))
    return ("+" if direction[k] > 0.0 else "-") + "XYZ"[k]


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


# Whether the laboratory's axes are right-handed, by a body whose left and right, front and back are named.
#
# A frame with one axis negated (or all three) shows a person in a mirror. Turned in any way, walking backwards or lying
# down, a body stays what it is: forward, up and right of one's own are a right-handed frame.
_HEEL = ("hee", "heel", "calc", "cal", "calcaneus")
_TOE = ("toe", "toetip", "tt2", "mt2", "bigtoe", "mt5", "5meta", "mfh5", "mfh1")
_FRONT = ("asi", "asis", "ias")
_BACK = ("psi", "psis", "ips")
_SACRUM = ("sacr", "sacrum", "vsacral", "s2")
_SURE = 0.3
"""Sine of the angle that the three directions span, below which they say nothing: feet in line, or crossed."""


def refuse_mirrored(recording: Recording, up: Array, vertical: str, pairs: FacingPairs) -> None:
    """Refuse a recording in which pelvis and feet, as far as their markers are named, are all seen in a mirror.

    Args:
        up: (3,) unit vector, taken where the pelvis or the feet are not named; vertical: its axis ("+Y").
        pairs: with these of a marker set the whole body is a witness too.

    Raises:
        RecordingError: says which axis looks negated, or that left and right may be exchanged.
    """
    found = {what: value for what, value in _witnesses(recording, up, pairs).items() if abs(value) > _SURE}
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


def _witnesses(recording: Recording, up: Array, pairs: FacingPairs) -> dict[str, float]:
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
    if pairs.across and (pairs.heel_toe or pairs.pelvis):
        low, high = (_seen_mean(recording, names) for names in (pairs.below, pairs.above))
        forward = _seen_difference(recording, [(front, back) for back, front in (*pairs.heel_toe, *pairs.pelvis)])
        standing = np.where(np.isfinite(high - low), high - low, own_up)
        spanned["body"] = _volume(forward, standing, _seen_difference(recording, list(pairs.across)))
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


def _seen_mean(recording: Recording, names: Sequence[str]) -> Array:
    """Mean (T, 3) m of those of some markers that are seen, NaN where none is."""
    if not names:
        return np.full((recording.n_frames, 3), np.nan)
    return mean_seen(np.stack([recording.marker(name) for name in names]), axis=0)


def _seen_difference(recording: Recording, pairs: Sequence[tuple[str, str]]) -> Array:
    """Mean (T, 3) m from the second to the first of the pairs that are seen whole, NaN where none is."""
    return mean_seen(np.stack([recording.marker(one) - recording.marker(other) for one, other in pairs]), axis=0)


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
