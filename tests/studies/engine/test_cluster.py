"""A Dask cluster of two workers over TCP, one of which is killed on the way: the same table."""

from __future__ import annotations

import os
import signal

import pytest

from dynakin.errors import ConfigError
from dynakin.studies.engine.pools import open_pool, work
from dynakin.studies.engine.tasks import Task
from support import engine_tasks as functions

distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")

SHARED = {"base": 1.1}
TASKS = [Task(f"{k:03d}", float(k)) for k in range(40)]


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as made:
        yield made


@pytest.mark.nightly
def test_a_worker_that_is_killed_on_the_way_changes_nothing(cluster):
    address = cluster.scheduler_address
    assert address.startswith("tcp://127.0.0.1:")
    pids = [worker.process.pid for worker in cluster.workers.values()]
    assert len(pids) == 2
    killed: list[int] = []

    def kill_one(done: int, total: int) -> None:
        if done == 10 and not killed:
            os.kill(pids[0], signal.SIGKILL)
            killed.append(pids[0])

    with open_pool("dask", scheduler=address) as pool:
        outcomes = work(pool, functions.slow_power, SHARED, TASKS, progress=kill_one)
    assert killed
    assert [o.row for o in outcomes] == [functions.power(SHARED, task.payload) for task in TASKS]


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr("dynakin.studies.engine.pools.TIMEOUT_S", 0.5)
    with pytest.raises(ConfigError, match=r"--scheduler tcp://127\.0\.0\.1:9: no scheduler answers"):
        open_pool("dask", scheduler="tcp://127.0.0.1:9")
