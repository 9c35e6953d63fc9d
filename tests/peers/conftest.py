"""The synthetic estimate of the results' tests, for a look at the files by others."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "results"))

from synthetic_estimate import make_estimate

from dynakin.results.estimate import Estimate


@pytest.fixture(scope="session")
def estimate() -> Estimate:
    """Twelve seconds of a squat, with gaps, bounds reached and a locked translation."""
    return make_estimate()
