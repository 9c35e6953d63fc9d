"""Which versions made a result: written into ``config.toml`` and ``estimate.nc``."""

from __future__ import annotations

import platform
from importlib import metadata

_PACKAGES = ("dynakin", "numpy", "scipy", "xarray", "ezc3d")


def versions() -> dict[str, str]:
    """Versions of dynakin, Python, the system and the packages that touch the numbers."""
    found = {name: _version(name) for name in _PACKAGES}
    return found | {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:  # run from a source tree that is not installed
        return "not installed"
