"""Cases in processes of their own: a crash or a hang in C ends one, is named by its seed, and stops nothing."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from support.fuzz.worker import SECONDS

A_PROCESS = 500  # cases: the peak of its memory tells of no more than these
_STUCK_S = 3 * SECONDS  # where not even the alarm is heard


@dataclass
class Outcome:
    """What came of many cases. failed: by seed, what happened."""

    errors: int = 0
    results: int = 0
    failed: dict[int, str] = field(default_factory=dict)
    longest_s: tuple[float, int] = (0.0, -1)
    most_mb: float = 0.0

    def __str__(self) -> str:
        return (
            f"{self.errors} clean errors, {self.results} clean results, {len(self.failed)} failed {self.failed}; "
            f"longest {self.longest_s[0]:.2f} s (seed {self.longest_s[1]}), largest process {self.most_mb:.0f} MB"
        )


def run(kind: str, start: int, count: int, corpus: Path, work: Path) -> Outcome:
    """All cases with seeds from ``start``."""
    work.mkdir(parents=True, exist_ok=True)
    found, seed = Outcome(), start
    while seed < start + count:
        seed = _process(kind, seed, min(A_PROCESS, start + count - seed), corpus, work, found)
    return found


def _process(kind: str, start: int, count: int, corpus: Path, work: Path, found: Outcome) -> int:
    """Work on cases in one process; gives the seed to go on with."""
    folder = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-m", "support.fuzz.worker", kind, str(start), str(count), str(corpus), str(work)]
    environment = os.environ | {"PYTHONPATH": str(folder), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    crash = work / "crash.txt"
    seed, why = start, ""
    with (
        crash.open("w+b") as complaint,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=complaint, env=environment, cwd=work) as process,
        selectors.DefaultSelector() as ready,
    ):
        assert process.stdout is not None
        ready.register(process.stdout, selectors.EVENT_READ)
        while True:
            if not ready.select(_STUCK_S):
                process.kill()
                why = f"no answer for {_STUCK_S} s"
                break
            line = process.stdout.readline()
            if not line:
                break
            row = json.loads(line)
            if "begins" not in row:
                _count(row, found)
            seed = row.get("begins", seed + 1)
    if seed < start + count:  # it ended in the middle of a case
        said = " ".join(crash.read_text(errors="replace").split())[:400]
        found.failed[seed] = why or f"the process ended with {process.returncode}: {said}"
        seed += 1
    return seed


def _count(row: dict[str, object], found: Outcome) -> None:
    seed, seconds = int(str(row["seed"])), float(str(row["seconds"]))
    found.errors += row["outcome"] == "error"
    found.results += row["outcome"] == "result"
    if row["outcome"] == "failed":
        found.failed[seed] = str(row["said"])
    found.longest_s = max(found.longest_s, (seconds, seed))
    found.most_mb = max(found.most_mb, float(str(row["peak_mb"])))
