"""The folder of a long piece of work and the rows in it as they come: what was done before a run was killed is not done
again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from dynakin.errors import OutputError
from dynakin.files import read_bytes, with_nulls
from dynakin.studies.engine.tasks import Row

ROWS = "rows.jsonl"
"""The journal: rows as they came. A folder that holds it is ours, and is gone on with."""


def open_folder(folder: Path, own: Sequence[str]) -> Path:
    """Make a folder for long work, or go on in one that was begun.

    Args:
        own: beginnings of the names that the work writes.

    Raises:
        OutputError: it cannot be made, or holds something else.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        names = sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith("."))
    except OSError as error:
        raise OutputError(f"{folder}: cannot write results there ({error.strerror or error})") from None
    foreign = [name for name in names if name != ROWS and not name.startswith(tuple(own))]
    if foreign:
        raise OutputError(f"{folder}: is no folder of this command (it holds {foreign[0]}); name a new or an empty one")
    return folder


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Says in one line why something could not be written into ``folder``.

    Raises:
        OutputError: a file cannot be written.
    """
    try:
        yield
    except OSError as error:
        raise OutputError(f"{error.filename or folder}: cannot be written ({error.strerror or error})") from None


VERSION = 2
_SHOWN = 60  # characters of a value in a message


class Journal:
    """A file of JSON lines: a heading that says what the rows belong to, then a row a task.

    A line that was cut off by the end of its writer is dropped, and its task done again.

    Args:
        path: the file; made when the first row comes, in a folder that exists.
        belongs_to: plain data: everything on which the rows depend. It stands in the heading.
        of_rows: a key of it under which stands, by the rows' keys, what a row depends on: that of rows which are not
            there (failed, or never begun) may change.
        group: of a row's key what names the rows that depend on all of each other's: these are dropped, and their tasks
            done again, where something of the group changed. By default each row depends on its own alone.

    Raises:
        OutputError: the file cannot be read, is none of ours, or belongs to something else; what changed is named.
    """

    def __init__(
        self, path: Path, belongs_to: Any, of_rows: str | None = None, group: Callable[[str], str] = str
    ) -> None:
        self.path = path
        self._of_rows, self._group = of_rows, group
        self._heading = {"dynakin_journal": VERSION, "belongs_to": json.loads(json.dumps(belongs_to))}
        self.rows = self._read()

    def _read(self) -> dict[str, Row]:
        if not self.path.exists():
            return {}
        whole = read_bytes(self.path, OutputError).split(b"\n")[:-1]
        try:
            heading = json.loads(whole[0]) if whole else None
        except (ValueError, RecursionError):
            raise OutputError(f"{self.path}: is no journal of dynakin; name another folder") from None
        if heading is None:  # killed before its heading was whole
            self.path.unlink()
            return {}
        if not isinstance(heading, dict) or heading.get("dynakin_journal") != VERSION:
            raise OutputError(f"{self.path}: belongs to another version of dynakin; name another folder, or remove it")
        found: dict[str, Row] = {}
        for number, line in enumerate(whole[1:], start=2):
            try:
                entry = json.loads(line)
                found[entry["key"]] = entry["row"]
            except (ValueError, TypeError, KeyError, RecursionError):
                raise OutputError(
                    f"{self.path}, line {number}: is damaged, expected a row of JSON; delete that line, and what it "
                    "held is worked out again"
                ) from None
        before, now = heading.get("belongs_to"), self._heading["belongs_to"]
        if changed := difference(self._of(before, found), self._of(now, found)):
            raise OutputError(
                f"{self.path}: belongs to other settings, recordings or another version ({changed}); name another "
                "folder, or remove it, and all is worked out again"
            )
        if digest(before) != digest(now):
            return self._begun_anew(found, self._changed(before, now))
        kept = sum(len(line) + 1 for line in whole)
        with self.path.open("r+b") as file:
            file.truncate(kept)
        return found

    def _of(self, belongs_to: Any, rows: dict[str, Row]) -> Any:
        """What these rows depend on by themselves."""
        each = self._each(belongs_to)
        if each is None:
            return belongs_to
        return {**belongs_to, self._of_rows: {key: value for key, value in each.items() if key in rows}}

    def _each(self, belongs_to: Any) -> dict[str, Any] | None:
        each = belongs_to.get(self._of_rows) if self._of_rows and isinstance(belongs_to, dict) else None
        return each if isinstance(each, dict) else None

    def _changed(self, before: Any, now: Any) -> set[str]:
        """Groups in which something changed."""
        was, is_now = self._each(before) or {}, self._each(now) or {}
        return {self._group(key) for key in {**was, **is_now} if digest(was.get(key)) != digest(is_now.get(key))}

    def _begun_anew(self, rows: dict[str, Row], changed: set[str]) -> dict[str, Row]:
        """The file with the heading as it is now, without rows of these groups."""
        kept = {key: row for key, row in rows.items() if self._group(key) not in changed}
        lines = [self._heading, *(with_nulls({"key": key, "row": row}) for key, row in kept.items())]
        fresh = self.path.with_suffix(".new")
        with writing(self.path.parent):
            fresh.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8", newline="\n")
            fresh.replace(self.path)
        return kept

    def add(self, key: str, row: Row) -> None:
        """Append one row; it is on its way to the disk when this returns.

        Raises:
            OutputError: the file cannot be written.
        """
        self.rows[key] = row
        try:
            fresh = not self.path.exists()
            with self.path.open("a", encoding="utf-8", newline="\n") as file:
                if fresh:
                    file.write(json.dumps(self._heading) + "\n")
                file.write(json.dumps(with_nulls({"key": key, "row": row}), allow_nan=False) + "\n")
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be written ({error.strerror or error})") from None


def difference(before: Any, now: Any, where: str = "") -> str:
    """The first thing in which plain data differ, "trials, walk, mass_kg: 70, now 71"; "" where nothing does."""
    if digest(before) == digest(now):
        return ""
    if isinstance(before, dict) and isinstance(now, dict):
        pairs = [(str(key), before.get(key, _MISSING), now.get(key, _MISSING)) for key in {**before, **now}]
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        pairs = [(str(k + 1), *both) for k, both in enumerate(zip(before, now, strict=True))]
    else:
        return f"{where or 'what it is of'}: {_shown(before)}, now {_shown(now)}"
    found = (difference(a, b, f"{where}, {key}" if where else key) for key, a, b in pairs)
    return next(text for text in found if text)


_MISSING = ["missing"]
"""What no setting is."""


def _shown(value: Any) -> str:
    if value is _MISSING:
        return "not set"
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def digest(content: Any) -> str:
    """SHA-256 of plain data, for any order of its keys."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
