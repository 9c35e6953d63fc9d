"""``config.toml`` and ``parameters.json``, and which versions made them."""

from __future__ import annotations

import platform
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any

import tomli_w

from dynakin.files import write_json
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import SCHEMA_VERSION

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


def write_parameters(estimate: Estimate, path: Path) -> None:
    """Every length, marker position and inertial parameter with its standard deviation, start, table and bounds."""
    write_json(
        path,
        {
            "schema_version": SCHEMA_VERSION,
            "model": estimate.model_name,
            "noise": estimate.config.get("noise_used", {}),
            "parameters": [asdict(parameter) for parameter in estimate.parameters],
        },
    )


_PACKAGES = ("dynakin", "numpy", "scipy", "xarray", "ezc3d")


def versions() -> dict[str, str]:
    """Versions of dynakin, Python, the system and the packages that touch the numbers."""
    found = {name: version_of(name) for name in _PACKAGES}
    return found | {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }


def version_of(name: str) -> str:
    """Of an installed package."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:  # run from a source tree that is not installed
        return "not installed"
