"""What an identification says, in sentences: what moved, how sure, and of what the data said nothing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dynakin.identification.batch import Posterior
from dynakin.identification.decision import Decision
from dynakin.model.identified import Batch
from dynakin.results.learned import judged
from dynakin.results.naming import listed, number, words

Array = npt.NDArray[np.float64]

_CENTRE_M = 0.005  # of a centre of mass, from which on it is said to have moved


def in_words(decision: Decision, posterior: Posterior, batch: Batch) -> list[str]:
    """Sentences, in the order in which they are asked for."""
    return [*decision.in_words(), *_moved(posterior), *_base(batch)]


def base_of_batch(batch: Batch) -> tuple[Array, Array, Array]:
    """Base parameters of a batch (r,), their standard deviations and those of the prior."""
    K = np.array(batch.K)
    sd, prior = (
        np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", K, np.array(matrix), K), 0.0))
        for matrix in (batch.covariance, batch.prior_covariance)
    )
    return K @ np.array(batch.values), sd, prior


def _moved(posterior: Posterior) -> list[str]:
    bodies = posterior.unknowns.bodies
    u = posterior.unknowns.split(posterior.theta)[0]
    mass = bodies.masses(u)
    each = len(bodies.names) // len(mass)
    sd = np.sqrt(np.diag(posterior.phi_covariance()))[::each]
    masses = [
        f"{words(segment)} {m:.2f} kg (table {t:.2f}, sd {s:.2f})"
        for segment, m, t, s in zip(bodies.segments, mass, bodies.masses(0.0 * u), sd, strict=True)
    ]
    centres = [
        f"{words(segment)} {_directions(move)}"
        for segment, move in zip(bodies.segments, bodies.centre_moves(u), strict=True)
        if np.abs(move).max() >= _CENTRE_M
    ]
    moved = listed(centres, 40) if centres else f"none by {1e3 * _CENTRE_M:.0f} mm"
    return [f"Masses, {bodies.total:.2f} kg in all: {listed(masses, 40)}.", f"Centres of mass that moved: {moved}."]


def _directions(move: Array) -> str:
    """Of a segment's own axes (2,) or (3,), m."""
    return ", ".join(f"{1e3 * x:+.0f} mm {way}" for x, way in zip(move, ("forward", "up", "right"), strict=False))


def _base(batch: Batch) -> list[str]:
    values, sd, prior = base_of_batch(batch)
    share = np.divide(sd, prior, out=np.ones_like(sd), where=prior > 0.0)
    verdicts = [judged(float(s)) for s in share]
    counts = {word: verdicts.count(word) for word in ("known", "partly", "nothing")}
    said = [
        f"Of {len(values)} base parameters (sums of inertial numbers that plates can tell) {counts['known']} are known "
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
        said.append(f"The data say nothing of the sums named after {listed(none, 30)}: these stay the table's.")
    return said
