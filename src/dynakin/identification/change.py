"""The change of base parameters between two sessions of one subject, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.errors import ModelError
from dynakin.identification.observability.base import base_spread
from dynakin.model.identified import IdentifiedSubject
from dynakin.results.naming import number

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
