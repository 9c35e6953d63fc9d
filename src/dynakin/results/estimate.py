"""What a run estimated: labelled arrays with what is needed to judge them. Data only; `dynakin.Result` saves it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from dynakin.elements import element
from dynakin.messages import Message
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Recording
from dynakin.results.records import Event, Parameter, Timing, Tracking
from dynakin.settings.lag import ALL_FRAMES
from dynakin.tree import Tree

if TYPE_CHECKING:
    import xarray as xr

AXES = ("x", "y", "z")
DIMENSIONS = ("time", "coordinate", "marker", "foot", "joint", "sensor", "element", "component", "axis", "axis_")
"""In the order in which they stand in an `Estimate`'s variables."""


def values_of(data: xr.Dataset, name: str) -> np.ndarray:
    """A variable of an `Estimate`'s data as an array, its dimensions as in the table there."""
    return np.asarray(data[name].transpose(*DIMENSIONS, missing_dims="ignore").values)


def tree_of(data: xr.Dataset) -> Tree:
    """Which segment hangs on which, of the joints of an `Estimate`'s data."""
    return Tree.numbered([str(name) for name in data["joint_segment"].values], data["joint_parent"].values)


def known_of(data: xr.Dataset, name: str) -> np.ndarray:
    """`values_of` of coordinates, speeds or accelerations, NaN where they have no deviation: nobody sees these joints,
    and the number is only where the body is posed."""
    values = values_of(data, name)
    return np.where(np.isnan(values_of(data, f"{name}_sd")), np.nan, values) if f"{name}_sd" in data else values


@dataclass(frozen=True, repr=False)
class Estimate:
    """What one run estimated. Do not change it: every output file and the report are made from it.

    ``data`` holds, in the ground frame (Y up; the laboratory's own of a body that is fixed nowhere, with X forward of a
    planar model), SI units and radians:

    ============================================================  ==========================  =====================
    variable                                                      dimensions                  unit
    ============================================================  ==========================  =====================
    coordinates, coordinates_sd                                   (time, coordinate)          rad or m
    coupled_coordinates                                           (time, coupled_coordinate)  rad or m
    speeds, speeds_sd                                             (time, coordinate)          rad/s or m/s
    accelerations, accelerations_sd                               (time, coordinate)          rad/s2 or m/s2
    moments                                                       (time, coordinate)          N m or N
    markers_measured, markers_estimated, markers_predicted        (time, marker, axis)        m
    wrench_measured, wrench_estimated, wrench_predicted           (time, component)           N or N m
    wrench_sd, wrench_needed                                      (time, component)           N or N m
    markers_innovation, markers_innovation_sd                     (time, marker, axis)        m
    wrench_innovation, wrench_innovation_sd                       (time, component)           N or N m
    test_ratio, verdict                                           (time, sensor)              1, codes
    state, state_sd                                               (time, element)             as the element's own
    initial_covariance, final_covariance                          (element, element_)         as the elements' own
    joint_centres                                                 (time, joint, axis)         m
    joint_orientations                                            (time, joint, axis, axis_)  1
    joint_loads                                                   (time, joint, component)    N or N m
    mass_centre, mass_centre_velocity                             (time, axis)                m, m/s
    foot_wrench, foot_wrench_sd, foot_wrench_measured             (time, foot, component)     N or N m
    foot_adjustment                                               (time, foot, component)     N or N m
    wrench_remainder                                              (time, component)           N or N m
    foot_contact, foot_source                                     (time, foot)                codes
    moment_source, joint_source                                   (time, coordinate | joint)  codes
    nis, n_rows, log_likelihood                                   (time,)                     1
    ============================================================  ==========================  =====================

    ``*_predicted`` is what the model expects before the frame is used, ``*_estimated`` after it. What is not measured
    or not modelled is NaN. ``*_innovation`` is what was measured less what was predicted, and ``test_ratio`` its
    square, normalised by its covariance, over the gate's limit (0 without a gate); ``verdict`` is 0 where a sensor is
    missing, 1 accepted, 2 refused, by the gate or because recovery found that it fits nothing. The coordinate variable
    ``coordinate_type`` says "rotation" or "translation" for each coordinate, ``clinical_sign`` 1 or -1 where it grows
    with or against the clinical angle of its name and 0 where neither, ``marker_axes_modelled`` for each axis whether
    the model explains it. The wrench is what the ground does to the person, about the model's ground
    origin. ``wrench_estimated`` is the sum of ``foot_wrench`` where plates measure all contacts, else what the movement
    needs by the model, which ``wrench_needed`` is throughout, with all that the model does not explain in it.
    ``joint_loads`` is what a segment's parent does to it through the joint by which it hangs, muscles and all, ground
    axes, about the joint's centre; ``joint_orientations`` turns a segment's axes into the ground's. The feet's
    variables are there if the moments were made with the feet's wrenches: ``foot_contact`` is 0 in the air, 1 on a
    plate, 2 not measured, 3 on a plate that bears another contact too. ``moment_source``, ``joint_source`` and
    ``foot_source`` are 0 where a moment, a joint's load or a foot's wrench is measured (with all the ground's reactions
    behind it), 1 where it is derived from the motion, because one of them is not, 2 where it is a prior, because how
    several of them divide the load is assumed, and 3 where it is absent (NaN); where they are missing all is measured
    (`dynakin.results.measures.sources`).

    Deviations (``*_sd``) of coordinates, speeds, accelerations and moments hold what the filter cannot know of joints,
    skin and centres of mass (`filter.uncertainty`), moments, ``foot_wrench`` and a measured total wrench also how far
    plates may be out of step; an angle's zero is not in them. ``state_sd`` and covariances are the
    filter's own, but for ``state_sd`` of constants, which is by the declared noise.

    ``lost`` (time,) is true in frames in which the filter lost the person: everything that was estimated there is NaN,
    but for ``state`` and ``state_sd``, which keep what the filter held.

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
    messages: list[Message] = field(default_factory=list)
    tracking: Tracking | None = None
    """How the person was followed (`results.measures.tracking`), as judged when it was estimated."""

    def __repr__(self) -> str:
        late = f"{1e3 * self.lag_s:.3g} ms late" if self.lag_s else "filtered"
        way = "smoothed" if self.smoothed else late
        return f"<Estimate of {self.recording.name}: {self.model_name}, {len(self.time)} frames, {way}>"

    @property
    def time(self) -> np.ndarray:
        """Time of each frame (T,), s."""
        return np.asarray(self.data["time"].values)

    def values(self, name: str) -> np.ndarray:
        """A variable of ``data`` as an array, its dimensions in the order of the table."""
        return values_of(self.data, name)

    def known(self, name: str) -> np.ndarray:
        """`known_of` of ``data``."""
        return known_of(self.data, name)

    @property
    def coordinate_names(self) -> list[str]:
        """Names of all coordinates of the model, the locked ones too."""
        return [str(name) for name in self.data["coordinate"].values]

    @property
    def held(self) -> dict[str, str]:
        """Coordinates that no marker shows, and why: constant, so that the body can be posed, and in no file."""
        return dict(self.config.get("held", {}))

    @property
    def marker_places(self) -> str:
        """ "named" by a marker set, or "guessed", where no set has the names."""
        return str(self.config.get("marker_places", "named"))

    @property
    def unmarked_joints(self) -> list[str]:
        """Knees and ankles that no marker shows: where the movement or proportions have them."""
        return list(self.config.get("unmarked_joints", ()))

    @property
    def marker_names(self) -> list[str]:
        """Names of the markers used, as in the recording."""
        return [str(name) for name in self.data["marker"].values]

    @property
    def marker_segments(self) -> dict[str, str]:
        """Marker (its name in the model) -> the segment that carries it, where the marker's place is estimated."""
        return {element(p.name).owner: p.segment for p in self.parameters if p.kind == "marker"}

    def is_rotation(self) -> np.ndarray:
        """(C,) bool: which coordinates are rotations (the others are translations)."""
        return np.asarray(self.data["coordinate_type"].values == "rotation")

    def modelled_axes(self) -> np.ndarray:
        """(3,) bool: which ground axes of the markers the model explains (a planar model: x and y)."""
        return np.asarray(self.data["marker_axes_modelled"].values, dtype=bool)

    @property
    def planar(self) -> bool:
        """Whether the model explains the markers in one plane only."""
        return not self.modelled_axes().all()

    @property
    def foot_names(self) -> list[str]:
        """The feet whose wrenches the moments were made with; none in a model that stands on its root."""
        declared = self.data.coords.get("foot_declared")
        names = self.contact_names
        return names if declared is None else [n for n, other in zip(names, declared.values, strict=True) if not other]

    @property
    def contact_names(self) -> list[str]:
        """The feet, and after them the contacts that were declared in addition: all of the dimension ``foot``."""
        return [str(name) for name in self.data["foot"].values] if "foot" in self.data.coords else []

    @property
    def lag_s(self) -> float:
        """Each frame was estimated from the frames until so many seconds later, as it would be live; inf: from all."""
        return float(self.config.get("lag_s", 0.0))

    @property
    def smoothed(self) -> bool:
        """Whether each frame was estimated from all frames."""
        return self.lag_s == ALL_FRAMES

    @property
    def lost(self) -> np.ndarray:
        """(T,) bool: frames in which the person was lost (`results.measures.tracking`); their estimates are NaN."""
        if "lost" not in self.data:
            return np.zeros(len(self.time), dtype=bool)
        return np.asarray(self.data["lost"].values, dtype=bool)

    @property
    def mass_kg(self) -> float | None:
        """Body mass as used, kg."""
        mass = self.config.get("mass_kg")
        return None if mass is None else float(mass)

    def powers(self) -> np.ndarray:
        """Power (T, C) W of each coordinate, moment times speed; positive adds energy to the body. It comes from where
        the moment does (``moment_source``)."""
        moments, speeds = (self.values(name) for name in ("moments", "speeds"))
        return np.asarray(moments * speeds)

    def moments_per_kg(self) -> np.ndarray:
        """Moments (T, C) in N m/kg, forces in N/kg: over the body mass, NaN where that is not known."""
        moments = self.values("moments")
        return np.asarray(moments / (self.mass_kg or np.nan))

    def joint_loads(self, frame: Literal["ground", "parent", "child"] = "ground") -> np.ndarray:
        """What each segment's parent does to it through its joint (T, J, 6), N and N m about the joint's centre.

        Args:
            frame: axes: the ground's, those of the parent segment (the ground's where there is none), or those of the
                segment itself. Out of a planar model's plane the loads are NaN.
        """
        loads = self.values("joint_loads")
        if frame == "ground":
            return np.asarray(loads)
        R_GB = self.values("joint_orientations")
        if frame == "parent":
            parents = self.data["joint_parent"].values
            R_GB = np.where((parents < 0)[:, None, None], np.eye(3), R_GB[:, parents])
        vectors = np.nan_to_num(loads).reshape(*loads.shape[:2], 2, 3) @ R_GB  # rows: v' R_GB is (R_BG v)'
        known = np.isfinite(loads) | np.isnan(loads).all(axis=(0, 1))  # a number turned away from may not be known
        turned = np.where(known.all(axis=2, keepdims=True), vectors.reshape(loads.shape), np.nan)
        return np.where(np.isnan(loads).all(axis=(0, 1)), np.nan, turned)
