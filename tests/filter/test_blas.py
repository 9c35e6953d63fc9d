"""BLAS has one thread while dynakin works, and as many as before afterwards. In a process of its own: the tests' may
have one from its start."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = str(Path(__file__).resolve().parents[1])
OPENING = """
from threading import Thread
import scipy.linalg
from threadpoolctl import threadpool_info
from dynakin.blas import one_blas_thread

def threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

assert threads() == {2}, threads()
"""
WITHIN_ONE_ANOTHER = """
def elsewhere():
    with one_blas_thread, one_blas_thread:
        seen.update(threads())

seen = set()
other = Thread(target=elsewhere)
with one_blas_thread:
    other.start()
    other.join()
    assert seen == threads() == {1}
"""
AN_ERROR = """
try:
    with one_blas_thread:
        raise ValueError
except ValueError:
    pass
"""
AN_ESTIMATE = """
from dynakin.simulation.trial import simulate_squat
from support.squat_estimator import estimator

seen = set()
recording = simulate_squat(seed=3, duration_s=6.0).recording
estimator().run(recording, progress=lambda done, total: seen.update(threads()))
assert seen == {1}
"""


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one processor: BLAS has one thread anyway")
@pytest.mark.parametrize("work", [WITHIN_ONE_ANOTHER, AN_ERROR, AN_ESTIMATE])
def test_blas_has_one_thread_until_the_last_who_asked_for_it_has_ended(work: str) -> None:
    environment = os.environ | {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "PYTHONPATH": TESTS}
    words = [sys.executable, "-c", f"{OPENING}{work}\nassert threads() == {{2}}, threads()"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
