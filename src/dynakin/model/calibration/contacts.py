"""Which segment of a model a declared contact acts on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from dynakin.errors import ConfigError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.settings.contacts import SEAT, DeclaredContact
from dynakin.settings.strict import nearest

_SIDES = {"right": "r", "left": "l"}


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
        return next(segment.name for segment in initial.spec.segments if segment.parent == "ground")
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
    for side, letter in _SIDES.items():
        for stem in (name.removesuffix(f"_{side}"), name.removeprefix(f"{side}_"), name.removesuffix(f"_{letter}")):
            if stem != name:
                found += [f"{stem}_{side}", f"{stem}_{letter}", f"{side}_{stem}", f"{letter}_{stem}"]
    return found
