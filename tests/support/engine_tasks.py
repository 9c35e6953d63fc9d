"""Functions of a module, as the engine's workers need them."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

from dynakin.errors import RecordingError

Row = dict[str, Any]


def power(shared: dict[str, float], payload: float) -> Row:
    return {"value": shared["base"] ** payload, "third": payload / 3.0}


def slow_power(shared: dict[str, float], payload: float) -> Row:
    time.sleep(0.05)
    return power(shared, payload)


def choosy(shared: None, payload: int) -> Row:
    if payload == 2:
        raise RecordingError("file 2: not a recording")
    if payload == 3:
        raise ZeroDivisionError("nobody foresaw this")
    return {"value": payload}


def dies_once(shared: str, payload: int) -> Row:
    """The first worker that takes task 3 dies with it; ``shared``: a file that remembers."""
    if payload == 3 and not Path(shared).exists():
        Path(shared).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return {"value": payload}


def deadly(shared: None, payload: int) -> Row:
    if payload == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"value": payload}
