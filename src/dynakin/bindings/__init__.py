"""The compiled core, and whether this processor can run it."""

from dynakin.bindings import _cpu

if not _cpu.supported():
    raise ImportError(
        f"dynakin's core was compiled for {_cpu.level}, which this processor lacks; "
        "build it with: pip install --config-settings=cmake.define.DYNAKIN_VECTOR=baseline ."
    )
