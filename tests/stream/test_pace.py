"""Missing samples are no jitter."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.stream.sources.clock import Pace


@pytest.mark.parametrize("rate_error", [0.0, 1e-3, -1e-3])
def test_jitter_of_nearly_half_a_period_is_no_gap_and_gaps_are_counted(rate_error: float) -> None:
    rng = np.random.default_rng(2)
    kept = np.delete(np.arange(5000), [1000, 2000, 2001, 2002])
    stamps = kept * (1.0 + rate_error) * 1e-3 + rng.uniform(-0.35e-3, 0.35e-3, len(kept))
    pace = Pace(1e-3)
    found = [pace.missing(t, t) for t in stamps]
    assert {int(kept[k]): n for k, n in enumerate(found) if n} == {1001: 1, 2003: 3}


def test_blocks_count_as_their_samples() -> None:
    pace = Pace(1e-3)
    blocks = ((0.0, 0.0095), (0.010, 0.0085), (0.025, 0.009), (0.035, 0.009))
    assert [pace.missing(t, t + late, 10) for t, late in blocks] == [0, 0, 5, 0]
