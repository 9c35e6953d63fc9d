"""The command line, `dynakin`: each command a thin call of the API."""

from dynakin.cli.app import app, main

__all__ = ["app", "main"]
