"""`benchmarks/pages.py` writes of which build a table is, once, and leaves the rest of the page as it is."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

PAGES = Path(__file__).resolve().parents[2] / "benchmarks" / "pages.py"
PAGE = "# A page\n\n<!-- nis: begin -->\n*Made with 0a0a0a0a, 2026-01-01.*\n\n| old |\n\n<!-- nis: end -->\n\nMore.\n"


def test_a_table_says_of_which_build_it_is(tmp_path: Path) -> None:
    pages = runpy.run_path(str(PAGES))
    put = pages["put"]
    put.__globals__["DOCS"] = tmp_path
    (tmp_path / "page.md").write_text(PAGE, encoding="utf-8")
    for _ in range(2):  # again: its own line is taken away with the table
        put("page.md", "nis", ["| new |"])
    before, made, after = re.split(r"(\*Made with .*\*)", (tmp_path / "page.md").read_text(encoding="utf-8"))
    commit = r"([0-9a-f]{8}( with changes that are not committed)?|a tree without git)"
    assert re.fullmatch(rf"\*Made with {commit}, \d{{4}}-\d\d-\d\d\.\*", made)
    assert before == "# A page\n\n<!-- nis: begin -->\n"
    assert after == "\n\n| new |\n\n<!-- nis: end -->\n\nMore.\n"
    with pytest.raises(SystemExit, match="lacks <!-- verdicts: begin -->"):
        put("page.md", "verdicts", [])


def test_every_table_of_the_pages_says_it() -> None:
    docs = PAGES.parents[1] / "docs"
    begun = {
        f"{page.name}, {name}": first
        for page in docs.rglob("*.md")
        for name, first in re.findall(r"<!-- (.+): begin -->\n(.*)", page.read_text(encoding="utf-8"))
    }
    assert len(begun) == 7
    for place, first in begun.items():
        assert re.fullmatch(r"\*(Made with|In this page since) [0-9a-f]{8}.*, \d{4}-\d\d-\d\d\.\*", first), place
