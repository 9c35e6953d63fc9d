"""Coordinates that a model's file locks and that the person moves: the markers on both sides show it, and the
deviations that are reported hold it.

A joint that is locked does not keep its two segments' markers from moving against each other: the filter puts that into
skin, and into the joints beside. With the coordinate free the same markers say how far it moves, and what of the other
angles that was ([derivations](derivations.md), section 17).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_solve

from dynakin.arrays import Array, rms
from dynakin.bindings import _core
from dynakin.filter.uncertainty.frames import wrenches_of
from dynakin.filter.uncertainty.geometry import BLOCKS, normal_factor
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.filter.uncertainty.upright import axes_of_root
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.spec import free_coordinates
from dynakin.recordings.times import step_of
from dynakin.results.estimate import values_of
from dynakin.results.naming import listed, words
from dynakin.results.records import REFUSED

if TYPE_CHECKING:
    import xarray as xr


OF_SKIN = 0.5
"""Part of the declared size of skin that moves a segment's markers against its neighbour's where nothing is locked:
turns that no knee of the model has looked as large as 0.1 to 0.2 of it gives on `truth3d`'s walks 1, 2, as 0.3 to 0.6
on the OpenCap walk and squats. Subtalar joints, hips' rotations and trunks that a file locks: 1.0 to 2.2 (walk 2)."""
MATTERS = 1.0
"""What an angle or a moment is off by locked coordinates, over the deviation that is reported without that (RMS, the
worst), from which on it is a warning: the rest is then less than what it is said to be wrong by."""
PLACED_M, HELD_OFF, HELD_FRAMES = 0.005, 2.5, 50
"""How well a file's places of markers are known at least, and how many times more than that leaves open a coordinate is
found, on average over so many frames, from where the file holds it: 2.7 to 3.8 of locked subtalar joints of a squat
(10 deg off in truth) and of a trunk (6 deg off), 0.3 of right ones (`truth3d`)."""
WINDOW_S = 0.15
"""Over which motion is smoothed and its size is taken: a step of a walk takes half a second."""
_LEAST_SKIN_M = 0.001


class Motion(NamedTuple):
    """What the markers say of the model with its coordinates unlocked.

    Attributes:
        names: (L,) coordinates that the file locks. sizes: (L,) rad or m, how far they move about their means, RMS; 0
            of what moves no more than skin does.
        moved: (T, C) by how much coordinates, speeds, accelerations and moments are others with that; of the locked
            coordinates themselves all that is seen, skin's part too: nothing is known of them for sure.
        offsets: (L,) rad or m, from where the file holds them on average; 0 where its marker places do not tell.
    """

    names: list[str]
    sizes: Array
    moved: dict[str, Array]
    offsets: Array


def with_locked(
    data: xr.Dataset, initial: CalibratedModel, systematic: Systematic, file: str
) -> tuple[xr.Dataset, list[Message]]:
    """``data`` with deviations that hold what the person moves of coordinates that the model's file locks, and what
    there is to say of it: nothing where nothing is locked, or nothing moves more than skin does.

    Args:
        data: as of `without_lost`, with deviations as of `Systematic.added_over_time`. file: name of the model's file.
    """
    motion = motion_of_locked(data, initial, systematic)
    if motion is None:
        return data, []
    from scipy.ndimage import uniform_filter1d

    window = 2 * _frames(data) - 1
    sizes = {b: np.sqrt(uniform_filter1d(m**2, window, axis=0, mode="nearest")) for b, m in motion.moved.items()}
    said = {block: values_of(data, f"{block}_sd") for block in BLOCKS}
    wider = {f"{b}_sd": (("time", "coordinate"), np.hypot(said[b], sizes[b])) for b in BLOCKS}
    of_root = [axis.coordinate for axis in axes_of_root(initial.spec)]
    judged = ~np.isin(data["coordinate"].values, [*motion.names, *of_root])
    notes = [_in_words(data, motion, said, sizes, judged, file)] if motion.sizes.any() else []
    return data.assign(wider), notes + ([_offset_in_words(data, motion, file)] if motion.offsets.any() else [])


def motion_of_locked(data: xr.Dataset, initial: CalibratedModel, systematic: Systematic) -> Motion | None:
    """None where the file locks nothing that a marker shows, and of too few frames."""
    spec = initial.spec
    names = [c.name for c in spec.coordinates if c.locked and c.name not in initial.held]
    frames = _frames(data)
    if initial.plan is not None or not names or len(data["time"]) < frames:
        return None
    model = _unlocked(spec, names)
    free = free_coordinates(model.spec)
    opened = np.array([spec.coordinates[k].locked for k in free])
    states = _states(model, spec, values_of(data, "state"), opened)
    lost = np.asarray(data["lost"].values, dtype=bool)  # its state is what the filter held
    known = np.flatnonzero(np.isfinite(states).all(axis=1) & ~lost)
    if len(known) < frames:
        return None
    from scipy.signal import savgol_filter  # a heavy library, for files that lock something

    K, L, at = len(free), len(names), np.arange(len(states))
    weight = 1.0 / np.repeat(np.maximum(initial.soft_tissue_m, _LEAST_SKIN_M), 3)
    markers = _markers(data)
    residual = _residuals(markers[known], model, states[known])
    angles, unsure = (np.zeros((len(known), L)) for _ in range(2))
    gains = np.zeros((len(known), K - L, L))
    for k, frame in enumerate(known):
        J = _core.marker_jacobian(model, states[frame])[:, :K] * weight[:, None]
        whole, others = normal_factor(J), J[:, ~opened]
        angles[k] = cho_solve(whole, J.T @ (residual[k] * weight))[opened]
        unsure[k] = np.diag(cho_solve(whole, np.eye(K)))[opened]
        gains[k] = cho_solve(normal_factor(others), others.T @ J[:, opened])
    angles -= angles.mean(axis=0)
    sizes = rms(angles, axis=0)
    shown = np.square(sizes) > OF_SKIN**2 * unsure.mean(axis=0)
    change = np.zeros((len(known), K))
    change[:, opened] = angles
    change[:, ~opened] = -np.einsum("tkl,tl->tk", gains[:, :, shown], angles[:, shown])
    step_s = step_of(data["time"].values)
    whole_change = np.column_stack([np.interp(at, known, column) for column in change.T])
    rates = [savgol_filter(whole_change, frames, 3, deriv=n, delta=step_s, axis=0) for n in range(3)]
    moved = {block: np.zeros((len(states), len(spec.coordinates))) for block in BLOCKS}
    for block, values in zip(BLOCKS, rates, strict=False):
        moved[block][:, free] = values
        values[:, np.flatnonzero(opened)[~shown]] = 0.0
    wrench, segments = wrenches_of(data)
    together = np.hstack(rates)
    for frame in known:
        T = _core.moment_jacobian(model, states[frame], systematic.geometry.external(wrench[frame], segments))
        moved["moments"][frame] = T[: len(spec.coordinates), : 3 * K] @ together[frame]
    some = known[:: max(1, len(known) // HELD_FRAMES)]
    moved_m = float(systematic.moved_m(values_of(data, "state")[known[-1]]))
    offset, sd = _from_held(markers[some], model, states[some], opened, initial, max(PLACED_M, moved_m))
    return Motion(names, np.where(shown, sizes, 0.0), moved, np.where(np.abs(offset) > HELD_OFF * sd, offset, 0.0))


def _frames(data: xr.Dataset) -> int:
    """Frames of the window, an odd number that a cubic goes through."""
    return max(5, 2 * round(0.5 * WINDOW_S / step_of(data["time"].values)) + 1)


def _unlocked(spec: _core.ModelSpec, names: Sequence[str]) -> _core.Model:
    spec = copy(spec)
    spec.coordinates = [
        _core.CoordinateSpec(c.name, c.value, c.locked and c.name not in names) for c in spec.coordinates
    ]
    return _core.Model(spec)


def _states(model: _core.Model, spec: _core.ModelSpec, states: Array, opened: npt.NDArray[np.bool_]) -> Array:
    """(T, n) of the unlocked model: what was locked stands still at its value."""
    K = len(opened)
    values = np.array([c.value for c in spec.coordinates])[free_coordinates(model.spec)]
    moving = np.zeros((len(states), 3, K))
    moving[:, 0] = values
    count = 3 * int((~opened).sum())
    moving[:, :, ~opened] = states[:, :count].reshape(len(states), 3, -1)
    return np.hstack([moving.reshape(len(states), -1), states[:, count:]])


def _markers(data: xr.Dataset) -> Array:
    """(T, 3 M) m; one that is not seen or believed is where the filter has it."""
    seen, estimated = values_of(data, "markers_measured"), values_of(data, "markers_estimated")
    believed = (values_of(data, "verdict")[:, : seen.shape[1]] != REFUSED)[:, :, None]
    return np.where(np.isfinite(seen) & believed, seen, estimated).reshape(len(seen), -1)


def _residuals(markers: Array, model: _core.Model, states: Array) -> Array:
    """(F, 3 M) m, markers off where the model has them with its skin displaced as it is on average."""
    skin = [k for k, name in enumerate(model.layout.names) if name.startswith("soft_tissue/")]
    still = states.copy()
    still[:, skin] = still[:, skin].mean(axis=0)
    off: Array = np.nan_to_num(markers - np.array([_core.marker_positions(model, x).ravel() for x in still]))
    return off


def _from_held(
    markers: Array,
    model: _core.Model,
    states: Array,
    opened: npt.NDArray[np.bool_],
    initial: CalibratedModel,
    sd_m: float,
) -> tuple[Array, Array]:
    """(L,) each: how far, rad or m, the locked coordinates are on average from where the file holds them, of markers
    (F, 3 M) that sit where the file has them to ``sd_m``; and the deviation of that."""
    known = dict(zip(initial.names, initial.x0, strict=True))
    as_filed = states.copy()
    for k, name in enumerate(model.layout.names):
        if name.startswith("marker/"):
            as_filed[:, k] = known[name]
        elif name.startswith("soft_tissue/"):
            as_filed[:, k] = 0.0
    K, found, variances = len(opened), [], []
    for own, x in zip(markers, as_filed, strict=True):
        for _ in range(2):  # postures lie farther apart than small angles
            J = _core.marker_jacobian(model, x)[:, :K] / sd_m
            normal = normal_factor(J)
            x[:K] += cho_solve(normal, J.T @ np.nan_to_num(own - _core.marker_positions(model, x).ravel()) / sd_m)
        found.append(x[:K][opened])
        variances.append(np.diag(cho_solve(normal, np.eye(K)))[opened])
    return np.mean(found, axis=0) - states[0, :K][opened], np.sqrt(np.mean(variances, axis=0))


def _in_words(
    data: xr.Dataset,
    motion: Motion,
    said: dict[str, Array],
    sizes: dict[str, Array],
    judged: npt.NDArray[np.bool_],
    file: str,
) -> Message:
    """What moves, and the angle and the moment of ``judged`` (C,) coordinates that it matters to most."""
    turns = np.asarray(data["coordinate_type"].values == "rotation")
    moving, amounts = _amounts(data, motion.names, motion.sizes)
    judged = judged & turns
    off = []
    for block, of, scale, unit in (
        ("coordinates", "", np.degrees(1.0), "deg"),
        ("moments", "the moment of ", 1.0, "N m"),
    ):
        now, before = rms(sizes[block], axis=0), rms(said[block], axis=0)
        share = np.divide(now, before, out=np.zeros_like(now), where=judged & (before > 0.0))
        k = int(np.argmax(share))
        if share[k] > MATTERS:
            off.append(f"{of}{words(str(data['coordinate'].values[k]))} by some {scale * now[k]:.1f} {unit}")
    text = (
        f"{file} locks {listed(moving)}, but the markers on both sides of the joint go as if it moved by "
        f"{listed(amounts)} (root mean square)"
    )
    if not off:
        return note("scaling", f"{text}. That matters little to other angles and moments.")
    return warning(
        "scaling",
        f"{text}: locked there, the model has {listed(off)} off. Deviations were widened by as much.",
    )


def _offset_in_words(data: xr.Dataset, motion: Motion, file: str) -> Message:
    moved, amounts = _amounts(data, motion.names, motion.offsets)
    return warning(
        "scaling",
        f"{file} locks {listed(moved)} {listed(amounts)} from where the markers show them on average, as the file has "
        "these on the segments: joints beside them, and their moments, are off with that.",
    )


def _amounts(data: xr.Dataset, names: Sequence[str], values: Array) -> tuple[list[str], list[str]]:
    """Those that are not 0, and how much they are."""
    turns = dict(zip(data["coordinate"].values, data["coordinate_type"].values == "rotation", strict=True))
    some = {name: abs(float(value)) for name, value in zip(names, values, strict=True) if value}
    return list(some), [f"{np.degrees(v):.0f} deg" if turns[n] else f"{1000.0 * v:.0f} mm" for n, v in some.items()]
