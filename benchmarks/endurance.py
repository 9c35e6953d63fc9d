"""A session that never ends: memory and the covariance's smallest eigenvalue over a million steps.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/endurance.py [--model planar|fullbody] [--steps 1000000] [--lag 0]

A recording is stepped through again and again, forwards and backwards in turn (a reversal of time leaves accelerations
and forces as they are). At 1, 2 and 5 times each power of ten a line is printed: memory of the process, smallest
eigenvalue of the correlation matrix of the state (1e-16 would be rounding), and the largest standard deviation over
what it was at the start, of constants.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from live_latency import RATE_HZ, fullbody, planar, resident_kb, there_and_back

from dynakin.bindings import _core
from dynakin.filter.core_filter import core_filter
from dynakin.filter.estimator import Estimator
from dynakin.filter.samples import marker_paths, total_wrench
from dynakin.settings.presets import preset


def smallest_eigenvalue(covariance: np.ndarray) -> float:
    """Of the correlation matrix, of what has a variance."""
    sd = np.sqrt(np.diag(covariance))
    some = sd > 0.0
    return float(np.linalg.eigvalsh(covariance[np.ix_(some, some)] / np.outer(sd[some], sd[some]))[0])


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="planar", choices=["planar", "fullbody"])
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--preset", default="default")
    parser.add_argument("--lag", type=int, default=0, help="frames")
    asked = parser.parse_args()
    recording, estimator = planar() if asked.model == "planar" else fullbody()
    recording = there_and_back(recording) if asked.model == "planar" else recording
    tracker = estimator.start(recording, rate_hz=RATE_HZ)
    if asked.preset != "default":
        tracker = Estimator(estimator.model, noise=preset(asked.preset)).start(recording, rate_hz=RATE_HZ)
    markers, wrench = marker_paths(recording, tracker.calibrated), total_wrench(recording, tracker.calibrated)
    _, model, kalman = core_filter(tracker.calibrated, tracker.noise, tracker.estimate)
    first, size = model.layout.blocks["lengths"][0], model.layout.size
    sd0 = np.sqrt(np.diag(kalman.covariance))
    lag = _core.FixedLag(kalman, asked.lag) if asked.lag else None
    looks = {m * 10**k for m in (1, 2, 5) for k in range(3, 9) if m * 10**k <= asked.steps}
    print(f"{asked.model}, {size} states, lag of {asked.lag} frames\n")
    print("| steps | memory, MB | smallest eigenvalue | least, largest sd of a constant over its prior | ms a step |")
    print("|---|---|---|---|---|", flush=True)
    began, before = time.process_time(), 0
    for done in range(1, asked.steps + 1):
        k = (done - 1) % len(markers)
        dt = 0.0 if done == 1 else 1.0 / RATE_HZ
        if lag is not None:
            report = lag.step(dt, markers[k], wrench[k])
        else:
            if done > 1:
                kalman.predict(dt)
            report = kalman.update(markers[k], wrench[k])
        if report.diverged:
            raise SystemExit(f"the filter diverged at step {done}: {report.status}")
        if done in looks:
            now = time.process_time()
            share = (np.sqrt(np.diag(kalman.covariance)) / np.where(sd0 > 0.0, sd0, np.nan))[first:]
            print(
                f"| {done} | {resident_kb() / 1024:.1f} | {smallest_eigenvalue(kalman.covariance):.2g} | "
                f"{np.nanmin(share):.2g}, {np.nanmax(share):.2g} | {1e3 * (now - began) / (done - before):.3f} |",
                flush=True,
            )
            began, before = time.process_time(), done


if __name__ == "__main__":
    main()
