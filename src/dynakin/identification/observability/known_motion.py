"""What a motion shows of the constants where the motion is known: linear least squares, without a filter.

Along a known motion the derivatives of all measurements are known beforehand, and what a filter would know at its end
is the inverse of an information matrix. It is summed frame by frame; what moves is eliminated as soon as the next frame
is there (Schur complement), so that one frame's moving states and the constants are all that is held. Two things make
it quick (docs/derivations.md, section 19):

- Skin. In its segment's axes each marker's displacement is a process of its own, s' = a s + noise. Rows less a times
  those of the frame before have white noise, and the displacements are no unknowns.
- Few frames: `RATE_HZ` a second, each with the noise that those in its place have together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from dynakin.arrays import Array, Flags
from dynakin.bindings import _core
from dynakin.filter.augment import continuous_noise
from dynakin.filter.contacts import carry
from dynakin.filter.noise import process_variance, wrench_covariance
from dynakin.filter.tracker import Tracker
from dynakin.identification.observability.measured import MeasuredModel

RATE_HZ = 10.0
"""Frames a second: what is tried swings once a second."""
JERK = 0.02
"""Part of the jerk's density at that rate. Accelerations err faster than anything moves: all frames together average
that out, few cannot. With less jerk they err more slowly, still faster than the movement."""


class Known(NamedTuple):
    """States (T, n) of a motion, and in which frames markers (T, M) and plates (T,) are not measured."""

    states: Array
    missing: Flags
    blind: Flags


class KnownMotion:
    """Deviations of the constants after motions that are known, with the noise of a tracker.

    Args:
        interval_s: between two frames of the motions.
    """

    def __init__(self, tracker: Tracker, measured: MeasuredModel, interval_s: float) -> None:
        noise, self._measured = tracker.noise, measured
        self._every = max(1, round(1.0 / (RATE_HZ * interval_s)))
        dt = self._every * interval_s
        density, decay = continuous_noise(measured.initial, noise, measured.core.layout)
        variance = self._every * process_variance(noise, measured.core.layout)
        for values in (density, variance):  # a recording of so few frames is filtered with all of it
            values[measured.block("accelerations")] *= max(JERK, self._every**-2.0)

        chain, seen, left_out = (
            self._among(*names)
            for names in (
                ("coordinates", "speeds", "accelerations"),
                ("coordinates", "lengths", "markers"),  # what markers depend on
                ("soft_tissue", "contacts"),
            )
        )
        moves = (chain | (density > 0.0) | (decay > 0.0) | (variance > 0.0)) & ~left_out
        parts = (moves & ~seen, moves & seen, ~moves & seen, ~moves & ~seen & ~left_out)
        sizes = np.cumsum([part.sum() for part in parts])
        self._order = np.concatenate([np.flatnonzero(part) for part in parts])
        self._moving, self._seen = sizes[1], slice(sizes[0], sizes[2])
        self._chain = chain[self._order]
        self._sd = np.sqrt(np.diag(measured.prior)[self._order])  # all that follows is in units of these
        self._prior = inverse(self._scaled(measured.prior, self._order))
        F, Q = transition(density, decay, variance, dt, int(chain.sum()) // 3)
        moving = self._order[: self._moving]
        noise_info = inverse(self._scaled(Q, moving))
        F = F[np.ix_(moving, moving)] * self._sd[: self._moving] / self._sd[: self._moving, None]
        self._process = (F.T @ noise_info @ F, -F.T @ noise_info, noise_info)

        spec = measured.initial.spec
        self._axes = np.array(spec.markers[0].measured)
        self._soft = np.array([any(marker.soft_tissue) for marker in spec.markers])
        self._skin = np.flatnonzero(self._among("soft_tissue")).reshape(-1, int(self._axes.sum()))
        first = self._skin[:, 0]
        self._kept, size = np.zeros((2, len(self._soft)))
        self._kept[self._soft], size[self._soft] = np.exp(-decay[first] * dt), np.diag(measured.prior)[first]
        white = measured.marker_sd**2 / self._every
        self._weight_alone = 1.0 / np.sqrt(size + white)
        self._weight_after = 1.0 / np.sqrt((1.0 - self._kept**2) * size + (1.0 + self._kept**2) * white)
        self._plates = self._plate_weights(wrench_covariance(noise) / self._every, noise.reference_point_m)
        self._mass = np.zeros((0, len(self._order)))
        if noise.total_mass_use == "frame":
            weighed = np.array([name.startswith("inertia/") and name.endswith("/mass") for name in measured.names])
            root = np.sqrt(self._every / noise.total_mass_variance_kg2)
            self._mass = root * (weighed[self._order] * self._sd)[None]

    def deviations(self, *motions: Known) -> Array:
        """Standard deviations (n,) after these motions, one after the other; NaN: skin and contacts.

        What moves is not known again at the beginning of each; the constants are.
        """
        information = self._prior
        for k, motion in enumerate(motions):
            if k:
                information = self._begun_again(information)
            information = self._after(motion, information)
        found = np.full(len(self._measured.names), np.nan)
        found[self._order] = self._sd * np.sqrt(np.diag(inverse(information)))
        return found

    def _after(self, motion: Known, information: Array) -> Array:
        """Information (o, o) after a motion, from that before it."""
        m, at = self._moving, self._seen
        own = m - at.start  # of what markers depend on, as many move
        states, missing, blind = (values[(self._every - 1) // 2 :: self._every] for values in motion)
        before: Array | None = None
        for k, (x, unseen) in enumerate(zip(states, missing, strict=True)):
            rows = self._marker_rows(x)
            kept = np.zeros_like(self._kept) if before is None else np.where(missing[k - 1], 0.0, self._kept)
            weight = np.where(unseen, 0.0, np.where(kept > 0.0, self._weight_after, self._weight_alone))[:, None, None]
            now = weight * rows
            if before is None:
                information = information.copy()
                now = now.reshape(-1, now.shape[2])
                information[at, at] += now.T @ now
            else:
                then = -kept[:, None, None] * weight * before
                now[:, :, own:] += then[:, :, own:]
                both = np.concatenate([then[:, :, :own], now], axis=2).reshape(-1, own + now.shape[2])
                information = self._next(information, both.T @ both, own)
            others = self._mass if blind[k] else np.vstack([self._mass, self._plate_rows(x)])
            information += others.T @ others
            before = rows
        return information

    def _next(self, information: Array, shown: Array, own: int) -> Array:
        """Information of a frame from that of the one before, which is eliminated.

        Args:
            shown: by the markers, over ``own`` that moved in the frame before and all that they depend on in this one.
        """
        m, at = self._moving, self._seen
        past, across, present = self._process
        past, between, rest = information[:m, :m] + past, np.empty((m, len(self._order))), np.zeros_like(information)
        between[:, :m], between[:, m:] = across, information[:m, m:]
        rest[:m, :m], rest[m:, m:] = present, information[m:, m:]
        past[at.start :, at.start :] += shown[:own, :own]
        between[at.start :, at] += shown[:own, own:]
        rest[at, at] += shown[own:, own:]
        eliminated = scipy.linalg.solve_triangular(np.linalg.cholesky(past), between, lower=True, check_finite=False)
        return np.asarray(rest - eliminated.T @ eliminated)

    def _begun_again(self, information: Array) -> Array:
        """Information before another motion: as the start's on the motion."""
        new, old = self._chain, ~self._chain
        cross = information[np.ix_(new, old)]
        found = np.zeros_like(information)
        found[np.ix_(new, new)] = self._prior[np.ix_(new, new)]
        found[np.ix_(old, old)] = information[np.ix_(old, old)] - cross.T @ np.linalg.solve(
            information[np.ix_(new, new)], cross
        )
        return found

    def _marker_rows(self, x: Array) -> Array:
        """Derivatives (M, axes, k) of the markers with respect to what they depend on, of those on skin in the axes of
        their segments."""
        J = _core.marker_jacobian(self._measured.core, x).reshape(len(self._soft), 3, -1)[:, self._axes]
        rows = J[:, :, self._order[self._seen]] * self._sd[self._seen]
        turned = np.take_along_axis(J[self._soft], self._skin[:, None], axis=2)  # of skin: its segment's axes
        rows[self._soft] = turned.transpose(0, 2, 1) @ rows[self._soft]
        return np.asarray(rows)

    def _plate_rows(self, x: Array) -> Array:
        """Derivatives (r, o) of the measured components of the wrench, in units of their noise."""
        return np.asarray(self._plates @ _core.plates_jacobian(self._measured.core, x)[:, self._order] * self._sd)

    def _plate_weights(self, covariance: Array, reference_point: object) -> Array:
        """(r, 6) from the wrench about the ground origin to independent rows of variance 1."""
        initial = self._measured.initial
        point = initial.plate_centre if reference_point == "auto" else reference_point
        shift = carry(np.asarray(point, dtype=float))
        used = np.flatnonzero(initial.spec.wrench_measured)
        root = np.linalg.cholesky((shift @ covariance @ shift.T)[np.ix_(used, used)])
        return np.asarray(np.linalg.solve(root, np.eye(6)[used]))

    def _scaled(self, covariance: Array, order: npt.NDArray[np.intp]) -> Array:
        """Of these elements, the first of the order, in units of their prior standard deviations."""
        sd = self._sd[: len(order)]
        return np.asarray(covariance[np.ix_(order, order)] / np.outer(sd, sd))

    def _among(self, *blocks: str) -> Flags:
        """(n,) which elements of the state are in these blocks."""
        found = np.zeros(len(self._measured.names), dtype=bool)
        for name in blocks:
            found[self._measured.block(name)] = True
        return found


def inverse(A: Array) -> Array:
    """Covariance from information, or the other way round, by Cholesky."""
    return np.asarray(scipy.linalg.cho_solve(scipy.linalg.cho_factor(A), np.eye(len(A))))


def transition(density: Array, decay: Array, variance: Array, dt: float, free: int) -> tuple[Array, Array]:
    """F and Q (n, n) of a step of ``dt`` s, as the core's `predict` has them.

    Args:
        density, decay: as `continuous_noise` gives them. variance: (n,) that is added in a step.
        free: number of coordinates, which lead the state, followed by their speeds and accelerations.
    """
    rest = np.arange(3 * free, len(decay))
    F, Q = np.diag(np.exp(-decay * dt)), np.diag(variance)
    rate = np.where(decay > 0.0, decay, 1.0)
    Q[rest, rest] += density[rest] * np.where(decay > 0.0, -np.expm1(-2.0 * rate * dt) / (2.0 * rate), dt)[rest]
    powers = dt ** np.arange(6)
    for k in range(free):
        F[k, free + k], F[k, 2 * free + k], F[free + k, 2 * free + k] = dt, powers[2] / 2.0, dt
        at = np.ix_([k, free + k, 2 * free + k], [k, free + k, 2 * free + k])
        Q[at] += density[2 * free + k] * np.array(
            [
                [powers[5] / 20.0, powers[4] / 8.0, powers[3] / 6.0],
                [powers[4] / 8.0, powers[3] / 3.0, powers[2] / 2.0],
                [powers[3] / 6.0, powers[2] / 2.0, dt],
            ]
        )
    return F, Q
