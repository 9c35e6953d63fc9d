"""Which frames a model is measured on, and the markers' positions there."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.messages import Message, note
from dynakin.model.calibration.landmarks import Positions
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.mirroring import SIDES
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window
from dynakin.results.naming import plural

FIRST_FRAMES = 10
"""How many frames stand in for a standing window where a trial has none (0.1 s at 100 Hz)."""

_WAYS = 200  # in which markers lack together, the ones with fewest markers that lack


@dataclass(frozen=True, eq=False)
class MarkedTrial:
    """A recording with its markers matched and in the ground frame."""

    recording: Recording
    match: MarkerMatch
    ground: GroundFrame
    paths: dict[MarkerKey, Array]  # (T, 3) m, ground frame

    @classmethod
    def of(cls, recording: Recording, match: MarkerMatch, ground: GroundFrame) -> MarkedTrial:
        """Turns the matched markers into the ground frame."""
        paths = {key: ground.points_to_ground(recording.marker(name)) for key, name in match.names.items()}
        return cls(recording, match, ground, paths)

    def facing(self) -> MarkedTrial:
        """The same trial with X in the direction in which the person faces."""
        return MarkedTrial.of(self.recording, self.match, self.ground.facing())

    def about(self, origin_L: Array) -> MarkedTrial:
        """The same trial with the ground origin at ``origin_L`` (3,) m, laboratory frame."""
        return MarkedTrial.of(self.recording, self.match, self.ground.with_origin(origin_L))

    def usable(self, keys: set[MarkerKey]) -> npt.NDArray[np.bool_]:
        """(T,) frames in which all these markers are seen."""
        seen = np.ones(self.recording.n_frames, dtype=bool)
        for key in keys:
            seen &= np.isfinite(self.paths[key]).all(axis=1)
        return seen

    def seen_apart(self, keys: set[MarkerKey]) -> set[MarkerKey]:
        """Of markers that no frame shows together, the ones to do without: as few as leave `FIRST_FRAMES` frames that
        show the others, where any do; none where a frame shows all."""
        if not keys or self.usable(keys).any():
            return set()
        ordered = sorted(keys)
        lacks = np.array([~np.isfinite(self.paths[key]).all(axis=1) for key in ordered]).T
        ways = np.unique(lacks, axis=0)
        ways = ways[np.argsort(ways.sum(axis=1), kind="stable")][:_WAYS]
        frames = (~(lacks.astype(np.float32) @ (~ways).astype(np.float32).T).astype(bool)).sum(axis=0)
        best = min(range(len(ways)), key=lambda k: (frames[k] < FIRST_FRAMES, ways[k].sum(), -frames[k]))
        return {key for key, gone in zip(ordered, ways[best], strict=True) if gone}

    def median(self, frames: npt.NDArray[np.intp]) -> Positions:
        """Median place (3,) m of each marker over some frames, NaN where it is never seen there."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # all-NaN: the answer is NaN, as wanted
            return {key: _median(path[frames]) for key, path in self.paths.items()}

    def calibration_frames(self, keys: set[MarkerKey], wished: set[MarkerKey]) -> tuple[npt.NDArray[np.intp], str]:
        """Frames on which lengths and marker places are measured, and a sentence that says which.

        The standing window where there is one, else the first frames; of these only frames with all markers
        needed.

        Args:
            keys: markers that must be seen.
            wished: these and others that are asked for where some frame has them all.

        Raises:
            ModelError: there is no frame with all of them; the message names the one that is seen least.
        """
        usable = self.usable(wished)
        if not usable.any():
            usable = self.usable(keys)
        if not usable.any():
            rarest = min(sorted(keys), key=lambda key: int(np.isfinite(self.paths[key]).all(axis=1).sum()))
            name = self.match.names[rarest]
            seen = int(np.isfinite(self.paths[rarest]).all(axis=1).sum())
            raise ModelError(
                f"{self.match.where}: no frame shows all {len(keys)} markers of the joint centres; {name} "
                "is seen least "
                f"({seen} of {self.recording.n_frames} frames)"
            )
        window = standing_window(self.recording)
        if window is not None:
            inside = np.flatnonzero(usable[window]) + window.start
            if len(inside) >= FIRST_FRAMES:
                t0, t1 = self.recording.time[inside[[0, -1]]]
                return (
                    inside,
                    f"standing from {t0:.2f} to {t1:.2f} s of {self.recording.name} ({plural(len(inside), 'frame')})",
                )
        first = np.flatnonzero(usable)[:FIRST_FRAMES]
        t0, t1 = self.recording.time[first[[0, -1]]]
        why = "nobody stands still there" if window is None else "a marker is missing while standing"
        return (
            first,
            f"the first {len(first)} usable frames of {self.recording.name} ({t0:.2f} to {t1:.2f} s; {why})",
        )

    def late_start(self, first: int) -> list[Message]:
        """A note where this is not the first frame."""
        if not first:
            return []
        when = f"frame {first} ({self.recording.time[first]:.2f} s)"
        return [note("details", f"Start from {when}: markers are missing before.")]


def _median(places: Array) -> Array:
    """Median over the first axis of what is known there."""
    median = np.median if np.isfinite(places).all() else np.nanmedian  # the latter takes ten times as long
    return np.asarray(median(places, axis=0))


def choose_side(match: MarkerMatch, recording: Recording, side: str) -> tuple[str, str]:
    """The side whose limb markers are used, and a sentence on it: "auto" takes the one with the fewest gaps.

    Raises:
        ModelError: the side is not one of auto, right, left, both.
    """
    if side in ("right", "left", "both"):
        return side, f"Limb markers: {side} side{'s' if side == 'both' else ''}, as asked."
    if side != "auto":
        raise ModelError(f"side is {side!r}, expected auto, right, left or both")
    gaps: dict[str, float] = {}
    for own in SIDES:
        gaps[own] = 0.0
        for marker in match.marker_set.markers:
            if not marker.measures(planar=True) or not marker.aliases(own):
                continue
            name = match.names.get((marker.name, own))
            path = recording.marker(name) if name else np.full((recording.n_frames, 3), np.nan)
            other = match.names.get((marker.name, "left" if own == "right" else "right"))
            if name or other:  # a marker that neither side has says nothing
                gaps[own] += float((~np.isfinite(path).all(axis=1)).sum())
    best = "left" if gaps["left"] < gaps["right"] else "right"
    return best, (
        f"Limb markers: {best} side (marker frames missing: right {gaps['right']:.0f}, left {gaps['left']:.0f})."
    )
