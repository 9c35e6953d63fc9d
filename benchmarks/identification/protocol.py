"""A two-minute protocol that makes the inertial parameters visible, and whether it keeps what it promises.

    python benchmarks/identification/protocol.py [--minutes 2] [--verify 1 3]

Gestures of ten seconds (`gestures.py`) and squats are chosen one after the other, each time the one after which the
inertia's posterior has the smallest volume, by the information of the regressor: the trial's slow plate errors and
delay are eliminated, and what geometry is held wrong by is counted. Weights are those that an identification finds on a
simulated squat. ``--verify`` simulates the protocol with sensor noise and soft tissue, identifies on it, and predicts
a gait.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from candidates import predicted
from gestures import GESTURE_S, Gesture, gestures, movement_of, possible
from simulated import DURATION_S, MARKERS, SKIPPED_S, SUBJECT, judged

import dynakin
from dynakin.identification.batch import identify_batch, wrench_rows
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.structure import base_of
from dynakin.identification.trials import Common, MeasuredTrial, measure_all
from dynakin.identification.unknowns import Unknowns
from dynakin.results.measures.posterior import judged as judgement
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.bodies.registry import choose_body
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.streams import Streams
from dynakin.simulation.trial import simulate

Array = np.ndarray
RATE_HZ = 25.0
SQUATS = "squats, thighs level"
PLACES = {"markers": MARKERS["fullbody"]}


def person(seed: int, spread: Spread) -> SimulatedBody:
    """As `simulate` draws it."""
    assert SUBJECT.mass_kg is not None and SUBJECT.height_m is not None
    return choose_body("fullbody", Streams(seed), SUBJECT.mass_kg, SUBJECT.height_m, SUBJECT.sex, spread, "opencap")


def common_of(seed: int, spread: Spread) -> tuple[Common, MeasuredTrial]:
    """The model measured on a standing person, and a squat."""
    standing, squat = (simulate("fullbody", "squat", seed, s, spread=spread, **PLACES).recording for s in (5.0, 10.0))
    estimator = dynakin.Estimator(dynakin.load_model("fullbody", subject=SUBJECT, markers=MARKERS["fullbody"]))
    common = Common.measure(estimator, squat, standing)
    return common, measure_all(common, [squat])[0]


def as_trial(common: Common, body: SimulatedBody, gesture: Gesture, like: MeasuredTrial) -> MeasuredTrial:
    """A gesture with exact kinematics; its plates say what the model says."""
    time = np.arange(0.0, GESTURE_S, 1.0 / RATE_HZ)
    motion = movement_of(body, [gesture]).at(time)
    states = np.tile(common.initial.x0, (len(time), 1))
    names = [common.core.layout.names[k] for k in range(*common.columns("coordinates").indices(states.shape[1]))]
    order = [motion.names.index(name) for name in names]
    for block, values in (("coordinates", motion.q), ("speeds", motion.qd), ("accelerations", motion.qdd)):
        states[:, common.columns(block)] = values[:, order]
    unknowns = Unknowns.of(common, geometry=False)
    wrench = unknowns.wrench(common.core, states, np.zeros(len(unknowns.sd)))
    movement = replace(like.movement, time=time, states=states, unfiltered=states)
    return MeasuredTrial(movement, wrench, wrench, True)


def information(common: Common, trial: MeasuredTrial, unknowns: Unknowns, weight: Array) -> Array:
    """(n, n) of [theta; slow errors of the plates], weight (r,) a second."""
    frames = np.arange(len(trial.movement.time))
    A, _ = wrench_rows(common, trial, frames, unknowns, np.zeros(len(unknowns.sd)))
    return np.einsum("tki,k,tkj->ij", A, weight / RATE_HZ, A, optimize=True)


def posterior(H: Array, unknowns: Unknowns) -> Array:
    """Covariance (b, b) of the inertia: what geometry is held wrong by is counted (Schmidt)."""
    free = np.concatenate([unknowns.free, np.ones(len(unknowns.nuisance_sd), dtype=bool)])
    prior = np.concatenate([unknowns.sd, unknowns.nuisance_sd])[free]
    inverse = np.linalg.inv(H[np.ix_(free, free)] + np.diag(prior**-2.0))
    through = inverse @ H[np.ix_(free, ~free)] * unknowns.considered_sd[~unknowns.free]
    count = int(unknowns.free.sum())
    return (inverse + through @ through.T)[:count, :count]


def gain(H: Array, unknowns: Unknowns) -> float:
    """Half the logarithm of the prior's volume over the posterior's."""
    P = posterior(H, unknowns)
    sd = unknowns.sd[unknowns.free]
    return -0.5 * float(np.linalg.slogdet(P / np.outer(sd, sd))[1])


def choose(tried: dict[str, Array], unknowns: Unknowns, count: int) -> list[str]:
    """Names of gestures, greedily."""
    total, chosen = np.zeros_like(next(iter(tried.values()))), []
    for _ in range(count):
        best = max(tried, key=lambda name: gain(total + tried[name], unknowns))
        total = total + tried[best]
        chosen.append(best)
        print(f"  {10 * len(chosen):4d} s  {gain(total, unknowns):6.1f}  {best}", flush=True)
    return chosen


def shares(common: Common, H: Array, unknowns: Unknowns) -> tuple[Array, Array]:
    """(e,), (r,): deviations of the inertial numbers, and of the base parameters over the prior's."""
    inertial, start = unknowns.inertial, np.zeros(len(unknowns.inertial.sd))
    after = inertial.covariance(start, posterior(H, unknowns))
    before = inertial.covariance(start, np.diag(inertial.sd**2))
    K = base_of(MeasuredModel.of(common.tracker())).K
    told, known = (np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", K, P, K), 0.0)) for P in (after, before))
    keep = known > 1e-9 * known.max()
    return np.sqrt(np.diag(after)), told[keep] / known[keep]


def promised(common: Common, H: Array, unknowns: Unknowns, title: str) -> None:
    """Print expected standard deviations."""
    sd, share = shares(common, H, unknowns)
    words = [judgement(float(s)) for s in share]
    print(
        f"\n{title}: of {len(share)} base parameters " + ", ".join(f"{words.count(w)} {w}" for w in sorted(set(words)))
    )
    print(f"  median deviation over the table's {np.median(share):.2f}")
    inertial, start = unknowns.inertial, np.zeros(len(unknowns.inertial.sd))
    P, before = posterior(H, unknowns), inertial.covariance(start, np.diag(inertial.sd**2))
    table = np.sqrt(np.diag(before))
    print("  segment        mass kg (sd, table's)   centre of mass mm (sd x, y, z; table's)")
    u_sd = np.sqrt(np.diag(inertial.tie @ P @ inertial.tie.T)).reshape(-1, 10)
    own = (np.abs(inertial.tie) @ inertial.sd).reshape(-1, 10)
    for k, segment in enumerate(inertial.segments):
        if not segment.endswith("_l"):
            c = " ".join(f"{1e3 * v:5.1f}" for v in u_sd[k, 1:4])
            print(f"  {segment:12s} {sd[10 * k]:8.2f} {table[10 * k]:8.2f}        {c}   {1e3 * own[k, 1]:5.1f}")


def verify(
    seed: int, chosen: list[Gesture], squats: int, errors: list[Array], rows: dict[tuple[str, str], list[Array]]
) -> None:
    """Identify a drawn person on the protocol (``squats`` parts are squats), and on one squat; predict a gait."""
    common, squat = common_of(seed, Spread())
    recordings = []
    if chosen:
        movement = movement_of(person(seed, Spread()), chosen)
        recordings.append(simulate("fullbody", movement, seed, GESTURE_S * len(chosen), **PLACES).recording)
    if squats:
        recordings.append(simulate("fullbody", "squat", seed, GESTURE_S * squats, **PLACES).recording)
    walking = simulate("fullbody", "gait", seed, DURATION_S["gait"], **PLACES)
    unknowns = Unknowns.of(common, geometry=False)
    inertial, start = unknowns.inertial, np.zeros(len(unknowns.inertial.sd))
    protocol = identify_batch(common, measure_all(common, recordings), unknowns)
    phi = {
        "table": inertial.phi(start),
        "protocol": protocol.phi,
        "squat, 10 s": identify_batch(common, [squat], unknowns).phi,
        "true inertia": np.array([walking.truth.parameters[name] for name in inertial.names]),
    }
    K = base_of(MeasuredModel.of(common.tracker())).K
    after, before = (
        np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", K, P, K), 0.0))
        for P in (protocol.phi_covariance(), inertial.covariance(start, np.diag(inertial.sd**2)))
    )
    told = before > 1e-9 * before.max()
    told &= after > 1e-6 * before  # all but the total mass
    errors.append((np.abs(K @ (protocol.phi - phi["true inertia"])) / np.where(told, after, 1.0))[told])
    seen = common.see(walking.recording)
    raw = common.with_plates(seen, walking.recording).full_band()
    for name, values in phi.items():
        off = (K @ (values - phi["true inertia"]) / np.where(told, before, 1.0))[told]
        rows.setdefault(("base parameters from truth, prior sds, RMS:", name), []).append(
            np.sqrt(np.mean(off**2, keepdims=True))
        )
        wrench = predicted(common, seen.states, values)
        rows.setdefault(("gait predicted, RMS fx to mz:", name), []).append(
            judged(common, raw, wrench, SKIPPED_S["gait"])
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--verify", nargs=2, type=int, metavar=("FIRST", "LAST"), help="Seeds to simulate.")
    args = parser.parse_args()
    common, squat = common_of(1, Spread.none())
    body = person(1, Spread.none())
    unknowns = Unknowns.of(common, geometry=False)
    like = identify_batch(common, [squat], unknowns)
    weight = 1.0 / (like.sigma[0] ** 2 * like.tau_s[0])
    print(f"error of the model: {like.sigma[0].round(1)} N, N m, lasting {like.tau_s[0].round(2)} s")
    can = {g.words: g for g in gestures() if possible(body, g)}
    left = [g.words for g in gestures() if g.words not in can]
    print(f"{len(can)} gestures are possible; not: {', '.join(left) or 'none'}")
    tried = {w: information(common, as_trial(common, body, g, squat), unknowns, weight) for w, g in can.items()}
    squats = information(common, squat, unknowns, weight) * (GESTURE_S / float(np.ptp(squat.movement.time)))
    tried[SQUATS] = squats
    print("\nlog volume (prior over posterior), gesture")
    chosen = choose(tried, unknowns, round(60.0 * args.minutes / GESTURE_S))
    promised(common, sum(tried[name] for name in chosen), unknowns, "Protocol")
    promised(common, squats * (60.0 * args.minutes / GESTURE_S), unknowns, "Squats for the same time")
    if args.verify:
        errors: list[Array] = []
        rows: dict[tuple[str, str], list[Array]] = {}
        for seed in range(args.verify[0], args.verify[1] + 1):
            verify(seed, [can[name] for name in chosen if name != SQUATS], chosen.count(SQUATS), errors, rows)
            print(f"seed {seed} done", flush=True)
        every = np.concatenate(errors)
        within = ", ".join(f"{n} sd {(every < n).mean():.0%}" for n in (1, 2, 3))
        print(f"\nSimulated with noise and soft tissue: base parameters, errors over deviations: within {within}")
        for (task, name), values in rows.items():
            print(f"  {task} {name:12s} {np.mean(values, axis=0).round(2)}")


if __name__ == "__main__":
    main()
