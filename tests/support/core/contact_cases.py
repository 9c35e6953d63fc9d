"""Contacts with everything: states, joint errors, a residual on the root; and how NumPy distributes what they lack."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynakin.bindings import _core
from support.core.bridge import model_of
from support.core.random_models import FEET, random_state, with_contacts
from support.oracle import measurement
from support.oracle.state import Layout, unpack

NONE, MEASURED, UNMEASURED, SHARED = range(4)
CASES = {  # codes of left foot, right foot and the residual
    "both measured": (MEASURED, MEASURED, MEASURED),
    "no residual": (MEASURED, MEASURED, NONE),
    "one derived": (UNMEASURED, MEASURED, MEASURED),
    "both a prior's": (UNMEASURED, UNMEASURED, MEASURED),
    "shared plate": (SHARED, SHARED, MEASURED),
    "one in the air": (NONE, UNMEASURED, MEASURED),
    "nothing but the residual": (NONE, NONE, MEASURED),
    "nothing": (NONE, NONE, NONE),
}


@dataclass
class Drawn:
    spec: Any
    model: _core.Model
    x: NDArray
    segments: list[str]
    wrench: NDArray  # (3, 6)
    covariance: NDArray  # (18, 18)
    effects: NDArray  # (6, 12)
    codes: tuple[int, ...]

    @classmethod
    def of(cls, base: Any, seed: int, codes: tuple[int, ...]) -> Drawn:
        """Errors of the feet go together on a shared plate (a sum known better than its parts); effects of a foot's
        states count where it is on no plate."""
        rng, spec = np.random.default_rng(seed), with_contacts(base, FEET)
        root = rng.normal(size=(18, 18)) * np.repeat([6.0, 6.0, 2.0], 6)[:, None]
        covariance = np.zeros((18, 18))
        for k in range(3):
            here = slice(6 * k, 6 * k + 6)
            covariance[here, here] = root[here] @ root[here].T / 18.0 + np.eye(6)
        if SHARED in codes:
            common = 50.0 * rng.normal(size=(6, 6))
            way = np.vstack([common, -common])  # what one has more the other has less
            covariance[:12, :12] += way @ way.T
        effects = np.zeros((6, 12))
        for k in range(2):
            if codes[k] in (UNMEASURED, NONE):  # of a foot in the air they must not count
                effects[:, 6 * k : 6 * k + 6] = rng.normal(size=(6, 6)) * 40.0
        return cls(
            spec,
            model_of(spec),
            random_state(Layout(spec), rng),
            [*FEET, spec.segments[0].name],
            rng.normal(size=(3, 6)) * 200.0 * np.array([1.0, 1.0, 0.0])[:, None],
            covariance,
            effects,
            codes,
        )

    @property
    def touches(self) -> NDArray:
        return np.array(self.codes) != NONE

    @property
    def matters(self) -> NDArray:
        """(2,) feet whose states change the moments."""
        return np.array(self.codes[:2]) == UNMEASURED

    @property
    def loads(self) -> _core.ContactLoads:
        return self.loads_with(self.wrench)

    def loads_with(self, wrench: NDArray) -> _core.ContactLoads:
        return _core.ContactLoads(
            self.segments,
            np.ascontiguousarray(wrench[None]),
            self.covariance[None],
            np.array([self.codes], np.uint8),
            self.effects[None],
        )

    def expected(self, x: NDArray) -> NDArray:
        """(3, 6) wrenches with the contacts' states; 0 where nothing touches."""
        states = unpack(Layout(self.spec), x).contacts
        out = self.wrench.copy()
        for k in range(2):
            out[k] += self.effects[:, 6 * k : 6 * k + 6] @ states[k]
        return np.where(self.touches[:, None], out, 0.0)

    @property
    def errors(self) -> NDArray:
        """(18, 18) without the rows and columns of what does not touch."""
        keep = np.repeat(self.touches, 6)
        return np.where(keep[:, None] & keep, self.covariance, 0.0)


def distribution(d: Drawn, x: NDArray) -> tuple[NDArray, NDArray]:
    """Wrenches (3, 6) and remainder (6,): f_i = w_i + C_i S^-1 (W - sum w), by loops and an inverse."""
    expected, missing = d.expected(x), measurement.wrench(Layout(d.spec), x) - d.expected(x).sum(axis=0)
    if not d.touches.any():
        return expected, missing
    R = d.errors.reshape(3, 6, 3, 6)
    C = [sum(R[i, :, j] for j in range(3)) for i in range(3)]
    S = np.linalg.inv(sum(C))
    found = np.array([expected[i] + C[i] @ S @ missing for i in range(3)])
    return found, measurement.wrench(Layout(d.spec), x) - found.sum(axis=0)


def conditioned(d: Drawn, x: NDArray) -> tuple[NDArray, NDArray]:
    """Mean (3, 6) and covariance (18, 18) of the wrenches given that they sum to what a certain x needs: the
    conditional of one dense Gaussian, by its precision matrix on what the sum leaves free."""
    keep = np.flatnonzero(np.repeat(d.touches, 6))
    R = d.errors[np.ix_(keep, keep)]
    A = np.tile(np.eye(6), (1, len(keep) // 6))
    free = np.linalg.svd(A)[2][6:].T  # directions that change no sum
    start = d.expected(x).ravel()[keep]
    at = np.linalg.lstsq(A, measurement.wrench(Layout(d.spec), x), rcond=None)[0]
    precision = np.linalg.inv(R)
    along = np.linalg.solve(free.T @ precision @ free, free.T @ precision @ (start - at)) if free.size else np.zeros(0)
    mean, spread = np.zeros(18), np.zeros((18, 18))
    mean[keep] = at + free @ along
    if free.size:
        spread[np.ix_(keep, keep)] = free @ np.linalg.inv(free.T @ precision @ free) @ free.T
    return mean.reshape(3, 6), spread
