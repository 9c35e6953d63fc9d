"""Every figure of a fixed set of runs (figures.toml), kept to compare before and after a change number by number.

    .venv/bin/python benchmarks/figures.py --out build/before [--jobs 2] [--only NAME] [--dynakin PATH]
    .venv/bin/python benchmarks/figures.py --compare build/before build/after [--renamed old=new] [--allow-added]

The program is used through its command line alone, so the set survives changes of Python names. A live session's
estimates come through a sink that this file is itself (``--publish figures:FILE``): each attribute of a published frame
that holds numbers is a column. Compared are .mot, .sto, .trc, .csv, .json, .toml, .nc: the same files and columns,
and each number to 1e-9 of its column's largest magnitude (of a single number: its own). A number in a text file may
also differ by its last digit where that is below 1e-4 of its column; how many do is counted. Not compared: timings,
versions, schema, sentences (text of more than three words), folders of paths.
"""

from __future__ import annotations

import argparse
import csv
import fnmatch
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", ROOT.parent / "shared" / "data")).absolute()
LIMIT_S = 900.0
NOT_COMPARED = re.compile(r"\b(versions?|\w+_version|timing|step_us)\b")
LEAST = 1e-12  # a single number below this is rounding
LAST_DIGIT = 1e-4  # of its column; a coarser digit may not change
Cells = list[Any]


class Sink:
    """Writes every number of each published frame: a row a frame, in all digits."""

    def __init__(self, address: str, options: dict[str, str]) -> None:
        self._path = Path(address)
        self._rows: list[dict[str, float]] = []

    def frame(self, frame: Any) -> None:
        """A step was done."""
        row: dict[str, float] = {}
        for part in ("estimate", "smoothed", "state"):
            found = getattr(frame, part, None)
            for name, value in (vars(found) if hasattr(found, "__dict__") else {"": found}).items():
                if isinstance(value, (int, float, np.ndarray)):
                    flat = np.asarray(value, dtype=float).ravel().tolist()
                    row |= {f"{part}.{name}[{k}]": number for k, number in enumerate(flat)}
        self._rows.append(row)

    def close(self) -> None:
        """Write the file; a frame without a column has a blank cell there."""
        with self._path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(dict.fromkeys(name for row in self._rows for name in row)))
            writer.writeheader()
            writer.writerows(self._rows)

    def asked(self) -> list[str]:
        """No wishes."""
        return []

    def __getattr__(self, name: str) -> Any:
        return lambda *_: None  # anything else that a session says


def _cases() -> dict[str, dict[str, Any]]:
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    words = tomllib.loads(text)["words"] | {"data": str(DATA)}
    for _ in range(3):  # words are made of words
        text = re.sub(r"\{(\w+)\}", lambda found: words[found[1]], text)
    return {name: case for name, case in tomllib.loads(text).items() if name != "words"}


def _trim(source: Path, frames: int, target: Path) -> None:
    """The first frames of a TRC, whose data begin after six lines."""
    lines = source.read_text(encoding="utf-8").splitlines()
    head = zip(lines[1].split("\t"), lines[2].split("\t"), strict=True)
    lines[2] = "\t".join(str(frames) if name in ("NumFrames", "OrigNumFrames") else value for name, value in head)
    target.write_text("\n".join(lines[: 6 + frames]) + "\n", encoding="utf-8")


def _plugin(folder: Path) -> None:
    """This file as an installed sink, which the program finds by its entry point."""
    info = folder / "dynakin_figures-0.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    shutil.copy(__file__, folder / "dynakin_figures.py")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: dynakin-figures\nVersion: 0\n")
    (info / "entry_points.txt").write_text("[dynakin.sinks]\nfigures = dynakin_figures:Sink\n")


def _work(case: dict[str, Any], folder: Path, program: Path) -> str:
    """Run a case in its own folder, which is made anew; how it went."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    started, exits = time.monotonic(), folder / "exits.json"
    used = " ".join([*case["commands"], *map(str, case.get("trim", []))]).split()
    absent = {Path(word).name for word in used if word.startswith(str(DATA)) and not Path(word).exists()}
    if absent:
        exits.write_text('{"skipped": "recordings"}')
        return f"skipped: {', '.join(sorted(absent))} not in {DATA} (set DYNAKIN_TEST_DATA)"
    if "trim" in case:
        source, frames = case["trim"]
        _trim(Path(source), frames, folder / Path(source).name)
    for name, text in case.get("files", {}).items():
        (folder / name).write_text(text, encoding="utf-8")
    one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(folder.parent / "plugin")}
    codes: dict[str, int] = {}
    with (folder / "log.txt").open("w", encoding="utf-8") as log:
        for k, command in enumerate(case["commands"]):
            print(f"\n$ dynakin {command}", file=log, flush=True)
            call = [str(program), *command.split()]
            done = subprocess.run(call, cwd=folder, env=os.environ | one, stdout=log, stderr=log, timeout=LIMIT_S)
            codes[f"{k} {command.split()[0]}"] = done.returncode
    exits.write_text(json.dumps(codes, indent=1))
    bad = "".join(f", {name} ended with {code}" for name, code in codes.items() if code)
    return f"{time.monotonic() - started:.0f} s{bad}"


def make(out: Path, program: Path, jobs: int, only: list[str] | None) -> None:
    """Run the cases, some at a time, each into ``out/NAME``."""
    cases = _cases()
    if unknown := set(only or ()) - set(cases):
        raise SystemExit(f"--only {', '.join(sorted(unknown))}: unknown; expected some of {', '.join(cases)}")
    _plugin(out / "plugin")
    with ThreadPoolExecutor(jobs) as pool:
        going = {n: pool.submit(_work, c, out / n, program) for n, c in cases.items() if only is None or n in only}
        for name, future in going.items():
            print(f"{name}: {future.result()}", flush=True)


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
    for line in head.splitlines():
        if line.startswith("inDegrees"):
            yield "inDegrees", [line]
    rows = [line.split("\t") for line in body.splitlines()]
    yield from _by_column(rows[0], rows[1:])


def _trc(text: str) -> Iterator[tuple[str, Cells]]:
    lines = [line.split("\t") for line in text.splitlines()]
    head = {name: value for name, value in zip(lines[1], lines[2], strict=False) if name}
    yield from ((name, [value]) for name, value in head.items())
    names = ["Frame#", "Time"] + [f"{name}.{axis}" for name in lines[3][2:] if name for axis in "xyz"]
    yield from _by_column(names, [row for row in lines[5:] if any(row)])


def _by_column(names: list[str], rows: list[list[str]]) -> Iterator[tuple[str, Cells]]:
    for k, name in enumerate(names):
        yield name, [row[k] if k < len(row) else "" for row in rows]


def _netcdf(path: Path) -> Iterator[tuple[str, Cells]]:
    import xarray as xr

    with xr.open_dataset(path, decode_times=False) as data:
        for name, variable in data.variables.items():
            yield str(name), [*np.asarray(variable).ravel().tolist()]
            yield f"{name}@", [f"{variable.dims} {variable.shape} {variable.attrs.get('units', '')}".replace(" ", "")]


def _columns(path: Path) -> Iterator[tuple[str, Cells]]:
    """A file as columns by their names."""
    if path.suffix == ".nc":
        return _netcdf(path)
    text = path.read_text(encoding="utf-8")
    if path.suffix in (".json", ".toml"):
        return _tree(json.loads(text) if path.suffix == ".json" else tomllib.loads(text))
    if path.suffix == ".trc":
        return _trc(text)
    if path.suffix in (".mot", ".sto"):
        return _storage(text)
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    return _by_column(rows[0], rows[1:]) if rows else iter(())


def _number(cell: Any) -> float:
    try:
        return float(cell)
    except (TypeError, ValueError):
        return float("nan")


def _digit(cell: Any) -> float:
    """What the last digit of a number in a text is worth; 0 of one that is no text, or whole."""
    found = re.fullmatch(r"\s*[+-]?\d*\.(\d+)(?:[eE]([+-]?\d+))?\s*", cell) if isinstance(cell, str) else None
    return float(10.0 ** (int(found[2] or 0) - len(found[1]))) if found else 0.0


def _word(text: str) -> str:
    """A text as it is compared."""
    return "(a sentence)" if len(text.split()) > 3 else text.rsplit("/", 1)[-1] if text.startswith("/") else text


READ = {".mot", ".sto", ".trc", ".csv", ".json", ".toml", ".nc"}


@dataclass
class Comparison:
    """Differences of two trees: (file, key, largest difference over scale, number of values), and what has no match."""

    relative: float
    renamed: list[tuple[str, str]]
    ignored: list[str]
    different: list[tuple[str, str, str, int]] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    added: list[str] = field(default_factory=list)
    values: int = 0
    last_digits: int = 0

    def _new(self, text: str) -> str:
        """A name of before as it is now."""
        for old, new in self.renamed:
            text = re.sub(rf"(?<![\w-]){re.escape(old)}(?![\w-])", new, text)
        return text

    def trees(self, before: Path, after: Path, only: list[str] | None) -> None:
        """Compare all files that can be read."""
        files = [
            {str(p.relative_to(t)): p for p in sorted(t.rglob("*")) if p.suffix in READ and p.is_file()}
            for t in (before, after)
        ]
        first, second = ({n: p for n, p in f.items() if only is None or n.split("/")[0] in only} for f in files)
        first = {self._new(name): path for name, path in first.items()}
        for name in self._matched("", first, second):
            old, new = dict(_columns(first[name])), dict(_columns(second[name]))
            old = {self._new(key): cells for key, cells in old.items()}
            for key in self._matched(f"{name}: ", old, new):
                self._column(name, key, old[key], new[key])

    def _matched(self, where: str, old: dict[str, Any], new: dict[str, Any]) -> list[str]:
        def counts(key: str) -> bool:
            hidden = bool(where) and NOT_COMPARED.search(key) is not None
            return not hidden and not any(fnmatch.fnmatch(where + key, pattern) for pattern in self.ignored)

        self.missing += [where + key for key in old if key not in new and counts(key)]
        self.added += [where + key for key in new if key not in old and counts(key)]
        return [key for key in old if key in new and counts(key)]

    def _column(self, file: str, key: str, old: Cells, new: Cells) -> None:
        if len(old) != len(new):
            self.different.append((file, key, f"{len(old)} values, now {len(new)}", len(new)))
            return
        self.values += len(old)
        a, b = (np.array([_number(cell) for cell in cells]) for cells in (old, new))
        numbers = np.isfinite(a) & np.isfinite(b)
        words = [k for k in np.flatnonzero(~numbers) if _word(self._new(str(old[k]))) != _word(str(new[k]))]
        off = np.abs(np.where(numbers, a - b, 0.0))
        scale = float(np.max(np.abs(a[numbers]), initial=0.0))
        beyond = list(np.flatnonzero(off > self.relative * scale + (LEAST if len(a) == 1 else 0.0)))
        rounded = {k for k in beyond if off[k] <= 1.01 * max(_digit(old[k]), _digit(new[k])) <= LAST_DIGIT * scale}
        self.last_digits += len(rounded)
        beyond = [k for k in beyond if k not in rounded]
        if beyond:
            largest = off.max() / scale if scale else np.inf
            self.different.append((file, key, f"{largest:.1e}", len(beyond)))
        if words:
            shown = f"{_word(str(old[words[0]]))}, now {_word(str(new[words[0]]))}"
            self.different.append((file, key, shown, len(words)))

    def report(self) -> str:
        """As Markdown."""
        lines = []
        if self.different:
            lines += ["| file | column | largest difference / scale | values |", "|---|---|---|---|"]
            lines += [f"| {file} | {key} | {what} | {count} |" for file, key, what, count in self.different]
        for title, names in (("Missing", self.missing), ("Added", self.added)):
            if names:
                lines += ["", f"{title}:", "", *(f"- {name}" for name in names)]
        lines.append(
            f"\n{self.values} values compared, {len(self.different)} columns differ, {len(self.missing)} missing, "
            f"{len(self.added)} added; {self.last_digits} values differ by the last digit of their text."
        )
        return "\n".join(lines).lstrip("\n")


def main() -> int:
    """The command line; 1 where trees differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    wanted = parser.add_mutually_exclusive_group(required=True)
    wanted.add_argument("--out", type=Path, help="folder of the tree to make")
    wanted.add_argument("--compare", type=Path, nargs=2, metavar=("BEFORE", "AFTER"))
    parser.add_argument("--dynakin", type=Path, default=ROOT / ".venv" / "bin" / "dynakin", help="the program")
    parser.add_argument("--jobs", type=int, default=1, help="cases at a time")
    parser.add_argument("--only", action="append", metavar="NAME", help="this case alone; may be repeated")
    parser.add_argument("--renamed", action="append", default=[], metavar="OLD=NEW", help="file, key, column or word")
    parser.add_argument("--ignore", action="append", default=[], metavar="GLOB", help="FILE or 'FILE: KEY'")
    parser.add_argument("--allow-added", action="store_true", help="what AFTER has more is listed, and no difference")
    parser.add_argument("--relative", type=float, default=1e-9, help="tolerance, over the largest of a column")
    given = parser.parse_args()
    if given.out:
        make(given.out.absolute(), given.dynakin.absolute(), given.jobs, given.only)
        return 0
    for tree in given.compare:
        if not tree.is_dir():
            parser.error(f"{tree}: no such folder")
    renamed = [(old, new) for old, _, new in (text.partition("=") for text in given.renamed)]
    found = Comparison(given.relative, renamed, given.ignore)
    found.trees(given.compare[0], given.compare[1], given.only)
    print(found.report())
    return int(bool(found.different or found.missing or (found.added and not given.allow_added) or not found.values))


if __name__ == "__main__":
    sys.exit(main())
