"""The body as lines and an arrow: segments between joint centres, and the ground reaction where it acts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynakin.elements import element
from dynakin.report.colours import segment_colours
from dynakin.results.estimate import Estimate

# Below this share of the largest vertical force the point of action is noise, and no arrow is drawn.
_LOADED = 0.05


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


def marker_segments(estimate: Estimate) -> dict[str, str]:
    """Marker -> the segment that carries it, where the marker's place is estimated."""
    return {element(p.name).owner: p.segment for p in estimate.parameters if p.kind == "marker"}


def segment_names(estimate: Estimate) -> list[str]:
    """Segments in the model's order: those of the joints, or, without joint centres, those of the parameters."""
    if "joint_segment" in estimate.data.coords:
        return [str(name) for name in estimate.data["joint_segment"].values]
    return list(dict.fromkeys(p.segment for p in estimate.parameters if p.kind in ("inertia", "marker")))


def colours_of(estimate: Estimate) -> dict[str, str]:
    """Colour of every segment that the estimate names."""
    parameters = [p.segment for p in estimate.parameters]
    return segment_colours(list(dict.fromkeys([*segment_names(estimate), *parameters])))


def chain_of(estimate: Estimate) -> Chain:
    """The chain of segments; without bones where the estimate holds no joint centres.

    A segment without a further joint is drawn to its farthest marker (a forearm to the wrist).
    """
    if "joint_centres" not in estimate.data:
        return Chain(np.zeros((len(estimate.time), 0, 3)), ())
    data = estimate.data
    points = [*np.moveaxis(data["joint_centres"].transpose("joint", "time", "axis").values, 0, 0)]
    parents = [int(parent) for parent in data["joint_parent"].values]
    segments = [str(name) for name in data["joint_segment"].values]
    bones = [Bone(p, j, segments[p]) for j, p in enumerate(parents) if p >= 0]
    markers = np.nan_to_num(data["markers_estimated"].transpose("time", "marker", "axis").values)
    carriers = marker_segments(estimate)
    for joint, segment in enumerate(segments):
        own = [k for k, name in enumerate(estimate.marker_names) if carriers.get(name) == segment]
        if joint in parents or not own:
            continue
        far = np.linalg.norm(markers[:, own] - points[joint][:, None], axis=2).mean(axis=0)
        bones.append(Bone(joint, len(points), segment))
        points.append(markers[:, own[int(np.argmax(far))]])
    return Chain(np.stack(points, axis=1), tuple(bones))


def floor_height(estimate: Estimate) -> float:
    """Height of the plates' surface in the ground frame, m; that of the ground's origin where no plate tells."""
    heights = [estimate.ground.points_to_ground(plate.cop)[:, 1] for plate in estimate.recording.plates]
    every = np.concatenate(heights) if heights else np.zeros(0)
    every = every[np.isfinite(every)]
    return float(np.median(every)) if len(every) else 0.0


def reaction(wrench: np.ndarray, floor: float) -> tuple[np.ndarray, np.ndarray]:
    """Where the ground reaction acts on the floor and how large it is, in the sagittal plane.

    Args:
        wrench: (T, 6) N, N m about the ground's origin; m_z = x f_y - y f_x gives x on the floor y.
        floor: m.

    Returns:
        points (T, 2) m and forces (T, 2) N; NaN where the foot is not loaded or the wrench not known.
    """
    fx, fy, mz = wrench[:, 0], wrench[:, 1], wrench[:, 5]
    known = np.isfinite(fx) & np.isfinite(fy) & np.isfinite(mz)
    largest = float(np.max(fy[known], initial=0.0))
    loaded = known & (fy > _LOADED * largest)
    point, force = np.full((len(wrench), 2), np.nan), np.full((len(wrench), 2), np.nan)
    point[loaded] = np.column_stack([(mz + floor * fx)[loaded] / fy[loaded], np.full(loaded.sum(), floor)])
    force[loaded] = np.column_stack([fx[loaded], fy[loaded]])
    return point, force
