"""Where results go: a folder that is replaced as a whole, and never one that is not ours."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from dynakin.errors import OutputError
from dynakin.files import expanded, is_text, unfinished

OUTPUT_FILES = (
    "coordinates.mot",
    "speeds.sto",
    "accelerations.sto",
    "moments.sto",
    "moments_source.sto",
    "markers.trc",
    "wrench.sto",
    "uncertainty.sto",
    "powers.sto",
    "centre_of_pressure.sto",
    "repetitions.csv",
    "parameters.json",
    "metrics.json",
    "estimate.nc",
    "config.toml",
    "report.html",
)
OPTIONAL_FILES = (
    "centre_of_mass.sto",
    "joint_reactions.sto",
    "joint_reactions_source.sto",
    "feet.sto",
    "feet_source.sto",
    "angles.sto",
    "failures.log",
)
"""Written where an estimate holds what they are made of, where they were asked for, or where something failed."""


@dataclass(frozen=True)
class FolderKind:
    """What a folder of one kind may hold: with anything else in it, it is the user's, not ours."""

    files: tuple[str, ...]
    mark: str
    """The file by which the kind is known."""
    what: str


RESULTS = FolderKind(OUTPUT_FILES + OPTIONAL_FILES, "metrics.json", "output folder of dynakin")
# Left by file managers in any folder that somebody has looked at.
_IGNORED = {".DS_Store", "Thumbs.db", "desktop.ini"}


def check_output_writable(folder: str | Path, *, kind: FolderKind = RESULTS, overwrite: bool = True) -> Path:
    """Make sure, before anything long is computed, that results can be written to ``folder``.

    Creates nothing that stays.

    Raises:
        OutputError: a file is in the way, the place cannot be written, or the folder holds something that dynakin
            did not write (or, with ``overwrite`` false, anything at all).
    """
    folder = _named(folder)
    try:
        _check_replaceable(folder, kind, overwrite)
    except OSError as error:
        raise OutputError(f"{folder}: cannot write results there ({error.strerror or error})") from error
    _check_takes_files(folder, _target(folder).parent)
    return folder


def check_folder_writable(folder: str | Path) -> Path:
    """The same for files that are added to ``folder``, which may hold others.

    Raises:
        OutputError: it is a file, or cannot be written.
    """
    folder = _named(folder)
    _check_takes_files(folder, folder.absolute())
    return folder


def _named(folder: str | Path) -> Path:
    if "\0" in str(folder) or not is_text(str(folder)):
        raise OutputError(f"{folder}: cannot write results there, its name is no text")
    return expanded(folder)


def _target(folder: Path) -> Path:
    """Where a folder lies: of a link, what it leads to."""
    try:
        return folder.resolve()
    except (OSError, RuntimeError) as error:  # a link that leads to itself
        raise OutputError(f"{folder}: cannot write results there ({error})") from None


def _check_takes_files(folder: Path, place: Path) -> None:
    """Whether the nearest folder that exists, from ``place`` upwards, can be written."""
    try:
        ancestor = _nearest_existing(place)
        if not ancestor.is_dir():
            raise OutputError(f"{folder}: cannot write there, {ancestor} is a file and a folder was expected")
        with tempfile.TemporaryDirectory(prefix=".dynakin-", dir=ancestor):
            pass
    except OSError as error:
        raise OutputError(f"{folder}: cannot write results there ({error.strerror or error})") from error


@contextmanager
def replacing(folder: Path, *, kind: FolderKind = RESULTS, overwrite: bool = True) -> Iterator[Path]:
    """Give a temporary sibling folder to fill; on success it takes the place of ``folder``, on failure it goes."""
    folder = check_output_writable(folder, kind=kind, overwrite=overwrite)
    target = _target(folder)
    made: Path | None = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        made = unfinished(target.parent)
        made.mkdir()
        made.chmod(0o755)  # results are ordinary files
        yield made
        _swap(made, target)
        made = None
    except OSError as error:
        raise OutputError(f"{folder}: cannot write results there ({error.strerror or error})") from error
    finally:
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)


def _swap(made: Path, folder: Path) -> None:
    if not folder.exists():
        made.rename(folder)
        return
    old = Path(tempfile.mkdtemp(prefix=".dynakin-old-", dir=folder.parent)) / folder.name
    try:
        folder.rename(old)
        try:
            made.rename(folder)
        except OSError:
            old.rename(folder)  # put back what was there
            raise
    finally:
        shutil.rmtree(old.parent, ignore_errors=True)


def _check_replaceable(folder: Path, kind: FolderKind, overwrite: bool) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise OutputError(f"{folder}: is a file, a folder for the results was expected")
    names = sorted(entry.name for entry in folder.iterdir() if entry.name not in _IGNORED)
    if not names:
        return
    foreign = [name for name in names if name not in kind.files]
    if foreign or kind.mark not in names:
        what = foreign[0] if foreign else names[0]
        raise OutputError(f"{folder}: is no {kind.what} (it holds {what}); name a new folder or an empty one")
    if not overwrite:
        raise OutputError(f"{folder}: already holds results and overwriting was not asked for")


def _nearest_existing(path: Path) -> Path:
    while not path.exists() and path != path.parent:
        path = path.parent
    return path
