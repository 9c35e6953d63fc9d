"""Held out on real squats: one half of `squats1` (with or without `static1`) identifies, the other half judges.

    python benchmarks/identification/real.py [--data ../shared/data/opencap_subject4]

`product` is what `dynakin run --parameters` does: the filter itself, started from the subject file, on the judging half
with its plates taken away, smoothed; the others are predictions of `candidates.py`.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from candidates import all_candidates, predicted
from simulated import judged

import dynakin
from dynakin.comparison.held_out import halves, marker_paths
from dynakin.filter import Estimator
from dynakin.identification import Common, Movement, identify_subject
from dynakin.identification.batch import PLANE
from dynakin.model.identified import IdentifiedSubject
from dynakin.recordings import Recording

Array = np.ndarray


def product(
    model: dynakin.ModelDefinition, recording: Recording, static: Recording, subject: IdentifiedSubject | None
) -> Array:
    """(T, 6) smoothed wrench of a trial without plates."""
    estimator = Estimator(model, parameters=subject)
    recording = replace(recording, plates=())
    initial = estimator.start(recording, static=static)
    markers = marker_paths(recording, initial, initial.ground)
    arrays = estimator.run_smoothed_arrays(recording.time, markers, np.full((recording.n_frames, 6), np.nan))
    return arrays["wrench_estimated"]


def of_movement(movement: Movement, recording: Recording, wrench: Array) -> Array:
    """(frames kept, 3) of a wrench (T, 6) of all frames."""
    return wrench[np.searchsorted(recording.time, movement.time - 1e-9)][:, PLANE]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--data", type=Path, default=Path("../shared/data/opencap_subject4"))
    args = parser.parse_args()
    squats, static = (
        dynakin.read(args.data / f"{name}.trc", args.data / f"{name}_grf.mot") for name in ("squats1", "static1")
    )
    model = dynakin.load_model("sagittal7", subject=dynakin.Subject(mass_kg=60.05), markers="opencap")
    for order, with_static in ((1, False), (-1, False), (1, True), (-1, True)):
        first, second = halves(squats)[::order]
        chosen = [first, static] if with_static else [first]
        common = Common.measure(Estimator(model), first, static)
        trials = [common.measured(recording) for recording in chosen]
        seen = common.see(second)
        raw = common.with_plates(seen, second, as_measured=True)
        print(f"\n{' + '.join(r.name for r in chosen)} -> {second.name}: RMS FX, FY (N), MZ (N m)")
        for name, (phi, geometry) in all_candidates(common, trials, chosen, ("paper", "default")).items():
            print(f"  {name:26s} {judged(raw, predicted(common, seen.states, phi, geometry)).round(1)}")
        decided = identify_subject(Estimator(model), chosen, static=static).subject
        used = decided.model_copy(update={"use": "bodies"})
        print(f"  cross-validation inside the trials: {decided.use}")
        for name, parameters in (("product, table", None), ("product, bodies", used)):
            wrench = of_movement(seen, second, product(model, second, static, parameters))
            print(f"  {name:26s} {judged(raw, wrench).round(1)}")


if __name__ == "__main__":
    main()
