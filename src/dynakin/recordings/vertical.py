"""Which axis of a laboratory points up: by the body, the plates, the standing trial and what the file says.

The body says so of who is upright. Who lies, or is on hands and feet, has it along a level axis: the plates that bear
the person from below, or a standing trial over the same floor, are then the surer witnesses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, mean_seen
from dynakin.errors import RecordingError
from dynakin.recordings.landmarks import FacingPairs, find_marker, mean_position, present_pairs
from dynakin.recordings.orientation import AXES, axis_vector, nearest_axis, walks
from dynakin.recordings.pushes import BEARS_N
from dynakin.recordings.recording import Recording

_MIN_SHARE = 0.8  # how much of a direction an axis must hold to be taken for it (37 deg)
FLOOR_M = 0.10
"""How far from what bears a person, or from the floor of the standing trial, the lowest marker lies: on a hand, a toe
or a back that is on the floor 0.02 to 0.08; along any other axis it is where the person happens to be."""
UNDER_M = 0.30
"""How far from below the middle of the markers plates push that bear a person alone: of who stands or is on hands and
toes 0.20, of who lies 0.25 (legs have most markers); hands push a wall 0.4 above the middle (chosen, as `FLOOR_M`, on
simulated push-ups and who lies; judged on planks, a side plank and all fours)."""


@dataclass(frozen=True)
class _StandingFloor:
    """What a standing trial says of its laboratory: the axis that points up, and where its lowest marker is, m."""

    name: str
    vertical: str
    low_m: float

    @classmethod
    def of(cls, static: Recording, pairs: FacingPairs) -> _StandingFloor | None:
        """What a trial says in which the body shows up, None where it does not."""
        vertical = _from_body(static, pairs)
        return None if vertical is None else cls(static.name, vertical, _lowest(static, vertical))

    def lies_under(self, recording: Recording, axis: str) -> bool:
        """Whether the lowest marker of a recording, if this axis is up, is where this floor is."""
        return abs(_lowest(recording, axis) - self.low_m) < FLOOR_M


def find_vertical(recording: Recording, pairs: FacingPairs, static: Recording | None = None) -> tuple[str, list[str]]:
    """The laboratory axis that points up, and sentences on how it was found.

    Witnesses, the first that speaks decides and the others are heard: the body itself (pelvis above heels),
    the plates (they push upwards), the standing trial, the longer side of the markers' box (an axis without its sign),
    what the file says of its screen (can be wrong: it is often left over from another laboratory). The body gives way
    to plates that bear it from below, or over the standing trial's floor, and to a standing trial of the same
    laboratory.

    Raises:
        RecordingError: no witness, or a standing trial of which nobody knows whether it is of the same laboratory says
            another axis than the body does.
    """
    standing = None if static is None or static is recording else _StandingFloor.of(static, pairs)
    body, plates = _from_body(recording, pairs), _from_plates(recording)
    witnesses: list[tuple[str, Callable[[], str | None]]] = [
        ("the body above the feet", lambda: body),
        ("the plates' force", lambda: plates),
        ("the standing trial", lambda: standing.vertical if standing else None),
        ("the longer side of the markers' box", lambda: _from_spread(recording)),
        ("the file's Y_SCREEN", lambda: _from_screen(recording)),
    ]
    found = [(why, axis) for why, witness in witnesses if (axis := witness())]
    if not found:
        where = recording.path or recording.name
        raise RecordingError(f"{where}: vertical axis not found, expected it to be given")
    if body is not None:
        surer = _surer_than_the_body(recording, body, plates, standing)
        found.sort(key=lambda one: one[1] != surer)  # the witnesses of that axis first, in their order
    why, vertical = found[0]
    agree = [other for other, axis in found[1:] if axis == vertical]
    how = [f"Vertical {vertical}: {why}" + (f"; so say {', '.join(agree)}." if agree else ".")]
    for other, axis in found:
        if axis != vertical:
            how.append(f"Vertical: {other} says {axis}, not {vertical}; not followed.")
    return vertical, how


def against_vertical(recording: Recording, axis: str, pairs: FacingPairs) -> tuple[str, bool]:
    """The axis that points up where the body says another than a given one, "" where it does not; and whether the
    plates say so too, as they do not of one who lies."""
    body = _from_body(recording, pairs) or axis
    return ("", False) if body == axis else (body, _from_plates(recording) == body)


def _surer_than_the_body(recording: Recording, body: str, plates: str | None, standing: _StandingFloor | None) -> str:
    """The axis that points up, where the body's own is known: another one where plates bear the person along it and
    the standing trial says so too, or they press from below; or where the standing trial's floor is under the person
    along it, and along the body's own is not.

    Raises:
        RecordingError: the standing trial says another one, and its floor shows nothing, or both.
    """
    upright = standing.vertical if standing else body
    if {plates or body, upright} == {body} or walks(recording, axis_vector(body)):
        return body
    if plates is not None and plates != body:
        if standing is not None and standing.vertical == plates:
            bear = standing.lies_under(recording, plates) and _bear(recording, plates)
        else:
            bear = _bear(recording, plates, from_below=True)
        if bear:
            return plates
    if standing is None or body in (upright, plates):
        return body
    own, other = (standing.lies_under(recording, axis) for axis in (body, upright))
    if own != other:
        return body if own else upright
    raise RecordingError(
        f"{recording.path or recording.name}: the body above the feet shows {body} as the vertical, the standing trial "
        f"{standing.name} {upright}: the person lies, or the trials have other axes; expected the vertical to be given "
        "(--vertical), and both in the same axes"
    )


def _bear(recording: Recording, axis: str, from_below: bool = False) -> bool:
    """Whether the plates bear the person if this axis is up, and, if asked, do so from below: they press at the
    person's lowest part, under the middle of the markers."""
    up = axis_vector(axis)
    push = np.nan_to_num(np.array([plate.force @ up for plate in recording.plates]))  # (P, T)
    cop = np.array([plate.cop for plate in recording.plates])
    push = np.where(np.isfinite(cop).all(axis=2), push, 0.0)
    total = push.sum(axis=0)
    loaded = (total > max(0.5 * total.max(), 1.0)) & np.isfinite(recording.markers).any(axis=(1, 2))
    if not loaded.any() or total[loaded].mean() < BEARS_N:
        return False
    if not from_below:
        return True
    pressed = np.einsum("pt,ptc->tc", push, np.nan_to_num(cop))[loaded] / total[loaded, None]
    away = np.median(mean_seen(recording.markers[loaded], axis=1) - pressed, axis=0)
    beside = np.linalg.norm(away - (away @ up) * up)
    return bool(beside < UNDER_M and abs(_lowest(recording, axis) - np.median(pressed @ up)) < FLOOR_M)


def _lowest(recording: Recording, axis: str) -> float:
    """m, along an axis, of the lowest marker: below it are 5 % of the frames' lowest ones. NaN where none is seen."""
    heights = recording.markers @ axis_vector(axis)
    heights = heights[np.isfinite(heights).any(axis=1)]
    return float(np.percentile(np.nanmin(heights, axis=1), 5.0)) if len(heights) else np.nan


def _name(direction: Array) -> str | None:
    """The axis nearest to a direction, None where none is near."""
    length = float(np.linalg.norm(direction))
    if not np.isfinite(length) or length < 1e-9:
        return None
    return None if np.abs(direction).max() < _MIN_SHARE * length else nearest_axis(direction)


def _from_body(recording: Recording, pairs: FacingPairs) -> str | None:
    everything = slice(None)
    below, above = (
        [own for name in names if (own := find_marker(recording, name))] for names in (pairs.below, pairs.above)
    )
    feet = below or [name for pair in present_pairs(recording, pairs.heel_toe) for name in pair]
    body = above or [name for pair in present_pairs(recording, pairs.pelvis) for name in pair]
    low, high = (mean_position(recording, names, everything) for names in (feet, body))
    return None if low is None or high is None else _name(high - low)


def _from_plates(recording: Recording) -> str | None:
    if not recording.plates:
        return None
    force = np.nan_to_num(np.array([plate.force for plate in recording.plates])).sum(axis=0)  # empty ones may be NaN
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
