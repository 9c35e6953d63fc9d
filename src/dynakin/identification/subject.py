"""From trials of one subject to its identified parameters: estimate, decide, and say what was learned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.filter import Estimator
from dynakin.identifiability.base import base_of
from dynakin.identifiability.element_words import base_words
from dynakin.identifiability.measured import MeasuredModel
from dynakin.identification.batch import Posterior
from dynakin.identification.decision import Decision, decide, estimate
from dynakin.identification.report import in_words
from dynakin.identification.trials import Common, MeasuredTrial, measure_all
from dynakin.model.identified import Batch, IdentifiedSubject
from dynakin.recordings import Recording

Array = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Identified:
    """Everything about one identification.

    Attributes:
        subject: what is written to the file. common, trials: what it was made of.
        posterior: the batch estimate of the bodies, used or not.
        decision: of cross-validation.
    """

    subject: IdentifiedSubject
    common: Common
    trials: tuple[MeasuredTrial, ...]
    posterior: Posterior
    decision: Decision


def identify_subject(
    estimator: Estimator,
    recordings: Sequence[Recording],
    *,
    static: Recording | None = None,
    progress: Progress | None = None,
) -> Identified:
    """Identify a subject on one or several trials with force plates.

    Args:
        estimator: model and noise (`presets.default()` or another that has a smoother); planar models.
        static: the same person and markers standing; else the first trial.
        progress: called with (trials and folds done, in all).

    Raises:
        ModelError, RecordingError: model, markers, plates and trials do not fit. ConfigError: noise without smoother.
    """
    folds = len(recordings) if len(recordings) > 2 else 2 * len(recordings)
    total = len(recordings) + folds
    report = progress or (lambda done, of: None)
    common = Common.measure(estimator, recordings[0], static)
    trials = measure_all(common, recordings, lambda done, _: report(done, total))
    decision = decide(common, trials, lambda done, _: report(len(recordings) + done, total))
    bodies = estimate(common, trials, "bodies")
    batch = _batch(estimator, bodies)
    subject = IdentifiedSubject(
        model=common.initial.spec.name,
        mass_kg=common.initial.mass_kg,
        use=decision.use,
        trials=tuple(recording.name for recording in recordings),
        report=tuple(in_words(decision, bodies, batch)),
        batch=batch,
    )
    return Identified(subject, common, tuple(trials), bodies, decision)


def _batch(estimator: Estimator, bodies: Posterior) -> Batch:
    measured = MeasuredModel.of(estimator)
    base = base_of(measured)
    names = bodies.unknowns.bodies.names
    order = [base.over.index(name) for name in names]
    J = bodies.unknowns.bodies.jacobian(np.zeros(len(names))) * bodies.unknowns.bodies.sd
    return Batch(
        names=names,
        values=tuple(bodies.phi.tolist()),
        covariance=_rows(bodies.phi_covariance()),
        prior_covariance=_rows(J @ J.T),
        base_names=base.names,
        base_words=tuple(base_words(base, measured.initial.spec)),
        K=_rows(base.K[:, order]),
    )


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())
