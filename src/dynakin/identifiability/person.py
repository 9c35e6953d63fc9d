"""A person for whom a model can be looked at when there is no recording: one who is simulated, as the table has it."""

from __future__ import annotations

from dynakin.errors import DynakinError, ModelError
from dynakin.filter import Estimator
from dynakin.model import ModelDefinition
from dynakin.simulation import BODIES, SensorNoise, Spread, simulate

MASS_KG, HEIGHT_M = 70.0, 1.75


def estimator_of(definition: ModelDefinition) -> Estimator:
    """An estimator of the model, started on a simulated recording of somebody of that mass, height and sex.

    Which lengths and places the markers have does not matter to ranks and gauges; the simulated bodies carry the
    built-in marker sets.

    Raises:
        ModelError: none of the simulated recordings has the markers that the model needs.
    """
    who, why = definition.subject, ""
    for body in BODIES:
        trial = simulate(
            body,
            duration_s=5.0,
            mass_kg=who.mass_kg or MASS_KG,
            height_m=who.height_m or HEIGHT_M,
            sex=who.sex,
            noise=SensorNoise.none(),
            spread=Spread().times(0.0),
        )
        estimator = Estimator(definition)
        try:
            estimator.start(trial.recording)
        except DynakinError as error:
            why = why or error.message
            if body != definition.name:
                continue
            why = error.message
        else:
            return estimator
    raise ModelError(
        f"model {definition.name}: cannot be measured on a simulated person ({why}); expected --trial FILE"
    )
