"""`tune fit` on the first half of a real trial, judged on the second half by what no filter has seen.

    python benchmarks/tuning_fit.py [--jobs 2]

Trial: `squats1` of ../shared/data, `sagittal7`, lengths from `static1`. Judged: likelihood, 100 ms ahead, each marker
left out from the middle on, and the plates withheld (constants of the first half, the second half's wrench from its
markers alone).
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace
from pathlib import Path

import dynakin
from dynakin.filter.estimator import Estimator
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.studies.engine.pools import Pool, open_pool
from dynakin.studies.tuning.fit import Fitter, usual_names
from dynakin.studies.tuning.score import Shared, figures_of, left_out_mm
from dynakin.studies.tuning.trial import TuningTrial, prepare, undoubting
from dynakin.validation.case import Setup
from dynakin.validation.unseen import WITHHELD, plates_withheld

ROOT = Path(__file__).resolve().parents[1]
MOTION = (
    "jerk_density_rad2_s5",
    "soft_tissue_sd_fraction",
    "soft_tissue_time_s",
    "plate_force_sd_n",
    "plate_moment_sd_nm",
)
"""Without the sensors' own noise, of which the maker knows more than the innovations of a smooth recording."""


def fitted(first: TuningTrial, noise: Noise, pool: Pool, names: tuple[str, ...], criterion: str) -> Noise:
    start = time.perf_counter()
    fitter = Fitter(Shared((first,), noise), names, pool, criterion=criterion)
    optimum, found = fitter.only()
    at = ", ".join(f"{name} {getattr(found, name):.3g}" for name in names)
    print(f"{criterion}: {optimum.evaluations} runs, {time.perf_counter() - start:.0f} s: {at}", flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    data = Path(os.environ.get("DYNAKIN_TEST_DATA", ROOT.parent / "shared" / "data")) / "opencap_subject4"
    recording = dynakin.read(data / "squats1.trc", data / "squats1_grf.mot")
    static = dynakin.read(data / "static1.trc")
    definition = dynakin.load_model("sagittal7", dynakin.Subject())
    base = presets.default()
    trial = prepare(recording, Estimator(definition, base), static=static)
    middle = recording.n_frames // 2
    first, second = replace(trial, end=middle), replace(trial, first=middle, end=recording.n_frames)
    with open_pool("threads", asked.jobs) as pool:
        noises = {
            "paper": presets.paper(),
            "default": base,
            "fit nll": fitted(first, base, pool, usual_names(base), "nll"),
            "fit nll, motion": fitted(first, base, pool, MOTION, "nll"),
            "fit ahead": fitted(first, base, pool, MOTION, "ahead"),
        }
    withheld = plates_withheld(recording, Setup(Estimator(definition), noises), static=static)
    for name, noise in noises.items():
        told = undoubting(noise.changed(total_mass_use="prior", total_mass_variance_kg2=base.total_mass_variance_kg2))
        row = figures_of(second, told, base)
        shown = {key: row[key] for key in ("nll", "nis_per_row", "ahead", "ahead_markers_mm", "ahead_fy", "fx", "fy")}
        shown["left_out_mm"] = left_out_mm(replace(second), told)
        shown |= {f"withheld_{q}": withheld.get((WITHHELD, q, f"EKF ({name})")) for q in ("fx", "fy", "mz")}
        print(name, {key: None if value is None else float(f"{value:.4g}") for key, value in shown.items()}, flush=True)


if __name__ == "__main__":
    main()
