"""One trial worked on by every method, in arrays of the same shape: filters, the table ("AT"), the classical method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from dynakin.comparison.setup import Setup
from dynakin.errors import ModelError
from dynakin.model import InitialModel
from dynakin.recordings import Recording
from dynakin.reference import Reference, reference_methods
from dynakin.results import COMPONENTS, Estimate, evaluation_window

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Progress = Callable[[int, int], None]

AT = "AT"
CLASSICAL = "classical"


@dataclass(frozen=True, eq=False)
class Method:
    """What one method makes of a trial; ground frame, NaN where it says nothing.

    Attributes:
        name: "EKF (paper)", "AT (6 Hz)", ...; kind: "EKF", "AT" or "classical".
        coordinates: (T, C) rad or m. moments: (T, C) N m or N.
        markers: (T, M, 3) m. wrench: (T, 6) N and N m, ground on person, about the ground origin.
    """

    name: str
    kind: str
    coordinates: Array
    moments: Array
    markers: Array
    wrench: Array


@dataclass(frozen=True, eq=False)
class Trial:
    """A recording with what all methods make of it.

    Attributes:
        window: (T,) bool, the frames that figures are taken over: after the adaptation.
        measured_markers: (T, M, 3) m; measured_wrench: (T, 6).
        axes: (3,) bool, ground axes that the model explains. rotation: (C,) bool.
        height: (T,) m, of the pelvis over the ground origin; NaN without a pelvis.
        notes: what was left out and why.
        estimates: of each preset, for whoever wants more.
    """

    name: str
    time: Array
    window: Mask
    marker_names: tuple[str, ...]
    coordinate_names: tuple[str, ...]
    measured_markers: Array
    measured_wrench: Array
    axes: Mask
    rotation: Mask
    height: Array
    mass_kg: float
    methods: tuple[Method, ...]
    notes: tuple[str, ...]
    estimates: dict[str, Estimate]

    def of_kind(self, kind: str) -> list[Method]:
        """The methods of one kind, in order."""
        return [method for method in self.methods if method.kind == kind]


def compare_trial(
    recording: Recording, setup: Setup, *, static: Recording | None = None, progress: Progress | None = None
) -> Trial:
    """Run every preset and the reference methods.

    "AT" is the paper's: classical angles, low-passed, on a chain of constant lengths with the table's inertia.
    "classical" lets every joint follow its own landmarks, so that each segment stands for itself; the table's inertia
    moves with it. The markers of both are carried rigidly from where they were while standing.

    Raises:
        DynakinError: as `Estimator.run`.
    """
    methods, estimates = [], {}
    for preset in setup.noise:
        estimator = setup.estimator(preset)
        estimates[preset] = estimate = estimator.run(recording, static=static, progress=progress)
        methods.append(_filtered(preset, estimate))
    initial = estimator.initial
    assert initial is not None
    notes: list[str] = []
    try:
        for kind, lengths in ((AT, "constant"), (CLASSICAL, "frame")):
            reference = reference_methods(
                recording,
                initial,
                setup.definition,
                setup.cutoff_hz,
                lengths=lengths,  # type: ignore[arg-type]
            )
            methods.append(_referred(kind, reference, initial))
            notes += [f"{kind}: {note}" for note in reference.notes]
    except ModelError as error:  # the filter took the model, so it is no hinge chain in the plane
        notes.append(f"AT and the classical method are left out: {error.message}")
    data = estimate.data
    return Trial(
        name=recording.name,
        time=estimate.time,
        window=evaluation_window(estimate.time),
        marker_names=tuple(estimate.marker_names),
        coordinate_names=tuple(estimate.coordinate_names),
        measured_markers=data["markers_measured"].transpose("time", "marker", "axis").values,
        measured_wrench=data["wrench_measured"].transpose("time", "component").values,
        axes=estimate.modelled_axes(),
        rotation=estimate.is_rotation(),
        height=pelvis_height(recording, initial),
        mass_kg=initial.mass_kg,
        methods=tuple(methods),
        notes=tuple(notes),
        estimates=estimates,
    )


def pelvis_height(recording: Recording, initial: InitialModel) -> Array:
    """Mean height (T,) m of the pelvis markers over the ground origin, NaN where one is missing or there are none."""
    names = [site.recorded for site in initial.plan.sites if site.segment == "pelvis"]
    if not names:
        return np.full(recording.n_frames, np.nan)
    points = initial.ground.points_to_ground(np.stack([recording.marker(name) for name in names], axis=1))
    return np.asarray(points[:, :, 1].mean(axis=1))


def _filtered(preset: str, estimate: Estimate) -> Method:
    data = estimate.data
    return Method(
        f"EKF ({preset})",
        "EKF",
        data["coordinates"].transpose("time", "coordinate").values,
        data["moments"].transpose("time", "coordinate").values,
        data["markers_estimated"].transpose("time", "marker", "axis").values,
        data["wrench_estimated"].transpose("time", "component").values,
    )


def _referred(kind: str, reference: Reference, initial: InitialModel) -> Method:
    data = reference.data
    cutoff = "" if reference.cutoff_hz is None else f" ({reference.cutoff_hz:g} Hz)"
    segments = reference.chain.moving(reference.kinematics).segments
    markers = np.stack([segments[site.segment].point(site.position) for site in initial.plan.sites], axis=1)
    return Method(
        kind + cutoff,
        kind,
        data["coordinates"].transpose("time", "coordinate").values,
        data["moments"].transpose("time", "coordinate").values,
        markers,
        data["wrench_estimated"].transpose("time", "component").sel(component=list(COMPONENTS)).values,
    )
