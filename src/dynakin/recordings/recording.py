"""What was measured: marker trajectories and force plates of one trial, in the laboratory frame of its
file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, wrench_about
from dynakin.errors import RecordingError
from dynakin.messages import Message, note
from dynakin.recordings.limits import check_markers, check_place, check_wrench, numbers
from dynakin.recordings.times import rate_of


@dataclass(frozen=True)
class Event:
    """Something that somebody, or a program, marked in the file.

    Attributes:
        time_s: at the recording's times.
        label: as the file has it, "Foot Strike" or "Foot Off", say.
        side: of the body; "" where the file names none.
    """

    time_s: float
    label: str
    side: Literal["left", "right", ""] = ""


@dataclass(frozen=True, eq=False)
class AnalogChannel:
    """One analog channel at its own rate.

    Attributes:
        name: as the file has it.
        unit: as the file has it ("V", "N", "Nmm"), "" where it has none.
        start_s: time of the first sample, at the recording's times.
        rate_hz: samples per second.
        values: (N,) in ``unit``, NaN where the file holds no number.
    """

    name: str
    unit: str
    start_s: float
    rate_hz: float
    values: npt.NDArray[np.float32]

    @property
    def time(self) -> Array:
        """(N,) s."""
        return np.asarray(self.start_s + np.arange(len(self.values)) / self.rate_hz)

    def between(self, start_s: float, end_s: float) -> AnalogChannel:
        """The samples with ``start_s <= time < end_s``."""
        slack = 1e-6  # of a sample
        first, last = (
            int(np.clip(np.ceil((at - self.start_s) * self.rate_hz - slack), 0, len(self.values)))
            for at in (start_s, end_s)
        )
        return replace(self, start_s=self.start_s + first / self.rate_hz, values=self.values[first:last])


_PERSON = 0.25  # of the markers that are usually seen: fewer are what a person leaves behind, or reflections


@dataclass(frozen=True, eq=False)
class Plate:
    """One force plate at the marker rate, laboratory frame, ground-on-person.

    Attributes:
        name: "plate 1", "plate r", ...: the number or side that the file gives.
        force: (T, 3) N.
        moment: (T, 3) N m, all of the wrench, about the LABORATORY origin.
        cop: (T, 3) m, centre of pressure; NaN where the plate is unloaded.
        free_moment: (T, 3) N m, what is left of the moment about the centre of pressure.
        corners: (4, 3) m, or None where the file does not give them.
        empty_n: what it read with nobody on it, N, where that was below 0 and its reader made it 0: under a foot it
            still reads so much too little.
    """

    name: str
    force: Array
    moment: Array
    cop: Array
    free_moment: Array
    corners: Array | None = None
    empty_n: float = 0.0

    def __post_init__(self) -> None:
        for key in ("force", "moment", "cop", "free_moment"):
            object.__setattr__(self, key, numbers(getattr(self, key), f"{self.name}: {key}"))

    @property
    def wrench(self) -> Array:
        """(T, 6) [force N, moment N m about the laboratory's origin]."""
        return np.hstack([self.force, self.moment])

    def frames(self, index: slice | npt.NDArray[Any]) -> Plate:
        """The same plate with only the frames of ``index``."""
        return replace(
            self,
            force=self.force[index],
            moment=self.moment[index],
            cop=self.cop[index],
            free_moment=self.free_moment[index],
        )


def _tuple_of(given: Any, kind: type, where: str, what: str) -> tuple[Any, ...]:
    """A tuple, or a list made one."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise RecordingError(f"{where} is {given!r}, expected a tuple of {what}")
    found = tuple(given)
    if wrong := [each for each in found if not isinstance(each, kind)]:
        raise RecordingError(f"{where} holds {wrong[0]!r}, expected {what} only")
    return found


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A trial as read: SI, laboratory frame of the file, a missing marker is NaN.

    Made with times that do not increase, or values that nobody can have measured (`limits`), it raises a
    RecordingError.

    Attributes:
        name: stem of the file's name.
        path: where it was read from, None if made in memory.
        time: (T,) s, strictly increasing.
        marker_names: M names as the file spells them (subject prefix kept).
        markers: (T, M, 3) m.
        plates: each force plate on its own.
        length_unit: unit of the file, in which its markers are written back.
        notes: what the reader found or changed, one sentence each.
        subject: what the file says of the person: "mass_kg", "height_m", and of each leg "leg_length_m_r",
            "knee_width_m_r", "ankle_width_m_r" ("_l").
        hints: what the file says of its axes (C3D: "X_SCREEN", "Y_SCREEN"); can be wrong, so it only votes.
        read_with: settings that it was read with (forces, plate_filter_hz, ...), by their keys in a configuration.
        events: what is marked in the file (strikes and offs of feet, say), in the order of time.
        analog: its analog channels, each at its own rate.
    """

    name: str
    path: Path | None
    time: Array
    marker_names: tuple[str, ...]
    markers: Array
    plates: tuple[Plate, ...] = ()
    length_unit: Literal["mm", "m"] = "m"
    notes: tuple[Message, ...] = ()
    subject: dict[str, float] = field(default_factory=dict)
    hints: dict[str, str] = field(default_factory=dict)
    read_with: dict[str, Any] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    analog: tuple[AnalogChannel, ...] = ()

    def __post_init__(self) -> None:
        for key in ("time", "markers"):
            object.__setattr__(self, key, numbers(getattr(self, key), f"{self.name}: {key}"))
        for key, kind, what in (("marker_names", str, "names"), ("plates", Plate, "plates")):
            object.__setattr__(self, key, _tuple_of(getattr(self, key), kind, f"{self.name}: {key}", what))
        if twice := [name for name, count in Counter(self.marker_names).items() if count > 1]:
            raise RecordingError(f"{self.name}: marker {twice[0]!r} is there more than once, expected each name once")
        if self.time.ndim != 1:
            raise RecordingError(f"{self.name}: time has shape {self.time.shape}, expected (T,)")
        expected = (len(self.time), len(self.marker_names), 3)
        if self.markers.shape != expected:
            raise RecordingError(f"{self.name}: markers have shape {self.markers.shape}, expected {expected}")
        for plate in self.plates:
            shapes = {plate.force.shape, plate.moment.shape, plate.cop.shape, plate.free_moment.shape}
            if shapes != {(len(self.time), 3)}:
                raise RecordingError(
                    f"{self.name}: {plate.name} has arrays of shapes {sorted(shapes)}, expected ({len(self.time)}, 3)"
                )
        where = str(self.path or self.name)
        check_markers(where, self.time, self.marker_names, self.markers)
        for plate in self.plates:
            check_wrench(plate.name, self.time, plate.force, plate.moment, where)
            check_place(plate.name, self.time, plate.force, plate.moment, plate.cop, str(self.plates_file))

    def __repr__(self) -> str:
        return (
            f"<Recording {self.name}: {self.n_frames} frames, {len(self.marker_names)} markers, "
            f"{len(self.plates)} force plates>"
        )

    @property
    def plates_file(self) -> str:
        """What the plates were read from: the file to name where something is wrong with them."""
        return str(self.read_with.get("forces") or self.path or self.name)

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self.time)

    @property
    def rate(self) -> float:
        """Frames per second (NaN for a single frame); see `rate_of`."""
        return rate_of(self.time)

    @cached_property
    def seen(self) -> npt.NDArray[np.bool_]:
        """(M,) markers that some frame shows."""
        return np.asarray(np.isfinite(self.markers).all(axis=2).any(axis=0))

    @property
    def seen_names(self) -> list[str]:
        """Names of the markers that some frame shows."""
        return [name for name, there in zip(self.marker_names, self.seen, strict=True) if there]

    @cached_property
    def _columns(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.marker_names)}

    def marker(self, name: str) -> Array:
        """Trajectory (T, 3) m of one marker, named as in the file.

        Raises:
            RecordingError: no marker has this name; the message lists those that are there.
        """
        try:
            return self.markers[:, self._columns[name]]
        except KeyError:
            raise RecordingError(
                f"{self.path or self.name}: no marker {name!r}; it has {', '.join(self.marker_names)}"
            ) from None

    def total_wrench(self, about: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Array:
        """Sum of all plates' wrenches (T, 6) [force N, moment N m], laboratory frame, moment about ``about``
        (3,) m."""
        if not self.plates:
            raise RecordingError(f"{self.path or self.name}: no force plates in this recording")
        force = np.sum([plate.force for plate in self.plates], axis=0)
        moment = np.sum([plate.moment for plate in self.plates], axis=0)
        return wrench_about(np.hstack([force, moment]), np.asarray(about, dtype=float))

    def with_plates(self, plates: tuple[Plate, ...], notes: tuple[Message, ...] = ()) -> Recording:
        """The same recording with these plates instead of its own, and with further notes."""
        return replace(self, plates=tuple(plates), notes=self.notes + notes)

    @cached_property
    def without_plates(self) -> Recording:
        """The same without its plates: one recording however often it is asked for, so that what its markers show is
        found once."""
        return replace(self, plates=()) if self.plates else self

    def window(self, start_s: float, end_s: float) -> Recording:
        """The part with ``start_s <= time <= end_s``; the times stay as they are.

        Raises:
            RecordingError: no frame lies in that window.
        """
        tolerance = 1e-9 * max(1.0, abs(end_s))
        index = np.flatnonzero((self.time >= start_s - tolerance) & (self.time <= end_s + tolerance))
        if not len(index):
            raise RecordingError(
                f"{self.path or self.name}: no frame between {start_s:g} s and {end_s:g} s; "
                f"it runs from {self.time[0]:g} s to {self.time[-1]:g} s"
            )
        return self._part(slice(int(index[0]), int(index[-1]) + 1))

    def without_empty_ends(self) -> Recording:
        """Without the frames before the person is seen and after: those in which less than a quarter of the markers are
        that the others show. Nothing could be estimated there; that they are left out is a note."""
        seen = np.count_nonzero(np.isfinite(self.markers).all(axis=2), axis=1)
        if not seen.any():
            return self
        somebody = np.flatnonzero(seen >= np.maximum(_PERSON * np.median(seen[seen > 0]), 1.0))
        keep = slice(int(somebody[0]), int(somebody[-1]) + 1)
        ends = (("first", keep.start), ("last", self.n_frames - keep.stop))
        left_out = [f"the {end} {f'{count} frames' if count > 1 else 'frame'}" for end, count in ends if count]
        if not left_out:
            return self
        part = self._part(keep)
        text = f"Fewer than a quarter of the markers are seen in {' and '.join(left_out)}: they are left out."
        return replace(part, notes=(*self.notes, note("recording", text)))

    def _part(self, keep: slice) -> Recording:
        """These frames; the times stay as they are."""
        first, last = self.time[keep][[0, -1]]
        step = 1.0 / self.rate if self.n_frames > 1 else np.inf
        return replace(
            self,
            time=self.time[keep],
            markers=self.markers[keep],
            plates=tuple(plate.frames(keep) for plate in self.plates),
            events=tuple(event for event in self.events if first - 0.5 * step <= event.time_s <= last + 0.5 * step),
            analog=tuple(channel.between(first, last + step) for channel in self.analog),
        )
