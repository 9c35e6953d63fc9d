"""What the deviations of estimated frames are worked out from, of a recording as of a live session."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags
from dynakin.bindings import _core
from dynakin.filter.contacts import stands_off_plates
from dynakin.filter.uncertainty.geometry import BLOCKS, Blocks, Geometry
from dynakin.recordings.times import at_the_ends, step_of
from dynakin.results.estimate import values_of
from dynakin.results.measures.sources import DERIVED, MEASURED, in_use, moment_sources, plates_refused

if TYPE_CHECKING:
    import xarray as xr


_STEP_S = 0.005
"""Step along the motion over which effects are differentiated."""


@dataclass(frozen=True, eq=False)
class Frames:
    """T frames of n states, C coordinates, M markers and F contacts.

    Attributes:
        time: (T,) s. step_s: usual step from frame to frame.
        states: (T, n). sd: the filter's own standard deviations, block -> (T, C).
        known_sd: (T, n), and known: (n, n) how surely constants are known by the declared noise: the covariance of
            frame t is that of ``known``, each element times its ``known_sd`` of t.
        wrench: (T, F, 6) N and N m, of the contacts on these segments. wrench_rate: (T, F, 6) by how much they change a
            second.
        used: (T, M) markers that show the posture (`in_use`).
        noise: (T, 6 F, 6 F) covariances of what plates' white noise beyond the usual leaves in the contacts' wrenches
            (`ContactLoads.noise_left`); None: nothing.
        sources: (T, C) of the moments (`results.measures.sources`), `as_believed` where plates were refused.
        ends: (T,) those `at_the_ends` of a recording, where later or earlier frames are missing.
        off_plates: whether some foot stands off the plates. late: whether later frames helped.
        variance_scale: of the noise that ``sd`` goes by.
    """

    time: Array
    step_s: float
    states: Array
    sd: Blocks
    known_sd: Array
    known: Array
    wrench: Array
    wrench_rate: Array
    segments: Sequence[str]
    used: Flags
    sources: npt.NDArray[np.uint8]
    ends: Flags
    off_plates: bool
    late: bool
    variance_scale: float
    noise: Array | None = None

    @classmethod
    def of(
        cls, data: xr.Dataset, feet: int, variance_scale: float, *, late: bool, noise: Array | None = None
    ) -> Frames:
        """Those of a recording.

        Args:
            data: as of `Estimate`, with ``state``, ``state_sd``, ``final_covariance``, and ``foot_wrench`` of a model
                whose contacts have been used.
            feet: how many of the contacts are feet.
        """
        time = np.asarray(data["time"].values)
        wrench, segments = wrenches_of(data)
        sources = moment_sources(data)
        return cls(
            time=time,
            step_s=step_of(time),
            states=values_of(data, "state"),
            sd={block: values_of(data, f"{block}_sd") for block in BLOCKS},
            # how constants hang together is known at the end alone, how well they are known in each frame
            known_sd=values_of(data, "state_sd"),
            known=_correlation(data["final_covariance"].values),
            wrench=wrench,
            wrench_rate=rates(wrench, time),
            segments=segments,
            used=in_use(np.isfinite(values_of(data, "markers_measured")).any(axis=2), time),
            sources=np.where(plates_refused(data)[:, None], as_believed(sources), sources),
            ends=at_the_ends(time),
            off_plates=any_off_plates(data, feet),
            late=late,
            variance_scale=variance_scale,
            noise=noise,
        )

    def at(self, k: int, geometry: Geometry) -> Frame:
        """One of them."""
        external, rate = (geometry.external(each[k], self.segments) for each in (self.wrench, self.wrench_rate))
        noise = None if self.noise is None else self.noise[k]
        known = (self.known_sd[k], self.known)
        return Frame(geometry, self.states[k], external, rate, self.used[k], known, noise, self.segments)


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame, and how what is estimated in it goes with markers and with the larger model of `Geometry`.

    Attributes:
        x: (n,) state. external: (S, 6) wrenches on the segments, about the ground's origin. external_rate: (S, 6) by
            how much they change a second. used: (M,), known: (n,) and (n, n), noise: (6 F, 6 F), segments: as of
            `Frames`; not given: all markers, no noise.
    """

    geometry: Geometry
    x: Array
    external: Array
    external_rate: Array
    used: Flags | None
    known: tuple[Array, Array]
    noise: Array | None = None
    segments: Sequence[str] = ()

    @property
    def motion(self) -> tuple[Array, Array, Array]:
        """Free coordinates, their speeds and accelerations (K,)."""
        K = len(self.geometry.free)
        return self.x[:K], self.x[K : 2 * K], self.x[2 * K : 3 * K]

    @cached_property
    def around(self) -> list[tuple[Array, Array, Array]]:
        """`_STEP_S` before, now and as much after: the posture (K,), and what `Geometry.gain` has of it."""
        q, qd, qdd = self.motion
        moved = [q + h * qd + 0.5 * h * h * qdd for h in (-_STEP_S, 0.0, _STEP_S)]
        return [(each, *self.geometry.gain(self.geometry.errors.state(each, qd, qdd), self.used)) for each in moved]

    @cached_property
    def moment_jacobian(self) -> Array:
        """(C, .) of the moments by the states of the larger model."""
        x = self.geometry.errors.state(*self.motion)
        return np.asarray(_core.moment_jacobian(self.geometry.errors.model, x, self.external)[: self.geometry.count])

    @property
    def moments_by_motion(self) -> list[Array]:
        """(C, K) each: the part of it by free coordinates, their speeds and accelerations."""
        errors = self.geometry.errors
        size = len(errors.free) + len(errors.placed)
        return [self.moment_jacobian[:, k * size + errors.free] for k in range(3)]


def differences(values: list[Array]) -> tuple[Array, Array, Array]:
    """Value, rate and second derivative of what is given as in `Frame.around`."""
    before, now, after = values
    return now, (after - before) / (2.0 * _STEP_S), (after - 2.0 * now + before) / _STEP_S**2


def wrenches_of(data: xr.Dataset) -> tuple[Array, list[str]]:
    """Wrenches (T, F, 6) of the contacts and their segments; none where the model has no contacts."""
    if "foot_wrench" not in data:
        return np.zeros((len(data["time"]), 0, 6)), []
    return np.nan_to_num(values_of(data, "foot_wrench")), [str(name) for name in data["foot_segment"].values]


def rates(wrench: Array, time: Array) -> Array:
    """By how much wrenches (T, ...) change, a second, from sample to sample (a load passes from foot to foot within
    one); 0 beside what is not known."""
    return np.nan_to_num(np.gradient(wrench, time, axis=0)) if len(time) > 1 else np.zeros_like(wrench)


def as_believed(sources: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Codes of moments of frames whose plates were refused, by which they are no surer than if these were believed."""
    return np.where(sources == DERIVED, MEASURED, sources).astype(np.uint8)


def any_off_plates(data: xr.Dataset, feet: int) -> bool:
    """Whether some foot stands off the plates in a frame of a recording.

    Args:
        feet: how many of the contacts are feet: the first ones, declared ones follow.
    """
    return "foot_contact" in data and stands_off_plates(values_of(data, "foot_contact"), feet)


def _correlation(covariance: Array) -> Array:
    """Of what is known for sure none with anything else."""
    sd = np.sqrt(np.diag(covariance))
    scale = np.divide(1.0, sd, out=np.zeros_like(sd), where=sd > 0.0)
    found: Array = scale[:, None] * covariance * scale
    np.fill_diagonal(found, 1.0)
    return found
