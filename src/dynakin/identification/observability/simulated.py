"""A model without a recording: measured on somebody simulated. Whoever has a recording need not load the simulator."""

from __future__ import annotations

from dynakin.errors import DynakinError, ModelError
from dynakin.filter.estimator import Estimator
from dynakin.filter.tracker import Tracker
from dynakin.model.definition import Definition
from dynakin.model.spec import free_coordinates
from dynakin.simulation.bodies.registry import BODIES
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate

MASS_KG, HEIGHT_M = 70.0, 1.75


def tracker_of(definition: Definition) -> Tracker:
    """A tracker of the model, calibrated on a simulated recording of somebody of that mass, height and sex.

    Which lengths and places the markers have does not matter to ranks and gauges; the simulated persons carry the
    built-in marker sets.

    Raises:
        ModelError: none of the simulated recordings has the markers that the model needs.
    """
    who, why = definition.subject, ""
    started: list[Tracker] = []
    for body in sorted(BODIES, key=lambda name: name != definition.name):
        trial = simulate(
            body,
            duration_s=5.0,
            mass_kg=who.mass_kg or MASS_KG,
            height_m=who.height_m or HEIGHT_M,
            sex=who.sex,
            noise=SensorNoise.none(),
            spread=Spread.none(),
        )
        try:
            started.append(Estimator(definition).start(trial.recording))
        except DynakinError as error:
            why = why or error.message
    if not started:
        raise ModelError(
            f"model {definition.name}: cannot be measured on a simulated person ({why}); expected --trial FILE"
        )
    return max(started, key=_free)  # a joint without markers beyond it is locked; of equals the first


def _free(tracker: Tracker) -> int:
    return len(free_coordinates(tracker.calibrated.spec))
