"""The whole body's errors against simulated truth, live and smoothed; squats and walking.

    python benchmarks/fullbody_by_error.py [--motions squat gait] [--markers opencap] [--seeds 1 4] [--set KEY=VALUE]

Every trial is of a drawn subject with soft tissue and noise of the default sizes, at 100 Hz; nothing but mass, height
and sex is given. A walk is measured on the same person's quiet standing (``static``). Errors are taken after 5 s of a
squat and after 0.5 s of a walk; angles about their mean error, whose size is given apart. Moments are judged while
every foot that carries stands on a plate, those apart that the estimate marks as derived (it can't know that a foot
near the floor off the plates carries nothing).
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import dynakin
from dynakin.arrays import rms
from dynakin.results.measures.sources import DERIVED, MEASURED
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate

SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
DURATION_S = {"squat": 15.0, "gait": 4.0}
START_S = {"squat": 5.0, "gait": 0.5}
ON_PLATES_N = 1.0  # what the plates may miss of the whole vertical force
FLEXION = ("hip_flexion", "knee_angle", "ankle_angle")
LEG = (*FLEXION, "hip_adduction", "hip_rotation", "subtalar_angle")
GROUPS = {
    "lower-limb flexion": [f"{stem}_{side}" for stem in FLEXION for side in "rl"],
    "other rotations of pelvis and legs": [
        "pelvis_tilt", "pelvis_list", "pelvis_rotation",
        *(f"{stem}_{side}" for stem in LEG[3:] for side in "rl"),
    ],
    "trunk": ["lumbar_extension", "lumbar_bending", "lumbar_rotation"],
    "arms": [f"{stem}_{side}" for stem in ("arm_flex", "arm_add", "arm_rot", "elbow_flex", "pro_sup") for side in "rl"],
}  # fmt: skip
SAGITTAL = [*GROUPS["lower-limb flexion"], "lumbar_extension"]
Array = np.ndarray


@dataclass(frozen=True)
class Errors:
    """Of one run: by coordinate RMS about the mean and mean error of the angle (deg), RMS of the speed (rad/s) and of
    the moment (N m, NaN where none is given), while all that it depends on is measured and while it is derived."""

    names: tuple[str, ...]
    angle: Array
    offset: Array
    speed: Array
    moment: Array
    derived: Array


def errors(estimate: dynakin.Estimate, trial: SimulatedTrial, motion: str) -> Errors:
    """Errors of the coordinates that the estimate and the truth share and that are free."""
    data, truth = estimate.data, trial.truth.data
    moved = {str(n) for n in truth["coordinate"].values if np.ptp(truth["speeds"].sel(coordinate=n).values) > 0.0}
    names = [str(n) for n in data["coordinate"].values if str(n) in moved]
    data, truth = data.sel(coordinate=names), truth.sel(coordinate=names)
    order = ("time", "coordinate")
    off = {
        key: data[key].transpose(*order).values - truth[key].transpose(*order).values
        for key in ("coordinates", "speeds", "moments")
    }
    time = trial.recording.time
    window = time >= START_S[motion]
    angle = np.degrees(off["coordinates"][window])
    measured = sum(plate.force[:, 1] for plate in trial.recording.plates)
    whole = trial.truth.data["wrench"].sel(component="fy").values
    known = window & (np.abs(measured - whole) < 10.0 * ON_PLATES_N)
    source = data["moment_source"].transpose(*order).values
    moments = {
        code: np.where(known[:, None] & (source == code), off["moments"], np.nan) for code in (MEASURED, DERIVED)
    }
    speed = np.sqrt(np.mean(off["speeds"][window] ** 2, axis=0))
    return Errors(
        tuple(names),
        angle.std(axis=0),
        angle.mean(axis=0),
        speed,
        rms(moments[MEASURED], axis=0),
        rms(moments[DERIVED], axis=0),
    )


def one_trial(motion: str, markers: str, seed: int, changes: dict[str, float]) -> dict[str, Errors]:
    """Errors live and smoothed."""
    trial = simulate("fullbody", motion, seed, DURATION_S[motion], markers=markers)
    definition = dynakin.load_model("fullbody", subject=SUBJECT, markers=markers)
    static = None if motion == "squat" else simulate("fullbody", "squat", seed, 5.0, markers=markers).recording
    found = {}
    for name, lag_s in (("live", 0.0), ("smoothed", np.inf)):
        estimator = dynakin.Estimator(definition, Noise(**(presets.default().model_dump() | changes)))
        estimate = estimator.run(trial.recording, static=static, lag_s=lag_s)
        found[name] = errors(estimate, trial, motion)
    return found


def tell(title: str, rows: Sequence[Errors]) -> None:
    names = rows[0].names
    mean = {
        key: np.ma.masked_invalid([getattr(row, key) for row in rows]).mean(axis=0).filled(np.nan)
        for key in ("angle", "speed", "moment", "derived")
    }
    offset = np.sqrt(np.mean([row.offset**2 for row in rows], axis=0))
    print(f"\n{title}: mean over {len(rows)} trials (largest of the group)")
    for group, wanted in GROUPS.items():
        k = [names.index(name) for name in wanted if name in names]
        a, o, s = mean["angle"][k], offset[k], mean["speed"][k]
        print(
            f"  {group}: angle {a.mean():.2f} ({a.max():.2f}) deg, offset {o.mean():.2f} ({o.max():.2f}) deg, "
            f"speed {s.mean():.3f} ({s.max():.3f}) rad/s"
        )
    k = [names.index(name) for name in SAGITTAL if name in names]
    for key, words in (("moment", "all contacts measured"), ("derived", "derived")):
        m = mean[key][k]
        if np.isfinite(m).any():
            print(f"  sagittal moments, {words}: {np.nanmean(m):.2f} ({np.nanmax(m):.2f}) N m")
    for j, name in enumerate(names):
        if not name.startswith("pelvis_t") or name == "pelvis_tilt":
            values = mean["angle"][j], offset[j], mean["speed"][j], mean["moment"][j]
            row = "    {:18s} {:6.2f} deg, offset {:6.2f} deg, {:6.3f} rad/s, {:7.2f} N m".format(name, *values)
            print(row if not name.startswith("pelvis") else row.rpartition(",")[0])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--motions", nargs="+", default=["squat", "gait"], choices=DURATION_S)
    parser.add_argument("--markers", default="opencap", choices=["opencap", "plug-in-gait"])
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 4))
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE", help="changes of the default preset")
    asked = parser.parse_args()
    changes = {key: float(value) for key, _, value in (text.partition("=") for text in asked.set)}
    seeds = range(asked.seeds[0], asked.seeds[1] + 1)
    for motion in asked.motions:
        trials = [one_trial(motion, asked.markers, seed, changes) for seed in seeds]
        for method in trials[0]:
            tell(f"{motion}, {asked.markers}, {method}", [trial[method] for trial in trials])


if __name__ == "__main__":
    main()
