"""The marker sets that come with the program, and those of a user's own."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from dynakin.errors import ModelError
from dynakin.files import is_file
from dynakin.model.markers.anatomy import expanded
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.settings.strict import nearest, read_toml, validate

_FOLDER = resources.files("dynakin.model") / "markers" / "sets"


def available_marker_sets() -> list[str]:
    """Names of the built-in marker sets."""
    return sorted(entry.name.removesuffix(".toml") for entry in _FOLDER.iterdir() if entry.name.endswith(".toml"))


def load_marker_set(name_or_path: str | Path) -> MarkerSetFile:
    """A built-in marker set by name, or a TOML file of a user's own.

    Raises:
        ModelError: unknown name (the nearest is suggested), or a wrong file (file and key are named).
    """
    name = str(name_or_path)
    known = available_marker_sets()
    path = Path(str(_FOLDER / f"{name}.toml")) if name in known else Path(name)
    if name not in known and (path.suffix != ".toml" or not is_file(path)):
        raise ModelError(
            f"marker set {name!r}: unknown{nearest(name, known)}; expected one that `dynakin markers list` names, or a "
            ".toml file that exists"
        )
    return _built_in(path) if name in known else _read(path)


def contents_of(name: str) -> dict[str, Any]:
    """What the file of a built-in set says, before places are written out."""
    return read_toml(Path(str(_FOLDER / f"{name}.toml")))


def set_of(contents: Mapping[str, Any]) -> MarkerSetFile:
    """The marker set that a file of these contents would give."""
    return validate(MarkerSetFile, expanded(contents), str(contents["name"]))


@cache
def _built_in(path: Path) -> MarkerSetFile:
    return _read(path)


def _read(path: Path) -> MarkerSetFile:
    data = read_toml(path)
    try:
        whole = expanded(data)
    except (TypeError, AttributeError, KeyError):
        raise ModelError(f"{path}: places and clusters: expected tables of names") from None
    except ValueError as error:
        raise ModelError(f"{path}: {error}") from None
    return validate(MarkerSetFile, whole, str(path))
