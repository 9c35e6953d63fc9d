"""Which optimiser `tune fit` should use: evaluations until each is near the likeliest settings.

    pip install cma optuna; python benchmarks/tuning_optimisers.py [--budget 400]

Cost: minus the log-likelihood of a simulated squat (8 s at 50 Hz) over six settings of the preset `default`, from its
own start. Reported: evaluations until the cost is within 100, 10 and 1 nats of the best that any of them found.
"""

from __future__ import annotations

import argparse
import time
import warnings
from contextlib import suppress

import numpy as np
from scipy.optimize import minimize

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.settings import presets
from dynakin.simulation.trial import simulate
from dynakin.studies.engine.pools import open_pool
from dynakin.studies.tuning.likelihood import REACH, Likelihood
from dynakin.studies.tuning.optimise import minimise
from dynakin.studies.tuning.score import Shared
from dynakin.studies.tuning.trial import prepare

NAMES = (
    "jerk_density_rad2_s5",
    "soft_tissue_sd_fraction",
    "soft_tissue_time_s",
    "force_variance_n2",
    "plate_force_sd_n",
    "plate_moment_sd_nm",
)
Array = np.ndarray


class Spent(Exception):
    """The budget is used up."""


def counted(likelihood: Likelihood, budget: int):
    likelihood.tried.clear()

    def cost(theta: Array) -> float:
        if len(likelihood.tried) >= budget:
            raise Spent
        return float(likelihood.costs([np.clip(theta, -REACH, REACH)])[0])

    return cost


def by_scipy(method: str, likelihood: Likelihood, budget: int) -> None:
    options = (
        {"initial_simplex": np.vstack([np.zeros(len(NAMES)), np.eye(len(NAMES))])} if method == "Nelder-Mead" else {}
    )
    minimize(counted(likelihood, budget), np.zeros(len(NAMES)), method=method, options=options)


def by_cma(likelihood: Likelihood, budget: int) -> None:
    import cma

    cma.fmin(counted(likelihood, budget), np.zeros(len(NAMES)), 1.0, {"verbose": -9, "seed": 1})


def by_optuna(likelihood: Likelihood, budget: int) -> None:
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    cost = counted(likelihood, budget)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1))
    study.enqueue_trial(dict.fromkeys(NAMES, 0.0))
    study.optimize(lambda t: cost(np.array([t.suggest_float(name, -REACH, REACH) for name in NAMES])), n_trials=budget)


def ours(likelihood: Likelihood, budget: int) -> None:
    likelihood.tried.clear()
    minimise(likelihood.costs, np.zeros(len(NAMES)), REACH)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--budget", type=int, default=400)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    recording = simulate("sagittal7", "squat", 1, 8.0, 50.0).recording
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    definition = dynakin.load_model("sagittal7", subject, markers="opencap")
    noise = presets.default()
    shared = Shared((prepare(recording, Estimator(definition, noise)),), noise)
    methods = {
        "L-BFGS-B, central differences": ours,
        "Nelder-Mead": lambda *a: by_scipy("Nelder-Mead", *a),
        "Powell": lambda *a: by_scipy("Powell", *a),
        "CMA-ES (cma)": by_cma,
        "TPE (Optuna)": by_optuna,
    }
    found: dict[str, tuple[Array, float]] = {}
    with open_pool("threads", 2) as pool:
        for name, method in methods.items():
            likelihood = Likelihood(shared, NAMES, pool)
            start = time.perf_counter()
            with suppress(Spent):
                method(likelihood, asked.budget)
            found[name] = np.array([cost for _, cost in likelihood.tried]), time.perf_counter() - start
    best = min(costs.min() for costs, _ in found.values())
    for name, (costs, seconds) in found.items():
        reached = [int(np.argmax(costs < best + gap)) + 1 if costs.min() < best + gap else None for gap in (100, 10, 1)]
        print(f"{name:32s} within 100, 10, 1 nats after {reached} of {len(costs)}; {seconds:.0f} s")


if __name__ == "__main__":
    main()
