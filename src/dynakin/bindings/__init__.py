"""The compiled core `_core`, for the widest vectors that this processor has: v4 (AVX-512), v3 (AVX2) or baseline.

DYNAKIN_VECTOR in the environment takes another of them (`level` says which it is).
"""

import os
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from dynakin.bindings import _cpu
from dynakin.errors import ConfigError

_LEVELS = ("v4", "v3", "baseline")


def _chosen(asked: str | None) -> str:
    """The level asked for, or the widest that was built and that the processor has.

    Raises:
        ConfigError: the level asked for is unknown, was not built, or is more than this processor has.
        ImportError: the processor has none of the levels that were built.
    """
    built = _cpu.built()
    runs = [level for level in built if _cpu.has(level)]
    if not asked:
        if not runs:
            raise ImportError(
                f"dynakin's core was compiled for {_listed(built)}, which this processor lacks; "
                "build it with: pip install --config-settings=cmake.define.DYNAKIN_LEVELS=baseline ."
            )
        return runs[0]
    asked = asked.removeprefix("x86-64-")
    if asked not in _LEVELS:
        raise ConfigError(f"DYNAKIN_VECTOR is {asked!r}, expected {_listed(_LEVELS)}, or nothing for the widest")
    if not _cpu.has(asked):
        raise ConfigError(f"DYNAKIN_VECTOR is {asked!r}, which this processor lacks, expected {_listed(runs)}")
    if asked not in built:
        raise ConfigError(
            f"DYNAKIN_VECTOR is {asked!r}, for which this dynakin was not built (it was for {_listed(built)}); "
            f"build it with: pip install --config-settings=cmake.define.DYNAKIN_LEVELS={asked} ."
        )
    return asked


def _listed(levels: list[str] | tuple[str, ...]) -> str:
    return " or ".join(filter(None, (", ".join(levels[:-1]), levels[-1]))) if levels else "none"


def _load(level: str) -> None:
    """Make the file `_core_<level>`, next to that of `_cpu`, the module `_core`."""
    name, file = f"{__name__}._core", Path(_cpu.__file__)
    spec = spec_from_file_location(name, file.with_name(file.name.replace("_cpu", f"_core_{level}", 1)))
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = globals()["_core"] = module
    spec.loader.exec_module(module)


level = _chosen(os.environ.get("DYNAKIN_VECTOR"))
"""The level of the core that is loaded."""
_load(level)
