"""Sources and sinks by name: those of dynakin and those that other packages add as entry points."""

from __future__ import annotations

from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

from dynakin.errors import ConfigError
from dynakin.recordings.read import READERS
from dynakin.settings.strict import nearest

SOURCES, SINKS = "dynakin.sources", "dynakin.sinks"
"""Groups of entry points. Each names a function (address, options) -> Source or Sink."""


def plugin(group: str, text: str, **more: str) -> Any:
    """What `KIND:ADDRESS[,key=value][,word]` names; a word alone means "yes".

    Args:
        group: SOURCES or SINKS.
        more: further options.

    Raises:
        ConfigError: an unknown kind; those that there are are listed. What the plug-in itself raises.
    """
    kind, _, rest = text.partition(":")
    address, *parts = rest.split(",")
    options = {key.strip(): value.strip() or "yes" for key, _, value in (part.partition("=") for part in parts)}
    entries = {entry.name: entry for entry in metadata.entry_points(group=group)}
    if kind not in entries and group == SOURCES and text == kind and Path(text).suffix.casefold() in READERS:
        raise ConfigError(f"{text!r} is a file, expected replay:{text}")
    if kind not in entries:
        known = sorted(entries)
        raise ConfigError(
            f"{text!r}: {kind!r} is unknown{nearest(kind, known)}; expected one of "
            f"{', '.join(f'{k}:...' for k in known)}"
        )
    try:
        make: Callable[[str, dict[str, str]], Any] = entries[kind].load()
    except ImportError as error:
        raise ConfigError(
            f"{kind}: needs a package that is not here ({error}); pip install 'dynakin[live]', or make live"
        ) from None
    return make(address, options | more)
