"""Fixtures that all tests share."""

from __future__ import annotations

import os
from pathlib import Path

# Before NumPy is loaded: matrices of a hundred rows gain nothing from threads that wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from dynakin.results.estimate import Estimate
from support.estimates.synthetic import make_estimate

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of the real recordings; the test is skipped where it is absent."""
    named = os.environ.get("DYNAKIN_TEST_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"real recordings not found in {folder} (set DYNAKIN_TEST_DATA)")
    return folder


@pytest.fixture(scope="session")
def estimate() -> Estimate:
    """Twelve seconds of a squat, with gaps, bounds reached and a locked translation."""
    return make_estimate()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update", action="store_true", help="accept what the replays give now")


@pytest.fixture
def update(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--update"))
