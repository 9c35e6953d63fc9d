"""BLAS has one thread while dynakin works, and as many as before afterwards."""

from collections.abc import Iterator
from threading import Thread

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from dynakin.blas import one_blas_thread
from dynakin.simulation.trial import simulate_squat
from support.squat_estimator import estimator


def threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def two_threads() -> Iterator[None]:
    with threadpool_limits(2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("this BLAS has one thread")
        yield


def test_until_the_last_of_those_who_asked_for_it_has_ended() -> None:
    def elsewhere() -> None:
        with one_blas_thread, one_blas_thread:
            seen.update(threads())

    seen: set[int] = set()
    other = Thread(target=elsewhere)
    with one_blas_thread:
        other.start()
        other.join()
        assert seen == threads() == {1}
    assert threads() == {2}


def test_an_error_within_gives_the_threads_back() -> None:
    with pytest.raises(ValueError, match="wrong"), one_blas_thread:
        raise ValueError("wrong")
    assert threads() == {2}


def test_an_estimate_has_one_thread() -> None:
    seen: set[int] = set()
    recording = simulate_squat(seed=3, duration_s=6.0).recording
    estimator().run(recording, progress=lambda done, total: seen.update(threads()))
    assert seen == {1}
    assert threads() == {2}
