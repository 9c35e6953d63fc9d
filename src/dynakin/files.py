"""What is in a file, with errors of one line that name it; tables and plain data written as files."""

from __future__ import annotations

import csv
import json
import math
import os
import platform
import re
import shutil
import stat
import uuid
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from numbers import Real
from pathlib import Path
from typing import Any

from dynakin.errors import DynakinError, RecordingError

LARGEST_TEXT = 64 * 2**20
"""Bytes of a model, table or configuration: the largest known (whole bodies with muscles) have a tenth."""


def is_text(name: str) -> bool:
    """Whether a name can be written as UTF-8; one of a file need not."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def expanded(path: str | Path) -> Path:
    """The path, its ``~`` the home folder, as a shell has it; unchanged where there is no such user."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


def is_file(path: Path) -> bool:
    """Whether there is such a file; a name that no file can have (5,000 characters, a NUL) is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def require_file(path: Path, raises: type[DynakinError] = RecordingError) -> None:
    """Raise RecordingError (or ``raises``) unless ``path`` is a file: a pipe would be waited for for ever."""
    if not is_text(str(path)):
        raise raises(f"{path}: its name is no UTF-8 text, so outputs could not hold it; rename it")
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        raise raises(f"{path}: cannot be read (no such file)") from None
    except (OSError, ValueError) as error:
        raise raises(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if stat.S_ISDIR(mode):
        raise raises(f"{path}: is a folder, expected a file")
    if not stat.S_ISREG(mode):
        raise raises(f"{path}: is a pipe or device, expected a file")


def read_bytes(path: Path, raises: type[DynakinError] = RecordingError, largest: float = float("inf")) -> bytes:
    """What is in a file.

    Raises:
        RecordingError (or ``raises``): no such file, not readable, or of more than ``largest`` bytes.
    """
    require_file(path, raises)
    try:
        size = path.stat().st_size
        if size > largest:
            raise raises(f"{path}: found {size} bytes, expected at most {largest:.0f}")
        return path.read_bytes()
    except OSError as error:
        raise raises(f"{path}: cannot be read ({error.strerror or error})") from None


def with_nulls(value: Any) -> Any:
    """The same dictionaries and lists with what is not a finite number as None."""
    if isinstance(value, dict):
        return {key: with_nulls(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [with_nulls(item) for item in value]
    if isinstance(value, int) or not isinstance(value, Real):
        return value
    return value if math.isfinite(value) else None  # NumPy's numbers too, without loading it


_HERE = f"{zlib.crc32(platform.node().encode()):08x}"  # this computer: on a shared disk others write as well
_UNFINISHED = re.compile(rf"\.dynakin-{_HERE}-(\d+)-[0-9a-f]{{8}}(\.\w+)?")


def unfinished(folder: Path, suffix: str = "") -> Path:
    """A new name in a folder for what takes another's place once it is whole. What processes of this computer that are
    gone (killed while they wrote) left under such names goes."""
    with suppress(OSError):
        for left in list(folder.iterdir()):
            process = _UNFINISHED.fullmatch(left.name)
            if process is None or _runs(int(process[1])):
                continue
            if left.is_dir():
                shutil.rmtree(left, ignore_errors=True)
            else:
                left.unlink(missing_ok=True)
    return folder / f".dynakin-{_HERE}-{os.getpid()}-{uuid.uuid4().hex[:8]}{suffix}"


def _runs(process: int) -> bool:
    """Whether there is such a process; true where asking would end it (Windows)."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # somebody else's
        return True
    return True


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a name beside a file to write to; on success that takes the place of the file, on failure it goes."""
    path = path.resolve()  # of a link, what it leads to
    made = unfinished(path.parent, path.suffix)
    try:
        yield made
        if path.is_file():
            made.chmod(path.stat().st_mode)
        made.replace(path)
    except OSError as error:
        error.filename = error.filename and str(path)  # the name that people know
        raise
    finally:
        made.unlink(missing_ok=True)


def write_text(path: Path, text: str, raises: type[DynakinError]) -> None:
    """A whole file, UTF-8, or what was there before.

    Raises:
        ``raises``: the file cannot be written.
    """
    try:
        with whole_file(path) as made:
            made.write_text(text, encoding="utf-8", newline="\n")
    except (OSError, RuntimeError) as error:
        raise raises(f"{path}: cannot be written ({getattr(error, 'strerror', None) or error})") from None


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Rows of the same columns; what is None or no finite number is a blank cell, numbers keep all their digits.

    Raises:
        OSError: the file cannot be written.
    """
    with whole_file(path) as made, made.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(with_nulls(dict(row)) for row in rows)


def write_json(path: Path, content: Any) -> None:
    """Plain data; a number that is not finite is null.

    Raises:
        OSError: the file cannot be written.
    """
    text = json.dumps(with_nulls(content), indent=2, ensure_ascii=False, allow_nan=False)
    with whole_file(path) as made:
        made.write_text(text + "\n", encoding="utf-8", newline="\n")
