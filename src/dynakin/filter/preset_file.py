"""Noise settings of one's own as a file: what `tune` writes, and what `--preset FILE.toml` reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from dynakin.errors import ConfigError, ModelError, OutputError
from dynakin.filter.noise import Noise
from dynakin.model.validation import nearest, read_toml, validate

_KEYS = ("base", "noise")


def read_preset(path: Path, named: Callable[[str], Noise]) -> Noise:
    """The settings of a file: ``base``, the preset from which it starts ("default" where not given), and the table
    ``noise`` with what is different.

    Args:
        named: gives the built-in preset of a name.

    Raises:
        ConfigError: the file cannot be read, or a key or value is wrong; the message names it.
    """
    content = read_toml(path, ConfigError)
    for key in content:
        if key not in _KEYS:
            raise ConfigError(f"{path}: unknown key {key!r}{nearest(key, _KEYS)}; expected keys: {', '.join(_KEYS)}")
    base, noise = content.get("base", "default"), content.get("noise", {})
    if not isinstance(base, str) or not isinstance(noise, dict):
        raise ConfigError(f'{path}: expected base = "NAME" and a table [noise]')
    for key in noise:
        if key not in Noise.model_fields:
            raise ConfigError(f"{path}: noise: unknown key {key!r}{nearest(key, Noise.model_fields)}")
    try:
        return validate(Noise, named(base).model_dump() | noise, f"{path}: noise")
    except ModelError as error:
        raise ConfigError(error.message) from None
    except ConfigError as error:
        raise ConfigError(f"{path}: base: {error.message}") from None


def write_preset(path: Path, noise: Noise, base: str, remarks: Sequence[str] = ()) -> None:
    """Write settings so that they stay what they are when presets change: every key that has a value.

    Args:
        base: the built-in preset that they come from. remarks: lines that open the file.

    Raises:
        OutputError: the file cannot be written.
    """
    values: dict[str, Any] = {k: v for k, v in noise.model_dump(mode="json").items() if v is not None}
    text = "".join(f"# {line}\n" for line in remarks) + tomli_w.dumps({"base": base, "noise": values})
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror or error})") from None
