"""Prior standard deviations and bounds of every element that a state can have, by the core's names of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from dynakin.arrays import Array
from dynakin.model.inertia import INERTIA_NAMES, RigidBody
from dynakin.model.schema import Interval
from dynakin.settings.model import Bounds, Priors

_SDS = 4.0
"""Half width of the bounds of what has a standard deviation of its own: the +-20 % of a length are as much of its."""
_POSITIVE = frozenset({"mass", "ixx", "iyy", "izz"})
COMMON_SKIN = 0.36
"""Part of the variance of its skin's displacement that all markers of a segment share."""
_LEAST_SHARE = 0.1  # of the table's value: a segment is not left without mass


@dataclass(frozen=True, eq=False)
class JointPrior:
    """Prior covariance (k, k) of elements of the state that are known together, by name; how well each is known by
    itself is ``CalibratedModel.sd0``."""

    names: tuple[str, ...]
    covariance: Array

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviation of each by itself."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    def with_known(self, other: JointPrior) -> JointPrior:
        """With what is known otherwise of some of the elements, or of others."""
        kept = [k for k, name in enumerate(self.names) if name not in other.names]
        names = (*(self.names[k] for k in kept), *other.names)
        return JointPrior(names, block_diag(self.covariance[np.ix_(kept, kept)], other.covariance))


def state_prior(
    kinds: Mapping[str, str],
    lengths: Mapping[str, float],
    length_sd: Mapping[str, float],
    markers: Iterable[str],
    inertia: Mapping[str, RigidBody],
    reach: Mapping[str, float],
    priors: Priors,
    worn_kg: Mapping[str, float],
) -> dict[str, float]:
    """Standard deviations.

    Args:
        kinds: "rotation" or "translation" of each coordinate. lengths: values of the geometry parameters.
        length_sd: of those that are known otherwise than to a part of their value.
        reach: length (m) that a segment's first moments are compared with.
        worn_kg: standard deviation of what a segment may weigh more or less, regardless of its size; else none.
    """
    sd: dict[str, float] = {}
    for name, kind in kinds.items():
        turn = kind == "rotation"
        sd[name] = np.deg2rad(priors.rotation_sd_deg) if turn else priors.translation_sd_m
        sd[f"{name}/speed"] = np.deg2rad(priors.rotation_speed_sd_deg_s) if turn else priors.translation_speed_sd_m_s
        sd[f"{name}/acceleration"] = (
            np.deg2rad(priors.rotation_acceleration_sd_deg_s2) if turn else priors.translation_acceleration_sd_m_s2
        )
    for name, value in lengths.items():
        sd[f"length/{name}"] = length_sd.get(name, priors.length_sd_fraction * value)
    for marker in markers:
        sd |= {f"marker/{marker}/{axis}": priors.marker_sd_m for axis in "xyz"}
    for segment, body in inertia.items():
        entry = np.sqrt(np.diag(inertia_covariance(body, reach[segment], priors, worn_kg.get(segment, 0.0))))
        sd |= {f"inertia/{segment}/{name}": float(value) for name, value in zip(INERTIA_NAMES, entry, strict=True)}
    return sd


def state_bounds(
    limits: Mapping[str, Interval],
    lengths: Mapping[str, float],
    length_sd: Mapping[str, float],
    places: Mapping[str, Array],
    inertia: Mapping[str, RigidBody],
    reach: Mapping[str, float],
    bounds: Bounds,
    worn_kg: Mapping[str, float],
) -> dict[str, Interval]:
    """Bounds of (9); speeds and accelerations have none.

    Args:
        limits: of the coordinates. places: (3,) m of each marker on its segment; the others as in ``state_prior``.
    """
    found: dict[str, Interval] = dict(limits)
    for name, value in lengths.items():
        half = _SDS * length_sd[name] if name in length_sd else bounds.length_fraction * value
        found[f"length/{name}"] = (value - half, value + half)
    for name, place in places.items():
        for axis, at in zip("xyz", place, strict=True):
            half = bounds.marker_threshold_m
            found[f"marker/{name}/{axis}"] = (float(at) - half, float(at) + half)
    for segment, body in inertia.items():
        entry = inertia_bounds(body, reach[segment], bounds, worn_kg.get(segment, 0.0))
        found |= {f"inertia/{segment}/{name}": interval for name, interval in entry.items()}
    return found


def inertia_covariance(body: RigidBody, length: float, priors: Priors, worn_kg: float) -> Array:
    """Prior covariance (10, 10) of a segment's inertia: each number by itself, and mass that has the body's shape, and
    lies anywhere in it: as far from the centre of mass as the body's own mass does."""
    found = np.diag(np.square(list(inertia_prior(body, length, priors).values())))
    if body.mass > 0.0:
        per_kg = body.vector / body.mass
        found += worn_kg**2 * np.outer(per_kg, per_kg)
        found[1:4, 1:4] += worn_kg**2 * body.spread
    return np.asarray(found)


def places_prior(
    places: Mapping[str, Array],
    segment_of: Mapping[str, str],
    priors: Priors,
    since_m: Mapping[str, float] | None = None,
) -> JointPrior:
    """Of markers' places (3,) on their segments: those of a segment together (`cluster_covariance`).

    Args:
        since_m: standard deviation of the way that each marker's skin has gone since it was measured.
    """
    names: list[str] = []
    blocks: list[Array] = []
    for segment in dict.fromkeys(segment_of.values()):
        own = [name for name in places if segment_of[name] == segment]
        names += [f"marker/{name}/{axis}" for name in own for axis in "xyz"]
        block = cluster_covariance(np.array([places[name] for name in own]), priors)
        blocks.append(block + _moved_covariance(np.array([(since_m or {}).get(name, 0.0) for name in own])))
    return JointPrior(tuple(names), block_diag(*blocks))


def cluster_covariance(places: Array, priors: Priors) -> Array:
    """Prior covariance (3 M, 3 M) of the places (M, 3) of a segment's markers that were measured together: a shift and
    a turn of all of them, and what each has of its own; of one alone as of any marker."""
    if len(places) == 1:
        return np.asarray(priors.marker_sd_m**2 * np.eye(3))
    shifts = np.tile(np.eye(3), (len(places), 1))
    turns = np.cross(np.eye(3), (places - places.mean(axis=0))[:, None]).swapaxes(1, 2).reshape(-1, 3)
    together = np.hstack([priors.cluster_shift_sd_m * shifts, np.deg2rad(priors.cluster_turn_sd_deg) * turns])
    return np.asarray(together @ together.T + priors.cluster_marker_sd_m**2 * np.eye(len(shifts)))


def _moved_covariance(since_m: Array) -> Array:
    """Covariance (3 M, 3 M) of how far skin has moved under M markers of a segment, in part together."""
    shared = COMMON_SKIN * np.outer(since_m, since_m) + (1.0 - COMMON_SKIN) * np.diag(since_m**2)
    return np.asarray(np.kron(shared, np.eye(3)))


def inertia_prior(body: RigidBody, length: float, priors: Priors) -> dict[str, float]:
    """Standard deviation of each of the ten numbers, each by itself."""
    moment = priors.inertia_sd_fraction * max(float(np.trace(body.inertia)) / 2.0, 1e-12)
    planar = priors.inertia_sd_fraction * max(float(body.inertia[2, 2]), 1e-12)
    sd = dict.fromkeys(INERTIA_NAMES, moment)
    sd |= dict.fromkeys(("mx", "my", "mz"), priors.first_moment_sd_fraction * body.mass * length)
    return sd | {"mass": priors.mass_sd_fraction * body.mass, "izz": planar}


def inertia_bounds(body: RigidBody, length: float, bounds: Bounds, worn_kg: float) -> dict[str, Interval]:
    """(lower, upper) of each of the ten numbers."""
    share = _SDS * worn_kg / body.mass if body.mass > 0.0 else 0.0
    values = dict(zip(INERTIA_NAMES, body.vector, strict=True))
    found: dict[str, Interval] = {}
    for name, value in values.items():
        if name == "mass":
            half = bounds.mass_fraction * abs(value)
        elif name in ("mx", "my", "mz"):
            half = bounds.first_moment_fraction * body.mass * length
        elif name in ("ixx", "iyy", "izz"):
            half = bounds.inertia_fraction * abs(value)
        else:  # products are bounded by the moments: |ixy| <= (ixx + iyy) / 2 for every real body
            half = bounds.inertia_fraction * float(np.trace(body.inertia)) / 2.0
        half += share * abs(value)
        low = max(value - half, _LEAST_SHARE * value) if name in _POSITIVE else value - half
        found[name] = (low, value + half)
    return found
