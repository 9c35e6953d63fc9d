"""How noisy the markers of an OpenSim model are: by their name in the built-in sets, else by the body they sit on."""

from __future__ import annotations

from functools import cache

import numpy as np

from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.recordings.landmarks import plain_name

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
