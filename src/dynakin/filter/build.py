"""From settings to what they ask for: a model that is not measured yet, an estimator."""

from __future__ import annotations

from dynakin.filter.estimator import Estimator
from dynakin.model.definition import ModelDefinition, load_model
from dynakin.model.identified import read_identified
from dynakin.model.opensim.definition import OpenSimDefinition
from dynakin.settings.effect import check_noise
from dynakin.settings.settings import Settings


def definition_of(settings: Settings) -> ModelDefinition | OpenSimDefinition:
    """The model, not measured yet.

    Raises:
        ModelError: as `load_model`.
    """
    return load_model(
        settings.model,
        settings.subject(),
        settings.markers,
        settings.table,
        settings.opensim,
        settings.functional,
    )


def estimator_of(settings: Settings) -> Estimator:
    """An estimator of the model with these settings.

    Raises:
        ModelError, ConfigError: the model or a setting is wrong, or has no effect on this model.
    """
    definition = definition_of(settings)
    check_noise(settings, definition.floating)
    return Estimator(
        definition,
        settings.noise_settings(),
        priors=settings.priors,
        bounds=settings.bounds,
        side=settings.side,
        vertical=settings.vertical,
        forward=settings.forward,
        estimate=settings.estimate,
        plates=settings.plates,
        contacts=settings.contacts,
        loads=settings.loads,
        parameters=None if settings.parameters is None else read_identified(settings.parameters),
    )
