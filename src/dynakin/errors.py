"""The errors dynakin raises on purpose.

Each carries one clear line: the file, the line or frame, the marker or key, what was found and what was
expected. The command line prints that line and exits with its code; anything else that escapes is a bug of
dynakin.
"""

from __future__ import annotations

import re
from typing import Self

_LONGEST = 1000  # characters that somebody reads; a damaged file can bring a name of a hundred thousand
_UNPRINTABLE = re.compile("[\x00-\x1f\x7f\x85\u2028\u2029\ud800-\udfff]")


class DynakinError(Exception):
    """Root of every error that dynakin raises on purpose; ``str(error)`` is the one line for the user.

    Names out of damaged files can hold anything: what cannot be printed in a line is written as Python writes it, and
    the middle of what is too long is left out.

    Attributes:
        asks_for: key of the setting that the line asks for ("static"), where it is one that another place may have.
    """

    exit_code = 2
    """With which the command line ends."""

    def __init__(self, message: str, *, asks_for: str = "") -> None:
        message = _UNPRINTABLE.sub(lambda found: ascii(found[0])[1:-1], message)
        if len(message) > _LONGEST:
            message = f"{message[: _LONGEST // 2]} ... {message[-_LONGEST // 2 :]}"
        super().__init__(message)
        self.message, self.asks_for = message, asks_for

    def reworded(self, message: str) -> Self:
        """The same error in other words, usually its own and more."""
        return type(self)(message, asks_for=self.asks_for)


class RecordingError(DynakinError):
    """A recording (markers, forces) cannot be read or does not hold what is needed."""


class ModelError(DynakinError):
    """A model, marker set, subject or parameter table is wrong, or does not fit the recording."""


class ConfigError(DynakinError):
    """A configuration file or option is wrong: unknown key, wrong type, value out of its range."""


class OutputError(DynakinError):
    """Results cannot be written (folder missing, not writable, not a folder)."""


class StreamError(DynakinError):
    """A live source cannot be reached, or its connection is lost."""


class DivergenceError(DynakinError):
    """The filter lost its estimate: non-finite state or indefinite covariance; the message names the
    frame."""


class LostError(DynakinError):
    """The filter lost the person in too many frames for the trial to be an estimate; the message names them."""

    exit_code = 1
