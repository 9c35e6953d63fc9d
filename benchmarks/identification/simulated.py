"""Held out by task, simulated: every task of one subject in turn is judged, the others identify.

    python benchmarks/identification/simulated.py [--model sagittal7] [--seeds 1 10] [--duration 20] [--filters]
    python benchmarks/identification/simulated.py --model fullbody [--seeds 1 10] [--duration 10]

The judging trial's kinematics come from its markers alone; its plates are read by `judged` only. `true inertia` is the
simulated subject's own phi in place of the table's, with the table's geometry, so that
(table - candidate) / (table - true inertia) is the share of what perfect inertial parameters could gain.
"""

from __future__ import annotations

import argparse

import numpy as np
from candidates import all_candidates, batch, predicted

import dynakin
from dynakin.identification.decision import rms_of
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.structure import base_of
from dynakin.identification.trials import Common, MeasuredTrial, measure_all
from dynakin.identification.unknowns import Unknowns
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate
from dynakin.units import COMPONENTS

TASKS = {"sagittal7": ("squat", "sit-to-stand", "sway"), "fullbody": ("squat", "gait")}
TASKS["squat7"] = TASKS["sagittal7"]
SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
MARKERS = {"sagittal7": "opencap", "squat7": "plug-in-gait", "fullbody": "opencap"}
STANDING = {"sagittal7": ("sway", 3.0), "squat7": ("sway", 3.0), "fullbody": ("squat", 5.0)}
SKIPPED_S = {"gait": 0.3}
SKIPPED_ELSE_S = 2.0
DURATION_S = {"gait": 4.0}
GAP_NM = 2.0  # MZ by which true inertia must be better than the table for a share to be reported
Array = np.ndarray


def judged(common: Common, trial: MeasuredTrial, wrench: Array, skipped_s: float = SKIPPED_ELSE_S) -> Array:
    """RMS (r,) against the plates, N and N m, after the filter has settled."""
    after = slice(int(np.searchsorted(trial.movement.time, trial.movement.time[0] + skipped_s)), None)
    return rms_of(common, trial.part(after), wrench[after])


def subject_of(model: str, seed: int, duration_s: float) -> tuple[Common, list[SimulatedTrial], list[MeasuredTrial]]:
    """The common model, the trials and what is seen of them."""
    markers = {"markers": MARKERS[model]} if model == "fullbody" else {}
    sims = [simulate(model, task, seed, DURATION_S.get(task, duration_s), **markers) for task in TASKS[model]]
    task, seconds = STANDING[model]
    standing = simulate(model, task, seed, seconds, **markers).recording
    estimator = dynakin.Estimator(dynakin.load_model(model, subject=SUBJECT, markers=MARKERS[model]))
    common = Common.measure(estimator, sims[0].recording, standing)
    return common, sims, measure_all(common, [sim.recording for sim in sims])


def one(model: str, seed: int, duration_s: float, filters: tuple[str, ...]) -> dict[tuple[str, str], Array]:
    """RMS by (task left out, candidate), and distances from the truth by ("truth", candidate)."""
    common, sims, trials = subject_of(model, seed, duration_s)
    inertial = Unknowns.of(common).inertial
    true = np.array([sims[0].truth.parameters[name] for name in inertial.names])
    prior = inertial.covariance(np.zeros(len(inertial.sd)), np.diag(inertial.sd**2))
    spread = np.sqrt(np.diag(prior))
    found: dict[tuple[str, str], Array] = {}
    for k, task in enumerate(TASKS[model]):
        others = [j for j in range(len(trials)) if j != k]
        candidates = all_candidates(common, [trials[j] for j in others], [sims[j].recording for j in others], filters)
        candidates |= {"true inertia": (true, None)}
        raw = common.with_plates(trials[k].movement, sims[k].recording).full_band()
        for name, (phi, geometry) in candidates.items():
            wrench = predicted(common, trials[k].movement.states, phi, geometry)
            found[task, name] = judged(common, raw, wrench, SKIPPED_S.get(task, SKIPPED_ELSE_S))
            found[task + ", from truth", name] = np.sqrt(np.mean(((phi - true) / spread) ** 2, keepdims=True))
    every = batch(common, trials, inertia=True, geometry=False)
    K = base_of(MeasuredModel.of(common.tracker())).K
    order = [MeasuredModel.of(common.tracker()).names.index(name) for name in inertial.names]
    assert order == sorted(order)  # K is over the inertial numbers in the state's order
    sd, before = (np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", K, P, K), 0.0)) for P in (every.phi_covariance(), prior))
    told = (before > 0.0) & (sd > 1e-6 * before)  # all but the total mass, which is known
    found["base", "errors over sd"] = (np.abs(K @ (every.phi - true)) / np.where(told, sd, 1.0))[told]
    found["base", "table's errors over prior sd"] = (
        np.abs(K @ (inertial.phi(np.zeros(len(inertial.sd))) - true)) / np.where(told, before, 1.0)
    )[told]
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
    for key in ("errors over sd", "table's errors over prior sd"):
        errors = np.concatenate(rows["base", key])
        within = ", ".join(f"{n} sd {(errors < n).mean():.0%}" for n in (1, 2, 3))
        print(f"base parameters, all tasks: {key}: within {within}")
    names = list(dict.fromkeys(name for task, name in rows if task in TASKS[args.model]))
    width = len(rows[TASKS[args.model][0], "table"][0])
    components = [COMPONENTS[k] for k in ((0, 1, 5) if width == 3 else range(6))]
    for task in TASKS[args.model]:
        table, true = (np.array(rows[task, name])[:, -1] for name in ("table", "true inertia"))
        gap = table - true
        wide = gap > GAP_NM
        print(f"\nleft out: {task}. RMS {', '.join(components)} (N, N m), mean of {len(gap)} seeds; share of MZ's gap")
        print(f"where it exceeds {GAP_NM:g} N m ({int(wide.sum())} seeds); seeds with a worse MZ; prior sds from truth")
        for name in names:
            if (task, name) not in rows:
                continue
            rms = np.array(rows[task, name])
            whole = len(rms) == len(table)  # a filter may lose a seed
            share = (table - rms[:, -1])[wide].sum() / gap[wide].sum() if whole and wide.any() else np.nan
            worse = int((rms[:, -1] > table).sum()) if whole else -1
            off = np.mean(rows[task + ", from truth", name])
            print(f"  {name:26s} {rms.mean(0).round(2)}  {share:6.2f}  worse in {worse:2d}  {off:5.2f}")


if __name__ == "__main__":
    main()
