"""A process that works on cases: `python -m support.fuzz.worker KIND START COUNT CORPUS WORK`, in `tests`.

It may take a gigabyte more than it has when it begins, and ten seconds a case; what a C library does in spite of that
is seen by whoever started it (`run.py`).
"""

from __future__ import annotations

import faulthandler
import json
import resource
import signal
import sys
import time
import traceback
import warnings
from pathlib import Path

from support.fuzz.cases import run_case

SECONDS, BYTES = 10, 2**30


class TookTooLong(BaseException):
    """No `except Exception` keeps it."""


def _ring(*_: object) -> None:
    raise TookTooLong(f"more than {SECONDS} s")


def _now() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main(kind: str, start: int, count: int, corpus: Path, work: Path) -> None:
    """Print a line of JSON before each case, and one after it."""
    faulthandler.enable()
    warnings.simplefilter("ignore")  # of NumPy, on numbers that overflow before they are refused
    signal.signal(signal.SIGALRM, _ring)
    resource.setrlimit(resource.RLIMIT_AS, (_now() + BYTES, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for seed in range(start, start + count):
        print(json.dumps({"begins": seed}), flush=True)
        begun, said = time.perf_counter(), ""
        signal.alarm(SECONDS)
        try:
            outcome = run_case(kind, seed, corpus, work)
        except (Exception, TookTooLong) as error:
            outcome = "failed"
            place = traceback.extract_tb(error.__traceback__)[-1]
            said = f"{type(error).__name__} ({Path(place.filename).name}:{place.lineno}): {str(error)[:300]}"
        finally:
            signal.alarm(0)
        seconds = time.perf_counter() - begun
        row = {"seed": seed, "outcome": outcome, "said": said, "seconds": seconds, "peak_mb": _peak_mb()}
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]), Path(sys.argv[5]))
