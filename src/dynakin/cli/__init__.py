"""The command line, `dynakin`: each command a thin call of the API."""

from __future__ import annotations

import sys
from collections.abc import Sequence

STOPPED = 130
"""The exit code of a command that was stopped, as shells have it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """`dynakin.cli.app.main`, which is imported here: who stops a command while it loads is told no more than that."""
    try:
        from dynakin.cli.app import main as run

        return run(arguments)
    except KeyboardInterrupt:
        print("error: stopped", file=sys.stderr)
        return STOPPED


__all__ = ["main"]
