"""Estimates of recordings in memory, kept by what they depend on: arrays, settings, files of the model, source."""

from __future__ import annotations

import hashlib
import json
import pickle
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from withheld_judge import Found

from dynakin.errors import DynakinError
from dynakin.pipeline.stages import configure
from dynakin.recordings.recording import Recording
from dynakin.studies.engine.build import build
from dynakin.validation.case import case_of
from dynakin.validation.methods import estimate_each

KEPT_STEMS = ("moment", "foot_")
"""How the variables of an estimate begin that are kept."""


@dataclass(frozen=True, eq=False)
class Run:
    """What came of a recording: the estimate, or the line with which it was refused; the program's messages."""

    found: Found | None
    said: str
    messages: list[str]
    seconds: float


def kept_run(
    folder: Path, name: str, recording: Recording, static: Recording | None, settings: Mapping[str, Any]
) -> Run:
    """An estimate, or what was kept of it in ``folder``.

    Args:
        settings: keys of a configuration; ``model`` is a built-in one or a file.
    """
    digest = hashlib.sha256(build().encode() + json.dumps(dict(settings), sort_keys=True).encode())
    for each in (recording, static):
        if each is not None:
            digest.update(repr(each.marker_names).encode() + each.time.tobytes() + each.markers.tobytes())
            for plate in each.plates:
                digest.update(plate.name.encode() + plate.force.tobytes() + plate.moment.tobytes())
    model = Path(settings["model"])
    digest.update(model.read_bytes() if model.is_file() else b"")
    file = folder / f"{name.replace('/', '_').replace(' ', '_')}-{digest.hexdigest()[:12]}.pickle"
    if file.exists():
        kept = pickle.loads(file.read_bytes())
        assert isinstance(kept, Run)
        return kept
    start = time.perf_counter()
    made = _estimate(recording, static, settings)
    made = replace(made, seconds=time.perf_counter() - start)
    folder.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_bytes(pickle.dumps(made))
    part.replace(file)
    return made


def _estimate(recording: Recording, static: Recording | None, settings: Mapping[str, Any]) -> Run:
    asked = dict(settings) | ({} if static is None else {"static": static.path or static.name})
    config = configure(Path(recording.path or recording.name), asked, {"output": Path()})
    case = case_of(config, recording=recording, static=static)
    try:
        estimates, _, _ = estimate_each(case.recording, case.setup, static=case.static, keep_lost=True)
    except DynakinError as error:
        return Run(None, error.message, [], 0.0)
    (estimate,) = estimates.values()
    data = estimate.data[[name for name in estimate.data if str(name).startswith(KEPT_STEMS)]].load()
    return Run(Found(data, estimate.ground), "", list(map(str, estimate.messages)), 0.0)
