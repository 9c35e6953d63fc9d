"""``config.toml``: the configuration as used, which `dynakin run config.toml` takes again, and what made the result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tomli_w

from dynakin.results.files.versions import versions

_HEADER = """\
# The configuration of this run as used. `dynakin run` on this file repeats it.
"""


def write_config(config: dict[str, Any], path: Path) -> None:
    """Write a plain dictionary; None has no TOML form and means "not given", so such keys are left out."""
    content = plain(config) | {"versions": versions()}
    path.write_text(_HEADER + tomli_w.dumps(content), encoding="utf-8", newline="\n")


def plain(value: Any) -> Any:
    """The same as plain data that TOML can hold; None means "not given" there, so such keys are left out."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, bool | int | float | str):
        return value
    if hasattr(value, "item"):  # a numpy scalar
        return value.item()
    return str(value)
