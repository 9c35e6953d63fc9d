"""A live session's settings, as the command line gives and a recording keeps them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dynakin.config import make_config
from dynakin.filter.estimator import Estimator


def estimator_of(settings: dict[str, Any], lag: int = 0) -> Estimator:
    """An estimator from the keys of a configuration (`dynakin.config`) that don't name files.

    Raises:
        DynakinError: a key or value that is wrong.
    """
    config = make_config(settings | {"trial": Path("live"), "output": Path("live")}, "live")
    return config.estimator(lag)
