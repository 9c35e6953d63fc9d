"""The commented configuration that `dynakin print-config` prints, made from the definitions of the keys themselves."""

from __future__ import annotations

import textwrap
from typing import Any

import tomli_w
from pydantic import BaseModel

from dynakin.settings import presets
from dynakin.settings.model import Bounds, OpenSimOptions, Priors
from dynakin.settings.noise import Noise
from dynakin.settings.settings import NEEDED, RECORDED, Settings

_HEADER = """\
# Configuration of `dynakin run`. Keys with a # right before them hold their default or, where there is none, an
# example: take the # away to change them. Options on the command line win over this file.
"""
_TABLES: dict[str, type[BaseModel]] = {"noise": Noise, "priors": Priors, "bounds": Bounds, "opensim": OpenSimOptions}
_WIDTH = 110


def config_template(preset: str = "default") -> str:
    """A configuration file with every key, its meaning and its default.

    Raises:
        ConfigError: the preset is unknown.
    """
    parts = [_HEADER]
    for key, field in Settings.model_fields.items():
        if key in RECORDED or key in _TABLES:
            continue
        required = key in NEEDED
        value = (field.examples or [None])[0] if required or field.default is None else field.default
        if key == "preset":
            value, required = preset, True
        parts.append("\n" + _comment(field.description) + ("" if required else "#") + _line(key, value))
    defaults: dict[str, BaseModel] = {
        "noise": presets.preset(preset),
        "priors": Priors(),
        "bounds": Bounds(),
        "opensim": OpenSimOptions(),
    }
    for table, schema in _TABLES.items():
        lines = [f"\n\n{_comment(Settings.model_fields[table].description)}[{table}]\n"]
        for key, value in defaults[table].model_dump(mode="json").items():
            meaning = "\n" + _comment(schema.model_fields[key].description)
            lines.append(meaning + (f"# {key}: not given\n" if value is None else "#" + _line(key, value)))
        parts.append("".join(lines))
    return "".join(parts)


def _comment(text: str | None) -> str:
    return "".join(f"# {line}\n" for line in textwrap.wrap(" ".join((text or "").split()), _WIDTH))


def _line(key: str, value: Any) -> str:
    if isinstance(value, dict):
        inner = ", ".join(_line(name, item).strip() for name, item in value.items())
        return f"{key} = {{{inner}}}\n"
    if isinstance(value, list | tuple):
        return f"{key} = [{', '.join(repr(item) for item in value)}]\n"
    return tomli_w.dumps({key: value})
