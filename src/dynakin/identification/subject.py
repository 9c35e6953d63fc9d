"""From trials of one subject to its identified parameters: estimate, decide, and report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynakin.arrays import Array
from dynakin.blas import one_blas_thread
from dynakin.errors import DynakinError, LostError
from dynakin.filter.estimator import Estimator
from dynakin.identification.batch import Posterior
from dynakin.identification.decision import Decision, decide, estimate
from dynakin.identification.observability.element_words import base_words
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.structure import base_of
from dynakin.identification.report import in_words
from dynakin.identification.trials import Common, MeasuredTrial, measure_all
from dynakin.messages import Message, warning, warnings_of
from dynakin.model.identified import Batch, HeldOut, IdentifiedSubject
from dynakin.progress import Progress
from dynakin.recordings.companions import of_most
from dynakin.recordings.recording import Recording
from dynakin.settings import presets
from dynakin.settings.lag import can_smooth
from dynakin.validation.held_out import IdentifyingTrial

_WORK, _SEEING = 1000, 850  # of a progress bar: nearly all of the time goes into the kinematics


@dataclass(frozen=True, eq=False)
class Identification:
    """Everything about one identification.

    Attributes:
        subject: what is written to the file. common, trials: what it was made of.
        posterior: the batch estimate of the segments' inertia, used or not.
        decision: of cross-validation. lost: sentences on the trials that are left out, the person being lost in them.
        warned: what makes the model as measured, or a trial, doubtful.
    """

    subject: IdentifiedSubject
    common: Common
    trials: tuple[MeasuredTrial, ...]
    posterior: Posterior
    decision: Decision
    lost: tuple[Message, ...] = ()
    warned: tuple[Message, ...] = ()


@one_blas_thread
def identify_subject(
    estimator: Estimator,
    recordings: Sequence[Recording],
    *,
    static: Recording | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Identify a subject on one or several trials with force plates.

    Args:
        estimator: model and noise (`presets.default()` or another that has a smoother), in the plane or in space.
        static: the same person and markers standing; else the first trial.
        progress: called with (work done, in all).

    Raises:
        ModelError, RecordingError: model, markers, plates and trials do not fit. ConfigError: noise without smoother.
        LostError: the filter lost the person in all trials, or in all but one of several.
    """
    report = progress or (lambda done, of: None)
    common, trials, lost = _followed(
        estimator, recordings, static, lambda done, of: report(round(_SEEING * done / of), _WORK)
    )
    decision = decide(common, trials, lambda done, of: report(round(_SEEING + (_WORK - _SEEING) * done / of), _WORK))
    posterior = estimate(common, trials, "bodies")
    batch = _batch(common, posterior)
    said = warned(common, trials)
    subject = IdentifiedSubject(
        model=common.initial.spec.name,
        mass_kg=common.initial.mass_kg,
        use=decision.use,
        trials=tuple(trial.movement.recording.name for trial in trials),
        report=(*map(str, lost), *in_words(decision, posterior, batch)),
        warnings=tuple(map(str, said)),
        held_out=HeldOut(
            parts=decision.folds,
            components=decision.components,
            table=_rows(decision.rms["table"]),
            bodies=_rows(decision.rms["bodies"]),
        ),
        batch=batch,
    )
    return Identification(subject, common, tuple(trials), posterior, decision, tuple(lost), said)


def warned(common: Common, trials: Sequence[MeasuredTrial]) -> tuple[Message, ...]:
    """What runs would warn of: first of the subject, then of trials what was not said before."""
    said = warnings_of(common.initial.messages)
    for trial in trials:
        own = (*trial.movement.doubts, *trial.doubts)
        said += [message.of(trial.movement.recording.name) for message in own if message not in said]
    return tuple(said)


def _followed(
    estimator: Estimator, recordings: Sequence[Recording], static: Recording | None, progress: Progress
) -> tuple[Common, list[MeasuredTrial], list[Message]]:
    """The trials in which the filter followed the person, and a sentence on each of the others."""
    common = Common.measure(estimator, recordings[0], static, of_most(recordings, static))
    lost: dict[int, str] = {}
    trials = measure_all(common, recordings, progress, lost)
    if len(trials) < min(len(recordings), 2):
        left = "one trial is" if trials else "no trial is"
        raise LostError(f"{'; '.join(lost.values())}; {left} left to identify on, nothing is saved")
    said = [warning("lost", f"left out: {reason}.") for reason in lost.values()]
    if 0 in lost and static is None:  # the lengths were measured on it
        kept = [recording for k, recording in enumerate(recordings) if k not in lost]
        common, trials, more = _followed(estimator, kept, static, progress)
        said += more
    return common, trials, said


def _batch(common: Common, posterior: Posterior) -> Batch:
    measured = MeasuredModel.of(common.tracker())
    base = base_of(measured)
    names = posterior.unknowns.inertial.names
    order = [base.over.index(name) for name in names]
    unknowns = posterior.unknowns
    start = np.zeros(len(unknowns.inertial.sd))
    prior = unknowns.inertial.covariance(start, np.diag(unknowns.inertial.sd**2))
    return Batch(
        names=names,
        values=tuple(posterior.phi.tolist()),
        covariance=_rows(posterior.phi_covariance()),
        prior_covariance=_rows(prior),
        base_names=base.names,
        base_words=tuple(base_words(base, measured.initial.spec)),
        K=_rows(base.K[:, order]),
    )


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def with_subject(identifying: IdentifyingTrial) -> tuple[IdentifyingTrial, list[str]]:
    """The same with the subject that `identify_subject` makes of this one trial, whose ``use`` says what is chosen; and
    why, in sentences. Nothing but the identifying trial is looked at. Predictions are judged as the filter gives them,
    so the choice is `Decision.full_band_use`.

    What the filter itself ends with is not asked: by parts of the identifying trial its inertia looked 4 % better than
    the table where it was 9 % worse on the rest, and the other way round (docs/identification.md). The batch estimate,
    held by its prior and weighed by what its residuals last, keeps its word. Where no subject can be identified there
    is none, and the sentences say why.
    """
    try:
        found = identify_subject(_estimator(identifying), [identifying.recording], static=identifying.static)
    except DynakinError as error:
        return identifying, [f"No batch inertia, so nothing is chosen: {error.message}"]
    chosen, said = found.decision.full_band_use, found.decision.in_words()
    if chosen != found.decision.use:
        said.append("Predictions are judged here as the filter gives them, not low-passed, so the table is chosen.")
    return replace(identifying, subject=found.subject.model_copy(update={"use": chosen})), said


def _estimator(identifying: IdentifyingTrial) -> Estimator:
    """Of the first preset that has a smoother; somebody whose mass was not given weighs what the identifying trial's
    own plates say."""
    setup = identifying.setup
    smooth = [preset for preset, noise in setup.noise.items() if can_smooth(noise)]
    estimator = setup.estimator(smooth[0] if smooth else next(iter(setup.noise)))
    noise = estimator.noise if smooth else presets.default()
    return replace(estimator.of_person(identifying.initial), noise=noise)
