"""What a plate reads while nobody is on it: its zero offset, which is no load of the person's.

It is taken off where the feet show that nobody is on the plate and what it reads stays the same, or drifts: by what it
reads there, and on straight lines in between. Nothing else then takes it for a load, and no other plate is blamed for
it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.messages import Message, note, warning
from dynakin.recordings.feet.contact import filled_by_others, foot_places
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.orientation import axis_vector
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.plates.loads import without_wrench
from dynakin.recordings.plates.pressure import JUDGED_N, UNLOADED_N
from dynakin.recordings.recording import Array, Recording

Flags = npt.NDArray[np.bool_]

MOST_OFFSET_N = 2.0 * JUDGED_N
"""What a plate reads beside the load, at most: a press that stays below it may be nobody's, and shows no place."""
NOISE_N = 3.0
"""The noise of the usual plates: what reads less is at zero."""
CLEAR_S, CLEAR_M = 0.5, 0.3
"""How long no marker of a foot must be near a plate, and how near is: a foot's length."""
BLOCK_S, STEADY_N = 0.25, 5.0
"""What a plate reads by itself varies within so long by less (standard deviation): drifts of 40 N in 3 s do by 1 N, noise
by 3 N, a cane by 15 N."""
STEADY = 0.5
"""Part of the time without a foot in which it must be so for it to be an offset."""


@dataclass(frozen=True, eq=False)
class _Offset:
    """Of one plate. wrench: (T, 6) N and N m, laboratory; None: what it reads is not steady. clear: (T,) no foot is
    near it. low_n, high_n: what it reads vertically there."""

    name: str
    wrench: Array | None
    clear: Flags
    low_n: float
    high_n: float
    middle_n: float

    def words(self) -> str:
        low, high = f"{self.low_n:.0f}", f"{self.high_n:.0f}"
        return f"{low} N" if low == high else f"{low} to {high} N"


def without_offsets(
    recording: Recording,
    ground: GroundFrame,
    foot_markers: Mapping[str, Sequence[str]],
    bearing_others: Collection[str] = (),
    *,
    only_said: bool = False,
) -> tuple[Recording, list[Message]]:
    """The recording, itself where there is nothing to take off, with its plates at zero while nobody is on them.

    Args:
        bearing_others: plates that something else than feet bears on.
        only_said: nothing is taken off: something else bears the person, and may do so on any plate.
    """
    places = foot_places(recording, ground, foot_markers)
    if len(places) < len(foot_markers) or recording.n_frames < 2:
        return recording, []
    feet = [filled_by_others(points)[:, :, [0, 2]] for _, points in places.values()]
    plates, found = list(recording.plates), list[_Offset]()
    for p, plate in enumerate(plates):
        if plate.name in bearing_others:
            continue
        offset = _offset_of(GroundPlate.of(plate, ground), plate.wrench, feet, recording)
        if offset is None:
            continue
        found.append(offset)
        if offset.wrench is not None and not only_said:
            plates[p] = without_wrench(plate, offset.wrench, axis_vector(ground.vertical))
    taken = [offset for offset in found if offset.wrench is not None and not only_said]
    said = _left_in_words([offset for offset in found if offset not in taken], recording.time)
    if not taken:
        return recording, said
    return recording.with_plates(tuple(plates)), [_taken_in_words(taken), *said]


def _offset_of(plate: GroundPlate, wrench: Array, feet: Sequence[Array], recording: Recording) -> _Offset | None:
    clear = _clear(plate, feet)
    if np.count_nonzero(clear) < CLEAR_S * recording.rate:
        return None
    read = plate.wrench[:, 1]
    low, middle, high = (float(value) for value in np.percentile(read[clear], (5.0, 50.0, 95.0)))
    if not NOISE_N < abs(middle) < MOST_OFFSET_N:
        return None
    block = max(2, round(BLOCK_S * recording.rate))
    at, means, steady = list[float](), list[Array](), 0
    for first, end in runs(clear):
        edges = np.linspace(first, end, max(1, (end - first) // block) + 1).astype(int)
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            if b - a >= block and read[a:b].std() < STEADY_N and abs(read[a:b].mean()) < MOST_OFFSET_N:
                at.append(0.5 * float(recording.time[a] + recording.time[b - 1]))
                means.append(wrench[a:b].mean(axis=0))
                steady += int(b - a)
    if steady < max(STEADY * np.count_nonzero(clear), CLEAR_S * recording.rate):
        return _Offset(plate.name, None, clear, low, high, middle) if abs(middle) > UNLOADED_N else None
    levels = np.array(means)
    drawn = np.stack([np.interp(recording.time, at, levels[:, c]) for c in range(6)], axis=1)
    return _Offset(plate.name, drawn, clear, low, high, middle)


def _clear(plate: GroundPlate, feet: Sequence[Array]) -> Flags:
    """(T,) frames in which every foot (T, K, 2) m is seen, and none of its markers near the plate; all of a plate that
    nobody is ever on."""
    clear = plate.known.copy()
    place = plate.corners
    if place is None:
        judged = plate.cop[(plate.push > JUDGED_N) & np.isfinite(plate.cop).all(axis=1)]
        if not len(judged):
            return clear
        (x0, z0), (x1, z1) = np.percentile(judged, (5.0, 95.0), axis=0)
        place = np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])
    for points in feet:
        flat = points.reshape(-1, 2)
        away = distance_to_hull(flat, np.broadcast_to(place, (len(flat), *place.shape))).reshape(points.shape[:2])
        clear &= np.nan_to_num(away, nan=np.inf).min(axis=1) > CLEAR_M
        clear &= np.isfinite(away).any(axis=1)
    return clear


def _taken_in_words(taken: Sequence[_Offset]) -> Message:
    parts = ", ".join(f"{offset.name} ({offset.words()})" for offset in taken)
    text = (
        f"Zero offset: while no foot is near, {parts} {'reads' if len(taken) == 1 else 'read'} this load of nobody's, "
        "which is taken off over the whole trial. Zero the plates before a trial."
    )
    return (warning if any(abs(offset.middle_n) > UNLOADED_N for offset in taken) else note)("plates", text)


def _left_in_words(left: Sequence[_Offset], time: Array) -> list[Message]:
    return [
        warning(
            "plates",
            f"{offset.name} reads {offset.low_n:.0f} to {offset.high_n:.0f} N while no foot is near it, between "
            f"{time[offset.clear][0]:.2f} and {time[offset.clear][-1]:.2f} s: zero it before the trial, or take it off "
            "with plate_loads.",
        )
        for offset in left
        if abs(offset.middle_n) > UNLOADED_N
    ]
