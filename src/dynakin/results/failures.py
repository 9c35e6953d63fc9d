"""Late stages that failed: what was computed before them is kept, and the failure has a name."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from dynakin.errors import DynakinError
from dynakin.messages import Message

LOG = "failures.log"


@dataclass(frozen=True)
class Failure:
    """A stage by its name, one line of why, and the traceback."""

    stage: str
    reason: str
    details: str

    @property
    def message(self) -> Message:
        """One sentence for messages, console and page."""
        return Message("results", "failure", f"{self.stage}: {self.reason.rstrip('.')}.")


class Failures:
    """Collects what failed once the estimate was there; each stage runs in ``with failures.stage(name):``."""

    def __init__(self) -> None:
        self.found: list[Failure] = []

    @contextmanager
    def stage(self, name: str, *, writes: bool = False) -> Iterator[None]:
        """Turn any exception within into a `Failure`.

        Args:
            writes: the stage writes one of several files, and a disk that does not take it takes none of them.

        Raises:
            OSError: only with ``writes``.
        """
        try:
            yield
        except Exception as error:
            if writes and isinstance(error, OSError):
                raise
            lines = str(error).strip().splitlines()
            kind = "" if isinstance(error, DynakinError) else type(error).__name__
            reason = ": ".join(filter(None, [kind, lines[0] if lines else ""]))
            if (name, reason) not in [(failure.stage, failure.reason) for failure in self.found]:  # tried again
                self.found.append(Failure(name, reason, traceback.format_exc()))

    def messages(self) -> list[Message]:
        """One sentence a failure."""
        return [failure.message for failure in self.found]

    def log(self) -> str:
        """Content of `LOG`: each failure with its traceback."""
        return "\n".join(f"{failure.message}\n{failure.details}" for failure in self.found)
