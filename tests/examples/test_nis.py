"""`benchmarks/nis.py` writes the table of all recordings that are kept, not only of the one that ran."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"

# in a process of its own: its neighbour `recordings` has the name of a folder of tests
SCRIPT = """
import sys
from pathlib import Path
import nis
from dynakin.errors import RecordingError

def figures(trial, wanted):
    value = {"squats1": 1.2, "walking1": 1.3}.get(trial.name.rsplit("/", 1)[1])
    if value is None:
        raise RecordingError("no markers")
    known = {"declared": 0.1, "calibrated": value, "markers": value, "plates": None, "variance_scale": 0.2}
    return known | {"jerk_scale": {"feet": 2.0}}

nis.KEPT, nis.figures = Path(sys.argv[1]) / "nis", figures
nis.put = lambda page, name, lines: print("WRITTEN", *lines, sep="\\n")
for wanted in (["squats1", "STS1"], ["walking1", "--write"]):
    sys.argv = ["nis.py", *wanted]
    nis.main()
"""


def test_one_recording_does_not_replace_the_table_of_all(tmp_path: Path) -> None:
    command = [sys.executable, "-c", SCRIPT, str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(BENCHMARKS), "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(command, env=environment, capture_output=True, encoding="utf-8", check=True)
    rows = [line for line in done.stdout.split("WRITTEN")[1].splitlines() if line.startswith("| `")]
    assert rows == [
        "| `opencap_subject4/squats1` | 0.1 | 1.2 | 1.2 | – | 0.2 | 1, 1, 1, 1, 1, 2 |",
        "| `opencap_subject4/walking1` | 0.1 | 1.3 | 1.3 | – | 0.2 | 1, 1, 1, 1, 1, 2 |",
        "| `opencap_subject4/STS1` | no markers | – | – | – | – | – |",
    ]
