"""How far each marker moves on its segment, against what skin and flesh are known to do there."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from dynakin.arrays import rms
from dynakin.elements import element
from dynakin.recordings.landmarks import plain_name
from dynakin.results.estimate import AXES, Estimate
from dynakin.results.naming import words

# Published sizes are means over people at full squat; twice the size, measured from the marker's mean place, is more
# than skin explains.
EXCESS = 2.0
# The least size that is compared with, even if less is declared (0 mm for a toe on the floor): cameras have noise too.
FLOOR_MM = 3.0
_NAMED = 3


@dataclass(frozen=True)
class MarkerDisplacement:
    """Displacement of one marker on its segment over a window, mm; None where nothing is known.

    ``rms`` and ``largest`` are distances from the marker's mean place, ``offset`` that of its mean place from where it
    was put at the start; ``expected`` is the size of what skin does that ``source`` gives.
    """

    segment: str
    rms: float | None
    largest: float | None
    offset: float | None
    expected: float | None
    source: str

    def exceeds(self) -> bool:
        """Whether it moves more than soft tissue explains."""
        if self.largest is None or self.expected is None:
            return False
        return self.largest > EXCESS * max(self.expected, FLOOR_MM)


def displacements(estimate: Estimate, window: np.ndarray) -> dict[str, MarkerDisplacement]:
    """Displacement of each marker in use over the frames ``window`` (T,) bool in which it was measured.

    It is the movement of the marker's estimated place on its segment; with the paper's filter that also takes up what
    the model cannot explain. A filter with a state block ``soft_tissue`` (``soft_tissue/NAME/x``, m) has that added.
    What was declared to the filter is the variable ``soft_tissue_amplitude`` (marker,), m, of the estimate's data.
    """
    blocks = [state_paths(estimate, block) for block in ("marker", "soft_tissue")]
    initial = {p.name: p.initial for p in estimate.parameters}
    segments = estimate.marker_segments
    measured = estimate.values("markers_measured")
    seen = np.isfinite(measured[:, :, estimate.modelled_axes()]).all(axis=2)
    found = {}
    for k, (name, site) in enumerate(marker_sites(estimate)):
        frames, segment = window & seen[:, k], segments.get(site, "")
        paths = [1000.0 * sum(b[site][axis] for b in blocks if axis in b.get(site, {})) for axis in _axes(blocks, site)]
        size, source = _expected(estimate, k, name, segment)
        if not paths or not frames.any():
            found[name] = MarkerDisplacement(segment, None, None, None, size, source)
            continue
        moved = np.stack(paths, axis=1)[frames]
        distance = np.linalg.norm(moved - moved.mean(axis=0), axis=1)
        start = [1000.0 * initial.get(f"marker/{site}/{axis}", np.nan) for axis in _axes(blocks, site)]
        offset = float(np.linalg.norm(moved.mean(axis=0) - start))
        found[name] = MarkerDisplacement(
            segment,
            float(rms(distance)),
            float(distance.max()),
            offset if np.isfinite(offset) else None,
            size,
            source,
        )
    return found


def soft_tissue(estimate: Estimate, window: np.ndarray) -> dict[str, Any]:
    """The block ``soft_tissue`` of ``metrics.json``: each marker's displacement, and a sentence on those too far."""
    markers = {
        name: {
            "segment": d.segment,
            "rms_mm": d.rms,
            "max_mm": d.largest,
            "offset_mm": d.offset,
            "expected_mm": d.expected,
            "expected_by": d.source,
            "exceeds": d.exceeds(),
        }
        for name, d in displacements(estimate, window).items()
    }
    return {
        "what": "distance of each marker from its mean place on its segment over the window, mm, and the size "
        "that skin has there; offset_mm: its mean place from where it was put at the start",
        "markers": markers,
        "verdict": excess_in_words(markers),
    }


def excess_in_words(markers: Mapping[str, Mapping[str, Any]]) -> str:
    """One sentence on the markers of that block that move too far, the worst first; empty where all are within."""
    excess = [(name, m["max_mm"], m["expected_mm"], m["segment"]) for name, m in markers.items() if m["exceeds"]]
    if not excess:
        return ""
    worst = sorted(excess, key=lambda entry: entry[1] - entry[2], reverse=True)
    parts = [
        f"{name} moves {largest:.0f} mm on the {words(segment)} (usual {expected:.0f} mm)"
        for name, largest, expected, segment in worst[:_NAMED]
    ]
    more = f" and {len(worst) - _NAMED} more" if len(worst) > _NAMED else ""
    return f"{', '.join(parts)}{more}: more than soft tissue does, so the model does not fit there."


def marker_sites(estimate: Estimate) -> list[tuple[str, str]]:
    """Recorded name and name in the state of each marker, both in the model's order; the same where they differ in
    number (a filter that does not estimate every place)."""
    names = estimate.marker_names
    sites = list(estimate.marker_segments)
    if len(sites) == len(names):
        return list(zip(names, sites, strict=True))
    plain = {plain_name(site): site for site in sites}
    return [(name, plain.get(plain_name(name), name)) for name in names]


def _expected(estimate: Estimate, index: int, marker: str, segment: str) -> tuple[float | None, str]:
    """Size in mm and who says so: the published one, or what was declared to the filter where that is more. Less, as
    for the pelvis in space, says how little its markers should give way relative to others, not what skin does."""
    sizes = []
    if (published := published_amplitude_mm(marker, segment)) is not None:
        sizes.append((published[0], f"published: {published[1]}"))
    if "soft_tissue_amplitude" in estimate.data:
        own = 1000.0 * float(estimate.data["soft_tissue_amplitude"].values[index])
        sizes.append((own, "declared to the filter"))
    return max(sizes, key=lambda size: size[0], default=(None, "nothing declared"))


def _axes(blocks: list[dict[str, dict[str, np.ndarray]]], site: str) -> list[str]:
    return [axis for axis in AXES if any(axis in block.get(site, {}) for block in blocks)]


def state_paths(estimate: Estimate, block: str) -> dict[str, dict[str, np.ndarray]]:
    """Site -> axis -> (T,) m of the state's elements ``block/SITE/AXIS``."""
    state = estimate.values("state")
    paths: dict[str, dict[str, np.ndarray]] = {}
    for k, name in enumerate(str(name) for name in estimate.data["element"].values):
        kind, site, axis = element(name)
        if kind == block and axis in AXES:
            paths.setdefault(site, {})[axis] = state[:, k]
    return paths


# Segment -> regions of soft_tissue.toml by a pattern in the marker's plain name, and the region of its other markers.
_REGIONS: dict[str, tuple[dict[str, str], str]] = {
    "toes": ({}, "forefoot"),
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
