"""Rows that another build made are refused, though its version is the same."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import dynakin
from dynakin.errors import OutputError
from dynakin.studies.batch import process
from dynakin.studies.engine.build import build, digest_of
from dynakin.studies.engine.journal import Journal
from dynakin.studies.tuning import fit, grid

SHARED: Any = SimpleNamespace(trials=(), base=dynakin.presets.default(), left_out=True)
BATCH: Any = SimpleNamespace(presets=(), cutoff_hz=6.0, files=False)
DATASET: Any = SimpleNamespace(sessions=(), path=Path("study.toml"))


@pytest.mark.parametrize(
    ("module", "belongs_to"),
    [
        (grid, lambda: grid.belongs_to(SHARED, ())),
        (fit, lambda: fit.belongs_to_fit(SHARED)),
        (process, lambda: process.belongs_to(DATASET, BATCH)),
    ],
    ids=["grid", "fit", "batch"],
)
def test_rows_of_another_build_are_refused(
    module: ModuleType, belongs_to: Callable[[], dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "rows.jsonl"
    Journal(path, belongs_to()).add("first", {"value": 1.0})
    assert Journal(path, belongs_to()).rows == {"first": {"value": 1.0}}
    version = build().split()[0]
    monkeypatch.setattr(module, "build", lambda: f"{version} (0123456789ab)")
    with pytest.raises(OutputError) as said:
        Journal(path, belongs_to())
    assert f"another version (version of dynakin: {build()}, now {version} (0123456789ab))" in str(said.value)
    assert str(said.value).endswith("name another folder, or remove it, and all is worked out again")


def test_the_digest_is_of_sources_tables_and_core(tmp_path: Path) -> None:
    package, core = tmp_path / "package", tmp_path / "core.so"
    (package / "deep").mkdir(parents=True)
    (package / "one.py").write_text("a = 1\n")
    (package / "deep" / "table.csv").write_text("1,2\n")
    core.write_bytes(b"core")
    seen = [digest_of(package, core)]
    (package / "deep" / "one.pyc").write_bytes(b"compiled")
    (package / "one.py").touch()  # copied anew: the same build
    assert digest_of(package, core) == seen[0]
    changes: list[Callable[[], object]] = [
        lambda: (package / "one.py").write_text("a = 2\n"),
        lambda: (package / "deep" / "table.csv").write_text("1,3\n"),
        lambda: (package / "one.py").rename(package / "other.py"),
        lambda: core.write_bytes(b"another core"),
    ]
    for change in changes:
        change()
        assert digest_of(package, core) not in seen
        seen.append(digest_of(package, core))


def test_this_build_is_digested_once() -> None:
    build.cache_clear()
    first = build()
    assert build() is first and build.cache_info().misses == 1
