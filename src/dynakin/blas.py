"""One thread of BLAS while dynakin works. Matrices outside the core are small: threads of BLAS gain nothing there, and
for 20 ms after each product they wait for the next one by turning in circles, where the core has its second thread."""

from __future__ import annotations

from contextlib import ContextDecorator
from threading import Lock


class _OneThread(ContextDecorator):
    """For the whole process, since BLAS knows no other: from when the first of those who ask for it begins until the
    last has ended, so that calls may be within one another and in several threads (where one thread ends what another
    began, OpenBLAS stays with one)."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._within = 0

    def __enter__(self) -> None:
        # here, because only who computes waits for them; SciPy and NumPy bring a BLAS each, which must be loaded
        import scipy.linalg  # noqa: F401
        from threadpoolctl import threadpool_limits

        with self._lock:
            if not self._within:
                self._limits = threadpool_limits(1, user_api="blas")
            self._within += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._within -= 1
            if not self._within:
                self._limits.restore_original_limits()


one_blas_thread = _OneThread()
"""``with one_blas_thread:`` or ``@one_blas_thread``: around runs, calibrations, comparisons, identification, tasks of
studies and live sessions. A loop of one's own over `Tracker.step` is not held; its matrices are the core's."""
