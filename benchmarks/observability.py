"""Which movement tells how much more of the constants: least squares of the known motion beside a filter pass over it.

    python benchmarks/observability.py fullbody squats1.trc squats1_grf.mot 60.05

Each motion that is tried is also put through the core's filter, all frames, measured exactly; both give a factor on
each standard deviation. Printed: seconds a motion, and the ratio of the factors by size of the filter's.
"""

from __future__ import annotations

import sys
import time
from itertools import pairwise

import numpy as np
import numpy.typing as npt

import dynakin
from dynakin.bindings import _core
from dynakin.filter.core_filter import filter_settings
from dynakin.filter.tracker import Tracker
from dynakin.identification.observability.excitation import Bench, Motion
from dynakin.results.measures.posterior import KNOWN, NOTHING

Array = npt.NDArray[np.float64]

FREE = {"marker_gate": 0.0, "wrench_gate": 0.0, "recover": False, "constraint": "none", "iterate_beyond_sd": None}
SIZES = (1.1, 1.25, 2.0, np.inf)


def filtered(tracker: Tracker, bench: Bench, motion: Motion) -> Array:
    """Standard deviations (n,) after the filter's pass over all frames of a motion."""
    core, noise = tracker.core_model, tracker.noise.changed(**FREE)
    settings = filter_settings(tracker.calibrated, noise, core.layout, tracker.estimate)
    states, frames = bench.states(motion), len(motion.time)
    markers = np.stack([_core.marker_positions(core, x) for x in states])
    wrench = np.stack([_core.wrench(core, x) for x in states])
    markers[bench.missing[:frames]] = np.nan
    wrench[bench.blind[:frames]] = np.nan
    kalman = _core.Filter(core, settings, states[0], bench.measured.prior)
    kalman.run(np.ascontiguousarray(motion.time), markers, wrench)
    return np.sqrt(np.diag(kalman.covariance))


def main(model: str, trial: str, forces: str, mass_kg: str) -> None:
    """Print the comparison for a recording."""
    definition = dynakin.load_model(model, dynakin.Subject(mass_kg=float(mass_kg)))
    estimate, tracker = dynakin.Estimator(definition).track(dynakin.read(trial, forces))
    bench = Bench(tracker, estimate)
    names = bench.measured.names
    motions = [bench.trial]
    for k, name in enumerate(bench.coordinates):
        if name not in bench.grounded and (found := bench.liveliest(k)) is not None:
            motions.append(found[1])
    at = [k for k, name in enumerate(names) if name.startswith(("inertia/", "length/"))]
    sd, seconds = [], []
    for way in (bench.deviations, lambda motion: filtered(tracker, bench, motion)):
        began = time.perf_counter()
        sd.append(np.stack([way(motion)[at] for motion in motions]))
        seconds.append((time.perf_counter() - began) / len(motions))
    print(f"{len(names)} states, {len(bench.trial.time)} frames, {len(motions) - 1} motions")
    print(f"a motion: {seconds[0]:.3f} s, the filter's pass {seconds[1]:.3f} s")
    known, expected = (values[0] / values[1:] for values in sd)
    for low, high in pairwise(SIZES):
        chosen = (expected >= low) & (expected < high)
        if chosen.any():
            least, middle, most = np.percentile((known / expected)[chosen], [0, 50, 100])
            print(f"factors {low:g} to {high:g}: {chosen.sum()}, ratio {least:.2f} to {most:.2f}, median {middle:.2f}")
    prior = np.sqrt(np.diag(bench.measured.prior))[at]
    judged = [np.digitize(values[0] / prior, [KNOWN, NOTHING]) for values in sd]
    print(
        f"known, in part, nothing of the trial itself: {(judged[0] != judged[1]).sum()} of {len(at)} judged otherwise"
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
