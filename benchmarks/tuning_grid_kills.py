"""The full grid of 2197 on `squats1`, by processes, killed and resumed, by threads, and by Dask with a worker killed.

    python benchmarks/tuning_grid_kills.py [--kill-after 20]

Runs the command line as a user would, kills with -9, and compares the tables byte by byte; ends with an error where one
differs, or where a kill came too late to mean anything.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", ROOT.parent / "shared" / "data")) / "opencap_subject4"
TRIAL = [DATA / "squats1.trc", "--forces", DATA / "squats1_grf.mot", "--model", "sagittal7", "--markers", "opencap"]
DYNAKIN = [sys.executable, "-c", "import sys; from dynakin.cli import main; sys.exit(main())"]
DASK = [str(Path(sys.executable).with_name("dask"))]
CELLS = 2197


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--kill-after", type=float, default=20.0, help="s; must fall in the middle of the grid.")
    asked = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        print("| how | seconds | `grid.csv` |\n|---|---|---|", flush=True)
        whole, seconds = grid(folder / "processes")
        print(f"| processes | {seconds:.0f} | |", flush=True)
        found = {
            "killed with -9 and started again": killed_and_resumed(folder / "resumed", asked.kill_after),
            "threads": grid(folder / "threads", "--backend", "threads"),
            "Dask over TCP, one of two workers killed with -9": on_a_cluster(folder, asked.kill_after),
        }
        for how, (table, seconds) in found.items():
            print(f"| {how} | {seconds:.0f} | {'the same' if table == whole else '**differs**'} |", flush=True)
    if any(table != whole for table, _ in found.values()):
        sys.exit("the tables are not the same")


def command(output: Path, *options: str) -> list[str]:
    return [*DYNAKIN, "tune", "grid", *map(str, TRIAL), "--mass", "60.05", "-o", str(output), *options]


def grid(output: Path, *options: str) -> tuple[bytes, float]:
    """The table, and how long it took."""
    start = time.perf_counter()
    subprocess.run(command(output, *options), check=True, stdout=subprocess.DEVNULL)
    return (output / "grid.csv").read_bytes(), time.perf_counter() - start


def killed_and_resumed(output: Path, after_s: float) -> tuple[bytes, float]:
    with subprocess.Popen(command(output), stdout=subprocess.DEVNULL, start_new_session=True) as first:
        time.sleep(after_s)
        os.killpg(first.pid, signal.SIGKILL)
    done = len((output / "rows.jsonl").read_text().splitlines())
    if not 0 < done < CELLS:
        sys.exit(f"killed after {done} of {CELLS} runs, expected some in the middle: change --kill-after")
    print(f"(killed after {done} of {CELLS} runs)", file=sys.stderr)
    return grid(output)


def on_a_cluster(folder: Path, after_s: float) -> tuple[bytes, float]:
    scheduler = start("scheduler", "--host", "127.0.0.1", "--port", "8799", "--no-dashboard")
    address = "tcp://127.0.0.1:8799"
    time.sleep(4.0)
    workers = [start("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard") for _ in range(2)]
    time.sleep(6.0)
    output = folder / "dask"
    begun = time.perf_counter()
    options = ("--backend", "dask", "--scheduler", address)
    with subprocess.Popen(command(output, *options), stdout=subprocess.DEVNULL) as tuning:
        time.sleep(after_s)
        workers[0].kill()
        if tuning.poll() is not None:
            sys.exit("the worker was killed after the end: change --kill-after")
        if tuning.wait() != 0:
            sys.exit(f"dynakin tune grid ended with {tuning.returncode}")
    seconds = time.perf_counter() - begun
    for process in (workers[1], scheduler):
        process.terminate()
        process.wait()
    return (output / "grid.csv").read_bytes(), seconds


def start(role: str, *options: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([*DASK, role, *options], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
