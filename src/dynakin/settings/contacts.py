"""Contacts that are declared: what else than the ground bears or pulls the person."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, model_validator

from dynakin.errors import ConfigError
from dynakin.settings.strict import Name, Strict, validate

SEAT = "seat"
"""The contact that is known to push upwards, from below the pelvis."""
TAKEN = ("right", "left", "residual", "r", "l")
"""Names that the feet and the filter's residual have, and those of the feet in columns of files."""


class DeclaredContact(Strict):
    """A seat, a rail, a cable, a stick, a helper's hand: by its name alone where that says which segment it acts on
    ("seat", "hand_right", "hand_left", or a segment of the model)."""

    name: Name
    """Its own name: seat, or any other."""
    segment: str | None = None
    """The segment of the model that it acts on. Not given: the one that the name says."""

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, data: Any) -> Any:
        return {"name": data} if isinstance(data, str) else data

    @model_validator(mode="after")
    def _not_taken(self) -> DeclaredContact:
        if self.name in TAKEN:
            raise ValueError(f"found {self.name!r}, expected another name than {', '.join(TAKEN)}")
        return self


class _Contacts(BaseModel):
    contacts: tuple[DeclaredContact, ...]


def declared(contacts: Iterable[Any]) -> tuple[DeclaredContact, ...]:
    """Contacts as they are given: names, mappings with ``name`` and ``segment``, or what this returns.

    Raises:
        ConfigError: none of these, or a name twice.
    """
    found = validate(_Contacts, {"contacts": tuple(contacts)}, "contacts", ConfigError).contacts
    check_names(found)
    return found


def check_names(contacts: Iterable[DeclaredContact]) -> None:
    """
    Raises:
        ConfigError: a name twice.
    """
    names = [contact.name for contact in contacts]
    if twice := [name for name in names if names.count(name) > 1]:
        raise ConfigError(f"contacts: {twice[0]!r} is declared twice, expected each name once")
