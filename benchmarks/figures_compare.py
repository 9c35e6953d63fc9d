"""Two trees of results, file by file and column by column; for figures.py.

Compared are .mot, .sto, .trc, .csv, .json, .toml and .nc: the same files and columns, and each number to 1e-9 of its
column's largest magnitude (of a single number: its own; below 1e-12 all is rounding). A number in a text file may also
differ by its last digit where that is below 1e-4 of its column; how many do is counted. Not compared: timings,
versions, schema, sentences (text of more than three words), folders of paths.
"""

from __future__ import annotations

import csv
import fnmatch
import json
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

NOT_COMPARED = re.compile(r"\b(versions?|\w+_version|timing|step_us)\b")
NUMBER = re.compile(r"(?:nan|[+-]?inf)|\s*[+-]?\d+(?:\.(\d+))?(?:[eE]([+-]?\d+))?\s*")
LEAST = 1e-12  # below this it is rounding
LAST_DIGIT = 1e-4  # of its column; a coarser digit may not change
READ = {".mot", ".sto", ".trc", ".csv", ".json", ".toml", ".nc"}
Cells = list[Any] | np.ndarray


def _tree(value: Any, key: str = "") -> Iterator[tuple[str, Cells]]:
    """Leaves of JSON or TOML; a list of numbers is one column, a list of named things goes by their names."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield from _tree(part, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list) and any(isinstance(part, (dict, list)) for part in value):
        for k, part in enumerate(value):
            yield from _tree(part, f"{key}[{part.get('name', k) if isinstance(part, dict) else k}]")
    else:
        yield key, value if isinstance(value, list) else [value]


def _storage(text: str) -> Iterator[tuple[str, Cells]]:
    head, _, body = text.partition("endheader\n")
    yield "inDegrees", re.findall(r"inDegrees=\w+", head)
    rows = [line.split("\t") for line in body.splitlines()]
    yield from _by_column(rows[0], rows[1:])


def _trc(text: str) -> Iterator[tuple[str, Cells]]:
    lines = [line.split("\t") for line in text.splitlines()]
    yield from ((name, [value]) for name, value in zip(lines[1], lines[2], strict=False) if name)
    names = ["Frame#", "Time"] + [f"{name}.{axis}" for name in lines[3][2:] if name for axis in "xyz"]
    yield from _by_column(names, [row for row in lines[5:] if any(row)])


def _by_column(names: list[str], rows: list[list[str]]) -> Iterator[tuple[str, Cells]]:
    for k, name in enumerate(names):
        yield name, [row[k] if k < len(row) else "" for row in rows]


def _csv(rows: list[list[str]]) -> Iterator[tuple[str, Cells]]:
    """A column of numbers for each set of labels (quantity, unit, ...) that rows have: these are of one scale."""
    names, rows = (rows[0], rows[1:]) if rows else ([], [])
    labels = [k for k in range(len(names)) if any(row[k] and not NUMBER.fullmatch(row[k]) for row in rows)]
    yield from ((names[k], [row[k] for row in rows]) for k in labels)
    groups: dict[tuple[str, ...], list[list[str]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[k] for k in labels), []).append(row)
    for g, group in enumerate(groups.values()):
        yield from ((f"{names[k]}[{g}]", [row[k] for row in group]) for k in range(len(names)) if k not in labels)


def _netcdf(path: Path) -> Iterator[tuple[str, Cells]]:
    with xr.open_dataset(path, decode_times=False) as data:
        for name, variable in data.variables.items():
            values = np.asarray(variable)
            if values.ndim < 2:
                yield str(name), values
            else:  # a column over time for each coordinate, marker's axis, ...; a row of the matrix without a time
                yield from ((f"{name}[{k}]", row) for k, row in enumerate(values.reshape(len(values), -1).T))
            yield f"{name}@units", [*variable.dims, variable.attrs.get("units", "")]


def _columns(path: Path) -> Iterator[tuple[str, Cells]]:
    """A file as columns by their names."""
    if path.suffix == ".nc":
        return _netcdf(path)
    text = path.read_text(encoding="utf-8")
    if path.suffix in (".json", ".toml"):
        return _tree(json.loads(text) if path.suffix == ".json" else tomllib.loads(text))
    if path.suffix in (".trc", ".mot", ".sto"):
        return _trc(text) if path.suffix == ".trc" else _storage(text)
    return _csv(list(csv.reader(line for line in text.splitlines() if not line.startswith("#"))))


def _floats(cells: Cells) -> np.ndarray:
    """As numbers; NaN where a cell is none."""
    try:
        return np.array(cells, dtype=float)
    except (TypeError, ValueError):
        return np.array([float(cell) if NUMBER.fullmatch(str(cell)) else np.nan for cell in cells])


def _digit(cell: Any) -> float:
    """What the last digit of a number in a text is worth; 0 of one that is no text, or whole."""
    found = NUMBER.fullmatch(cell) if isinstance(cell, str) else None
    return float(10.0 ** (int(found[2] or 0) - len(found[1]))) if found and found[1] else 0.0


def _whole(key: str) -> str:
    """The variable of a column that has no name of its own."""
    return re.sub(r"(?:\[\d+\])+$", "", key)


def _word(cell: Any) -> str:
    """A text as it is compared."""
    text = str(cell)
    return "(a sentence)" if len(text.split()) > 3 else text.rsplit("/", 1)[-1] if text.startswith("/") else text


@dataclass
class Comparison:
    """Differences of two trees, and what has no match."""

    relative: float
    renamed: list[tuple[str, str]]
    ignored: list[str]
    different: dict[str, tuple[float, str, int]] = field(default_factory=dict)
    """By file and variable: largest difference over the scale of its column, or what it is; number of values."""
    missing: dict[str, None] = field(default_factory=dict)
    added: dict[str, None] = field(default_factory=dict)
    values: int = 0
    last_digits: int = 0

    def _new(self, text: str) -> str:
        """A name of before as it is now."""
        for old, new in self.renamed:
            text = re.sub(rf"(?<![\w-]){re.escape(old)}(?![\w-])", new, text)
        return text

    def trees(self, before: Path, after: Path, only: list[str] | None) -> None:
        """Compare all files that can be read."""

        def files(tree: Path) -> dict[str, Path]:
            found = {str(p.relative_to(tree)): p for p in sorted(tree.rglob("*")) if p.suffix in READ and p.is_file()}
            return {name: path for name, path in found.items() if only is None or name.split("/")[0] in only}

        first, second = {self._new(name): path for name, path in files(before).items()}, files(after)
        for name in self._matched("", first, second):
            old, new = dict(_columns(first[name])), dict(_columns(second[name]))
            old = {self._new(key): cells for key, cells in old.items()}
            for key in self._matched(f"{name}: ", old, new):
                self._column(name, key, old[key], new[key])

    def _matched(self, where: str, old: dict[str, Any], new: dict[str, Any]) -> list[str]:
        def counts(key: str) -> bool:
            hidden = bool(where) and NOT_COMPARED.search(key) is not None
            return not hidden and not any(fnmatch.fnmatch(where + key, pattern) for pattern in self.ignored)

        self.missing |= {where + _whole(key): None for key in old if key not in new and counts(key)}
        self.added |= {where + _whole(key): None for key in new if key not in old and counts(key)}
        return [key for key in old if key in new and counts(key)]

    def _column(self, file: str, key: str, old: Cells, new: Cells) -> None:
        if len(old) != len(new):
            return self._differs(file, key, np.inf, f"{len(old)} values, now {len(new)}", len(new))
        self.values += len(old)
        a, b = _floats(old), _floats(new)
        known = np.isfinite(a) & np.isfinite(b)
        words = [k for k in np.flatnonzero(~known) if self._new(_word(old[k])) != _word(new[k])]
        off = np.abs(np.subtract(a, b, out=np.zeros(len(a)), where=known))
        scale = float(np.max(np.abs(a), initial=0.0, where=known))
        beyond = np.flatnonzero(off > max(self.relative * scale, LEAST))
        far = [k for k in beyond if not off[k] <= 1.01 * max(_digit(old[k]), _digit(new[k])) <= LAST_DIGIT * scale]
        self.last_digits += len(beyond) - len(far)
        if far:
            self._differs(file, key, max(off[far]) / scale if scale else np.inf, "", len(far))
        if words:
            first = words[0]
            self._differs(file, key, np.inf, f"{_word(old[first])}, now {_word(new[first])}", len(words))

    def _differs(self, file: str, key: str, size: float, words: str, count: int) -> None:
        name = f"{file} | {_whole(key)}"
        largest, said, before = self.different.get(name, (0.0, "", 0))
        self.different[name] = (max(size, largest), said or words, before + count)

    def report(self) -> str:
        """As Markdown."""
        lines = []
        if self.different:
            lines += ["| file | column | largest difference / scale | values |", "|---|---|---|---|"]
            lines += [f"| {name} | {text or f'{off:.1e}'} | {n} |" for name, (off, text, n) in self.different.items()]
        for title, names in (("Missing", self.missing), ("Added", self.added)):
            if names:
                lines += ["", f"{title}:", "", *(f"- {name}" for name in names)]
        lines.append(
            f"\n{self.values} values compared, {len(self.different)} columns differ, {len(self.missing)} missing, "
            f"{len(self.added)} added; {self.last_digits} values differ by the last digit of their text."
        )
        return "\n".join(lines).lstrip("\n")
