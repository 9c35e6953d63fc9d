"""What is declared of a person in addition to what is measured: things carried, rigid and of known mass (a barbell),
and the segments on which other contacts than the feet act (a seat, a rail)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynakin.bindings import _core
from dynakin.errors import ConfigError, ModelError
from dynakin.messages import note
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.mirroring import SUFFIXES
from dynakin.settings.contacts import SEAT, DeclaredContact
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
    return replace(
        initial,
        spec=spec,
        carried_kg=initial.carried_kg + carried,
        messages=(*initial.messages, note("calibration", message)),
    )


def with_contacts(initial: CalibratedModel, contacts: Sequence[DeclaredContact]) -> CalibratedModel:
    """The same model with declared contacts on its segments.

    Raises:
        ConfigError: a segment that the model does not have, or a model that stands on its root.
    """
    if not contacts:
        return initial
    if not initial.feet:
        raise ConfigError(
            f"contacts: {contacts[0].name!r} cannot act on {initial.spec.name}, which takes all plates together; "
            "expected a model with feet of its own (fullbody, an .osim file)"
        )
    return replace(initial, contacts={contact.name: _segment(initial, contact) for contact in contacts})


def _segment(initial: CalibratedModel, contact: DeclaredContact) -> str:
    names = [segment.name for segment in initial.spec.segments]
    if contact.segment is not None:
        if contact.segment not in names:
            raise ConfigError(
                f"contacts: segment {contact.segment!r} of {contact.name!r} is not in the model"
                f"{nearest(contact.segment, names)}, expected one of {', '.join(names)}"
            )
        return contact.segment
    if contact.name == SEAT:
        return initial.tree.roots[0]
    for name in _spellings(contact.name):
        if name in names:
            return name
    raise ConfigError(
        f"contacts: {contact.name!r} does not say which segment it acts on{nearest(contact.name, names)}, expected "
        f'{{name = "{contact.name}", segment = "..."}} with one of {", ".join(names)}'
    )


def _spellings(name: str) -> list[str]:
    """hand_right as models call it: hand_r, right_hand."""
    found = [name]
    for side, suffix in SUFFIXES.items():
        for stem in (name.removesuffix(f"_{side}"), name.removeprefix(f"{side}_"), name.removesuffix(suffix)):
            if stem != name:
                found += [f"{stem}_{side}", f"{stem}{suffix}", f"{side}_{stem}", f"{suffix[1:]}_{stem}"]
    return found
