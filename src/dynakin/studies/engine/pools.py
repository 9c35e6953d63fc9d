"""Who works (processes or threads of this machine by joblib, or a Dask cluster, all behind one call), and the work:
tasks in, a table out, in the order of the keys, whoever worked, also where a part was done in an earlier run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from types import TracebackType
from typing import Any, Protocol, Self

import joblib

from dynakin.errors import ConfigError
from dynakin.progress import Progress
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.tasks import Failure, Function, Outcome, Task, attempt

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
        from dynakin.studies.engine.cluster import ClusterPool

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
