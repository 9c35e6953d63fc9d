"""Base parameters of the wrench: what of the inertia plates can identify at all, and the posterior of a trial."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.errors import ModelError
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.validation.reference.base_parameters import BaseParameters, base_parameters
from dynakin.validation.reference.condensed import stacked

Array = npt.NDArray[np.float64]

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
