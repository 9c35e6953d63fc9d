"""`dynakin print-config`: a commented configuration with every default."""

from __future__ import annotations

import typer

from dynakin.cli.options import Given, with_settings
from dynakin.settings.template import config_template


@with_settings("preset")
def print_config(given: Given) -> None:
    """Print a commented configuration file for `run`."""
    typer.echo(config_template(given.get("preset", "default")), nl=False)
