"""The journal of a long piece of work: which rows are kept when what they depend on changes."""

from __future__ import annotations

from pathlib import Path

import pytest

from dynakin.errors import OutputError
from dynakin.studies.engine.journal import Journal


def of(first: int, second: int, version: int = 1) -> dict[str, object]:
    return {"version": version, "trials": {"first": first, "second": second}}


def test_what_has_no_row_may_change(tmp_path: Path) -> None:
    """A trial that failed and was mended; and then its row depends on the file as it is now."""
    path = tmp_path / "rows.jsonl"
    Journal(path, of(1, 1), "trials").add("first", {"value": 1.0})
    mended = Journal(path, of(1, 2), "trials")
    assert mended.rows == {"first": {"value": 1.0}}
    mended.add("second", {"value": 2.0})
    assert set(Journal(path, of(1, 2), "trials").rows) == {"first", "second"}
    with pytest.raises(OutputError, match="trials, second: 2, now 3"):
        Journal(path, of(1, 3), "trials")


@pytest.mark.parametrize(("now", "of_rows"), [(of(2, 1), "trials"), (of(1, 1, 2), "trials"), (of(1, 2), None)])
def test_what_rows_depend_on_may_not(tmp_path: Path, now: dict[str, object], of_rows: str | None) -> None:
    path = tmp_path / "rows.jsonl"
    Journal(path, of(1, 1), of_rows).add("first", {"value": 1.0})
    with pytest.raises(OutputError, match="belongs to other settings"):
        Journal(path, now, of_rows)


def test_rows_that_depend_on_what_changed_are_done_again(tmp_path: Path) -> None:
    """Of a subject that was identified on all its trials, one of which was mended; another subject's are kept."""
    path = tmp_path / "rows.jsonl"

    def journal(second: int) -> Journal:
        belongs = {"trials": {"a/1": 1, "a/2": second, "b/1": 1}}
        return Journal(path, belongs, "trials", lambda key: key.split("/")[0])

    begun = journal(1)
    for key in ("a", "a/1", "b", "b/1"):
        begun.add(key, {"value": 1.0})
    assert set(journal(2).rows) == {"b", "b/1"}
    assert set(journal(2).rows) == {"b", "b/1"}  # as it was written
