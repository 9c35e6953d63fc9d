"""Which build this is: a version stands for many between releases, and rows that one build made belong to no other."""

from __future__ import annotations

import hashlib
import os
from functools import cache
from pathlib import Path

from dynakin.bindings import _core
from dynakin.results.files.config import version_of


@cache
def build() -> str:
    """The version, and a short digest of the package and its compiled core, once a process: "0.1.0 (3f2a09b1c5d7)"."""
    return f"{version_of('dynakin')} ({digest_of(Path(__file__).parents[2], Path(_core.__file__))})"


def digest_of(package: Path, core: Path) -> str:
    """Of what is in the sources and tables of a package, whose names count and whose times do not, and in its core."""
    digest = hashlib.sha256()
    paths = (
        f"{folder}{os.sep}{name}"
        for folder, _, names in os.walk(package)
        for name in names
        if name.endswith((".py", ".toml", ".csv"))
    )
    root = len(str(package))
    for path in sorted(paths):
        digest.update(path[root:].encode() + b"\0" + Path(path).read_bytes())
    digest.update(core.read_bytes())
    return digest.hexdigest()[:12]
