"""How long the model's error has to be taken to last: inertia against truth and held out, by the least time.

    python benchmarks/identification/error_time.py [--model sagittal7|fullbody] [--seeds 11 20]

Seeds apart from those of `simulated.py`. Of `fullbody` a minute of gestures (`gestures.py`) identifies too.
"""

from __future__ import annotations

import argparse

import numpy as np
from gestures import GESTURE_S, gestures, movement_of
from protocol import PLACES, person
from simulated import SKIPPED_ELSE_S, SKIPPED_S, TASKS, judged, subject_of

import dynakin.identification.batch as batch
from dynakin.identification.batch import identify_batch
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.structure import base_of
from dynakin.identification.trials import MeasuredTrial, measure_all
from dynakin.identification.unknowns import Unknowns
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.trial import simulate

LEAST_S = (0.0, 0.25, 0.5, 1.0, 2.0)
CHOSEN = (
    "the trunk twists, arms out sideways", "knee bends, a third deep", "elbows bend and stretch, upper arms forward",
    "on one foot, the right leg swings forward and back", "on one foot, the left leg swings forward and back",
    "both arms swing forward and up, brisk",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--model", default="sagittal7", choices=TASKS)
    parser.add_argument("--seeds", nargs=2, type=int, default=(11, 20))
    args = parser.parse_args()
    off: dict[tuple[str, str], list[float]] = {}
    rms: dict[tuple[str, str], list[np.ndarray]] = {}
    for seed in range(args.seeds[0], args.seeds[1] + 1):
        spatial = args.model == "fullbody"
        common, sims, trials = subject_of(args.model, seed, 10.0 if spatial else 20.0)
        unknowns = Unknowns.of(common, geometry=False)
        inertial, start = unknowns.inertial, np.zeros(len(unknowns.inertial.sd))
        true = np.array([sims[0].truth.parameters[name] for name in inertial.names])
        K = base_of(MeasuredModel.of(common.tracker())).K
        P = inertial.covariance(start, np.diag(inertial.sd**2))
        prior = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", K, P, K), 0.0))
        told = prior > 1e-9 * prior.max()
        tasks = TASKS[args.model]
        folds: list[tuple[str, list[MeasuredTrial], int]] = [
            (f"others -> {task}", [t for j, t in enumerate(trials) if j != k], k) for k, task in enumerate(tasks)
        ]
        if spatial:
            movement = movement_of(person(seed, Spread()), [g for g in gestures() if g.words in CHOSEN])
            gestured = simulate("fullbody", movement, seed, GESTURE_S * len(CHOSEN), **PLACES).recording
            trial = measure_all(common, [gestured])
            folds += [(f"gestures -> {task}", trial, k) for k, task in enumerate(tasks)]
        for label, chosen, k in folds:
            raw = common.with_plates(trials[k].movement, sims[k].recording).full_band()
            found = {"table": (inertial.phi(start), start)}
            for least in LEAST_S:
                batch.LEAST_TAU_S = least
                posterior = identify_batch(common, chosen, unknowns)
                found[f"{least:g} s"] = (posterior.phi, posterior.theta[: len(start)])
            for name, (phi, u) in found.items():
                error = (K @ (phi - true))[told] / prior[told]
                off.setdefault((label, name), []).append(float(np.mean(error**2)))
                theta = np.concatenate([u, np.zeros(len(unknowns.sd) - len(u))])
                wrench = unknowns.wrench(common.core, trials[k].movement.states, theta)
                skipped = SKIPPED_S.get(tasks[k], SKIPPED_ELSE_S)
                rms.setdefault((label, name), []).append(judged(common, raw, wrench, skipped))
        print(f"seed {seed} done", flush=True)
    print("\nbase parameters from truth (prior deviations, RMS); held-out RMS, N and N m")
    for (label, name), values in off.items():
        held_out = np.mean(rms[label, name], axis=0).round(2)
        print(f"  {label:20s} {name:8s} {np.sqrt(np.mean(values)):5.2f}  {held_out}")


if __name__ == "__main__":
    main()
