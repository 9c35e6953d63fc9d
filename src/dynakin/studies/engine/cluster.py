"""A Dask cluster as a pool. What all tasks share is shipped to the workers once; those that die or are added meanwhile
are the scheduler's matter, data that died with its holders is shipped anew."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any, Self

from dynakin.errors import ConfigError, DynakinError
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
