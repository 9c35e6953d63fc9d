"""The body as lines: segments between joint centres, and their colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.report.styles import SIDE_COLOURS, segment_colours, side_of
from dynakin.results.estimate import Estimate, tree_of
from dynakin.results.naming import words


@dataclass(frozen=True)
class Bone:
    """A line of a segment between two points of `Chain.points`."""

    start: int
    end: int
    segment: str


@dataclass(frozen=True, eq=False)
class Chain:
    """points (T, P, 3) m, ground frame: joint centres, then the ends of segments that carry no further joint."""

    points: np.ndarray
    bones: tuple[Bone, ...]


def segment_names(estimate: Estimate) -> list[str]:
    """Segments in the model's order: those of the joints, or, without joint centres, those of the parameters."""
    if "joint_segment" in estimate.data.coords:
        return [str(name) for name in estimate.data["joint_segment"].values]
    return list(dict.fromkeys(p.segment for p in estimate.parameters if p.kind in ("inertia", "marker")))


def colours_of(estimate: Estimate) -> dict[str, str]:
    """Colour of every segment that the estimate names."""
    parameters = [p.segment for p in estimate.parameters]
    return segment_colours(list(dict.fromkeys([*segment_names(estimate), *parameters])))


def painted(estimate: Estimate, chain: Chain) -> tuple[dict[str, str], dict[str, str]]:
    """Colour of each segment that is drawn or carries a marker, and the words of a key with theirs: in a plane each its
    own; in space its side's, because thirty segments in six colours say nothing."""
    segments = dict.fromkeys([*(bone.segment for bone in chain.bones), *estimate.marker_segments.values()])
    if estimate.planar:
        colours = colours_of(estimate)
        return colours, {words(bone.segment): colours[bone.segment] for bone in chain.bones}
    return (
        {name: SIDE_COLOURS[side_of(name)] for name in segments},
        {side or "middle": colour for side, colour in SIDE_COLOURS.items()},
    )


def chain_of(estimate: Estimate) -> Chain:
    """The chain of segments; without bones where the estimate holds no joint centres.

    A segment without a further joint is drawn to its farthest marker (a forearm to the wrist).
    """
    if "joint_centres" not in estimate.data:
        return Chain(np.zeros((len(estimate.time), 0, 3)), ())
    points = [*np.moveaxis(estimate.values("joint_centres"), 1, 0)]
    tree = tree_of(estimate.data)
    hung = zip(tree.numbers, tree.parents.values(), strict=True)
    bones = [Bone(p, j, parent) for j, (p, parent) in enumerate(hung) if p >= 0]
    markers = np.where(estimate.modelled_axes(), estimate.values("markers_estimated"), 0.0)
    known = ~estimate.lost  # the others are empty
    carriers = estimate.marker_segments
    for joint, segment in enumerate(tree.parents):
        own = [k for k, name in enumerate(estimate.marker_names) if carriers.get(name) == segment]
        if segment not in tree.ends or not own:
            continue
        far = np.linalg.norm(markers[known][:, own] - points[joint][known, None], axis=2).sum(axis=0)
        bones.append(Bone(joint, len(points), segment))
        points.append(markers[:, own[int(np.argmax(far))]])
    return Chain(np.stack(points, axis=1), tuple(bones))
