"""An OpenSim model that is chosen, what of it can be estimated, and its calibration on a recording: marker places,
joints and inertia come from the file, mass and posture are measured."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.messages import Message, note
from dynakin.model.calibration.calibrated import (
    CalibratedModel,
    StartingState,
    first_centre_of_pressure,
    starting_state,
)
from dynakin.model.calibration.how import AUTO, Calibration
from dynakin.model.calibration.pose_start import PoseFit, start_posture
from dynakin.model.inertia import INERTIA_NAMES
from dynakin.model.opensim.calibrate import (
    beyond_range,
    estimated_bodies,
    facing_pairs,
    first_frame,
    foot_markers,
    limits_of,
    of_subject,
    reach_of,
    refuse_too_few,
)
from dynakin.model.opensim.description import Marker, OpenSimModel, person_of
from dynakin.model.opensim.feet import feet_of
from dynakin.model.opensim.masses import doubtful_masses
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.sites import sites, skin_of
from dynakin.model.opensim.spec import coupled_of, in_radians, independent_coordinates, moved_by, to_spec, unseen
from dynakin.model.schema import kinds_of
from dynakin.model.state_priors import JointPrior, places_prior, state_bounds, state_prior
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Recording
from dynakin.settings.model import OpenSimOptions
from dynakin.settings.strict import nearest, validate
from dynakin.settings.subject import Subject
from dynakin.units import gravity_problem

Site = tuple[Marker, str]
"""A marker of the file, and its name in the recording."""

_MODEL_M = 0.003
"""Standard deviation of a marker for what a generic skeleton, scaled, gets wrong of a person's joints: on `squats1` the
normalised innovations are consistent with it (1.1), and far too large with the cameras' noise alone (1.9 to 18)."""
_SKIN_LASTS = 10.0 / 3.0
"""The skeleton's joints do not hang on the markers, so that what these show apart from it is skin, which moves slowly:
0.5 s with the default noise (`docs/validation/held_out.md`)."""


@dataclass(frozen=True, eq=False)
class OpenSimDefinition:
    """What ``load_model`` returns for an .osim file; ``calibrate`` lays it on a recording.

    Attributes:
        source: the file's content.
        subject: mass, height, sex, as far as they are given.
        options: what can be estimated.
        scales: scale parameter of each body that has one.
    """

    source: OpenSimModel
    subject: Subject
    options: OpenSimOptions
    scales: dict[str, str]

    @property
    def name(self) -> str:
        """The model's name."""
        return self.source.name

    @property
    def path(self) -> Path:
        """Where it came from."""
        return self.source.path

    @property
    def planar(self) -> bool:
        """Whether it moves in the sagittal plane only: no OpenSim model is held there."""
        return False

    @property
    def floating(self) -> bool:
        """Whether the body may be anywhere and head anywhere."""
        return bool(self.source.floating)

    @property
    def has_mass(self) -> bool:
        """Whether a mass is known without a recording: the file has one."""
        return True

    def with_subject(self, subject: Subject) -> OpenSimDefinition:
        """The same model of somebody else."""
        return replace(self, subject=subject)

    def markers_among(self, recording: Recording) -> tuple[str, list[str], list[str], str]:
        """The model's name, its markers, those that the recording has, and what lacks where they are less than half."""
        expected = [marker.name for marker in self.source.markers]
        found = [name for name in expected if name in recording.marker_names]
        return self.name, expected, found, "expected half of them" if 2 * len(found) < len(expected) else ""

    def calibrate(
        self, recording: Recording, *, static: Recording | None = None, how: Calibration = AUTO
    ) -> CalibratedModel:
        """As ``Definition.calibrate``; the side does not matter, for the file says where its markers are. The ground is
        the laboratory, Y up; X is forward where it is asked for, or where the file holds the body so that it cannot
        head anywhere."""
        messages = [*(note("calibration", text) for text in self.source.left_out), *doubtful_masses(self.source)]
        source, chosen, feet, frame = self._frame_and_feet(recording, static, how, messages)
        lock, estimated = self._body(source, chosen, messages)
        names = tuple(name for _, name in chosen)
        kept = self.options.marker_places == "kept"
        spec_at = partial(
            to_spec,
            source,
            self.scales,
            markers=[marker for marker, _ in chosen],
            estimate_inertia=estimated,
            estimate_places=not kept,
            lock=lock,
        )
        measured = frame.points_to_ground(np.stack([recording.marker(name) for name in names], axis=1))
        fit = _posed(_core.Model(spec_at(values={})), source, measured, recording, messages)
        spec = spec_at(values=fit.coordinates)
        refuse_too_few(source, spec, list(names), recording)
        state, together = _start(source, spec, [marker for marker, _ in chosen], how, fit.rms_m, messages)
        skin = np.array([skin_of(marker.name, marker.body) for marker, _ in chosen])
        masses = {body.name: body.rigid.mass for body in source.bodies}
        return CalibratedModel(
            spec=spec,
            **vars(state),
            marker_variance=skin[:, 0],
            soft_tissue_m=skin[:, 1],
            ground=frame,
            plate_centre=first_centre_of_pressure(recording, frame),
            recorded_markers=names,
            side="both",
            mass_kg=source.mass,
            height_m=self.subject.height_m,
            parts={},
            messages=tuple(messages),
            plan=None,
            feet=feet,
            unmodelled_m=np.full(len(skin), _MODEL_M),
            skin_lasts=_SKIN_LASTS,
            dimensionless=frozenset(parameter.name for parameter in spec.parameters),
            unmarked_kg=sum(masses[name] for name in moved_by(source, lock)),
            held=dict.fromkeys(lock, "it moves no measured marker"),
            coupled=coupled_of(source),
            in_radians=in_radians(source),
            joint_prior=None if kept else together,
        )

    def _frame_and_feet(
        self, recording: Recording, static: Recording | None, how: Calibration, messages: list[Message]
    ) -> tuple[OpenSimModel, list[Site], dict[str, str], GroundFrame]:
        """The model with the subject's mass, its markers that are measured, the bodies of the feet, and the ground."""
        source = self.source
        chosen, measured_by = sites(source, self.options.leave_out, recording)
        feet, found_by = feet_of(source, {str(side): body for side, body in self.options.feet.items()})
        pairs = facing_pairs(source, chosen, feet)
        frame = how.ground or how.find_ground(recording, pairs, static, floating=self.floating)
        messages += [note("ground", text) for text in frame.how]
        if self.options.scale_masses:
            weighed = [r for r in (static, recording) if r is not None]
            source = of_subject(source, self.subject, weighed, frame, foot_markers(source, chosen, feet), messages)
        else:
            messages.append(note("mass", f"Mass {source.mass:.2f} kg: the OpenSim file's."))
        messages += [note("calibration", text) for text in (*measured_by, *found_by)]
        if static is not None:
            messages.append(note("calibration", "The standing trial gives the mass only."))
        return source, chosen, feet, frame

    def _body(
        self, source: OpenSimModel, chosen: Sequence[Site], messages: list[Message]
    ) -> tuple[list[str], list[str]]:
        """Coordinates that are locked for want of markers, and bodies whose inertia is estimated."""
        kept = self.options.marker_places == "kept"
        places = "kept as the OpenSim file has them" if kept else "the OpenSim file's, calibrated by the recording"
        messages.append(note("details", f"Marker places: {places}."))
        lock = unseen(source, {marker.body for marker, _ in chosen}) if self.options.lock_unseen else []
        if lock:
            words = f"Coordinates that move no measured marker, locked at the file's value: {', '.join(lock)}."
            messages.append(note("calibration", words))
        fixed = [c.name for c in independent_coordinates(source) if c.locked]
        if fixed:
            words = f"The file locks {', '.join(fixed)}: held at its values. Unlock there what the person moves."
            messages.append(note("calibration", words))
        return lock, estimated_bodies(source, self.options.lightest_share, messages)


def _posed(
    model: _core.Model, source: OpenSimModel, measured: Array, recording: Recording, messages: list[Message]
) -> PoseFit:
    """The model laid on the first frame that shows nearly all of the markers (T, M, 3) m, ground frame."""
    first = first_frame(measured)
    where = str(recording.path or recording.name)
    fit = start_posture(model, measured[first], limits=limits_of(source), where=where)
    text = (
        f"Start: frame {first + 1} ({recording.time[first]:.2f} s), where the model of {source.path.name} "
        f"fits the markers to {1000.0 * fit.rms_m:.0f} mm (root mean square)."
    )
    messages.append(note("details", text))
    messages += beyond_range(source, fit.coordinates)
    return fit


def _start(
    source: OpenSimModel,
    spec: _core.ModelSpec,
    markers: Sequence[Marker],
    how: Calibration,
    fit_rms_m: float,
    messages: list[Message],
) -> tuple[StartingState, JointPrior]:
    """The state at that frame, and how marker places hang together: as unsure as they fit there (m), too."""
    bodies, reach = {body.name: body.rigid for body in source.bodies}, reach_of(source)
    lengths = {parameter.name: 1.0 for parameter in spec.parameters}
    places = {marker.name: np.array(marker.location) for marker in markers}
    known = how.priors.changed(marker_sd_m=float(np.hypot(how.priors.marker_sd_m, fit_rms_m / np.sqrt(3.0))))
    together = places_prior(places, {marker.name: marker.body for marker in markers}, known)
    prior = state_prior(kinds_of(spec.segments), lengths, {}, places, bodies, reach, known, {})
    state, said = starting_state(
        spec,
        bounds=state_bounds(limits_of(source), lengths, {}, places, bodies, reach, how.bounds, {}),
        prior=prior | together.sd,
        table={
            f"inertia/{s.name}/{k}": v for s in spec.segments for k, v in zip(INERTIA_NAMES, s.inertia, strict=True)
        },
        speeds={},
    )
    messages += said
    return state, together


def load_opensim(
    path: str | Path, subject: Subject | None = None, options: OpenSimOptions | None = None, **fields: object
) -> OpenSimDefinition:
    """An OpenSim model (.osim, versions 3 and 4) for the filter.

    Args:
        subject: who is measured; nothing is known where not given.
        options: what can be estimated; ``fields`` are single ones of it (``scale=None``).

    Raises:
        ModelError: the file or an option is wrong, or holds what is not supported (bodies without mass); its place is
            named.
    """
    source = person_of(read_osim(path))
    if source.mass == 0.0:
        raise ModelError(f"{source.path}: the bodies of the person have no mass, expected each body's (kg)")
    if problem := gravity_problem(source.gravity):
        raise ModelError(f"{source.path}: gravity: {problem}")
    given = {} if options is None else options.model_dump()
    chosen = validate(OpenSimOptions, given | fields, "OpenSim model")
    scales = scale_names(source, chosen.scale, share=chosen.share_sides)
    return OpenSimDefinition(source, subject or Subject(), chosen, scales)


PREFIX = "scale_"
_SIDES = (("_r", "_l"), ("_right", "_left"), ("r_", "l_"), ("right_", "left_"), ("_R", "_L"), ("R_", "L_"))


def without_side(name: str, names: Iterable[str]) -> str:
    """The name without its side where its mirror image is there too ("femur_r" with "femur_l": "femur")."""
    there = set(names)
    for pair in _SIDES:
        for own, other in (pair, pair[::-1]):
            if own.startswith("_") and name.endswith(own) and name.removesuffix(own) + other in there:
                return name.removesuffix(own)
            if own.endswith("_") and name.startswith(own) and other + name.removeprefix(own) in there:
                return name.removeprefix(own)
    return name


def scale_names(
    model: OpenSimModel, bodies: Sequence[str] | str | None = "all", *, share: bool = True
) -> dict[str, str]:
    """The scale parameter of each body that has one.

    Args:
        bodies: which bodies are scaled: "all", some names, or None for none of them.
        share: whether mirrored bodies (femur_r, femur_l) have one parameter.

    Raises:
        ModelError: a name that is no body of the model.
    """
    known = [body.name for body in model.bodies]
    if bodies is None or bodies == "all":
        chosen: Sequence[str] = known if bodies == "all" else []
    elif isinstance(bodies, str):
        raise ModelError(f"scale is {bodies!r}, expected 'all', a list of bodies or none")
    else:
        chosen = bodies
    for name in chosen:
        if name not in known:
            raise ModelError(
                f"{model.path}: scale: no body {name!r}{nearest(name, known)}; expected some of {', '.join(known)}"
            )
    return {name: PREFIX + (without_side(name, known) if share else name) for name in chosen}
