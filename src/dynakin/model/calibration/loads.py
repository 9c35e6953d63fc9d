"""Known things that a person carries: rigid, of known mass, fixed to a segment (a barbell, a rucksack)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.settings.strict import nearest
from dynakin.settings.subject import CarriedLoad


def with_loads(initial: CalibratedModel, loads: Sequence[CarriedLoad]) -> CalibratedModel:
    """The same model with these loads welded to it, each a segment without joint and with fixed inertia.

    Nothing of the state changes: the person's own numbers, their bounds and priors stay the person's.

    Raises:
        ModelError: a segment that the model does not have, or a name that is taken.
    """
    if not loads:
        return initial
    spec = _core.Model(initial.spec).spec  # a copy
    segments = list(spec.segments)
    own = [segment.name for segment in segments]
    for load in loads:
        if load.segment not in own:
            raise ModelError(
                f"load {load.name!r}: segment {load.segment!r} is not in {spec.name}{nearest(load.segment, own)}, "
                f"expected one of {', '.join(own)}"
            )
        if load.name in (segment.name for segment in segments):
            raise ModelError(f"load {load.name!r}: the name is taken, expected another one than those of the segments")
        segments.append(
            _core.SegmentSpec(
                name=load.name,
                parent=load.segment,
                rotation=np.eye(3),
                translation=np.array(load.place_m),
                lengths=[],
                axes=[],
                inertia=np.array([load.mass_kg, 0.0, 0.0, 0.0, *load.inertia_kg_m2, 0.0, 0.0, 0.0]),
                inertia_estimated=[False] * 10,
            )
        )
    spec.segments = segments
    carried = sum(load.mass_kg for load in loads)
    said = ", ".join(f"{load.name} {load.mass_kg:g} kg on the {load.segment}" for load in loads)
    message = f"Known loads: {said}. They count as the person's weight on the plates and move with their segments."
    return replace(initial, spec=spec, carried_kg=initial.carried_kg + carried, messages=(*initial.messages, message))
