"""A task and what came of it."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from dynakin.blas import one_blas_thread
from dynakin.errors import DynakinError
from dynakin.progress import silent

Row = dict[str, Any]
"""What a task gives: plain data that JSON carries (numbers, texts, lists, None)."""
Function = Callable[[Any, Any], Row]
"""``function(shared, payload)``; of a module, so that it pickles."""


@dataclass(frozen=True)
class Task:
    """One piece of work. key: its name and its place in the table; payload: what is its own, small and picklable."""

    key: str
    payload: Any


@dataclass(frozen=True)
class Failure:
    """Why a task gave nothing.

    message: one line. unexpected: true where the error is none that dynakin raises on purpose; ``details`` then holds
    the traceback.
    """

    message: str
    unexpected: bool = False
    details: str = ""


@dataclass(frozen=True)
class Outcome:
    """A task's row, or why there is none."""

    key: str
    row: Row | None = None
    failure: Failure | None = None


@one_blas_thread
def attempt(function: Function, shared: Any, task: Task) -> Outcome:
    """Work on one task where it lands; its errors come back as values, so that none stops another task."""
    try:
        with silent():
            return Outcome(task.key, row=function(shared, task.payload))
    except DynakinError as error:
        return Outcome(task.key, failure=Failure(error.message))
    except Exception as error:  # a bug, or a file that no reader foresaw: one task's matter
        message = f"{type(error).__name__}: {' '.join(str(error).split())}"
        return Outcome(task.key, failure=Failure(message, True, traceback.format_exc()))
