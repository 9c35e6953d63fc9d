"""Mutated files end in one clear error or in a clean result; a case is made anew from its kind and seed.

A failure names seeds: `python -m support.fuzz.worker KIND SEED 1 CORPUS WORK`, in `tests`, repeats one
(`corpus.make`).
"""

from __future__ import annotations

from pathlib import Path

import pytest

from support.fuzz.corpus import add_real, make
from support.fuzz.run import run

REAL_FROM = 1_000_000  # seeds of mutated real files


@pytest.fixture(scope="session")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("own")
    make(folder)
    return folder


@pytest.mark.parametrize(("kind", "count"), [("text", 250), ("c3d", 120)])
def test_a_slice_is_clean(own: Path, tmp_path: Path, kind: str, count: int) -> None:
    found = run(kind, 0, count, own, tmp_path)
    assert not found.failed, str(found)
    assert found.errors + found.results == count
    assert min(found.errors, found.results) > count // 20, str(found)  # it damages, and not everything


@pytest.mark.nightly
@pytest.mark.parametrize(("kind", "count"), [("text", 14_000), ("c3d", 3_500)])
def test_all_are_clean(own: Path, tmp_path: Path, kind: str, count: int) -> None:
    found = run(kind, 0, count, own, tmp_path)
    print(f"\n{kind}: {found}")
    assert not found.failed, str(found)
    assert found.errors + found.results == count


@pytest.mark.nightly
@pytest.mark.parametrize(("kind", "count"), [("text", 6_000), ("c3d", 1_500)])
def test_real_files_are_clean(own: Path, data_dir: Path, tmp_path: Path, kind: str, count: int) -> None:
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    for path in own.glob("markers_squat.trc"):  # what forces are read with
        (corpus / path.name).write_bytes(path.read_bytes())
    add_real(corpus, data_dir)
    found = run(kind, REAL_FROM, count, corpus, tmp_path / "work")
    print(f"\nreal {kind}: {found}")
    assert not found.failed, str(found)
    assert found.errors + found.results == count
