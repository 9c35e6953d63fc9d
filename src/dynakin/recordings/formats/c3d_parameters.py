"""Parameters of a C3D file, found for any case of their names, and whether they are there or not."""

from __future__ import annotations

from itertools import takewhile
from typing import Any

import numpy as np
import numpy.typing as npt


class Parameters:
    """View of the parameter section that ezc3d read."""

    def __init__(self, groups: Any) -> None:
        self._groups = {
            str(group).upper(): {
                str(name).upper(): content["value"]
                for name, content in groups[group].items()
                if not str(name).startswith("__") and isinstance(content, dict) and "value" in content
            }
            for group in groups
        }

    def names(self, group: str) -> list[str]:
        """Parameter names of a group, upper case."""
        return list(self._groups.get(group, {}))

    def array(self, group: str, name: str) -> npt.NDArray[np.float64]:
        """Values as numbers in the parameter's own shape; empty where it is absent or text."""
        value = self._groups.get(group, {}).get(name)
        if value is None:
            return np.empty(0)
        try:
            return np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            return np.empty(0)

    def continued(self, group: str, name: str) -> npt.NDArray[np.float64]:
        """Values as numbers in one list, continued in NAME2, NAME3, ... as C3D does beyond 255 of them."""
        return np.concatenate([np.empty(0), *(self.array(group, part).ravel() for part in self._parts(group, name))])

    def number(self, group: str, name: str) -> float | None:
        """First value as a number, None where there is none."""
        values = self.array(group, name).ravel()
        return float(values[0]) if len(values) else None

    def texts(self, group: str, name: str) -> list[str]:
        """Values as stripped texts, continued in NAME2, NAME3, ... as C3D does beyond 255 of them."""
        values = (self._groups[group][part] for part in self._parts(group, name))
        return [_printable(str(text)).strip() for each in values for text in np.ravel(np.asarray(each, dtype=object))]

    def _parts(self, group: str, name: str) -> list[str]:
        """NAME, NAME2, NAME3, ... up to the first that is not there."""
        names = (name + suffix for suffix in ("", *map(str, range(2, 100))))
        return list(takewhile(lambda part: self._groups.get(group, {}).get(part) is not None, names))

    def text(self, group: str, name: str) -> str:
        """First text, "" where there is none."""
        texts = self.texts(group, name)
        return texts[0] if texts else ""


def _printable(text: str) -> str:
    """A text that is not UTF-8 comes with its bytes as lone surrogates, which nothing can print: Latin-1 then. NUL ends
    it, as in C; what else cannot be printed (a line end, say) is a blank."""
    text = text.split("\0")[0]
    try:
        text.encode()
    except UnicodeEncodeError:
        text = text.encode("utf-8", "surrogateescape").decode("latin-1")
    return "".join(letter if letter.isprintable() else " " for letter in text)
