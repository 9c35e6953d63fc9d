"""What results depend on beside their inputs: the package, Python and compiled."""

from __future__ import annotations

import hashlib
from pathlib import Path

from dynakin.bindings import _core

SOURCE = Path(__file__).resolve().parents[1] / "src"


def source_digest() -> str:
    """Digest of the package's files and of the compiled core, wherever that was installed."""
    digest = hashlib.sha256(Path(_core.__file__).read_bytes())
    for path in sorted(SOURCE.rglob("*")):
        if path.suffix in (".py", ".toml", ".csv"):
            digest.update(path.read_bytes())
    return digest.hexdigest()
