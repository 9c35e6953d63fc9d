"""`tune fit` on simulated squats by several criteria, judged by the true error on other ones.

    python benchmarks/tuning_fit_truth.py [--jobs 2]

Fitted together on seeds 1 to 3 (8 s at 50 Hz) from the preset `default`; errors of seeds 6 to 10 as in tuning_truth.py.
"""

from __future__ import annotations

import argparse
import time

from tuning_truth import ERRORS, means, score, trial_of

from dynakin.settings import presets
from dynakin.studies.engine.pools import open_pool
from dynakin.studies.tuning.fit import Fitter, usual_names
from dynakin.studies.tuning.score import Shared
from dynakin.studies.tuning.settings import together

MOTION = (
    "jerk_density_rad2_s5",
    "soft_tissue_sd_fraction",
    "soft_tissue_time_s",
    "plate_force_sd_n",
    "plate_moment_sd_nm",
)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    base = presets.default()
    learning = tuple(trial_of(seed, 8.0, 50.0, base).trial for seed in (1, 2, 3))
    judging = [trial_of(seed, 8.0, 50.0, base) for seed in range(6, 11)]
    everything = usual_names(base)
    fits = {"default": None, "nll, all": ("nll", everything), "nll, motion": ("nll", MOTION)}
    fits |= {"ahead, motion": ("ahead", MOTION), "sigma, motion": ("sigma", MOTION)}
    with open_pool("threads", asked.jobs) as pool:
        for title, asked_for in fits.items():
            start, changes = time.perf_counter(), {}
            if asked_for is not None:
                criterion, names = asked_for
                optimum, noise = Fitter(Shared(learning, base), names, pool, criterion=criterion).only()
                changes = together(base, {name: getattr(noise, name) for name in names})
                print(f"{title}: {3 * optimum.evaluations} runs, {time.perf_counter() - start:.0f} s")
            row = means([score(judging, (k, changes, "default")) for k in range(len(judging))])
            errors = ", ".join(f"{e} {row[e]:.2f} {ERRORS[e][1]}" for e in ERRORS)
            more = ", ".join(f"{key} {row[key]:.3g}" for key in ("nll", "ahead", "nis_per_row", "markers_mm", "fy"))
            at = ", ".join(f"{name} {value:.3g}" for name, value in changes.items())
            print(f"{title}: {errors}; {more}; {at}", flush=True)


if __name__ == "__main__":
    main()
