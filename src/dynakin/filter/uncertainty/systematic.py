"""What the filter's covariance cannot know: joints off where they are, skin that follows them, segments' centres of
mass, inertia that a recording leaves open, and how intense the movement is.

A consider covariance (Schmidt 1966): these errors are not estimated; their effect on what is reported is worked out
afterwards and added to the filter's own variances ([derivations](derivations.md), section 17).
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.uncertainty.frames import Frame, Frames
from dynakin.filter.uncertainty.geometry import BLOCKS, Blocks, Geometry, Parts
from dynakin.filter.uncertainty.joints import Joints
from dynakin.filter.uncertainty.loads import Clock, Hands, PlateNoise, late_by
from dynakin.filter.uncertainty.mass_centres import Inertia, MassCentres
from dynakin.filter.uncertainty.reported import movement_intensity, reported
from dynakin.filter.uncertainty.sizes import KINDS, Sizes, usual_sizes
from dynakin.filter.uncertainty.skin import Skin
from dynakin.filter.uncertainty.upright import Turned
from dynakin.messages import Message, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.times import frames_apart
from dynakin.results.naming import listed, words
from dynakin.settings.noise import Noise

if TYPE_CHECKING:
    import xarray as xr


MISFIT = 1.6
"""Times `Sizes.placed` from which a run says that a model was not scaled well: by truth 0.4 to 1.1 with the person's
own skeleton, 2.3 to 3.2 with one scaled by hand."""
SAMPLE_S = 0.1
"""Frames of a recording further apart than this are worked out, variances of those between by straight lines."""


class Error(Protocol):
    """A kind of error, or some that are worked out together."""

    def variances(self, frame: Frame) -> Parts:
        """By errors of size 1, in one frame."""


class Systematic:
    """Effects of systematic errors on what is estimated of one person.

    Args:
        calibrated: with the states that the filter has. noise: how surely the markers are known, for their weights.
        sizes: of the errors; by where the joints come from where not given.
    """

    def __init__(self, calibrated: CalibratedModel, noise: Noise, sizes: Sizes | None = None) -> None:
        spec = calibrated.spec
        self.sizes = sizes or usual_sizes(calibrated).scaled(noise.systematic_scale)
        self.geometry = Geometry(calibrated, noise)
        self._clock, self._joints = Clock(self.geometry), Joints(self.geometry, calibrated)
        self._noise = PlateNoise(self.geometry)
        self._errors: list[Error] = [
            self._joints,
            Skin(self.geometry, calibrated),
            MassCentres(self.geometry, calibrated),
            Hands(self.geometry),
            self._clock,
            self._noise,
            Inertia(self.geometry, calibrated),
        ]
        self._locked = [c.name for c in spec.coordinates if c.locked and c.name not in calibrated.held]
        self._feet = len(calibrated.feet)
        self._variance_scale = noise.variance_scale
        first = {name: k for k, name in enumerate(calibrated.names)}
        axes = [[f"marker/{marker.name}/{axis}" for axis in "xyz"] for marker in spec.markers]
        self._places = np.array([[first[n] for n in own] for own in axes if first.keys() >= set(own)], dtype=np.intp)
        self._place0 = calibrated.x0[self._places]

    def with_found(
        self,
        clock_sd_s: float,
        in_hands_kg: float = 0.0,
        skin: float = 0.0,
        hips_turned: Mapping[str, Turned] = MappingProxyType({}),
    ) -> Systematic:
        """The same, where the plates' clock is less sure than in a walk whose segments are all marked, hands may hold
        what the model does not have, more of skin's displacement was found than usual, or hips turn (`hips_turned`)
        so little that their centres stay where standing markers have them."""
        sizes, other = self.sizes, copy(self)
        other.sizes = replace(sizes, clock=max(clock_sd_s, sizes.clock), hands=in_hands_kg).with_skin(skin)
        other._errors = [each for each in self._errors if each is not self._joints]
        other._joints = self._joints.with_hips(hips_turned)
        other._errors.append(other._joints)
        return other

    def parts_at(self, frame: Frame) -> Parts:
        """Variances by kind of error, of errors of size 1, in one frame: block -> (C,); NaN where its state is not a
        number."""
        if not np.isfinite(np.concatenate(frame.motion)).all():
            unknown = np.full(self.geometry.count, np.nan)
            return {kind: dict.fromkeys(BLOCKS, unknown) for kind in (*KINDS, "inertia", "plates")}
        return {kind: blocks for error in self._errors for kind, blocks in error.variances(frame).items()}

    def parts(self, frames: Frames) -> Parts:
        """`parts_at` of all frames: kind -> block -> (T, C). NaN around frames whose state is not a number."""
        time, chosen = frames.time, frames_apart(frames.time, SAMPLE_S)
        each = [self.parts_at(frames.at(k, self.geometry)) for k in chosen]
        found = {
            kind: {block: _between(time, time[chosen], np.array([p[kind][block] for p in each])) for block in BLOCKS}
            for kind in each[0]
        }
        known = np.flatnonzero(np.isfinite(frames.states).all(axis=1))
        for k in np.setdiff1d(known, chosen):  # a load passes faster
            frame = frames.at(k, self.geometry)
            for kind, blocks in (self._clock.variances(frame) | self._noise.variances(frame)).items():
                found[kind]["moments"][k] = blocks["moments"]
        return found

    def added(self, frames: Frames) -> Blocks:
        """The filter's standard deviations with these errors: block -> (T, C)."""
        K = len(self.geometry.free)
        acceleration, sd = frames.states[:, 2 * K : 3 * K], frames.sd["accelerations"][:, self.geometry.free]
        intensity, moved_m = movement_intensity(acceleration, sd), self.moved_m(frames.states)
        return reported(frames, self.sizes, self.parts(frames), intensity, moved_m)

    def added_over_time(self, data: xr.Dataset, *, late: bool, noise: Array | None = None) -> xr.Dataset:
        """The same of a recording: ``data`` with other ``coordinates_sd`` ... ``moments_sd``, and the plates' clock in
        those of contacts' wrenches; noise: as of `Frames`."""
        sd = self.added(Frames.of(data, self._feet, self._variance_scale, late=late, noise=noise))
        blocks = {f"{block}_sd": (("time", "coordinate"), sd[block]) for block in BLOCKS}
        return data.assign(blocks | late_by(data, self.sizes.clock))

    def moved_m(self, x: Array) -> Array:
        """(...,) how far markers are found from where the model has them by states (..., n), mean; 0 where none is
        looked for."""
        if not len(self._places):
            return np.zeros(x.shape[:-1])
        return np.asarray(np.linalg.norm(x[..., self._places] - self._place0, axis=-1).mean(axis=-1))

    def misfit(self, x: Array) -> list[Message]:
        """What there is to say of how well the model was scaled to the person, by the last state (n,)."""
        moved_m = float(self.moved_m(x))
        if not moved_m > self.sizes.placed * MISFIT:
            return []
        locked = f"; held still are {listed([words(name) for name in self._locked])}" if self._locked else ""
        return [
            warning(
                "scaling",
                f"markers lie {1000.0 * moved_m:.0f} mm (mean) from where the model has them, of a model that "
                f"fits the person at most {1000.0 * self.sizes.placed:.0f} mm: the centres of its joints count as "
                f"{moved_m / self.sizes.placed:.1f} times less sure. Whether their axes are turned too the standard "
                f"deviations do not hold{locked}.",
            )
        ]


def _between(time: Array, known: Array, values: Array) -> Array:
    if len(known) == len(time):  # a session's frame
        return values
    return np.array([np.interp(time, known, column) for column in values.T]).T
