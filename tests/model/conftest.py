"""A made-up person with known joint places, as a recording with the marker names of the set "opencap"."""

from __future__ import annotations

import pytest

from dynakin.recordings.recording import Recording
from support.made_person import make, stand


@pytest.fixture
def standing_person() -> Recording:
    """One second of standing with ankle 5, knee 8 and hip 10 deg."""
    return make([stand()] * 100)
