"""The result of a run: labelled arrays with what is needed to judge them, and `save`."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from dynakin.results.records import Event, Parameter, Timing

if TYPE_CHECKING:
    from dynakin.comparison import Trial
    from dynakin.identifiability import Identifiability
    from dynakin.recordings import GroundFrame, Recording

AXES = ("x", "y", "z")
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass(frozen=True)
class Estimate:
    """What one run estimated. Do not change it: every file of `save` and the report are made from it.

    ``data`` holds, in the ground frame (X forward, Y up, Z right), SI units and radians:

    ============================================================  ==========================  =====================
    variable                                                      dimensions                  unit
    ============================================================  ==========================  =====================
    coordinates, coordinates_sd                                   (time, coordinate)          rad or m
    speeds, speeds_sd                                             (time, coordinate)          rad/s or m/s
    accelerations, accelerations_sd                               (time, coordinate)          rad/s2 or m/s2
    moments                                                       (time, coordinate)          N m or N
    markers_measured, markers_estimated, markers_predicted        (time, marker, axis)        m
    wrench_measured, wrench_estimated, wrench_predicted           (time, component)           N or N m
    state, state_sd                                               (time, element)             as the element's own
    initial_covariance, final_covariance                          (element, element_)         as the elements' own
    joint_centres                                                 (time, joint, axis)         m
    nis, n_rows, log_likelihood                                   (time,)                     1
    ============================================================  ==========================  =====================

    ``*_predicted`` is what the model expects before the frame is used, ``*_estimated`` after it. What is not measured
    or not modelled is NaN. The coordinate variable ``coordinate_type`` says "rotation" or "translation" for each
    coordinate, ``marker_axes_modelled`` says for each axis whether the model explains it. The wrench is what the
    ground does to the person, about the model's ground origin.

    ``recording`` is the recording as read (laboratory frame), ``ground`` the frame that carries it to the model's.
    """

    data: xr.Dataset
    parameters: list[Parameter]
    events: list[Event]
    timing: Timing
    recording: Recording
    ground: GroundFrame
    config: dict[str, Any]
    model_name: str
    messages: list[str] = field(default_factory=list)

    @property
    def time(self) -> np.ndarray:
        """Time of each frame (T,), s."""
        return np.asarray(self.data["time"].values)

    @property
    def coordinate_names(self) -> list[str]:
        """Names of all coordinates of the model, the locked ones too."""
        return [str(name) for name in self.data["coordinate"].values]

    @property
    def marker_names(self) -> list[str]:
        """Names of the markers used, as in the recording."""
        return [str(name) for name in self.data["marker"].values]

    def is_rotation(self) -> np.ndarray:
        """(C,) bool: which coordinates are rotations (the others are translations)."""
        return np.asarray(self.data["coordinate_type"].values == "rotation")

    def modelled_axes(self) -> np.ndarray:
        """(3,) bool: which ground axes of the markers the model explains (a planar model: x and y)."""
        return np.asarray(self.data["marker_axes_modelled"].values, dtype=bool)

    def metrics(self) -> dict[str, Any]:
        """The content of ``metrics.json`` (see `dynakin.results.metrics`); computed once, a copy is given."""
        return deepcopy(self._metrics)

    @cached_property
    def _metrics(self) -> dict[str, Any]:
        from dynakin.results.metrics import compute_metrics

        return compute_metrics(self)

    def save(
        self,
        folder: str | Path,
        *,
        overwrite: bool = True,
        comparison: Trial | None = None,
        identifiability: Identifiability | None = None,
    ) -> Path:
        """Write every output file into ``folder`` and return it.

        All files are first written into a temporary folder beside it, which then takes its place: a failure leaves
        what was there. A folder that exists is replaced only if ``overwrite`` is true and it is empty or holds
        nothing but an earlier output of dynakin.

        Args:
            comparison: this estimate beside the reference methods (`dynakin.comparison.trial_of`), for the report and
                for ``repetitions.csv``.
            identifiability: what this trial tells and what would tell more (`dynakin.identifiability`), for the report
                and for ``metrics.json``.

        Raises:
            OutputError: the folder cannot be written or holds something else.
        """
        from dynakin.results.save import save_estimate

        return save_estimate(
            self, Path(folder), overwrite=overwrite, comparison=comparison, identifiability=identifiability
        )
