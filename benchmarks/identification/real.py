"""Held out on real recordings: `squats1` by halves, and `squats1` with `static1` judged on `walking1`.

    python benchmarks/identification/real.py [--model sagittal7|fullbody|FILE.osim] [--data FOLDER] [--walking]

`product` is what `dynakin run --parameters` does: the filter itself, started from the subject file, on the judging part
with its plates taken away, smoothed; the others are predictions of `candidates.py`. `walking1` is for models in space:
its plates are another set and read 63 kg, so predictions are scaled to that mass and every component's mean is taken
from the error.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from candidates import all_candidates, predicted
from simulated import judged

import dynakin
from dynakin.arrays import wrench_about
from dynakin.filter.estimator import Estimator
from dynakin.filter.measurements import Measurements
from dynakin.filter.samples import marker_paths
from dynakin.identification.subject import identify_subject
from dynakin.identification.trials import Common, MeasuredTrial, Movement
from dynakin.model.identified import IdentifiedSubject
from dynakin.recordings.recording import Recording
from dynakin.units import COMPONENTS
from dynakin.validation.held_out import halves

Array = np.ndarray
DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", "../shared/data")) / "opencap_subject4"
MASS_KG = 60.05  # by the plates of static1 and squats1
WALKING_KG = 63.0  # by those of walking1
WALKING_S = (0.15, 1.20)  # every stance foot is on a plate


def product(
    model: dynakin.ModelDefinition, recording: Recording, static: Recording, subject: IdentifiedSubject | None
) -> Array:
    """(T, 6) smoothed wrench of a trial without plates."""
    estimator = Estimator(model, parameters=subject)
    recording = replace(recording, plates=())
    tracker = estimator.start(recording, static=static)
    initial = tracker.calibrated
    markers = marker_paths(recording, initial, lacking=True)
    measured = Measurements(recording.time, markers, np.full((recording.n_frames, 6), np.nan))
    return tracker.run_smoothed_arrays(measured)["wrench_estimated"]


def of_movement(movement: Movement, recording: Recording, wrench: Array) -> Array:
    """(frames kept, 6) of a wrench (T, 6) of all frames."""
    return wrench[np.searchsorted(recording.time, movement.time - 1e-9)]


def judged_walking(common: Common, trial: MeasuredTrial, wrench: Array) -> Array:
    """RMS (r,) of the error about its mean, where every foot is on a plate, scaled to the mass that its plates read."""
    inside = (trial.movement.time >= WALKING_S[0]) & (trial.movement.time <= WALKING_S[1])
    error = wrench_about(trial.wrench - WALKING_KG / MASS_KG * wrench, trial.reference)[inside][:, common.rows]
    return np.asarray(np.nanstd(error, axis=0))


def compare(
    model: dynakin.ModelDefinition, chosen: Sequence[Recording], static: Recording, judging: Recording, walks: bool
) -> None:
    """Print a table of all candidates and of the product."""
    common = Common.measure(Estimator(model), chosen[0], static)
    trials = [common.measured(recording) for recording in chosen]
    seen = common.see(judging)
    raw = common.with_plates(seen, judging).full_band()
    judge = judged_walking if walks else judged
    components = ", ".join(COMPONENTS[k] for k in common.rows)
    print(f"\n{' + '.join(r.name for r in chosen)} -> {judging.name}: RMS {components} (N, N m)")
    filters = () if common.floating else ("paper", "default")
    for name, (phi, geometry) in all_candidates(common, trials, chosen, filters).items():
        print(f"  {name:26s} {judge(common, raw, predicted(common, seen.states, phi, geometry)).round(1)}", flush=True)
    decided = identify_subject(Estimator(model), chosen, static=static).subject
    used = decided.model_copy(update={"use": "bodies"})
    print(f"  cross-validation inside the trials: {decided.use}.")
    for text in decided.report[:4]:
        print(f"    {text}")
    for name, parameters in (("product, table", None), ("product, inertia", used)):
        wrench = of_movement(seen, judging, product(model, judging, static, parameters))
        print(f"  {name:26s} {judge(common, raw, wrench).round(1)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--model", default="sagittal7")
    parser.add_argument("--walking", action="store_true", help="walking1 alone, for models in space.")
    args = parser.parse_args()
    squats, static, walking = (
        dynakin.read(args.data / f"{name}.trc", args.data / f"{name}_grf.mot")
        for name in ("squats1", "static1", "walking1")
    )
    markers = {} if args.model.endswith(".osim") else {"markers": "opencap"}
    model = dynakin.load_model(args.model, subject=dynakin.Subject(mass_kg=MASS_KG), **markers)
    for order, with_static in () if args.walking else ((1, False), (-1, False), (1, True), (-1, True)):
        first, second = halves(squats)[::order]
        compare(model, [first, static] if with_static else [first], static, second, walks=False)
    if args.model not in ("sagittal7", "squat7"):
        compare(model, [squats, static], static, walking, walks=True)


if __name__ == "__main__":
    main()
