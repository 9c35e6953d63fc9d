"""Options that several commands have in common: those that are keys of the settings are made from their definitions."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_args

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from dynakin.settings.lag import ALL_FRAMES
from dynakin.settings.settings import Settings, option_names
from dynakin.settings.template import config_template

Given = dict[str, Any]
"""What was given on the command line, by the key of the settings."""
Command = Callable[..., None]

Trials = Annotated[
    list[Path] | None, typer.Argument(metavar="TRIAL...", help="Recordings, or a configuration (.toml) for each.")
]
ForceEach = Annotated[list[Path] | None, typer.Option("--forces", help="Ground forces, one a trial, in order.")]
Backend = Annotated[str, typer.Option(help="Who works: processes or threads of this machine, or dask.")]
Jobs = Annotated[int | None, typer.Option(help="Workers at a time on this machine; else one a core.")]
Scheduler = Annotated[str | None, typer.Option(help="Address of the Dask cluster's scheduler, tcp://HOST:PORT.")]

OF_A_MODEL = ("model", "markers", "opensim.marker_places", "static", "functional", "mass_kg", "height_m", "sex")
"""With a dot: a key of a table."""
OF_THE_LABORATORY = ("side", "vertical", "forward")
OF_THE_PLATES = ("contacts", "table", "plate_filter_hz", "force_threshold_n")


def with_settings(*keys: str, **meanings: str) -> Callable[[Command], Command]:
    """A command with the options of these keys of the settings in the place of its parameter ``given``, which takes
    the values of those that were given (`Given`).

    Args:
        meanings: help text of a key, where the command's differs from the setting's own.
    """

    def decorated(command: Command) -> Command:
        @wraps(command)
        def called(**arguments: Any) -> None:
            values = {key: arguments.pop(_argument(key)) for key in keys}
            if "lag_s" in keys:
                values["lag_s"] = _lag(values["lag_s"], arguments.pop("smooth"))
            given: Given = {}
            for key, value in values.items():
                table, _, name = key.rpartition(".")
                if value is not None:
                    (given.setdefault(table, {}) if table else given)[name] = _READ.get(key, _same)(value)
            command(given=given, **arguments)

        parameters = []
        for parameter in inspect.signature(command, eval_str=True).parameters.values():
            own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY)]
            if parameter.name != "given":
                parameters += own
                continue
            for key in keys:
                parameters += [_option(key, meanings)] + ([_SMOOTH] if key == "lag_s" else [])
        called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return called

    return decorated


def _argument(key: str) -> str:
    return key.replace(".", "_")


def _field(key: str) -> FieldInfo:
    table, _, name = key.rpartition(".")
    owner = Settings.model_fields[table].annotation if table else Settings
    assert isinstance(owner, type) and issubclass(owner, BaseModel)
    return owner.model_fields[name]


def _option(key: str, meanings: dict[str, str]) -> inspect.Parameter:
    field = _field(key)
    kinds = {field.annotation, *get_args(field.annotation)} - {type(None)}
    kind = next((kind for kind in (Path, bool) if kind in kinds), float if float in kinds and str not in kinds else str)
    assert field.description is not None
    text = meanings.get(key) or " ".join(field.description.split("\n\n")[0].split())
    option = typer.Option(None, *option_names(key), help=text)
    return inspect.Parameter(_argument(key), inspect.Parameter.KEYWORD_ONLY, default=option, annotation=kind | None)


_SMOOTH = inspect.Parameter(
    "smooth",
    inspect.Parameter.KEYWORD_ONLY,
    default=typer.Option(None, "--smooth/--live-like", help="Estimate from all frames (--lag inf), or as --lag 0."),
    annotation=bool | None,
)


def _lag(lag_s: float | None, smooth: bool | None) -> float | None:
    if smooth is None:
        return lag_s
    if lag_s is not None:
        raise typer.BadParameter(f"--lag and {'--smooth' if smooth else '--live-like'}: expected one of them")
    return ALL_FRAMES if smooth else 0.0


def _forward(text: str) -> str | tuple[float, ...]:
    """`--forward 0,1,0` as numbers; a word stays a word and is checked with the settings."""
    if "," not in text:
        return text
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(
            f"--forward is {text!r}, expected auto, an axis (+X) or three numbers (0,1,0)"
        ) from None


def _estimate(text: str) -> list[str]:
    """`--estimate lengths,markers` as a list; "none" is an empty one. The words are checked with the settings."""
    return [] if text.strip() == "none" else [part.strip() for part in text.split(",") if part.strip()]


def _contacts(text: str) -> list[Any]:
    """`--contact seat,rail=hand_r` as a list, or as a configuration has it (`{name = "rail", segment = "hand_r"}`);
    what is wrong with it is said with the settings."""
    if "{" in text:
        try:
            return list(tomllib.loads(f"contacts = [{text}]")["contacts"])
        except tomllib.TOMLDecodeError:
            raise typer.BadParameter(f"--contact is {text!r}, expected names with commas: seat,rail=hand_r") from None
    parts = [part.strip().partition("=") for part in text.split(",") if part.strip()]
    return [{"name": name, "segment": segment} if equals else name for name, equals, segment in parts]


def _functional(text: str) -> dict[str, str]:
    """`--functional hip_r=hip.c3d,knee_r=knee.c3d` as a table; the joints are checked with the settings."""
    parts = [part.strip().partition("=") for part in text.split(",") if part.strip()]
    wrong = next((joint for joint, _, file in parts if not file), None)
    if wrong is not None or not parts:
        raise typer.BadParameter(f"--functional is {text!r}, expected JOINT=FILE with commas (hip_r=right_hip.c3d)")
    return {joint.strip(): file.strip() for joint, _, file in parts}


def _same(value: Any) -> Any:
    return value


_READ: dict[str, Callable[[Any], Any]] = {
    "forward": _forward,
    "estimate": _estimate,
    "contacts": _contacts,
    "functional": _functional,
}


@with_settings("preset")
def print_config(given: Given) -> None:
    """Print a commented configuration file for `run`."""
    typer.echo(config_template(given.get("preset", "default")), nl=False)
