"""A plate in the ground frame: what it carries, where that presses, how high it lies, and when it can be believed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynakin.arrays import Array, Flags, filled, runs
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.pushes import JUDGED_N, LOADED_N, UNLOADED_N
from dynakin.recordings.recording import Plate, Recording

FLAT_FRAMES = 5
"""A loaded plate that stays at its own extreme to 1e-6 for so many frames is at the end of its range."""
UNDER_MARKERS_M = 0.02
"""How far below its lowest marker a shoe's sole is at least: half a marker and its base."""
SHOE_M = 0.12
"""How far above the floor the lowest marker of a foot that stands may be: on a boot, or on an ankle."""
SAME_LEVEL_M = 0.05
"""Supports whose heights differ by less are on one level: a foot's markers show its support to some cm. Steps of stairs
are 0.15 m and more."""


@dataclass(frozen=True, eq=False)
class GroundPlate:
    """One plate in the ground frame.

    Attributes:
        wrench: (T, 6) N and N m about the ground's origin.
        cop: (T, 2) m, X and Z of its centre of pressure at the plate's own height; NaN where it is not loaded.
        known: (T,) it is measured, and not at the end of its range.
        corners: (4, 2) m, X and Z; None where not known.
        height_m: of its surface; None where it is not known.
    """

    name: str
    wrench: Array
    cop: Array
    known: Flags
    corners: Array | None
    height_m: float | None

    @classmethod
    def of(cls, plate: Plate, ground: GroundFrame) -> GroundPlate:
        """The plate, turned to the ground frame; on the ground's own plane where its height is not known."""
        wrench = ground.wrench_to_ground(plate.wrench)
        known = np.asarray(np.isfinite(wrench).all(axis=1)) & ~saturated(wrench[:, 1])
        corners = None if plate.corners is None else ground.points_to_ground(plate.corners)[:, [0, 2]]
        height = surface_height(plate, ground)
        return cls(plate.name, wrench, pressed_at(wrench, height or 0.0), known, corners, height)

    @cached_property
    def push(self) -> Array:
        """(T,) N, vertical; 0 where it is not measured."""
        return filled(self.wrench[:, 1])

    @cached_property
    def loaded(self) -> Flags:
        """(T,) its centre of pressure is known."""
        return np.asarray(self.push > LOADED_N)

    @cached_property
    def pressed(self) -> Flags:
        """(T,) it is not empty."""
        return np.asarray(self.push > UNLOADED_N)

    @cached_property
    def axes(self) -> tuple[Array, Array]:
        """Its middle (2,) m and its own axes (2, 2), rows, X and Z.

        Raises:
            ValueError: as `beyond`.
        """
        corners = self._edges()
        along = corners[0] - corners[1]
        along = along / np.linalg.norm(along)
        return corners.mean(axis=0), np.array([along, [-along[1], along[0]]])

    def beyond(self, points: Array) -> Array:
        """How far (T, K) m points (T, K, 2) lie beyond its edges; 0 inside.

        Raises:
            ValueError: its edges are not known.
        """
        return distance_to_hull(points.reshape(-1, 2), self._edges()).reshape(points.shape[:2])

    def _edges(self) -> Array:
        if self.corners is None:
            raise ValueError(f"{self.name}: expected corners")
        return self.corners


def surface_height(plate: Plate, ground: GroundFrame) -> float | None:
    """Height (m, ground frame) of a plate's surface: its corners' mean, else the median of its centres of pressure;
    None where neither is known."""
    points = plate.cop if plate.corners is None else plate.corners
    heights = ground.points_to_ground(points)[:, 1]
    return float(np.nanmedian(heights)) if np.isfinite(heights).any() else None


def floor_height(recording: Recording, ground: GroundFrame) -> float:
    """Height (m, ground frame) of the floor, the one that a run has: that of its lowest plate. Without plates it is the
    laboratory's zero, which is where laboratories put it, or, where markers go lower or never come near that, a little
    below the lowest of them."""
    plates = [height for plate in recording.plates if (height := surface_height(plate, ground)) is not None]
    if plates:
        return min(plates)
    zero = float(ground.points_to_ground(np.zeros(3))[1])
    heights = ground.points_to_ground(recording.markers)[..., 1]
    if not np.isfinite(heights).any():
        return zero
    lowest = float(np.percentile(np.where(np.isfinite(heights), heights, np.inf).min(axis=1), 5.0))
    return zero if -UNDER_MARKERS_M <= lowest - zero <= SHOE_M or not np.isfinite(lowest) else lowest - UNDER_MARKERS_M


def saturated(push: Array) -> Flags:
    """(T,) where a vertical force (T,) N rests at its largest value, as an amplifier at the end of its range does.

    It gets there on a slope and is cut off; a force that is the same all the time (made up) is not.
    """
    found = np.zeros(len(push), dtype=bool)
    if not np.isfinite(push).any() or np.nanmax(push) < JUDGED_N:
        return found
    top = float(np.nanmax(push))
    with np.errstate(invalid="ignore"):
        at_top: Flags = push > top * (1.0 - 1e-6)
    for first, end in runs(at_top):
        before = push[first - 1] if first > 0 else top
        after = push[end] if end < len(push) else top
        found[first:end] = end - first >= FLAT_FRAMES and min(before, after) < 0.99 * top
    return found


class EndOfRange:
    """`saturated` at this moment, by the frames until now."""

    def __init__(self, plates: int) -> None:
        self._top = np.full(plates, JUDGED_N)
        self._last, self._before = np.full(plates, np.nan), np.full(plates, np.nan)
        self._flat = np.zeros(plates, dtype=int)

    def at_end(self, push: Array) -> Flags:
        """(P,) of the next frame's vertical forces (P,) N."""
        self._top = np.fmax(self._top, push)
        flat = (push > self._top * (1.0 - 1e-6)) & (np.abs(push - self._last) <= 1e-6 * self._top)
        self._before = np.where(flat, self._before, self._last)
        self._flat = np.where(flat, self._flat + 1, 0)
        self._last = push.copy()
        return np.asarray((self._flat >= FLAT_FRAMES - 1) & (self._before < 0.99 * self._top))
