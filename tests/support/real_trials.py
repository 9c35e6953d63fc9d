"""The real recordings of a folder that can be read, each with the forces that belong to it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dynakin.errors import DynakinError
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording


def forces_of(trial: Path) -> Path | None:
    """The file of ground forces of a TRC, as these recordings name it."""
    stem = trial.stem.removeprefix("motion_capture_")
    names = (f"{trial.stem}_grf.mot", f"grf_{stem}.mot")
    return next((trial.with_name(name) for name in names if trial.with_name(name).exists()), None)


def real_trials(folder: Path) -> Iterator[Recording]:
    """Every recording that a reader takes."""
    for path in sorted([*folder.rglob("*.trc"), *folder.rglob("*.c3d")]):
        try:
            yield read(path, forces_of(path))
        except DynakinError:
            continue  # what is refused is another test's
