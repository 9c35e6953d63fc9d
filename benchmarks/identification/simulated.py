"""Held out by task, simulated: squat, sit-to-stand and sway of one subject; two identify, the third judges.

    python benchmarks/identification/simulated.py [--model sagittal7] [--seeds 1 10] [--duration 20] [--filters]

The judging trial's kinematics come from its markers alone; its plates are read by `judged` only. `true bodies` is the
simulated subject's own phi in place of the table's, with the table's geometry, so that
(table - candidate) / (table - true bodies) is the share of what perfect inertial parameters could gain.
"""

from __future__ import annotations

import argparse

import numpy as np
from candidates import all_candidates, batch, predicted

import dynakin
from dynakin.identifiability.base import base_of
from dynakin.identifiability.measured import MeasuredModel
from dynakin.identification import Common, MeasuredTrial, Unknowns, measure_all
from dynakin.identification.batch import PLANE
from dynakin.simulation import SimulatedTrial, simulate

TASKS = ("squat", "sit-to-stand", "sway")
SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
MARKERS = {"sagittal7": "opencap", "squat7": "plug-in-gait"}
SKIPPED_S = 2.0
GAP_NM = 2.0  # MZ by which true bodies must be better than the table for a share to be told
Array = np.ndarray


def judged(trial: MeasuredTrial, wrench: Array) -> Array:
    """RMS (3,) of fx, fy (N), mz (N m) against the plates, after the filter has settled."""
    after = trial.movement.time >= trial.movement.time[0] + SKIPPED_S
    return np.sqrt(np.nanmean((trial.wrench[after][:, PLANE] - wrench[after]) ** 2, axis=0))


def subject_of(model: str, seed: int, duration_s: float) -> tuple[Common, list[SimulatedTrial], list[MeasuredTrial]]:
    """The common model, the trials and what is seen of them."""
    sims = [simulate(model, task, seed, duration_s) for task in TASKS]
    standing = simulate(model, "sway", seed, 3.0).recording
    estimator = dynakin.Estimator(dynakin.load_model(model, subject=SUBJECT, markers=MARKERS[model]))
    common = Common.measure(estimator, sims[0].recording, standing)
    return common, sims, measure_all(common, [sim.recording for sim in sims])


def one(model: str, seed: int, duration_s: float, filters: tuple[str, ...]) -> dict[tuple[str, str], Array]:
    """RMS by (task left out, candidate), and distances from the truth by ("truth", candidate)."""
    common, sims, trials = subject_of(model, seed, duration_s)
    bodies = Unknowns.of(common).bodies
    true = np.array([sims[0].truth.parameters[name] for name in bodies.names])
    spread = np.linalg.norm(bodies.jacobian(np.zeros(len(bodies.sd))) * bodies.sd, axis=1)
    found: dict[tuple[str, str], Array] = {}
    for k, task in enumerate(TASKS):
        others = [j for j in range(len(TASKS)) if j != k]
        candidates = all_candidates(common, [trials[j] for j in others], [sims[j].recording for j in others], filters)
        candidates |= {"true bodies": (true, None)}
        for name, (phi, geometry) in candidates.items():
            raw = common.with_plates(trials[k].movement, sims[k].recording, as_measured=True)
            found[task, name] = judged(raw, predicted(common, trials[k].movement.states, phi, geometry))
            found[task + ", from truth", name] = np.sqrt(np.mean(((phi - true) / spread) ** 2, keepdims=True))
    every = batch(common, trials, inertia=True, geometry=False)
    K = base_of(MeasuredModel.of(common.estimator)).K
    sd = np.sqrt(np.einsum("ij,jk,ik->i", K, every.phi_covariance(), K))
    found["base", "errors over sd"] = np.abs(K @ (every.phi - true)) / sd
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--model", default="sagittal7", choices=MARKERS)
    parser.add_argument("--seeds", nargs=2, type=int, default=(1, 10))
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--filters", action="store_true", help="also the filters' own parameters (slow)")
    args = parser.parse_args()
    filters = ("paper", "default") if args.filters else ()
    rows: dict[tuple[str, str], list[Array]] = {}
    for seed in range(args.seeds[0], args.seeds[1] + 1):
        for key, value in one(args.model, seed, args.duration, filters).items():
            rows.setdefault(key, []).append(value)
        print(f"seed {seed} done", flush=True)
    errors = np.array(rows["base", "errors over sd"])
    print(
        f"\nbase parameters from all three tasks: within 1 sd {(errors < 1).mean():.0%}, 2 sd {(errors < 2).mean():.0%}"
    )
    names = list(dict.fromkeys(name for task, name in rows if task in TASKS))
    for task in TASKS:
        table, true = (np.array(rows[task, name])[:, 2] for name in ("table", "true bodies"))
        gap = table - true
        count = len(rows[task, "table"])
        print(f"\nleft out: {task}. RMS FX, FY (N), MZ (N m), mean of {count} seeds; share of MZ's gap where")
        print(
            f"it exceeds {GAP_NM:g} N m ({int((gap > GAP_NM).sum())} seeds); seeds with a worse MZ; prior sds from truth"
        )
        for name in names:
            if (task, name) not in rows:
                continue
            rms = np.array(rows[task, name])
            wide = gap > GAP_NM
            share = (table - rms[:, 2])[wide].sum() / gap[wide].sum() if wide.any() else np.nan
            off = np.mean(rows[task + ", from truth", name])
            worse = int((rms[:, 2] > table).sum())
            print(f"  {name:26s} {rms.mean(0).round(2)}  {share:6.2f}  worse in {worse:2d}  {off:5.2f}")


if __name__ == "__main__":
    main()
