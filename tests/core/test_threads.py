"""Trials side by side give the same bits as one after the other: the core shares nothing between filters."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import numpy as np
import pytest

import dynakin
from dynakin.filter.prepared import Prepared
from dynakin.pipeline.stages import _Ahead
from dynakin.report import page
from dynakin.simulation.trial import simulate
from dynakin.studies.engine.pools import open_pool
from dynakin.studies.engine.tasks import Task

SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
TRIALS = {f"{kind} {seed}": (kind, seed) for seed in (1, 2, 3) for kind in ("sagittal7", "fullbody")}
TIMES = {"step_us", "backward_us"}


@pytest.fixture(scope="module")
def ready() -> dict[str, Prepared]:
    found = {}
    for name, (kind, seed) in TRIALS.items():
        recording = simulate(kind, "squat", seed, 5.0).recording.window(1.0, 1.5)
        markers = {"markers": "opencap"} if kind == "sagittal7" else {}
        model = dynakin.load_model(kind, subject=SUBJECT, **markers)
        found[name] = dynakin.Estimator(model).prepare(recording, lag_s=0.0)
    return found


def smoothed(ready: dict[str, Prepared], name: str) -> dict[str, np.ndarray]:
    one = ready[name]
    run = one.tracker.fresh().run_smoothed_arrays
    return run(one.measured)


def by_executor(ready: dict[str, Prepared], threads: int) -> dict[str, dict[str, np.ndarray]]:
    with ThreadPoolExecutor(threads) as pool:
        return dict(zip(TRIALS, pool.map(lambda name: smoothed(ready, name), TRIALS), strict=True))


def by_engine(ready: dict[str, Prepared], threads: int) -> dict[str, dict[str, np.ndarray]]:
    with open_pool("threads", threads) as pool:
        outcomes = list(pool.run(smoothed, ready, [Task(name, name) for name in TRIALS]))
    assert all(outcome.failure is None for outcome in outcomes)
    return {outcome.key: outcome.row for outcome in outcomes}


def test_the_second_thread_of_a_step_changes_no_bit(ready, monkeypatch):
    """Of a whole body, whose updates are shared (from 200 states on), smoothed and live."""
    one, found = ready["fullbody 1"], []
    assert one.tracker.calibrated.x0.size > 200
    for threads in ("1", "2"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        live = one.tracker.fresh().run_arrays(one.measured)
        found.append(smoothed(ready, "fullbody 1") | {f"live_{key}": value for key, value in live.items()})
    for array in found[0].keys() - TIMES - {f"live_{key}" for key in TIMES}:
        assert found[0][array].tobytes() == found[1][array].tobytes(), array


def threads_more(run: Callable[[], object]) -> int:
    """How many threads this process has more than before while ``run`` runs."""
    done, seen = Event(), list[int]()

    def watch() -> None:
        while not done.is_set():
            seen.append(len(list(Path("/proc/self/task").iterdir())))

    with ThreadPoolExecutor(1) as pool:
        watching = pool.submit(watch)
        while not seen:
            pass
        before = seen[-1]
        run()
        done.set()
        watching.result()
    return max(seen) - before


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads are counted as Linux lists them")
def test_the_second_thread_waits_for_what_is_loaded_ahead(ready, monkeypatch):
    """On two processors, which the core and that thread need: a third would have all take turns."""
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    one, begun, go_on = ready["fullbody 1"], Event(), Event()

    def run() -> None:
        one.tracker.fresh().run_arrays(one.measured)

    def templates() -> None:
        begun.set()
        go_on.wait()

    monkeypatch.setattr(page, "templates", templates)
    assert threads_more(run) == 1
    ahead = _Ahead(None)
    ahead.start()
    try:
        assert begun.wait(60.0)
        assert threads_more(run) == 0
    finally:
        go_on.set()
        ahead.join()
    assert threads_more(run) == 1


@pytest.mark.parametrize("side_by_side", [by_executor, by_engine])
def test_two_threads_give_the_bits_of_one(ready, side_by_side):
    one, two = by_executor(ready, 1), side_by_side(ready, 2)
    for name in TRIALS:
        assert one[name].keys() == two[name].keys()
        for array in one[name].keys() - TIMES:
            assert one[name][array].tobytes() == two[name][array].tobytes(), (name, array)
