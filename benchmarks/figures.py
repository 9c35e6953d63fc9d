"""Every figure of a fixed set of runs (figures.toml), kept to compare before and after a change number by number.

    .venv/bin/python benchmarks/figures.py --out build/before [--jobs 2] [--only NAME] [--dynakin PATH]
    .venv/bin/python benchmarks/figures.py --compare build/before build/after [--renamed old=new] [--allow-added]

The program is used through its command line alone, so the set survives changes of Python names. A live session's
estimates come through the sink of figures_sink.py; what is compared, and how far it may differ: figures_compare.py.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from figures_compare import Comparison

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("DYNAKIN_TEST_DATA", ROOT.parent / "shared" / "data")).absolute()
LIMIT_S = 900.0
TIMED_OUT = 124  # as the command timeout says it


def _cases() -> dict[str, dict[str, Any]]:
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    words = tomllib.loads(text)["words"] | {"data": str(DATA)}
    while re.search(r"\{\w+\}", text):  # words are made of words
        text = re.sub(r"\{(\w+)\}", lambda found: words[found[1]], text)
    return {name: case for name, case in tomllib.loads(text).items() if name != "words"}


def _trim(source: Path, frames: int, target: Path) -> None:
    """The first frames of a TRC, whose data begin after six lines."""
    lines = source.read_text(encoding="utf-8").splitlines()
    head = zip(lines[1].split("\t"), lines[2].split("\t"), strict=True)
    lines[2] = "\t".join(str(frames) if name in ("NumFrames", "OrigNumFrames") else value for name, value in head)
    target.write_text("\n".join(lines[: 6 + frames]) + "\n", encoding="utf-8")


def _plugin(folder: Path) -> None:
    """figures_sink.py as if it were installed: the program finds it by its entry point."""
    info = folder / "dynakin_figures-0.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    shutil.copy(Path(__file__).with_name("figures_sink.py"), folder / "dynakin_figures.py")
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
            try:
                done = subprocess.run(call, cwd=folder, env=os.environ | one, stdout=log, stderr=log, timeout=LIMIT_S)
                code = done.returncode
            except subprocess.TimeoutExpired:
                code = TIMED_OUT
            codes[f"{k} {command.split()[0]}"] = code
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
