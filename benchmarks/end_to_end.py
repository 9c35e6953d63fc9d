"""From the recording's files to joint moments, each program in a process of its own, in turns.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/end_to_end.py [--rounds 3] [--trial squats1]

OpenSim: its shipped model, kinematics of all frames, inverse dynamics at 6 Hz. dynakin: `dynakin.run`, smoothed,
calibration and start included, no files written; and the command `dynakin run`, which writes the folder with its page.
Wall and CPU seconds, medians over the rounds; only ratios within a round count on a machine that others use.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from opensim_peer import inverse_kinematics, load, residual

from peers import DATA, FEET, FILE, MASS

GIVEN = "[noise]\nadapt = false\n"
PROGRAMS = {
    "OpenSim IK and ID": "opensim",
    "dynakin, .osim": "osim",
    "dynakin, .osim, given noise": "osim given",
    "dynakin, fullbody": "fullbody",
    "dynakin, fullbody, given noise": "fullbody given",
    "dynakin, fullbody, live-like": "fullbody live",
    "`dynakin run`, fullbody, with its page": "command",
    "`dynakin run`, fullbody, given noise, with its page": "command given",
    "`dynakin run --live-like`, fullbody, given noise, with its page": "command given live",
}


def with_opensim(trial: str) -> None:
    """OpenSim on one trial, in this process."""
    kinematics = inverse_kinematics(load(FILE, as_shipped=True), DATA / f"{trial}.trc")
    residual(load(FILE, mass_kg=MASS[trial]), kinematics, DATA / f"{trial}_grf.mot", FEET, 6.0)


def with_dynakin(how: str, trial: str) -> str:
    """A program that imports dynakin and nothing else."""
    given: dict[str, object] = {
        "forces": f"{DATA / trial}_grf.mot",
        "model": str(FILE) if "osim" in how else "fullbody",
        "mass_kg": MASS[trial],
        "lag_s": 0.0 if "live" in how else None,
        "noise": {"adapt": False} if "given" in how else None,
    }
    return f"import dynakin; dynakin.run({f'{DATA / trial}.trc'!r}, **{given!r})"


def command(how: str, trial: str, folder: Path) -> list[str]:
    """The words of a process."""
    if not how.startswith("command"):
        own = [__file__, "--opensim", "--trial", trial] if how == "opensim" else ["-c", with_dynakin(how, trial)]
        return [sys.executable, *own]
    (folder / "noise.toml").write_text(GIVEN, encoding="utf-8")
    words = ["run", f"{DATA / trial}.trc", "--forces", f"{DATA / trial}_grf.mot", "--mass", str(MASS[trial])]
    words += ["--preset", str(folder / "noise.toml")] if "given" in how else []
    words += ["--live-like"] if "live" in how else []
    return [str(Path(sys.executable).parent / "dynakin"), *words, "-o", str(folder / "out")]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--trial", default="squats1", choices=sorted(MASS))
    parser.add_argument("--opensim", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.opensim:
        with_opensim(asked.trial)
        return
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in PROGRAMS}
    for _ in range(asked.rounds):
        for name, how in PROGRAMS.items():
            with tempfile.TemporaryDirectory() as folder:
                before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
                done = subprocess.run(command(how, asked.trial, Path(folder)), capture_output=True, text=True)
                wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
            if done.returncode:
                raise SystemExit(f"{name}: {done.stderr or done.stdout}")
            found[name].append((wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))
    peer = np.array(found["OpenSim IK and ID"])
    print(f"| {asked.trial} | wall, s | CPU, s | CPU over OpenSim's |\n|---|---|---|---|")
    for name, times in found.items():
        wall, cpu = np.median(np.array(times), axis=0)
        ratio = np.median(np.array(times)[:, 1] / peer[:, 1])
        print(f"| {name} | {wall:.1f} | {cpu:.1f} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
