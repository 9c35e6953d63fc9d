"""A synthetic estimate for the tests of what is made from one."""

from __future__ import annotations

import pytest
from synthetic_estimate import make_estimate

from dynakin.results.estimate import Estimate


@pytest.fixture(scope="session")
def estimate() -> Estimate:
    """Twelve seconds of a squat, with gaps, bounds reached and a locked translation."""
    return make_estimate()
