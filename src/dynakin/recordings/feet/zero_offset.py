"""What a plate has while nobody is on it: its zero offset, which is no load of the person's, or no numbers at all, as
some programs write an empty one.

An offset is taken off where the markers show that nobody is on the plate and what it reads stays the same, or drifts:
by what it reads there, and on straight lines in between. Nothing else then takes it for a load, and no other plate is
blamed for it. What a plate without numbers carries while a foot may be on it is not known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dynakin.arrays import Array, Flags, mean_seen, runs
from dynakin.messages import Message, note, warning
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.loads import MEASURED, SHARED, SWING
from dynakin.recordings.feet.places import filled_by_others, foot_places
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.orientation import axis_vector
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.plates.loads import without_wrench
from dynakin.recordings.pushes import JUDGED_N, MOST_OFFSET_N, NOISE_N, UNLOADED_N
from dynakin.recordings.recording import Recording

CLEAR_S, CLEAR_M = 0.5, 0.3
"""How long no foot must be near a plate, and how far (its middle) is surely not on it: its own length."""
PRESSED_M = 0.2
"""How high over a plate a marker of what presses it may be, within `CLEAR_M` of where it presses: of a hand, a forearm,
a knee on the floor 0.02 to 0.12."""
BLOCK_S, STEADY_N = 0.25, 5.0
"""What a plate reads by itself varies within so long by less (standard deviation): drifts of 40 N in 3 s do by 1 N,
noise by 3 N, a cane by 15 N (chosen on walks of `truth3d` of seeds 1 and 61, judged on 3 and 4)."""
NOBODYS = 0.1
"""Part of what the plates carry together at most that a plate without edges reads if nobody is ever on it: in another
unit (N per kg, % of the weight) all of them may read so little."""
STEADY = 0.5
"""Part of the time without a foot in which it must be so for it to be an offset."""


def without_blanks(
    recording: Recording, ground: GroundFrame, foot_markers: Mapping[str, Sequence[str]]
) -> tuple[Recording, list[Message]]:
    """The recording, itself where nothing is blank, with 0 where a plate has no numbers, and each foot is seen in the
    air or on another plate."""
    blank = [~np.isfinite(plate.wrench).all(axis=1) for plate in recording.plates]
    if not np.any(blank) or not all(foot_markers.values()):
        return recording, []
    loads = foot_loads(recording, ground, foot_markers)
    owned = np.asarray(loads.on.any(axis=1))
    elsewhere = np.isin(loads.reason, (SWING, MEASURED, SHARED)) | loads.on.any(axis=2)
    plates, emptied = list(recording.plates), []
    for p, plate in enumerate(plates):
        empty = blank[p] & ~owned[:, p] & elsewhere.all(axis=1)
        if empty.any():
            given = (plate.force, plate.moment, plate.free_moment)
            force, moment, free = (np.where(empty[:, None], 0.0, values) for values in given)
            plates[p] = replace(plate, force=force, moment=moment, free_moment=free)
            emptied.append(plate.name)
    if not emptied:
        return recording, []
    text = f"{', '.join(emptied)}: no numbers while no foot is near, taken as empty there."
    return recording.with_plates(tuple(plates)), [note("plates", text)]


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
) -> tuple[Recording, list[Message]]:
    """The recording, itself where there is nothing to take off, with its plates at zero while nobody is on them."""
    places = foot_places(recording, ground, foot_markers)
    if len(places) < len(foot_markers) or recording.n_frames < 2:
        return recording, []
    feet = [mean_seen(filled_by_others(points)[:, :, [0, 2]], axis=1) for _, points in places.values()]
    on_feet = {column for columns, _ in places.values() for column in columns}
    rest = [k for k in range(len(recording.marker_names)) if k not in on_feet]
    others = ground.points_to_ground(recording.markers[:, rest])
    plates, found = list(recording.plates), list[_Offset]()
    on_ground = [GroundPlate.of(plate, ground) for plate in plates]
    most = np.max(np.sum([plate.push for plate in on_ground], axis=0), initial=0.0)
    for p, plate in enumerate(plates):
        clear = _clear(on_ground[p], feet, NOBODYS * float(most)) & ~_pressed(on_ground[p], others)
        offset = _offset_of(on_ground[p], plate.wrench, clear, recording)
        if offset is None:
            continue
        found.append(offset)
        if offset.wrench is not None:
            plates[p] = without_wrench(plate, offset.wrench, axis_vector(ground.vertical))
    taken = [offset for offset in found if offset.wrench is not None]
    said = _left_in_words([offset for offset in found if offset.wrench is None], recording.time)
    if not taken:
        return recording, said
    return recording.with_plates(tuple(plates)), [_taken_in_words(taken), *said]


def _offset_of(plate: GroundPlate, wrench: Array, clear: Flags, recording: Recording) -> _Offset | None:
    if np.count_nonzero(clear) < CLEAR_S * recording.rate:
        return None
    read = plate.wrench[:, 1]
    low, middle, high = (float(value) for value in np.percentile(read[clear], (5.0, 50.0, 95.0)))
    if not NOISE_N < abs(middle) < MOST_OFFSET_N:
        return None
    blocks = _steady_blocks(clear, read, max(2, round(BLOCK_S * recording.rate)))
    time, steady = recording.time, sum(end - first for first, end in blocks)
    enough = steady >= max(STEADY * np.count_nonzero(clear), CLEAR_S * recording.rate)
    if not enough or _goes_on(time, read, blocks):
        return _Offset(plate.name, None, clear, low, high, middle) if abs(middle) > UNLOADED_N else None
    at = [0.5 * float(time[first] + time[end - 1]) for first, end in blocks]
    levels = np.array([wrench[first:end].mean(axis=0) for first, end in blocks])
    drawn = np.stack([np.interp(time, at, levels[:, c]) for c in range(6)], axis=1)
    return _Offset(plate.name, drawn, clear, low, high, middle)


def _steady_blocks(clear: Flags, read: Array, length: int) -> list[tuple[int, int]]:
    """Frames [first, end), so many and more, without a foot, in which what is read (T,) N keeps still, and is no
    step's."""
    found = []
    for first, end in runs(clear):
        edges = np.linspace(first, end, max(1, (end - first) // length) + 1).astype(int).tolist()
        for a, b in pairwise(edges):
            if b - a >= length and read[a:b].std() < STEADY_N and abs(read[a:b].mean()) < MOST_OFFSET_N:
                found.append((a, b))
    return found


def _goes_on(time: Array, read: Array, blocks: Sequence[tuple[int, int]]) -> bool:
    """Whether a plate drifts, and would by more than is empty until the recording's ends: nobody knows how far."""
    at = np.concatenate([time[first:end] for first, end in blocks])
    values = np.concatenate([read[first:end] for first, end in blocks])
    centred = at - at.mean()
    slope = float(centred @ values / (centred @ centred))
    error = float(np.std(values - values.mean() - slope * centred) / np.sqrt(centred @ centred))
    beyond = max(float(at.min() - time[0]), float(time[-1] - at.max()))
    return abs(slope) > 3.0 * error and abs(slope) * beyond > UNLOADED_N


def _clear(plate: GroundPlate, feet: Sequence[Array], nobodys_n: float) -> Flags:
    """(T,) frames in which every foot, its middle (T, 2) m, is seen and not near the plate; all of a plate
    without edges that nobody is ever on: it reads no more than ``nobodys_n``."""
    clear = plate.known.copy()
    place = plate.corners
    if place is None:
        judged = plate.cop[(plate.push > JUDGED_N) & np.isfinite(plate.cop).all(axis=1)]
        if not len(judged):
            return np.asarray(clear & (plate.push.max() < nobodys_n))
        (x0, z0), (x1, z1) = np.percentile(judged, (5.0, 95.0), axis=0)
        place = np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])
    for middle in feet:
        clear &= np.nan_to_num(distance_to_hull(middle, place), nan=0.0) > CLEAR_M
    return clear


def _pressed(plate: GroundPlate, others: Array) -> Flags:
    """(T,) frames in which a marker (T, M, 3) m that is on no foot is low over where the plate presses: that is a
    hand's load, or a knee's."""
    with np.errstate(invalid="ignore"):
        beside = np.linalg.norm(others[:, :, [0, 2]] - plate.cop[:, None], axis=2) < CLEAR_M
        low = others[:, :, 1] - (plate.height_m or 0.0) < PRESSED_M
    return np.asarray((beside & low).any(axis=1))


def _taken_in_words(taken: Sequence[_Offset]) -> Message:
    parts = ", ".join(f"{offset.name} reads {offset.words()}" for offset in taken)
    text = f"While no foot is near, {parts}: it is taken off over the whole trial."
    return (warning if any(abs(offset.middle_n) > UNLOADED_N for offset in taken) else note)("zero", text)


def _left_in_words(left: Sequence[_Offset], time: Array) -> list[Message]:
    return [
        warning(
            "zero",
            f"{offset.name} reads {offset.low_n:.0f} to {offset.high_n:.0f} N while no foot is near it, between "
            f"{time[offset.clear][0]:.2f} and {time[offset.clear][-1]:.2f} s: zero it before the trial, or take it off "
            "with plate_loads.",
        )
        for offset in left
    ]
