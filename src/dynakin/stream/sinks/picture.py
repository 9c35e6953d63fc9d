"""What the viewer shows of a frame, as plain numbers: the same order at both ends."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.elements import element
from dynakin.filter.step import Labelled
from dynakin.model.schema import kinds_of
from dynakin.recordings.plates.pressure import pressed_at
from dynakin.recordings.pushes import LOADED_N
from dynakin.stream.sinks.base import LiveFrame, Started, Status
from dynakin.tree import Tree

_NAMES, _NAME = 4, 40  # of a list of names, so many are shown, and so many characters of each


class Picture:
    """Makes the numbers of a frame, ground frame, SI.

    Where estimates are late, the body is drawn as it is now, and time, coordinates and moments are those published.

    Blocks, in this order: time (1); joint centres (S, 3); measured and estimated markers (M, 3) each; arrows (A, 6),
    each a centre of pressure and a force, of the plates and, last, of the estimated total; coordinates, moments and the
    moments' standard deviations and the codes of their sources (C); constants (K).
    """

    def __init__(self, started: Started, plates: int) -> None:
        self.initial, self.model = started.initial, started.model
        spec, tree = self.initial.spec, self.initial.tree
        elements = [element(name) for name in self.initial.names]
        self._constants = [k for k, e in enumerate(elements) if e.kind == "length" or e[::2] == ("inertia", "mass")]
        joints, markers, axes = 3 * len(spec.segments), 3 * len(spec.markers), len(spec.coordinates)
        sizes = (1, joints, markers, markers, 6 * (plates + 1), axes, axes, axes, axes, len(self._constants))
        self.sizes = dict(zip(BLOCKS, sizes, strict=True))
        self._moment_sd = np.full(len(spec.coordinates), np.nan)
        self.setup: dict[str, Any] = {
            "model": spec.name,
            "sizes": self.sizes,
            "bones": [[parent, j] for j, parent in enumerate(tree.numbers) if parent >= 0],
            "ends": self._ends(tree),
            "coordinates": [c.name for c in spec.coordinates],
            "rotation": rotations(spec),
            "locked": [c.locked for c in spec.coordinates],
            "constants": [self.initial.names[k] for k in self._constants],
            "begin": [float(self.initial.x0[k]) for k in self._constants],
            "markers": list(self.initial.recorded_markers),
        }

    def numbers(self, frame: LiveFrame, deviations: Mapping[str, Labelled] | None) -> Array:
        """The frame's numbers, all blocks after one another; deviations keep their last values where None."""
        ground, estimate, late = self.initial.ground, frame.estimate, frame.published or frame.estimate
        body = _core.whole_body(self.model, np.ascontiguousarray(frame.state[None]))
        sample = frame.fused.sample.markers
        measured = np.stack([np.asarray(sample[name], float) for name in self.initial.recorded_markers])
        arrows = np.full((self.sizes["arrows"] // 6, 6), np.nan)
        if frame.fused.wrenches is not None:
            arrows[:-1] = [arrow(w) for w in ground.wrench_to_ground(frame.fused.wrenches)]
        arrows[-1] = arrow(estimate.values["wrench"])
        if deviations is not None:
            self._moment_sd = deviations["moments"].values
        parts = (
            [late.time_s],
            body["joint_centres"][0],
            ground.points_to_ground(measured),
            estimate.markers,
            arrows,
            late.coordinates,
            late.moments,
            self._moment_sd,
            late.moment_sources,
            frame.state[self._constants],
        )
        return np.concatenate([np.ravel(part) for part in parts])

    def _ends(self, tree: Tree) -> list[list[int]]:
        """(joint, marker): a segment without a further joint is drawn to its farthest marker."""
        centres = _core.whole_body(self.model, np.ascontiguousarray(self.initial.x0[None]))["joint_centres"][0]
        places = _core.marker_positions(self.model, np.ascontiguousarray(self.initial.x0))
        found = []
        for joint, segment in enumerate(tree.parents):
            own = [k for k, marker in enumerate(self.initial.spec.markers) if marker.segment == segment]
            if segment in tree.ends and own:
                far = np.linalg.norm(places[own] - centres[joint], axis=1)
                found.append([joint, own[int(np.argmax(far))]])
        return found


def status_text(status: Status) -> bytes:
    """A status as JSON of a bounded length (2 kB): of each list of names its count and the first few, shortened."""
    content = asdict(status)
    for key, value in content.items():
        if isinstance(value, tuple):
            content[key] = {"count": len(value), "first": [name[:_NAME] for name in value[:_NAMES]]}
    return json.dumps(content).encode()


def in_words(names: Mapping[str, Any]) -> str:
    """Names as `status_text` gives them: "a, b and 3 more", "none" without any."""
    more = names["count"] - len(names["first"])
    return (", ".join(names["first"]) or "none") + (f" and {more} more" if more else "")


def as_text(text: str) -> str:
    """Markdown that shows a text as it is: names come from files, and the page would take HTML, links and pictures of
    this machine's files from them."""
    return "".join(c if c.isalnum() or c == " " else f"&#{ord(c)};" if c.isprintable() else " " for c in text)


def rotations(spec: _core.ModelSpec) -> list[bool]:
    """Of each coordinate whether it turns."""
    kinds = kinds_of(spec.segments)
    return [kinds.get(c.name) != "translation" for c in spec.coordinates]


BLOCKS = (
    "time",
    "joints",
    "measured",
    "estimated",
    "arrows",
    "angles",
    "moments",
    "moment_sd",
    "moment_sources",
    "constants",
)


def split(numbers: Array, sizes: Mapping[str, int]) -> dict[str, Array]:
    """The blocks by name, flat."""
    ends = np.cumsum([sizes[name] for name in BLOCKS])
    return dict(zip(BLOCKS, np.split(numbers, ends[:-1]), strict=True))


def arrow(wrench: Array) -> Array:
    """Centre of pressure (3,) m on the ground's plane y = 0 and force (3,) N of a wrench (6,); NaN where unloaded."""
    if not np.isfinite(wrench).all() or wrench[1] < LOADED_N:
        return np.full(6, np.nan)
    x, z = pressed_at(wrench)
    return np.array([x, 0.0, z, *wrench[:3]])
