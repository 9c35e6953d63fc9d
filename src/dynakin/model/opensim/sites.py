"""Which of an OpenSim model's markers a recording has, under which names, and how noisy they are."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import cache

import numpy as np

from dynakin.errors import ModelError
from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.model.opensim.description import GROUND, Marker, OpenSimModel
from dynakin.recordings.landmarks import plain_name
from dynakin.recordings.recording import Recording
from dynakin.settings.strict import nearest

_FEWEST = 3


def sites(
    source: OpenSimModel, leave_out: Collection[str], recording: Recording
) -> tuple[list[tuple[Marker, str]], list[str]]:
    """Markers on bodies that are seen, each with its name in the recording, and sentences on the others.

    Raises:
        ModelError: fewer than three, or two recorded names that fit one marker.
    """
    where = recording.path or recording.name
    there = {marker.name: marker for marker in source.markers if marker.body != GROUND}
    for name in leave_out:
        if name not in there:
            raise ModelError(f"{source.path}: leave_out: no marker {name!r}{nearest(name, there)}")
    recorded: dict[str, list[str]] = {}
    for name in recording.seen_names:
        recorded.setdefault(plain_name(name), []).append(name)
    found: list[tuple[Marker, str]] = []
    for marker in there.values():
        names = recorded.get(plain_name(marker.name), [])
        if len(names) > 1:
            raise ModelError(f"{where}: {' and '.join(names)} both fit marker {marker.name} of {source.path}")
        if names and marker.name not in leave_out:
            found.append((marker, names[0]))
    if len(found) < _FEWEST:
        raise ModelError(
            f"{where}: {len(found)} of the {len(there)} markers of {source.path} are seen, expected {_FEWEST} or more; "
            f"the model has {', '.join(there) or 'none'}; the recording has {', '.join(recording.marker_names)}"
        )
    used = {name for _, name in found}
    lacking = [name for name in there if name not in {marker.name for marker, _ in found}]
    unknown = [name for name in recording.marker_names if name not in used]
    said = [f"{len(found)} markers of {source.path.name} are measured."]
    if lacking:
        said.append(f"Markers of the model that are not measured: {', '.join(lacking)}.")
    if unknown:
        said.append(f"Markers of the recording that the model does not have, left out: {', '.join(unknown)}.")
    return found, said


def with_mass(source: OpenSimModel, mass_kg: float) -> OpenSimModel:
    """The same model with all masses and inertias multiplied so that they sum to ``mass_kg``."""
    factor = mass_kg / source.mass
    bodies = tuple(
        replace(body, mass=factor * body.mass, inertia=tuple(factor * value for value in body.inertia))
        for body in source.bodies
    )
    return replace(source, bodies=bodies)


# Parts of a body's name, and the segment of the marker sets whose markers stand for it; the first that fits counts.
_SEGMENTS = (
    (("calc", "toe", "talus", "foot"), "foot"),
    (("tibia", "shank", "fibula"), "shank"),
    (("femur", "thigh", "patella"), "thigh"),
    (("pelvis", "sacrum"), "pelvis"),
    (("humer", "upper"), "upper_arm"),
    (("ulna", "radius", "hand", "forearm", "lower"), "forearm"),
)
_OTHERWISE = "trunk"

Skin = tuple[float, float]


def skin_of(marker: str, body: str) -> Skin:
    """R (m^2) and declared size (m) of the displacement of skin and flesh of a marker."""
    named, by_segment = _sets()
    found = named.get(plain_name(marker))
    if found is not None:
        return found
    low = body.casefold()
    segment = next((segment for words, segment in _SEGMENTS if any(word in low for word in words)), _OTHERWISE)
    return by_segment.get(segment) or by_segment["thigh"]


@cache
def _sets() -> tuple[dict[str, Skin], dict[str, Skin]]:
    """By the plain name of a marker, and the median of each segment."""
    named: dict[str, Skin] = {}
    segments: dict[str, list[Skin]] = {}
    for name in available_marker_sets():
        for marker in load_marker_set(name).markers:
            if marker.variance is None:
                continue
            skin = (float(marker.variance), marker.soft_tissue_m(planar=False))
            segments.setdefault(_part(marker.segment), []).append(skin)
            for alias in (*marker.right, *marker.left, *marker.centre):
                named.setdefault(plain_name(alias), skin)
    medians = {part: np.median(skins, axis=0) for part, skins in segments.items()}
    return named, {part: (float(m[0]), float(m[1])) for part, m in medians.items()}


def _part(segment: str) -> str:
    known = (*(name for _, name in _SEGMENTS), _OTHERWISE)
    return next((name for name in known if name in segment), _OTHERWISE)
