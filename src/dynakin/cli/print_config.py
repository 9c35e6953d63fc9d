"""`dynakin print-config`: a commented configuration with every default."""

from __future__ import annotations

import typer

from dynakin.cli.options import Preset
from dynakin.settings.template import config_template


def print_config(preset: Preset = None) -> None:
    """Print a commented configuration file for `run`."""
    typer.echo(config_template(preset or "default"), nl=False)
