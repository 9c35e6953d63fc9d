"""How far skin and flesh move over the bone, by marker: the published sizes, looked up by segment and marker name."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from importlib import resources

from dynakin.recordings.landmarks import plain_name

# Segment -> regions of soft_tissue.toml by a pattern in the marker's plain name, and the region of its other markers.
_REGIONS: dict[str, tuple[dict[str, str], str]] = {
    "foot": ({"toe": "toe", "hee": "heel", "calc": "heel"}, "forefoot"),
    "shank": ({"(?<!sh)ank": "ankle", "mal": "ankle"}, "shank"),
    "thigh": ({"kne": "knee"}, "thigh"),
    "pelvis": ({}, "pelvis"),
    "abdomen": ({}, "trunk"),
    "thorax": ({"sho": "shoulder", "acr": "shoulder"}, "trunk"),
    "trunk": ({"sho": "shoulder", "acr": "shoulder"}, "trunk"),
    "torso": ({"sho": "shoulder", "acr": "shoulder"}, "trunk"),
    "head": ({}, "head"),
    "upper_arm": ({}, "arm"),
    "forearm": ({}, "forearm"),
}


def published_amplitude_mm(marker: str, segment: str) -> tuple[float, str] | None:
    """Size of the displacement at full squat and its region, from the list that the simulator draws from.

    The region is found by the marker's name on its segment (ankle, knee, heel, ...), else it is the segment's; None
    for a segment that the list does not know.
    """
    part = next((part for part in _REGIONS if part in segment), None)
    if part is None:
        return None
    named, otherwise = _REGIONS[part]
    plain = plain_name(marker)
    region = next((region for pattern, region in named.items() if re.search(pattern, plain)), otherwise)
    return _sizes()[region], region


@cache
def _sizes() -> dict[str, float]:
    # The list is data: the simulator's code is not imported.
    text = (resources.files("dynakin.results.measures") / "soft_tissue.toml").read_text(encoding="utf-8")
    return {region: float(row["amplitude_mm"]) for region, row in tomllib.loads(text).items()}
