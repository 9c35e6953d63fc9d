"""Who works (processes or threads of this machine by joblib, or a Dask cluster, all behind one call), and the work:
tasks in, a table out, in the order of the keys, whoever worked, also where a part was done in an earlier run.

To a cluster's workers what all tasks share is shipped once; those that die or are added meanwhile are the scheduler's
matter, data that died with its holders is shipped anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from types import TracebackType
from typing import Any, Protocol, Self

import joblib

from dynakin.errors import ConfigError, DynakinError
from dynakin.progress import Progress
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.tasks import Failure, Function, Outcome, Task, attempt

TIMEOUT_S = 10.0
"""How long to wait for the scheduler to answer."""
SHIPMENTS = 5
"""How often data that was lost with its workers is shipped before it is given up."""


class ClusterPool:
    """Workers of the scheduler at ``address``.

    Raises:
        ConfigError: dask.distributed is not installed, or no scheduler answers.
    """

    def __init__(self, address: str) -> None:
        try:
            import distributed
        except ImportError:
            raise ConfigError(
                "--backend dask: dask.distributed is not installed; expected pip install 'dynakin[cluster]'"
            ) from None
        self._distributed: Any = distributed
        self._address = address
        try:
            self._client = self._distributed.Client(address, timeout=TIMEOUT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            text = " ".join(str(error).split())
            raise ConfigError(f"--scheduler {address}: no scheduler answers there ({text})") from None
        self._shared: Any = None
        self._shipped: Any = None

    def run(self, function: Function, shared: Any, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """
        Raises:
            DynakinError: the cluster lost the data again and again.
        """
        left = {task.key: task for task in tasks}
        for _ in range(SHIPMENTS):
            if not left:
                return
            shipped = self._ship(shared)
            futures = {
                self._client.submit(attempt, function, shipped, task, pure=False): task.key for task in left.values()
            }
            for future in self._distributed.as_completed(futures, loop=self._client.loop):
                outcome = self._outcome(future, futures[future])
                if outcome is not None:
                    del left[outcome.key]
                    yield outcome
            if left:
                self._shared = None
        if left:
            raise DynakinError(f"{self._address}: {len(left)} tasks were lost with their workers {SHIPMENTS} times")

    def _ship(self, shared: Any) -> Any:
        if self._shared is not shared or self._shipped is None or self._shipped.status != "finished":
            self._client.wait_for_workers(1)
            self._shipped = self._client.scatter(shared, broadcast=True, hash=False)
            self._shared = shared
        return self._shipped

    def _outcome(self, future: Any, key: str) -> Outcome | None:
        """None: the task was lost with the data that it needs."""
        if future.status == "finished":
            found: Outcome = future.result()
            return found
        if future.status != "error":
            return None
        error = future.exception()
        if isinstance(error, self._distributed.KilledWorker):
            return Outcome(key, failure=Failure("the workers that tried it died", unexpected=True))
        if isinstance(error, KeyError | self._distributed.CancelledError):
            return None
        raise error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()


BACKENDS = ("processes", "threads", "dask")


class Pool(Protocol):
    """Workers that stay for several calls; a context manager."""

    def run(self, function: Function, shared: Any, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """The outcomes, as they come, in any order."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class LocalPool:
    """This machine's cores. Processes survive a crash of the code that they run, threads share the memory."""

    def __init__(self, backend: str, jobs: int) -> None:
        self._backend = {"processes": "loky", "threads": "threading"}[backend]
        self._jobs = jobs

    def run(self, function: Function, shared: Any, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """A worker that dies takes only the task with it that killed it: what it had not done is done anew, and from
        the second death that brought nothing new each task gets a process of its own."""
        left = {task.key: task for task in tasks}
        while left:
            before = len(left)
            try:
                for outcome in self._parallel(function, shared, list(left.values())):
                    del left[outcome.key]
                    yield outcome
            except BrokenProcessPool:
                if len(left) == before:
                    yield from self._one_by_one(function, shared, list(left.values()))
                    return

    def _parallel(self, function: Function, shared: Any, tasks: Sequence[Task]) -> Iterator[Outcome]:
        parallel = joblib.Parallel(n_jobs=self._jobs, backend=self._backend, return_as="generator_unordered")
        found: Iterator[Outcome] = parallel(joblib.delayed(attempt)(function, shared, task) for task in tasks)
        yield from found

    def _one_by_one(self, function: Function, shared: Any, tasks: Sequence[Task]) -> Iterator[Outcome]:
        alone = LocalPool("processes", 2)  # joblib runs a single job in this very process
        for task in tasks:
            try:
                yield from alone._parallel(function, shared, [task])
            except BrokenProcessPool:
                yield Outcome(task.key, failure=Failure("the process that worked on it died", unexpected=True))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None


def open_pool(backend: str = "processes", jobs: int | None = None, scheduler: str | None = None) -> Pool:
    """Workers by the name of their kind.

    Args:
        backend: "processes", "threads" (of this machine), or "dask".
        jobs: workers at a time; None: as many as there are cores. A cluster has its own number.
        scheduler: address of the cluster's scheduler, tcp://HOST:PORT; with "dask" only.

    Raises:
        ConfigError: options that do not go together, dask is not installed, or no scheduler answers there.
    """
    if backend not in BACKENDS:
        raise ConfigError(f"backend is {backend!r}, expected {', '.join(BACKENDS)}")
    if (backend == "dask") != (scheduler is not None):
        raise ConfigError("expected --scheduler ADDRESS together with --backend dask, and only then")
    if jobs is not None and jobs < 1:
        raise ConfigError(f"jobs is {jobs}, expected 1 or more")
    if scheduler is not None:
        return ClusterPool(scheduler)
    return LocalPool(backend, jobs or joblib.cpu_count())


def work(
    pool: Pool,
    function: Function,
    shared: Any,
    tasks: Sequence[Task],
    *,
    journal: Journal | None = None,
    progress: Progress | None = None,
) -> list[Outcome]:
    """Work on all tasks.

    Args:
        function: ``function(shared, payload)``, a function of a module. shared: picklable, what all tasks need.
        tasks: each with a key of its own.
        journal: rows found there are taken, new ones are added as they come. Failures are not kept: they are tried
            again when the run is.
        progress: called with (tasks done, tasks in all).

    Returns:
        An outcome a task, sorted by key.
    """
    assert len({task.key for task in tasks}) == len(tasks), "keys name tasks: each once"
    known = {} if journal is None else journal.rows
    done = {task.key: Outcome(task.key, row=known[task.key]) for task in tasks if task.key in known}
    left = [task for task in tasks if task.key not in done]
    if progress is not None:
        progress(len(done), len(tasks))
    for outcome in pool.run(function, shared, left):
        done[outcome.key] = outcome
        if journal is not None and outcome.row is not None:
            journal.add(outcome.key, outcome.row)
        if progress is not None:
            progress(len(done), len(tasks))
    return [done[key] for key in sorted(done)]
