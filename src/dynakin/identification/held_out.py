"""Table or identified inertia for a trial that is judged by markers alone: decided on the identifying trial only.

What the filter itself ends with is not asked: by parts of the identifying trial its inertia looked 4 % better than the
table where it was 9 % worse on the rest, and the other way round (docs/identification.md). The batch estimate, held by
its prior and weighed by what its residuals last, keeps its word.
"""

from __future__ import annotations

from dataclasses import replace

from dynakin.errors import DynakinError
from dynakin.filter.estimator import Estimator
from dynakin.identification.subject import identify_subject
from dynakin.settings import presets
from dynakin.settings.lag import can_smooth
from dynakin.validation.held_out import IdentifyingTrial


def with_subject(identifying: IdentifyingTrial) -> tuple[IdentifyingTrial, list[str]]:
    """The same with the subject that `identify_subject` makes of this one trial, whose ``use`` says what is chosen; and
    why, in sentences. Nothing but the identifying trial is looked at. Predictions are judged as the filter gives them,
    so the choice is `Decision.full_band_use`.

    Where no subject can be identified there is none, and the sentences say why.
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
    setup, measured = identifying.setup, identifying.initial
    smooth = [preset for preset, noise in setup.noise.items() if can_smooth(noise)]
    estimator = setup.estimator(smooth[0] if smooth else next(iter(setup.noise)))
    subject = setup.definition.subject.changed(mass_kg=measured.mass_kg, height_m=measured.height_m)
    noise = estimator.noise if smooth else presets.default()
    return replace(estimator, model=setup.definition.with_subject(subject), noise=noise)
