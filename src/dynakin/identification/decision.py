"""Whether identified parameters earn their place: each trial predicted from its markers by the others.

Of fewer than three trials halves are left out instead: with two, a standing trial would have to predict a squat all by
itself. Two walks that are too short to be halved predict each other. A fold leaves out a whole trial or half, never
single frames: the model's error is alike from frame to frame, so single frames would judge themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from dynakin.arrays import Array, rms, wrench_about
from dynakin.errors import RecordingError
from dynakin.identification.batch import Posterior, at_start, identify_batch, known_s
from dynakin.identification.trials import SHORTEST_S, Common, MeasuredTrial, middle_of
from dynakin.identification.unknowns import Unknowns
from dynakin.progress import Progress
from dynakin.units import COMPONENTS

Use = Literal["table", "bodies"]
USES: tuple[Use, ...] = get_args(Use)
_CALLED: dict[Use, str] = {"table": "Table", "bodies": "Identified parameters"}

GAIN = 0.97
"""Mean RMS over the table's from which on the table is left: 3 % is within what two halves of a trial differ by."""
WORST = 1.10
"""And the worst trial must not lose more than this."""


@dataclass(frozen=True, eq=False)
class Decision:
    """What cross-validation found.

    Attributes:
        use: the winner. folds: names of what was left out. rms: (folds, r) of what was left out, predicted from its
            markers, by candidate, low-passed. full_band: (folds, r) the same, neither prediction nor plates low-passed.
            components: (r,) of them, fx, fy, fz (N), mx, my, mz (N m).
    """

    use: Use
    folds: tuple[str, ...]
    rms: dict[Use, Array]
    full_band: dict[Use, Array]
    components: tuple[str, ...] = ("fx", "fy", "mz")

    @property
    def ratios(self) -> Array:
        """(folds,) RMS with the identified inertia over that with the table's, mean over the components."""
        return np.asarray((self.rms["bodies"] / self.rms["table"]).mean(axis=1))

    @property
    def full_band_ratios(self) -> Array:
        """(folds,) the same of predictions that are not low-passed."""
        return np.asarray((self.full_band["bodies"] / self.full_band["table"]).mean(axis=1))

    @property
    def full_band_use(self) -> Use:
        """The winner for predictions that are not low-passed: the table too where more noise of accelerations, which
        goes with inertia far out on the limbs, outweighs what the identified inertia explains."""
        ratios = self.full_band_ratios
        return self.use if ratios.mean() <= 1.0 and ratios.max() <= WORST else "table"

    def in_words(self) -> list[str]:
        """Sentences."""
        found = {use: rms(self.rms[use], axis=0) for use in USES}
        said = [
            "Each left out in turn and predicted from its markers alone by the others' posterior: "
            f"{', '.join(self.folds)}."
        ]
        for use, values in found.items():
            each = [
                f"{name.upper()} {value:.1f} {'N' if name.startswith('f') else 'N m'}"
                for name, value in zip(self.components, values, strict=True)
            ]
            said.append(f"{_CALLED[use]}: {', '.join(each)}.")
        gain = 100.0 * (1.0 - self.ratios.mean())
        worst = 100.0 * (self.ratios.max() - 1.0)
        verdict = (
            f"held-out gain {gain:z.0f} % of the wrench without plates (mean over components and parts; at the worst "
            f"part {-worst:+z.0f} %)"
        )
        said.append(f"Not low-passed, the gain is {100.0 * (1.0 - self.full_band_ratios.mean()):z.0f} %.")
        if self.use == "table":
            return [
                *said,
                f"The table is kept: {verdict}; expected a gain of {100.0 * (1.0 - GAIN):.0f} % and no loss of more "
                f"than {100.0 * (WORST - 1.0):.0f} %.",
            ]
        return [*said, f"The identified segment inertia is used: {verdict}."]


_HALVED = " or its half: fewer than three trials are halved, and each half is predicted by the others"


def parts_of(trials: Sequence[MeasuredTrial]) -> list[MeasuredTrial]:
    """What is left out in turn: the trials, or the halves of fewer than three if these can be identified on."""
    if len(trials) > 2:
        return list(trials)
    middles = [middle_of(len(trial.movement.time)) for trial in trials]
    parts = [
        trial.part(half)
        for trial, middle in zip(trials, middles, strict=True)
        for half in (slice(None, middle), slice(middle, None))
    ]
    long = sum(known_s(part) >= SHORTEST_S for part in parts)
    return list(trials) if len(trials) == 2 and long < 2 else parts  # each is left out, and one must be left


def estimate(common: Common, trials: Sequence[MeasuredTrial], use: Use) -> Posterior:
    """The table, or the batch estimate of the segments' inertia.

    Geometry stays as measured: lengths and zeros of angles predict as well in this batch, but a filter that follows its
    markers undoes them (docs/identification.md).
    """
    unknowns = Unknowns.of(common, inertia=use == "bodies", geometry=False)
    return at_start(unknowns) if use == "table" else identify_batch(common, trials, unknowns)


def posteriors(common: Common, others: Sequence[MeasuredTrial]) -> dict[Use, Posterior]:
    """What trials say, by candidate; of another trial's plates nothing, whose movement they are then given
    (`Posterior.wrench` of its states).

    Raises:
        RecordingError: they have too few frames with the plates' wrench.
    """
    return {use: estimate(common, others, use) for use in USES}


def rms_of(common: Common, trial: MeasuredTrial, predicted: Array) -> Array:
    """(r,) RMS of a prediction (T, 6) against the plates, about the trial's reference point: the metric. NaN where the
    plates say nothing."""
    rows = common.rows
    error = wrench_about(trial.wrench, trial.reference)[:, rows] - wrench_about(predicted, trial.reference)[:, rows]
    return rms(error[np.isfinite(error).all(axis=1)], axis=0)


def decide(common: Common, trials: Sequence[MeasuredTrial], progress: Progress | None = None) -> Decision:
    """Cross-validation over the identification trials.

    Raises:
        RecordingError: too few frames with the plates' wrench.
    """
    parts = parts_of(trials)
    halves = ("first half of ", "second half of ") * len(trials) if len(parts) > len(trials) else ("",) * len(trials)
    names: list[str] = []
    low_passed: list[dict[Use, Array]] = []
    full_band: list[dict[Use, Array]] = []
    for k, (left_out, half) in enumerate(zip(parts, halves, strict=True)):
        others = [part for j, part in enumerate(parts) if j != k]
        if np.isfinite(left_out.wrench[:, common.rows]).all(axis=1).any():  # else there is nothing to judge by
            try:
                found = posteriors(common, others)
            except RecordingError as error:
                raise error.reworded(f"{error.message}{_HALVED if half else ''}") from None
            for rows, part in ((low_passed, left_out), (full_band, left_out.full_band())):
                states = part.movement.states
                rows.append({use: rms_of(common, part, one.wrench(common, states)) for use, one in found.items()})
            names.append(half + left_out.movement.recording.name)
        if progress is not None:
            progress(k + 1, len(parts))
    rms, unfiltered = (
        {use: np.array([each[use] for each in rows]) for use in USES} for rows in (low_passed, full_band)
    )
    components = tuple(COMPONENTS[k] for k in common.rows)
    decided = Decision("bodies", tuple(names), rms, unfiltered, components)
    ratios = decided.ratios
    return decided if ratios.mean() <= GAIN and ratios.max() <= WORST else replace(decided, use="table")
