"""The classical method of a whole body: inverse kinematics, zero-lag low-pass, differentiation, inverse dynamics with
the plates as measured and the model's inertia. What plates and motion disagree on stays at the root, as the residual.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, rms_length, wrench_about
from dynakin.bindings import _core
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.inverse_kinematics import fixed_model, inverse_kinematics
from dynakin.recordings.smoothing import MAX_GAP_S, fill_gaps, smooth
from dynakin.recordings.times import even_step
from dynakin.results.estimate import values_of
from dynakin.results.measures.sources import ABSENT, MEASURED

if TYPE_CHECKING:
    import xarray as xr


INVERSE = "IK + ID"
"""Its kind; with the cut-off its name (`inverse_name`)."""

FAST_CUTOFF_HZ = 12.0
"""The other usual cut-off, for walking and faster: at 6 Hz a heel strike is gone."""
_OF_RATE = 0.4
"""Of the frame rate, below half of which a low-pass makes sense."""


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """States (T, n) of a rigid model over time; NaN where the motion is not known."""

    model: _core.Model
    states: Array

    @classmethod
    def of(cls, model: _core.Model, coordinates: Array, speeds: Array, accelerations: Array) -> RigidMotion:
        """From the free coordinates (T, F) and their derivatives."""
        return cls(model, np.ascontiguousarray(np.hstack([coordinates, speeds, accelerations])))

    def coordinates(self) -> Array:
        """Coordinates, speeds and accelerations (3, T, C) of all coordinates, locked ones too."""
        found = self._each(lambda x: np.stack(_core.coordinates(self.model, x)), 3, len(self.model.coordinate_names))
        return np.moveaxis(found, 1, 0)

    def markers(self) -> Array:
        """Places (T, M, 3) m of the model's markers."""
        return self._each(lambda x: _core.marker_positions(self.model, x), len(self.model.marker_names), 3)

    def wrench(self) -> Array:
        """Total external wrench (T, 6) N and N m about the ground's origin that the motion needs."""
        return self._each(lambda x: _core.wrench(self.model, x), 6)

    def poses(self) -> tuple[Array, Array]:
        """Orientations (T, S, 3, 3) and origins (T, S, 3) m of the segments."""
        count = len(self.model.segment_names)
        return (
            self._each(lambda x: _core.segment_poses(self.model, x)[0], count, 3, 3),
            self._each(lambda x: _core.segment_poses(self.model, x)[1], count, 3),
        )

    def moments(self, external: Array | None = None) -> Array:
        """Generalised forces (T, C) N m or N that drive the motion, less the external wrenches (T, S, 6) on the
        segments, about the ground's origin: of a floating root the residual."""
        found = np.full((len(self.states), len(self.model.coordinate_names)), np.nan)
        for k in self._known():
            found[k] = _core.joint_moments(self.model, self.states[k], None if external is None else external[k])
        return found

    def _known(self) -> npt.NDArray[np.intp]:
        return np.flatnonzero(np.isfinite(self.states).all(axis=1))

    def _each(self, of: Callable[[Array], Array], *shape: int) -> Array:
        found = np.full((len(self.states), *shape), np.nan)
        for k in self._known():
            found[k] = of(self.states[k])
        return found


def filled(time: Array, markers: Array) -> Array:
    """Markers (T, M, 3) with gaps of at most `MAX_GAP_S` closed by splines."""
    frames = round(MAX_GAP_S / even_step(time))
    columns = [fill_gaps(column, frames)[0] for column in markers.reshape(len(markers), -1).T]
    return np.stack(columns, axis=1).reshape(markers.shape)


def inverse_name(cutoff_hz: float) -> str:
    """What the method is called, with a cut-off."""
    return f"{INVERSE} ({cutoff_hz:g} Hz)"


def usual_cutoffs(cutoff_hz: float, time: Array) -> tuple[float, ...]:
    """The cut-off that was asked for, and the other usual one where the rate of these times (T,) s allows it."""
    other = (FAST_CUTOFF_HZ,) if _OF_RATE / even_step(time) > FAST_CUTOFF_HZ else ()
    return tuple(dict.fromkeys((cutoff_hz, *other)))


def rigid_motions(
    calibrated: CalibratedModel, time: Array, markers: Array, cutoffs_hz: Sequence[float]
) -> dict[float, RigidMotion]:
    """The calibrated model, rigid, laid on markers (T, M, 3) m, its angles low-passed with each cut-off.

    Raises:
        RecordingError: uneven time steps, or a cut-off that is not below half the rate.
    """
    model = fixed_model(calibrated)
    found = inverse_kinematics(calibrated, filled(time, markers))
    return {
        cutoff: RigidMotion.of(model, smoothed.values, smoothed.rates, smoothed.seconds)
        for cutoff in cutoffs_hz
        for smoothed in [smooth(time, found, cutoff)]
    }


def with_plates(motion: RigidMotion, estimated: xr.Dataset) -> tuple[xr.Dataset, list[str]]:
    """A motion and its inverse dynamics, labelled as the data of the estimate that plates and feet are taken from.

    Plates are those that the filter's run found under each foot, as measured, their delay taken off; a moment behind a
    contact that no plate measures is absent.

    Returns:
        Data along the ground of ``estimated``, and sentences on gaps and on the residual at the root.
    """
    import xarray as xr  # as in `reference_methods`

    external, sources = _on_segments(motion.model, estimated), None
    moments = motion.moments(external)
    if "moment_source" in estimated:
        sources = values_of(estimated, "moment_source")
        sources = np.where((sources == MEASURED) & np.isfinite(moments), MEASURED, ABSENT).astype(np.uint8)
        moments = np.where(sources == MEASURED, moments, np.nan)
    wrench, (orientations, origins) = motion.wrench(), motion.poses()
    by_coordinate, by_component = ("time", "coordinate"), ("time", "component")
    data = xr.Dataset(
        {
            name: (by_coordinate, values)
            for name, values in zip(("coordinates", "speeds", "accelerations"), motion.coordinates(), strict=True)
        }
        | {
            "moments": (by_coordinate, moments),
            "markers_estimated": (("time", "marker", "axis"), motion.markers()),
            "wrench_estimated": (by_component, wrench),
            "wrench_measured": estimated["wrench_measured"],
            "joint_orientations": (("time", "joint", "axis", "axis_"), orientations),
            "joint_centres": (("time", "joint", "axis"), origins),
        }
        | ({} if sources is None else {"moment_source": (by_coordinate, sources)}),
        coords=estimated.coords,
    )
    missing = np.count_nonzero(~np.isfinite(motion.states).all(axis=1))
    notes = [f"{missing} frames have no posture: too few markers for more than {MAX_GAP_S:g} s."] if missing else []
    if external is None:
        return data, notes
    measured = values_of(estimated, "wrench_measured")
    force, moment = np.split(wrench_about(measured - wrench, origins[:, 0]), 2, axis=1)
    known = np.isfinite(force).all(axis=1) & np.isfinite(moment).all(axis=1)
    if not known.any():
        return data, [*notes, "The plates nowhere measure the whole: the residual is not known."]
    sizes = [float(rms_length(part[known])) for part in (force, moment)]
    return data, [
        *notes,
        f"What it leaves at the {motion.model.segment_names[0]}: {sizes[0]:.1f} N and {sizes[1]:.1f} N m "
        f"(root mean square over {np.count_nonzero(known)} frames).",
    ]


def _on_segments(model: _core.Model, estimated: xr.Dataset) -> Array | None:
    """External wrenches (T, S, 6) of the plates, 0 where none is measured; None of a model that stands on its root."""
    if "foot_wrench_measured" not in estimated:
        return None
    wrenches = np.nan_to_num(values_of(estimated, "foot_wrench_measured"))
    found = np.zeros((len(wrenches), len(model.segment_names), 6))
    for k, name in enumerate(estimated["foot_segment"].values):
        found[:, model.segment_names.index(str(name))] += wrenches[:, k]
    return found
