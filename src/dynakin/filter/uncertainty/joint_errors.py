"""A model whose joints may be misplaced and turned: each error is a coordinate that stands still, so that the core's
own derivatives say what it does to markers and moments ([derivations](derivations.md), section 17). Centres of mass of
its segments may be displaced too: their first moments are states."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.filter.uncertainty.upright import floats, thighs_of
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.pose_start import bare
from dynakin.model.inertia import INERTIA_NAMES
from dynakin.model.spec import free_coordinates, free_names

Kind = Literal[
    "hinge_centre",
    "hinge_across",
    "elbow_centre",
    "ball_centre",
    "spine_centre",
    "ball_across",
    "hinge_axes",
    "pair_axes",
    "ball_axes",
    "shoulder_axes",
    "root_frame",
    "frame_tilt",
    "root_origin",
]
"""The centre of a joint with one or two axes (hinge; elbow: what hangs on a limb of the trunk) off where it is on its
bones, and besides across its parent's sagittal plane (hinges of limbs); or with three (ball; the spine's) within that
plane and across it; its one axis, two or three turned on both bones, or those of what hangs on the trunk and bears
another joint; the root's frame turned in its bone, about its third axis (tilt, the trunk's as well) or another, or its
origin elsewhere in it."""
BALLS: tuple[Kind, ...] = ("ball_centre", "ball_across")
"""Centres of joints with three axes that are not the spine's."""
OF_FRAMES: tuple[Kind, ...] = ("root_frame", "frame_tilt", "root_origin")
"""What moves no marker beside its bone."""
Column = dict[str, float]

_AXES = np.eye(3)
_FIRST = ("mx", "my", "mz")
_TURNED: dict[int, Kind] = {1: "hinge_axes", 2: "pair_axes", 3: "ball_axes"}


@dataclass(frozen=True, eq=False)
class JointErrors:
    """Errors of a model's joints, as coordinates of a larger model.

    Attributes:
        model: the original's coordinates first, then those of the errors; of the rest first moments alone are states.
        free: (K,) places of the original's free coordinates among the larger model's.
        placed: (E,) places of the errors' coordinates among the same.
        sources: (E, S) how far each of these is moved by a unit of each source of error: m a m, rad a rad.
        kinds: (S,) what each source is. joints: (S,) the segment that hangs at its joint.
        first_moments: (3 B,) places in the state of first moments, three a segment. masses: (3 B,) kg, of the segments.
        massive: (B,) their names.
    """

    model: _core.Model
    free: npt.NDArray[np.intp]
    placed: npt.NDArray[np.intp]
    sources: Array
    kinds: tuple[Kind, ...]
    joints: tuple[str, ...]
    first_moments: npt.NDArray[np.intp]
    masses: Array
    massive: tuple[str, ...]

    @classmethod
    def of(
        cls,
        spec: _core.ModelSpec,
        reference: Array,
        held: Collection[str] = (),
        trunks: Collection[str] = (),
    ) -> JointErrors:
        """Those of a model.

        Args:
            reference: (C,) posture in which the bones were found: there a misplaced joint displaces no bone but its
                own.
            held: coordinates that are locked because no marker shows them: a hip stays a joint with three axes.
            trunks: as of `trunks_of`.
        """
        spec = bare(copy(spec))
        orientations = _orientations(spec, reference)
        larger, added = _with_errors(spec)
        found = _sources(spec, orientations, set(held), trunks)
        place = {name: k for k, name in enumerate(free_names(larger))}
        sources = np.array([[column.get(name, 0.0) for _, _, column in found] for name in added])
        model = _core.Model(larger)
        at = {name: k for k, name in enumerate(model.layout.names)}
        estimated = [segment for segment in larger.segments if any(segment.inertia_estimated)]
        return cls(
            model,
            np.array([place[c.name] for c in spec.coordinates if c.name in place], dtype=np.intp),
            np.array([place[name] for name in added], dtype=np.intp),
            sources.reshape(len(added), len(found)),
            tuple(kind for kind, _, _ in found),
            tuple(joint for _, joint, _ in found),
            np.array([at[f"inertia/{segment.name}/{name}"] for segment in estimated for name in _FIRST], dtype=np.intp),
            np.repeat([float(segment.inertia[0]) for segment in estimated], len(_FIRST)),
            tuple(segment.name for segment in estimated),
        )

    def hips_open_m(self, calibrated: CalibratedModel, sd: Mapping[str, float]) -> Array:
        """(S,) m, what deviations of lengths leave open of the centres of hips along each source; 0 of all others, and
        of hips that no regression from the pelvis has."""
        found = np.zeros(len(self.kinds))
        if calibrated.plan is None or calibrated.provenance.hips == "functional":
            return found
        for name in thighs_of(calibrated):
            own = [k for k, kind in enumerate(self.kinds) if self.joints[k] == name and kind in BALLS]
            terms = next(segment.lengths for segment in calibrated.spec.segments if segment.name == name)
            left = [sd.get(f"length/{term.parameter}", 0.0) * np.asarray(term.direction) for term in terms]
            found[own] = np.linalg.norm([np.zeros(3), *left], axis=0)[: len(own)]
        return found

    def state(self, q: Array, qd: Array, qdd: Array) -> Array:
        """(n,) of the larger model with its errors at 0.

        Args:
            q, qd, qdd: (K,) of the original's free coordinates.
        """
        x = np.array(self.model.initial_state())
        moving = x[: 3 * (len(self.free) + len(self.placed))].reshape(3, -1)
        moving[:] = 0.0
        moving[:, self.free] = q, qd, qdd
        return x


def _orientations(spec: _core.ModelSpec, reference: Array) -> dict[str, Array]:
    """R_GB of each segment in the reference posture."""
    model = _core.Model(spec)
    x = np.zeros(model.layout.size)
    free = free_coordinates(spec)
    x[: len(free)] = reference[free]
    return dict(zip(model.segment_names, _core.segment_poses(model, x)[0], strict=True))


def _turning(spec: _core.ModelSpec) -> dict[str, set[str]]:
    """Segment -> free rotations of its joint, without those that follow a joint before it (a patella's)."""
    free = set(free_names(spec))
    seen: set[str] = set()
    found = {}
    for segment in spec.segments:
        own = {axis.coordinate for axis in segment.axes if axis.kind == "rotation" and axis.coordinate in free}
        if own - seen:
            found[segment.name] = own
        seen |= own
    return found


def _with_errors(spec: _core.ModelSpec) -> tuple[_core.ModelSpec, list[str]]:
    """Each segment may be displaced in its parent; a joint's axes may be turned in the parent, and the segment behind
    them: three translations and three rotations before the joint, three rotations behind its own; of the root, whose
    origin may be elsewhere in its bone, three translations behind them."""
    joints, added = _turning(spec), []
    larger = copy(spec)
    segments, coordinates = larger.segments, larger.coordinates

    def errors(segment: str, place: str, kind: str) -> list[_core.AxisSpec]:
        names = _names(segment, place)
        added.extend(names)
        coordinates.extend(_core.CoordinateSpec(name) for name in names)
        return [_core.AxisSpec(name, kind, axis) for name, axis in zip(names, _AXES, strict=True)]

    for segment in segments:
        axes, name, inner = list(segment.axes), segment.name, segment.parent != "ground"
        if name in joints:
            last = max(k for k, axis in enumerate(axes) if axis.kind == "rotation")
            axes[last + 1 : last + 1] = errors(name, "behind", "rotation")
            axes[:0] = errors(name, "turned", "rotation") if inner else []
            axes += errors(name, "shifted", "translation") if not inner else []
        axes[:0] = errors(name, "moved", "translation") if inner else []
        segment.axes = axes
        segment.inertia_estimated = [bool(segment.inertia[0] > 0.0) and each in _FIRST for each in INERTIA_NAMES]
    larger.segments, larger.coordinates = segments, coordinates
    return larger, added


def _names(segment: str, place: str) -> list[str]:
    return [f"{segment}_{place}_{axis}" for axis in "xyz"]


def _sources(
    spec: _core.ModelSpec,
    orientations: dict[str, Array],
    held: set[str],
    trunks: Collection[str],
) -> list[tuple[Kind, str, Column]]:
    """Unit errors along the ground's axes in the reference posture, of balls' centres along their parent's, of
    frames about their own: kind, segment of the joint, and how they move the errors' coordinates."""
    planar = not all(spec.markers[0].measured)
    joints = _turning(spec)
    arms = {segment.name for segment in spec.segments if segment.parent in trunks}
    found: list[tuple[Kind, str, Column]] = []
    for segment in spec.segments:
        if segment.name not in joints:
            continue
        name, R_B = segment.name, orientations[segment.name]
        children = [child for child in spec.segments if child.parent == name]
        jointed = [child for child in children if child.name in joints]
        limb = any(axis.kind == "rotation" for child in children for axis in child.axes)
        if segment.parent == "ground":
            if not planar and floats(segment):
                kinds: tuple[Kind, ...] = ("root_frame", "root_frame", "frame_tilt")
                roots = [_frame_turned(name, R_B, jointed, e) for e in R_B.T]
                found += [(kind, name, column) for kind, column in zip(kinds, roots, strict=True)]
                found += [("root_origin", name, {axis: 1.0}) for axis in _names(name, "shifted")]
            continue
        R_J = orientations[segment.parent] @ segment.rotation
        own = {axis.coordinate for axis in segment.axes if axis.kind == "rotation"}
        axes = min(len(joints[name] | own & held), 3)
        directions = orientations[segment.parent].T if axes == 3 else _AXES
        for k, e in enumerate(directions[: 2 if planar else 3]):
            column = _moved(name, R_J, children, R_B, e)
            hinge: Kind = "elbow_centre" if segment.parent in arms else "hinge_centre"
            found.append((hinge if axes < 3 else _centre(k, name in trunks), name, column))
        if not planar:
            if axes < 3 and segment.parent not in arms:
                side = orientations[segment.parent].T[2]
                found.append(("hinge_across", name, _moved(name, R_J, children, R_B, side)))
            if name in trunks:
                found.append(("frame_tilt", name, _frame_turned(name, R_B, jointed, R_B.T[2])))
            both = [_along(name, "turned", R_J, e) | _along(name, "behind", R_B, -e) for e in _AXES]
            turned = "shoulder_axes" if segment.parent in trunks and limb else _TURNED[axes]
            found += [(turned, name, column) for column in both]
    return found


def _centre(direction: int, spine: bool) -> Kind:
    if direction == 2:
        return "ball_across"
    return "spine_centre" if spine else "ball_centre"


def _moved(name: str, R_J: Array, children: Sequence[_core.SegmentSpec], R_B: Array, e: Array) -> Column:
    """A joint moved by e: its segment goes with it, and what hangs on that stays where it is on the bones."""
    column = _along(name, "moved", R_J, e)
    for child in children:
        column |= _along(child.name, "moved", R_B @ child.rotation, -e)
    return column


def _frame_turned(name: str, R_B: Array, children: Sequence[_core.SegmentSpec], e: Array) -> Column:
    """A frame turned by e in its bone: seen from the frame, the bone with its markers and the centres of its
    joints is turned by -e; the axes of these joints stay with the frame."""
    column = _along(name, "behind", R_B, -e)
    for child in children:
        column |= _along(child.name, "turned", R_B @ child.rotation, e)
    return column


def _along(segment: str, place: str, R: Array, vector: Array) -> Column:
    """A vector of ground axes as displacements of three of the errors' coordinates whose axes are R's columns."""
    return dict(zip(_names(segment, place), (R.T @ vector).tolist(), strict=True))
