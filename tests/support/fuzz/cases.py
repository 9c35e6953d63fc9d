"""One case: a mutated file, read as dynakin reads it, and whether what came of it is clean."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from dynakin.errors import DynakinError
from dynakin.model.definition import load_model
from dynakin.model.identified import read_constants, read_identified
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.model.markers.recognise import foot_markers_of
from dynakin.model.table import load_table
from dynakin.recordings.checks import check_plates
from dynakin.recordings.formats.c3d import read_c3d_results
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.read import read
from dynakin.recordings.recording import Plate, Recording
from dynakin.settings import presets
from dynakin.settings.settings import Settings, read_keys
from dynakin.studies.batch.dataset import read_dataset
from support.fuzz.mutate import mutated_c3d, mutated_text

KINDS = ("text", "c3d")


class Unclean(Exception):
    """A result that holds something that no result may, or an error that is no clear line."""


def run_case(kind: str, seed: int, corpus: Path, work: Path) -> str:
    """Mutate a file of the corpus by a seed and read it: "error" (one clear line) or "result" (a clean one).

    Raises:
        Unclean, or whatever a reader let through.
    """
    rng = random.Random(f"{kind} {seed}")
    files = sorted(corpus.iterdir())
    chosen = [path for path in files if (path.suffix == ".c3d") == (kind == "c3d")]
    source = rng.choice(_fairly(chosen, rng))
    other = rng.choice([path for path in chosen if path.suffix == source.suffix])
    change = mutated_c3d if kind == "c3d" else mutated_text
    damaged = work / f"damaged{source.suffix}"
    damaged.write_bytes(change(source.read_bytes(), other.read_bytes(), rng))
    what = source.name.split("_")[0]
    try:
        found = READERS[what](damaged, corpus)
    except DynakinError as error:
        _check_error(error)
        return "error"
    _check_result(found, what)
    return "result"


def _fairly(files: list[Path], rng: random.Random) -> list[Path]:
    """The files of one kind, each kind as likely as another."""
    kinds = sorted({path.name.split("_")[0] for path in files})
    kind = rng.choice(kinds)
    return [path for path in files if path.name.startswith(f"{kind}_")]


def _recording(path: Path, corpus: Path) -> Recording:
    recording = read(path)
    try:
        ground = find_ground_frame(recording)
        check_plates(recording, ground, None, foot_markers_of(recording))
    except DynakinError as error:  # markers that make no person are no fault of the file
        _check_error(error)
    return recording


def _c3d(path: Path, corpus: Path) -> Recording:
    recording = _recording(path, corpus)
    for label, values in read_c3d_results(path).items():
        if values.shape != (recording.n_frames, 3):
            raise Unclean(f"{label} has shape {values.shape}")
    return recording


def _with_forces(path: Path, corpus: Path) -> Recording:
    return read(corpus / "markers_squat.trc", path)


def _study(path: Path, corpus: Path) -> Any:
    dataset = read_dataset(path)
    for session in dataset.sessions:
        if dataset.output.resolve() not in Path(session.content["output"]).resolve().parents:
            raise Unclean(f"{session.name} is written to {session.content['output']}")
    return [Settings.of(session.content, session.name) for session in dataset.sessions]


READERS: Mapping[str, Callable[[Path, Path], Any]] = {
    "markers": _recording,
    "c3d": _c3d,
    "forces": _with_forces,
    "model": lambda path, _: load_model(path),
    "osim": lambda path, _: load_model(path),
    "set": lambda path, _: load_marker_set(path),
    "table": lambda path, _: load_table(path, None),
    "preset": lambda path, _: presets.preset(str(path)),
    "config": lambda path, _: Settings.of(read_keys(path), str(path)),
    "study": _study,
    "subject": lambda path, _: read_identified(path),
    "known": lambda path, _: read_constants(path),
}


def _check_error(error: DynakinError) -> None:
    text = str(error)
    if not text.isprintable() or not text or len(text) > 1100:
        raise Unclean(f"no clear line of {len(text)} characters: {text[:200]!r}")
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, MemoryError) or "bad_alloc" in str(cause):
            raise Unclean(f"memory ran out: {text[:200]}")
        cause = cause.__cause__ or cause.__context__


def _check_result(found: Any, what: str) -> None:
    if isinstance(found, Recording):
        if not (np.isfinite(found.time).all() and (np.diff(found.time) > 0).all()):
            raise Unclean("times that do not increase")
        for array in (found.markers, *(a for plate in found.plates for a in _arrays(plate))):
            if np.isinf(array).any():
                raise Unclean("an infinite number in a recording")
        for channel in found.analog:
            if np.isinf(channel.values).any() or not np.isfinite([channel.start_s, channel.rate_hz]).all():
                raise Unclean(f"an infinite number in analog channel {channel.name}")
        if not np.isfinite([*(event.time_s for event in found.events), *found.subject.values()]).all():
            raise Unclean("an infinite number in events or measures of the person")
        if not "".join(map(str, found.notes)).isprintable():
            raise Unclean("notes that cannot be printed")
        found.window(float(found.time[0]), float(found.time[-1]))
    else:
        _check_numbers(found, what, 0)


def _arrays(plate: Plate) -> list[np.ndarray]:
    return [plate.force, plate.moment, plate.cop, plate.free_moment]


def _check_numbers(value: Any, where: str, depth: int) -> None:
    """Every number in nested records is finite (a missing one, NaN, is none; limits may be infinite)."""
    if isinstance(value, float | np.ndarray):
        if not np.isfinite(value).all() and "range" not in where and "limit" not in where:
            raise Unclean(f"{where} is {value}")
    elif isinstance(value, BaseModel):
        for name in type(value).model_fields:
            _check_numbers(getattr(value, name), f"{where}.{name}", depth + 1)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            _check_numbers(getattr(value, field.name), f"{where}.{field.name}", depth + 1)
    elif isinstance(value, Mapping):
        for key, entry in value.items():
            _check_numbers(entry, f"{where}.{key}", depth + 1)
    elif isinstance(value, tuple | list):
        for entry in value:
            _check_numbers(entry, where, depth + 1)
