"""The command line, `dynakin`: each command a thin call of the API."""

from __future__ import annotations

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """`dynakin.cli.app.main`, which is imported here: who stops a command while it loads is told no more than that."""
    try:
        from dynakin.cli.app import main as run

        return run(arguments)
    except KeyboardInterrupt:
        print("error: stopped", file=sys.stderr)
        return 130  # as shells have it


__all__ = ["main"]
