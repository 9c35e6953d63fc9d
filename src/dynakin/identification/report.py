"""What an identification says, in sentences: what moved, how sure, and of what the data said nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.identification.batch import Posterior
from dynakin.identification.decision import Decision
from dynakin.identification.observability.base import base_spread
from dynakin.model.identified import Batch
from dynakin.results.measures.posterior import judged
from dynakin.results.naming import listed, number, words

Array = npt.NDArray[np.float64]

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
    share = np.divide(sd, prior, out=np.ones_like(sd), where=prior > 0.0)
    verdicts = [judged(float(s)) for s in share]
    counts = {word: verdicts.count(word) for word in ("known", "partly", "nothing")}
    said = [
        f"Of {len(values)} base parameters (sums of inertial numbers that plates identify) {counts['known']} are known "
        f"from these trials, {counts['partly']} in part, and of {counts['nothing']} they say nothing."
    ]
    best = np.argsort(share)[:5]
    known = [
        f"{batch.base_words[k]} = {number(float(values[k]))} (sd {number(float(sd[k]))}, {100 * share[k]:.0f} % of the "
        "table's)"
        for k in best
    ]
    said.append(f"Best known: {'; '.join(known)}.")
    none = [batch.base_names[k].removeprefix("inertia/") for k in range(len(share)) if verdicts[k] == "nothing"]
    if none:
        said.append(f"The data say nothing of the sums named after {listed(none, 30)}: these lean on the table.")
    return said
