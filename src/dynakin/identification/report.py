"""What an identification says, in sentences: what moved, how sure, of what the data said nothing, and what changed
between two sessions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.identification.batch import Posterior
from dynakin.identification.decision import Decision
from dynakin.identification.observability.element_words import inertia_words, is_planar
from dynakin.identification.observability.structure import base_spread
from dynakin.model.identified import Batch, IdentifiedSubject
from dynakin.results.measures.posterior import judged
from dynakin.results.naming import listed, number, words

_CENTRE_M = 0.005  # of a centre of mass, from which on it is said to have moved


def in_words(decision: Decision, posterior: Posterior, batch: Batch) -> list[str]:
    """Sentences, in the order in which they are asked for."""
    return [*decision.in_words(), *_moved(posterior), *base_in_words(batch)]


def base_of_batch(batch: Batch) -> tuple[Array, Array, Array]:
    """Base parameters of a batch (r,), their standard deviations and those of the prior."""
    K = np.array(batch.K)
    sd, prior = (base_spread(K, np.array(matrix)) for matrix in (batch.covariance, batch.prior_covariance))
    return K @ np.array(batch.values), sd, prior


@dataclass(frozen=True)
class SegmentRow:
    """A segment: mass, the table's and the standard deviation (kg); how far its centre of mass left the table's (2,) or
    (3,) m, along the segment's axes."""

    segment: str
    mass: float
    table: float
    sd: float
    centre: Array

    @property
    def moved(self) -> str:
        """In words; nothing where it stayed."""
        if np.abs(self.centre).max() < _CENTRE_M:
            return ""
        ways = ("forward", "up", "right")
        return ", ".join(f"{1e3 * x:+z.0f} mm {way}" for x, way in zip(self.centre, ways, strict=False))


def segment_rows(posterior: Posterior) -> list[SegmentRow]:
    """One row a segment."""
    inertial = posterior.unknowns.inertial
    u = posterior.unknowns.split(posterior.theta)[0]
    mass = inertial.masses(u)
    sd = np.sqrt(np.diag(posterior.phi_covariance()))[:: len(inertial.names) // len(mass)]
    columns = zip(inertial.segments, mass, inertial.masses(0.0 * u), sd, inertial.centre_moves(u), strict=True)
    return [SegmentRow(words(segment), float(m), float(t), float(s), move) for segment, m, t, s, move in columns]


def _moved(posterior: Posterior) -> list[str]:
    rows = segment_rows(posterior)
    masses = [f"{row.segment} {row.mass:.2f} kg (table {row.table:.2f}, sd {row.sd:.2f})" for row in rows]
    centres = [f"{row.segment} {row.moved}" for row in rows if row.moved]
    moved = listed(centres, 40) if centres else f"none by {1e3 * _CENTRE_M:.0f} mm"
    total = posterior.unknowns.inertial.total
    return [f"Masses, {total:.2f} kg together: {listed(masses, 40)}.", f"Centres of mass that moved: {moved}."]


def base_in_words(batch: Batch) -> list[str]:
    """How sure: what is known of the sums that plates identify, and of which the data say nothing."""
    values, sd, prior = base_of_batch(batch)
    asked = np.flatnonzero(prior > GIVEN * np.maximum(1.0, np.abs(values)))
    values, sd, prior = values[asked], sd[asked], prior[asked]
    sums, names = [batch.base_words[k] for k in asked], [batch.base_names[k] for k in asked]
    share = np.divide(sd, prior, out=np.ones_like(sd), where=prior > 0.0)
    verdicts = [judged(float(s)) for s in share]
    counts = {word: verdicts.count(word) for word in ("known", "partly", "nothing")}
    said = [
        f"Of {len(values)} base parameters (sums of inertial numbers that plates identify) {counts['known']} are known "
        f"from these trials, {counts['partly']} in part, and of {counts['nothing']} they say nothing."
    ]
    best = np.argsort(share)[:5]
    known = [
        f"{sums[k]} = {number(float(values[k]))} (sd {number(float(sd[k]))}, {100 * share[k]:.0f} % of the table's)"
        for k in best
    ]
    said.append(f"Best known: {'; '.join(known)}.")
    planar = is_planar(batch.names)
    none = [inertia_words(names[k], planar=planar) for k in range(len(share)) if verdicts[k] == "nothing"]
    if none:
        said.append(f"The data say nothing of the sums that hold {listed(none, 30)}: these lean on the table.")
    return said


GIVEN = 1e-6
"""Of a number (SI), what is no uncertainty of it: a mass that is given was not identified (its deviation is 3e-8)."""
ROUNDING = 1e-9
"""Of a number (SI), what no session can show: a total mass that is given has no deviation, and differs by 1e-14."""


@dataclass(frozen=True)
class Change:
    """One base parameter: before, after and their difference (SI); ``sd`` of the difference, sqrt of the sum of both
    variances. Both sessions lean on the same table, whose error is common to them, so ``sd`` is rather too large."""

    words: str
    before: float
    after: float
    sd: float

    @property
    def difference(self) -> float:
        """After less before."""
        return self.after - self.before

    @property
    def clear(self) -> bool:
        """Whether the difference is beyond two of its standard deviations, and more than rounding."""
        return abs(self.difference) > 2.0 * self.sd + ROUNDING * max(1.0, abs(self.before), abs(self.after))


def change_between(before: IdentifiedSubject, after: IdentifiedSubject) -> list[Change]:
    """Changes, the clearest first; sums by the first session's geometry.

    Raises:
        ModelError: the two are not of the same model.
    """
    if before.model != after.model or before.batch.names != after.batch.names:
        raise ModelError(f"two sessions: models {before.model} and {after.model}, expected the same model in both")
    K = np.array(before.batch.K)
    first, second = (K @ np.array(subject.batch.values) for subject in (before, after))
    spread = np.array(before.batch.covariance) + np.array(after.batch.covariance)
    sd = base_spread(K, spread)
    found = [
        Change(words, float(a), float(b), float(s))
        for words, a, b, s in zip(before.batch.base_words, first, second, sd, strict=True)
    ]
    return sorted(found, key=lambda change: -abs(change.difference) / max(change.sd, 1e-300))


def change_in_words(changes: list[Change], masses: tuple[float, float]) -> list[str]:
    """Sentences."""
    clear = [change for change in changes if change.clear]
    said = [f"Mass {masses[0]:.2f} kg before, {masses[1]:.2f} kg after ({masses[1] - masses[0]:+z.2f} kg)."]
    if not clear:
        return [*said, f"None of {len(changes)} base parameters changed by more than two standard deviations."]
    said.append(f"{len(clear)} of {len(changes)} base parameters changed by more than two standard deviations:")
    said += [
        f"{c.words}: {number(c.before)} to {number(c.after)} ({c.difference:+.3g}, sd {number(c.sd)})" for c in clear
    ]
    return said
