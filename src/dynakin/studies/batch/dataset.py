"""DATASET.toml: which subjects and trials there are, as one configuration a trial."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dynakin.errors import ConfigError
from dynakin.files import is_file
from dynakin.settings.presets import preset
from dynakin.settings.settings import RECORDED, Settings, named_beside, read_keys, with_named_files
from dynakin.settings.strict import nearest

# Keys of their own; all others are those of a run's configuration and hold for everything below them.
_OF_DATASET = ("subjects", "trials", "presets")
_OF_SUBJECT = ("name", "folder", "trials")
OF_A_TRIAL = ("trial", "forces", "output")  # by which the trials of one person differ
_NOT_HERE = ("trial", *RECORDED, "grid")
_PATTERN = "*.c3d"
# Subjects and trials name folders of the results.
_NO_FOLDER = re.compile(r"[/\\\x00-\x1f\x7f\ud800-\udfff]")
_LONGEST_NAME = 200  # bytes; file systems take 255, with what is put before it while results are written


@dataclass(frozen=True)
class Session:
    """One trial of one subject. content: the keys of its configuration, paths made whole."""

    subject: str
    trial: str
    content: dict[str, Any]

    @property
    def name(self) -> str:
        """As it is named in tables and messages."""
        return f"{self.subject}/{self.trial}"


@dataclass(frozen=True)
class Dataset:
    """What a dataset's file names. presets: to be compared; empty: each configuration's own."""

    path: Path
    output: Path
    presets: tuple[str, ...]
    sessions: tuple[Session, ...]


def read_dataset(path: Path, output: Path | None = None) -> Dataset:
    """Read a dataset's file: every key is checked; the files that it names are looked at when they are worked on.

    Args:
        output: folder of the results, instead of the one that the file names.

    Raises:
        ConfigError: the file cannot be read, a key is unknown, missing or wrong, no trial is found for a subject, or
            two trials of a subject have one name.
    """
    content = read_keys(path, paths=("output",))  # the others lie with subjects and trials
    entries = content.get("subjects")
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise ConfigError(f"{path}: no subjects, expected a table [[subjects]] for each")
    if output is not None:
        content["output"] = str(output)
    if not isinstance(content.get("output"), str):
        raise ConfigError(f'{path}: output is missing, expected output = "FOLDER"')
    common = _run_keys(content, _OF_DATASET, f"{path}")
    into = Path(common.pop("output"))
    sessions: list[Session] = []
    for number, entry in enumerate(entries, start=1):
        sessions += _sessions(path, number, entry, common, content.get("trials", _PATTERN), into)
    names = [session.name for session in sessions]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ConfigError(f"{path}: two trials are called {twice}, expected each name once (a trial may have a `name`)")
    presets = content.get("presets", [])
    if not isinstance(presets, list) or not all(isinstance(name, str) for name in presets):
        raise ConfigError(f"{path}: presets is {presets!r}, expected a list of names")
    presets = [named_beside(path, name) for name in presets]
    check_presets(presets, f"{path}: presets")
    for session in sessions:
        Settings.of(session.content, f"{path}: {session.name}")
    return Dataset(path, into, tuple(presets), tuple(sessions))


def copies(dataset: Dataset) -> dict[str, str]:
    """Trials that hold what an earlier one does, byte by byte, and are to be worked on alike; by name, the earlier one.
    A mean would count them twice."""
    found: dict[str, str] = {}
    first: dict[tuple[str, ...], str] = {}
    sizes = [tuple(file.stat().st_size for file in _recorded(session)) for session in dataset.sessions]
    for session, size in zip(dataset.sessions, sizes, strict=True):
        if not size or sizes.count(size) < 2:
            continue
        how = {key: value for key, value in session.content.items() if key not in OF_A_TRIAL}
        try:
            held = [hashlib.sha256(file.read_bytes()).hexdigest() for file in _recorded(session)]
        except OSError:  # said when it is read
            continue
        earlier = first.setdefault((repr(sorted(how.items())), *held), session.name)
        if earlier != session.name:
            found[session.name] = earlier
    return found


def _recorded(session: Session) -> list[Path]:
    named = [Path(str(session.content[key])) for key in ("trial", "forces") if key in session.content]
    return [file for file in named if is_file(file)]


def check_presets(names: Sequence[str], where: str) -> None:
    """
    Raises:
        ConfigError: there is no such preset; ``where`` opens the message.
    """
    for name in names:
        try:
            preset(name)
        except ConfigError as error:
            raise error.reworded(f"{where}: {error.message}") from None


def _run_keys(content: dict[str, Any], own: tuple[str, ...], where: str) -> dict[str, Any]:
    """Those keys that a run's configuration has."""
    known = [key for key in Settings.model_fields if key not in _NOT_HERE]
    for key in content:
        if key not in own and key not in known:
            expected = ", ".join((*own, *known))
            raise ConfigError(f"{where}: unknown key {key!r}{nearest(key, [*own, *known])}; expected keys: {expected}")
    return {key: value for key, value in content.items() if key not in own}


def _sessions(
    path: Path, number: int, entry: dict[str, Any], common: dict[str, Any], pattern: Any, output: Path
) -> list[Session]:
    name = entry.get("name")
    if not isinstance(name, str):
        raise ConfigError(f"{path}: subject {number} has no name, expected a text without /")
    _check_name(f"{path}: subject {number}: name", name)
    where = f"{path}: subject {name!r}"
    keys = common | with_named_files(_run_keys(entry, _OF_SUBJECT, where), path)
    folder = path.parent / str(entry.get("folder", name))
    trials = entry.get("trials", pattern)
    if isinstance(trials, str):
        static = folder / str(keys["static"]) if "static" in keys else None
        files = [file for file in _matching(folder, trials, f"{where}: trials") if file != static]
        if not files:
            raise ConfigError(f"{where}: no file {trials} in {folder}, expected at least one trial")
        # trials in folders of their own are called by these
        inner = ["_".join(file.parent.relative_to(folder).parts) for file in files]
        alike = len({file.name for file in files}) < len(files)
        trials = [
            {"trial": str(file.relative_to(folder)), "name": (alike and where_in) or file.stem}
            for file, where_in in zip(files, inner, strict=True)
        ]
    if not isinstance(trials, list) or not all(isinstance(t, dict) and isinstance(t.get("trial"), str) for t in trials):
        raise ConfigError(f'{where}: trials, expected a pattern such as "*.c3d" or tables with `trial`')
    return [_session(where, name, folder, with_named_files(trial, path), keys, output) for trial in trials]


def _matching(folder: Path, pattern: str, where: str) -> list[Path]:
    """Files of a subject's folder, sorted; ``where`` names the key.

    Raises:
        ConfigError: a pattern that is none, or begins at the root.
    """
    if not pattern or Path(pattern).is_absolute():
        raise ConfigError(f'{where} is {pattern!r}, expected a pattern inside {folder}, such as "*.c3d"')
    try:
        return sorted(file for file in folder.glob(pattern) if is_file(file))
    except (OSError, ValueError, NotImplementedError, RuntimeError) as error:
        raise ConfigError(f'{where} is {pattern!r} ({error}), expected a pattern such as "*.c3d"') from None


def _check_name(where: str, name: str) -> None:
    """
    Raises:
        ConfigError: a name that is no folder's inside another: results would be written elsewhere, or nowhere.
    """
    if not name.strip() or name in (".", "..") or _NO_FOLDER.search(name) or len(name.encode()) > _LONGEST_NAME:
        raise ConfigError(
            f"{where} is {name!r}, expected the name of a folder for results: text without / and \\, not . or .., "
            f"of at most {_LONGEST_NAME} bytes"
        )


def _session(
    where: str, subject: str, folder: Path, entry: dict[str, Any], keys: dict[str, Any], output: Path
) -> Session:
    entry_file = entry.pop("trial")
    file = folder / entry_file
    name = str(entry.pop("name", file.stem))
    _check_name(f"{where}, trial {entry_file!r}: name", name)
    content = keys | _run_keys(entry, (), f"{where}, trial {name!r}")
    if "forces" in content:  # in the trial's folder; {trial} stands for its name
        content["forces"] = str(file.parent / str(content["forces"]).replace("{trial}", file.stem))
    for key in ("static", "parameters"):
        if key in content:
            content[key] = str(folder / str(content[key]))
    return Session(subject, name, content | {"trial": str(file), "output": str(output / subject / name)})
