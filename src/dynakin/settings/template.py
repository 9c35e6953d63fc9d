"""The commented configuration that `dynakin print-config` prints, made from the definitions of the keys themselves."""

from __future__ import annotations

import ast
import inspect
import textwrap
from typing import Any

import tomli_w
from pydantic import BaseModel

from dynakin.settings import presets
from dynakin.settings.model import Bounds, OpenSimOptions, Priors
from dynakin.settings.noise import Noise
from dynakin.settings.settings import NEEDED, Settings

_HEADER = """\
# Configuration of `dynakin run`. Keys with a # right before them hold their default or, where there is none, an
# example: take the # away to change them. Options on the command line win over this file.
"""
_RECORD = {"ground", "identified", "versions"}  # written into outputs, not for people to set
_TABLES: dict[str, type[BaseModel]] = {"noise": Noise, "priors": Priors, "bounds": Bounds, "opensim": OpenSimOptions}
_WIDTH = 110


def config_template(preset: str = "default") -> str:
    """A configuration file with every key, its meaning and its default.

    Raises:
        ConfigError: the preset is unknown.
    """
    docs = attribute_docs(Settings)
    parts = [_HEADER]
    for key, field in Settings.model_fields.items():
        if key in _RECORD or key in _TABLES:
            continue
        required = key in NEEDED
        value = (field.examples or [None])[0] if required or field.default is None else field.default
        if key == "preset":
            value, required = preset, True
        parts.append("\n" + _comment(docs[key]) + ("" if required else "#") + _line(key, value))
    defaults: dict[str, BaseModel] = {
        "noise": presets.preset(preset),
        "priors": Priors(),
        "bounds": Bounds(),
        "opensim": OpenSimOptions(),
    }
    for table, schema in _TABLES.items():
        table_docs = attribute_docs(schema)
        lines = [f"\n\n{_comment(docs[table])}[{table}]\n"]
        for key, value in defaults[table].model_dump(mode="json").items():
            meaning = "\n" + _comment(table_docs.get(key, ""))
            lines.append(meaning + (f"# {key}: not given\n" if value is None else "#" + _line(key, value)))
        parts.append("".join(lines))
    return "".join(parts)


def attribute_docs(schema: type[BaseModel]) -> dict[str, str]:
    """The docstring below each attribute of a class: the one place where a key's meaning is written."""
    body = ast.parse(textwrap.dedent(inspect.getsource(schema))).body[0]
    assert isinstance(body, ast.ClassDef)
    docs: dict[str, str] = {}
    for node, after in zip(body.body, body.body[1:], strict=False):
        if not (isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)):
            continue
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str):
            docs[node.target.id] = " ".join(after.value.value.split())
    return docs


def _comment(text: str) -> str:
    return "".join(f"# {line}\n" for line in textwrap.wrap(text, _WIDTH))


def _line(key: str, value: Any) -> str:
    if isinstance(value, dict):
        inner = ", ".join(_line(name, item).strip() for name, item in value.items())
        return f"{key} = {{{inner}}}\n"
    if isinstance(value, list | tuple):
        return f"{key} = [{', '.join(repr(item) for item in value)}]\n"
    return tomli_w.dumps({key: value})
