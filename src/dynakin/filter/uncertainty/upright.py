"""The upright posture of a model, its trunk and thighs, and what follows the joints' angles out of it: skin and
centres that roll."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.joint_motion import SKIN_ANGLE_RAD
from dynakin.model.spec import free_coordinates, free_names

ABOUT = 0.7
"""Part of an axis that points somewhere from which on it turns about that."""


def floats(segment: _core.SegmentSpec) -> bool:
    """Whether a segment moves freely in the laboratory."""
    return bool(segment.parent == "ground" and len({axis.coordinate for axis in segment.axes}) == 6)


def axes_of_root(spec: _core.ModelSpec) -> list[_core.AxisSpec]:
    """Of the segments that float."""
    return [axis for segment in spec.segments if floats(segment) for axis in segment.axes]


def trunks_of(calibrated: CalibratedModel) -> set[str]:
    """Segments that hang on one that floats, and that no foot hangs on."""
    return _on_root(calibrated) - {*calibrated.tree.up(*calibrated.feet.values())}


def thighs_of(calibrated: CalibratedModel) -> set[str]:
    """Segments that hang on one that floats, and that a foot hangs on."""
    return _on_root(calibrated) & {*calibrated.tree.up(*calibrated.feet.values())}


def _on_root(calibrated: CalibratedModel) -> set[str]:
    roots = {segment.name for segment in calibrated.spec.segments if floats(segment)}
    return {segment.name for segment in calibrated.spec.segments if segment.parent in roots}


class Turned(NamedTuple):
    """How far a hip turns about its mean, rad, root mean square.

    Attributes:
        in_all: about all axes together: what shows its centre within the pelvis' sagittal plane.
        across: in adduction, beyond what follows flexion of hip and knee: seen from the thigh a centre that lies
            farther out moves as it is adducted, and skin that follows flexion moves as that does. How a thigh turns
            about its own length would show it as well, but is half skin.
    """

    in_all: float
    across: float


def hips_turned(calibrated: CalibratedModel, states: Array) -> dict[str, Turned]:
    """Thigh -> how far its hip turns. Each leg by itself: of who stands on one and kicks with the other one hip shows
    nothing of its centre. Empty where there are no hips or no frames.

    Args:
        states: (T, n), or their free coordinates alone (T, K): without the lengths that place hips, which angles go
            along with as these are learned.
    """
    spec = calibrated.spec
    place = {name: k for k, name in enumerate(calibrated.names[: states.shape[1]])}
    free = place.keys() & set(free_names(spec))
    states = states[np.isfinite(states).all(axis=1)]
    found = {}
    for segment in spec.segments if len(states) else ():
        own = [axis for axis in segment.axes if axis.kind == "rotation" and axis.coordinate in free]
        if not own or segment.name not in thighs_of(calibrated):
            continue
        flexing, out_of_it = ([axis for axis in own if abs(axis.direction[k]) > ABOUT] for k in (2, 0))
        below = [axis for child in spec.segments if child.parent == segment.name for axis in child.axes]
        flexing += [axis for axis in below if axis.kind == "rotation" and axis.coordinate in free]
        whole, bent, out = (
            states[:, sorted({place[axis.coordinate] for axis in axes})] for axes in (own, flexing, out_of_it)
        )
        lengths = [f"length/{term.parameter}" for term in segment.lengths]
        learned = states[:, [place[name] for name in lengths if name in place]]
        follows = np.column_stack([np.ones(len(states)), np.tanh(bent / SKIN_ANGLE_RAD), learned])
        beyond = out - follows @ np.linalg.lstsq(follows, out, rcond=None)[0]
        found[segment.name] = Turned(*(float(np.sqrt(values.var(axis=0).sum())) for values in (whole, beyond)))
    return found


def neutral(calibrated: CalibratedModel) -> Array:
    """(C,) upright posture: free coordinates 0, or as near to it as their bounds allow. As the person starts are the
    heading, because a pelvis' tilt and list are about axes of the laboratory, and what hangs on the trunk: arms stand
    in no posture of all angles 0 (palms lie a quarter turn and more from it), and markers are put on arms that hang."""
    spec = calibrated.spec
    q = np.array([c.value for c in spec.coordinates], dtype=float)
    free = free_coordinates(spec)
    K = len(free)
    q[free] = np.clip(0.0, calibrated.lower[:K], calibrated.upper[:K])
    turns = {axis.coordinate for axis in axes_of_root(spec) if axis.kind == "rotation" and axis.direction[1]}
    above = calibrated.tree.below(*trunks_of(calibrated))
    for segment in spec.segments:
        if segment.name in above:
            turns |= {axis.coordinate for axis in segment.axes}
    for k, place in enumerate(free):
        if spec.coordinates[place].name in turns:
            q[place] = calibrated.x0[k]
    return q


def followed(q: Array, calibrated: CalibratedModel) -> Array:
    """What skin follows of the free coordinates (..., K): it saturates, and is 0 upright."""
    free = free_coordinates(calibrated.spec)
    return np.asarray(np.tanh((q - neutral(calibrated)[free]) / SKIN_ANGLE_RAD))


def rolls(spec: _core.ModelSpec) -> list[str]:
    """Lengths by which the centre of a joint moves with its angle, as elements of the state."""
    axes = [axis for segment in spec.segments for axis in segment.axes]
    return [f"length/{scale}" for scale in dict.fromkeys(axis.scale for axis in axes if _rolls(axis))]


def _rolls(axis: _core.AxisSpec) -> bool:
    return bool(axis.kind == "translation" and axis.coordinate and axis.scale)


def rolling_more(spec: _core.ModelSpec) -> _core.ModelSpec:
    """A copy in which these centres move as much more as the joint is bent more: ``rolls`` are a rad of the angle."""
    spec = copy(spec)
    segments = spec.segments
    for segment in segments:
        axes = segment.axes
        for axis in axes:
            if _rolls(axis):
                axis.coefficients = [0.0, *axis.coefficients]
        segment.axes = axes
    spec.segments = segments
    return spec


def drives(spec: _core.ModelSpec, free: npt.NDArray[np.intp]) -> Array:
    """(S, K) 1 where a free rotation moves a segment's skin: those of its own joint and of the joints that hang on it,
    but for the root's, which turn the whole body."""
    place = {spec.coordinates[k].name: i for i, k in enumerate(free)}
    index = {segment.name: k for k, segment in enumerate(spec.segments)}
    found = np.zeros((len(index), len(place)))
    for segment in spec.segments:
        if floats(segment):
            continue
        for axis in segment.axes:
            if axis.kind == "rotation" and axis.coordinate in place:
                found[index[segment.name], place[axis.coordinate]] = 1.0
                if segment.parent in index:
                    found[index[segment.parent], place[axis.coordinate]] = 1.0
    return found
