"""Reads TOML files into strict pydantic models; every error names the file and the key, what was found, what
was expected."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, TypeVar, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError, model_validator
from pydantic.fields import FieldInfo

from dynakin.errors import ConfigError, DynakinError, ModelError
from dynakin.files import LARGEST_TEXT, read_bytes

_MOST_PARTS = 64  # of a dotted key: ours have three; the standard library's reader needs their square in time
_LONG_KEY = re.compile(
    r"""(?<![\w."'-])(?:(?:"[^"\n]*+"|'[^'\n]*+'|[\w-]++)[ \t]*+\.[ \t]*+)""" f"{{{_MOST_PARTS}}}", re.ASCII
)
_CONTROL = re.compile(r"[\x00-\x1f\x7f]")


def _printable(name: str) -> str:
    if _CONTROL.search(name):
        raise ValueError(f"found {name!r}, expected a name without control characters (line ends, tabs, NUL)")
    return name


def _without_slash(name: str) -> str:
    if "/" in name:
        raise ValueError(f"found {name!r}, expected a name without /, which parts a coordinate from its derivatives")
    return _printable(name)


CoordinateName = Annotated[str, AfterValidator(_without_slash)]
Name = Annotated[str, AfterValidator(_printable)]
"""What something is called: it becomes a column of text files, which a line end or tab would break."""


def nearest(word: str, known: Iterable[str]) -> str:
    """ " (did you mean 'x'?)" for the known word closest to a misspelt one, or an empty string."""
    names = list(known)
    close = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    if not close:
        by_case = {name.casefold(): name for name in names}
        close = difflib.get_close_matches(word.casefold(), list(by_case), n=1, cutoff=0.6)
        close = [by_case[name] for name in close]
    return f" (did you mean {close[0]!r}?)" if close else ""


class Strict(BaseModel):
    """Base of everything read from a file: unknown keys are refused, instances cannot be changed. With
    ``use_attribute_docstrings`` (a class argument) the text below a field is its meaning, wherever that is shown."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        str_strip_whitespace=True,
        allow_inf_nan=False,
    )

    renamed: ClassVar[Mapping[str, str]] = {}
    """New names of keys that were called otherwise, after a space with how its values are written now: the old ones are
    refused by naming the new."""

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        if isinstance(data, dict):
            for key, value in data.items():
                if isinstance(value, bool) and _is_number(cls.model_fields.get(key)):
                    raise ValueError(f"{key}: expected a number, found {value}")
            if old := [key for key in data if key in cls.renamed]:
                called = [(key, *cls.renamed[key].partition(" ")) for key in old]
                raise ValueError(
                    "; ".join(f"{key!r} is now called {name!r}{space}{values}" for key, name, space, values in called)
                )
            for key in data:
                if key not in cls.model_fields:
                    raise ValueError(
                        f"unknown key {key!r}{nearest(str(key), cls.model_fields)}; "
                        f"expected keys: {', '.join(cls.model_fields)}"
                    )
        return data

    def changed(self, /, **values: Any) -> Self:
        """The same with some values replaced, checked like those of a file.

        Raises:
            ConfigError: an unknown key, or a value that is wrong; the message names it.
        """
        present = {name: getattr(self, name) for name in type(self).model_fields}
        return validate(type(self), present | values, type(self).__name__.lower(), ConfigError)


def _is_number(field: FieldInfo | None) -> bool:
    """Whether a field takes numbers and no truth values, which Python takes for 0 and 1."""
    kinds = _kinds(field.annotation) if field else set()
    return bool(kinds & {int, float}) and bool not in kinds


def _kinds(annotation: Any) -> set[Any]:
    """The types of a union, without what is annotated of them."""
    origin = get_origin(annotation)
    if origin is Annotated:
        return _kinds(get_args(annotation)[0])
    if origin in (Union, UnionType):
        return set().union(*(_kinds(each) for each in get_args(annotation)))
    return {annotation}


class _Called(type(BaseModel)):  # type: ignore[misc]
    """Of classes that people call: what is wrong is a ConfigError, as it is from a file."""

    def __call__(cls, *args: Any, **values: Any) -> Any:
        try:
            return super().__call__(*args, **values)
        except ValidationError as error:
            raise ConfigError(_first_error(error, values, cls.__name__.lower())) from None


if TYPE_CHECKING:  # which finds the arguments in the fields, without a metaclass
    _Base = Strict
else:

    class _Base(Strict, metaclass=_Called):
        pass


class Called(_Base):
    """`Strict` that is made in Python as well.

    Raises:
        ConfigError: an unknown key, or a value that is wrong; the message names it.
    """


Schema = TypeVar("Schema", bound=BaseModel)


def read_toml(path: Path, raises: type[DynakinError] = ModelError) -> dict[str, Any]:
    """The content of a TOML file.

    Raises:
        ModelError (or ``raises``): no such file, not readable, or not TOML (with the line).
    """
    try:
        text = read_bytes(path, raises, LARGEST_TEXT).decode("utf-8-sig")
        long = _LONG_KEY.search(text)
        if long:
            line = text.count("\n", 0, long.start()) + 1
            raise raises(f"{path}, line {line}: found a key of {_MOST_PARTS} parts or more, expected fewer")
        return tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise raises(f"{path}: cannot be read ({error})") from None
    except RecursionError:
        raise raises(f"{path}: not a TOML file for this program: tables or lists lie too deep in one another") from None
    except ValueError as error:  # TOMLDecodeError, or Python's own: a whole number of 4,300 digits
        raise raises(f"{path}: not a TOML file: {error}") from None


def _place(location: tuple[int | str, ...], data: Any, names: Mapping[str, str]) -> str:
    """'segments[2] "shank": axes[0]' from pydantic's location; names: of keys that are called otherwise."""
    text, node = "", data
    for step in location:
        if isinstance(step, int):
            text += f"[{step}]"
            node = node[step] if isinstance(node, list) and step < len(node) else None
            if isinstance(node, dict) and isinstance(node.get("name"), str):
                text += f' "{node["name"]}"'
        elif "[" in step or step[:1].isupper():
            continue  # pydantic's name of a branch of a union, no key of the file
        else:
            text = f"{text}.{step}" if text else step
            text = names.get(text, text)
            node = node.get(step) if isinstance(node, dict) else None
    return text


def validate(
    schema: type[Schema],
    data: Any,
    where: str,
    raises: type[DynakinError] = ModelError,
    names: Mapping[str, str] | None = None,
) -> Schema:
    """``data`` as an instance of ``schema``.

    Args:
        names: how messages call keys, where not by themselves.

    Raises:
        ModelError (or ``raises``): with the first thing that is wrong; ``where`` (a file, "subject") opens the message.
    """
    try:
        return schema.model_validate(data)
    except ValidationError as error:
        raise raises(_first_error(error, data, where, names)) from None


def _first_error(error: ValidationError, data: Any, where: str, names: Mapping[str, str] | None = None) -> str:
    found_errors = error.errors(include_url=False)
    first = found_errors[0]
    if first["type"] == "literal_error" and not isinstance(first["input"], str) and len(found_errors) > 1:
        first = found_errors[1]  # "a word or a table", and it is a table: say what is wrong in that
    place = _place(tuple(first["loc"]), data, names or {})
    message = str(first["msg"]).removeprefix("Value error, ")
    found = "" if first["type"] in {"value_error", "missing"} else f", found {first['input']!r}"
    return f"{where}: {place + ': ' if place else ''}{message}{found}"
