"""The command line: which commands there are, and how errors leave."""

from __future__ import annotations

import atexit
import gc
import os
import re
import sys
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any

import typer

import dynakin
from dynakin.cli import STOPPED
from dynakin.cli.batch import batch
from dynakin.cli.check import check
from dynakin.cli.compare import compare
from dynakin.cli.console import lost_output, print_error
from dynakin.cli.demo import demo
from dynakin.cli.identify import identify
from dynakin.cli.live import live
from dynakin.cli.markers import markers
from dynakin.cli.model import model
from dynakin.cli.options import print_config
from dynakin.cli.run import run
from dynakin.cli.simulate import simulate
from dynakin.cli.tune import tune
from dynakin.errors import DynakinError

# Typer carries its own copy of click or uses click's, depending on its version; its own name leads to either.
_USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]

app = typer.Typer(
    name="dynakin",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for command in (run, live, demo, compare, batch, identify, simulate, check, model):
    app.command()(command)
app.command("print-config")(print_config)
app.add_typer(tune, name="tune")
app.add_typer(markers, name="markers")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"dynakin {dynakin.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """How a person moves and what drives the movement, from markers and force plates."""


_DECIMAL_COMMA = re.compile(r"-?\d+,\d+")
_MORE_BEFORE_GARBAGE = 100_000
"""New objects before Python collects reference cycles. By its own 700 it looks 500 times while libraries are loaded
and results written, for a sixteenth of a short run."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and give its exit code: 0, 1 where what came out may not be used, or 2 with one line on stderr for
    anything wrong with the input.

    DYNAKIN_DEBUG=1 in the environment lets the traceback through.
    """
    gc.set_threshold(_MORE_BEFORE_GARBAGE)
    atexit.register(gc.freeze)  # else Python looks for reference cycles once more as it ends, for 0.3 s
    words = list(sys.argv[1:] if arguments is None else arguments)
    command: Any = typer.main.get_command(app)  # which takes 30 ms
    if wrong := _without_value(words, command):
        print_error(wrong)
        return 2
    try:
        code = command(args=words, standalone_mode=False)
    except DynakinError as error:
        if os.environ.get("DYNAKIN_DEBUG") == "1":
            raise
        print_error(error.message)
        return error.exit_code
    except _USAGE_ERROR as error:
        if type(error).__name__ == "NoArgsIsHelpError":  # its message is the help text
            typer.echo(str(getattr(error, "message", error)))
            return 2
        text = str(getattr(error, "format_message", error.__str__)()).rstrip(".")
        command = getattr(getattr(error, "ctx", None), "command_path", "dynakin")
        print_error(_with_a_comma(words, text) or f"{text}. See {command} --help.")
        return 2
    except (KeyboardInterrupt, typer.Abort):
        code = STOPPED
    if code == STOPPED:  # which typer may have made of a KeyboardInterrupt itself
        print_error("stopped")
    return (code if isinstance(code, int) else 0) or int(lost_output())


def _without_value(words: Sequence[str], command: Any) -> str | None:
    """What is wrong where an option that needs a value is followed by another option, which click takes for it."""
    for word in words:
        inner = getattr(command, "commands", {}).get(word)
        if inner is None:
            break
        command = inner
    options = [parameter for parameter in command.params if parameter.param_type_name == "option"]
    names = {name for option in options for name in (*option.opts, *option.secondary_opts)}
    valued = {name for option in options if not (option.is_flag or option.count) for name in option.opts}
    for option, value in pairwise(words):
        if option in valued and value in names:
            return f"Option {option} has no value: after it stands {value}, an option itself. See dynakin --help."
    return None


def _with_a_comma(words: Sequence[str], said: str) -> str | None:
    """What is wrong where the option that a refusal names has a number with a decimal comma."""
    for option, value in [*pairwise(words), *(tuple(word.split("=", 1)) for word in words if "=" in word)]:
        if f"'{option}'" in said and _DECIMAL_COMMA.fullmatch(value):
            return f"{option} is {value}, expected a number with a decimal point: {value.replace(',', '.')}"
    return None
