"""What a model's measurements can identify at all, whoever moves and however: base parameters of the wrench (sums of
the inertia), their posterior of a trial, and gauges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.blas import one_blas_thread
from dynakin.errors import ModelError
from dynakin.filter.tracker import Tracker
from dynakin.identification.observability.element_words import base_words, gauges_in_words, inertia_words, is_planar
from dynakin.identification.observability.gauges import Gauges, gauges_of
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.results.naming import listed
from dynakin.validation.reference.base_parameters import BaseParameters, base_parameters
from dynakin.validation.reference.condensed import stacked

_POSTURES = 400
_NONE = 1e-9  # of a prior standard deviation: less of a number in every base parameter is rounding


def base_of(measured: MeasuredModel, states: Array | None = None) -> BaseParameters:
    """Base parameters of the stacked regressor: of random motion (what the model allows), or of given states.

    The regressor is the core's derivative of the wrench with respect to the inertial numbers, in which it is linear
    (Ayusawa et al. 2013), its columns in units of the prior standard deviations; so the condition number says how
    unevenly a motion identifies what was not known before.

    Args:
        states: (T, n).

    Raises:
        RecordingError: fewer states than inertial numbers.
        ModelError: the model estimates none.
    """
    states = measured.random_states(_POSTURES) if states is None else states
    at = measured.block("inertia")
    if at.start == at.stop:
        raise ModelError(f"model {measured.initial.spec.name}: it estimates no inertial number, expected at least one")
    table = states[-1, at]
    Y = np.stack([measured.wrench_rows(x)[:, at] for x in states])
    names, scale = measured.names[at], np.sqrt(np.diag(measured.prior)[at])
    every = np.ones(len(names), dtype=bool)
    return base_parameters(stacked(names, table, scale, every, Y, Y @ table, sigma=measured.wrench_sigma().tolist()))


def in_no_base_parameter(base: BaseParameters, measured: MeasuredModel) -> list[str]:
    """Names of the inertial numbers that the wrench does not depend on in any motion like that of ``base``."""
    sd = np.sqrt(np.diag(measured.prior)[measured.block("inertia")])
    size = np.abs(base.K * sd).max(axis=0, initial=0.0) / sd
    return [name for name, value in zip(base.over, size, strict=True) if value < _NONE]


def identified_alone(base: BaseParameters, measured: MeasuredModel) -> set[str]:
    """Names of the inertial numbers that some motion identifies by themselves; of the others only sums."""
    sd = np.sqrt(np.diag(measured.prior)[measured.block("inertia")])
    rows = np.linalg.qr((base.K * sd).T)[0]  # (e, r): an orthonormal basis of what can be identified
    left = 1.0 - (rows**2).sum(axis=1)
    return {name for name, value in zip(base.over, left, strict=True) if value < _NONE}


def base_spread(K: Array, covariance: Array) -> Array:
    """Standard deviations (r,) of the base parameters K phi from a covariance (e, e) of the inertial numbers phi; a
    variance that rounding left below 0 is 0."""
    return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", K, covariance, K), 0.0)))


@dataclass(frozen=True, eq=False)
class Structure:
    """Base parameters and gauges of a model, by random motion within the joints' limits.

    Attributes:
        base: base parameters. base_in_words: each as the sum that it is.
        in_none: inertial numbers that are in no base parameter. alone: those that some motion identifies by themselves.
        gauges, gauges_in_words: what no measurement sees; the words put the skin's displacements together.
    """

    base: BaseParameters
    base_in_words: tuple[str, ...]
    in_none: tuple[str, ...]
    alone: frozenset[str]
    gauges: Gauges
    gauges_in_words: tuple[str, ...]

    def in_words(self) -> list[str]:
        """Rank and what is in none of the base parameters, a sentence each."""
        base, planar = self.base, is_planar(self.base.over)
        said = [
            f"{base.rank} of {len(base.over)} inertial numbers, as sums (base parameters), can be identified from the "
            f"ground reaction; condition number {base.condition:.2g} over random motion, each number in units of its "
            "prior standard deviation."
        ]
        if self.in_none:
            names = [inertia_words(name, planar=planar) for name in self.in_none]
            said.append(f"In no base parameter, so without any effect on the ground reaction: {listed(names, 20)}.")
        else:
            said.append("Every inertial number is in some base parameter.")
        return said

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "rank": self.base.rank,
            "of": len(self.base.over),
            "condition": self.base.condition,
            "in_none": list(self.in_none),
            "gauges": {
                "count": len(self.gauges.found),
                "words": list(self.gauges_in_words),
                "directions": [gauge.direction for gauge in self.gauges.found],
            },
        }


@one_blas_thread
def structure_of(tracker: Tracker) -> Structure:
    """Base parameters and gauges of a tracker's model."""
    measured = MeasuredModel.of(tracker)
    spec, base, gauges = measured.initial.spec, base_of(measured), gauges_of(measured)
    return Structure(
        base,
        tuple(base_words(base, spec)),
        tuple(in_no_base_parameter(base, measured)),
        frozenset(identified_alone(base, measured)),
        gauges,
        tuple(gauges_in_words(gauges.found, spec)),
    )
