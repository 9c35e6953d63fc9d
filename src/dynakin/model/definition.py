"""A model that is chosen: what all have in common, and those of TOML files with subject, marker set and table."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Protocol

import numpy as np

from dynakin.errors import ModelError
from dynakin.files import is_file
from dynakin.messages import Message, warning
from dynakin.model.calibration.calibrated import (
    CalibratedModel,
    first_centre_of_pressure,
    starting_state,
)
from dynakin.model.calibration.how import AUTO, Calibration
from dynakin.model.calibration.in_space import started
from dynakin.model.calibration.measure import Asked, measure
from dynakin.model.markers.fit import choose_marker_set, lacking
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.model.markers.match import SIDES, match_markers
from dynakin.model.markers.recognise import recognise
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.model.mirroring import SUFFIXES
from dynakin.model.opensim.definition import OpenSimDefinition, load_opensim
from dynakin.model.plan import ModelPlan
from dynakin.model.schema import ModelFile
from dynakin.model.spec import to_core
from dynakin.model.table import BodyTable, load_table
from dynakin.recordings.companions import told_of_the_static
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.results.naming import listed
from dynakin.settings.model import OpenSimOptions
from dynakin.settings.settings import FunctionalJoint
from dynakin.settings.strict import nearest, read_toml, validate
from dynakin.settings.subject import Subject

_FOLDER = resources.files("dynakin.model") / "builtin"
_MODEL_M = 0.0015
"""Standard deviation of a marker for what hinges and rigid segments that are found from markers get wrong in space."""


def available_models() -> list[str]:
    """Names of the built-in models."""
    return sorted(entry.name.removesuffix(".toml") for entry in _FOLDER.iterdir() if entry.name.endswith(".toml"))


class Definition(Protocol):
    """A model that is chosen but not yet calibrated on a person: built in, of a TOML file, or OpenSim's."""

    @property
    def name(self) -> str:
        """The model's name."""

    @property
    def path(self) -> Path:
        """Its file."""

    @property
    def subject(self) -> Subject:
        """Mass, height, sex, as far as they are given."""

    @property
    def planar(self) -> bool:
        """Whether it moves in the sagittal plane only."""

    @property
    def floating(self) -> bool:
        """Whether the body may be anywhere and head anywhere."""

    @property
    def has_mass(self) -> bool:
        """Whether a mass is known without a recording: given, or the model's own."""

    def with_subject(self, subject: Subject) -> Definition:
        """The same model of somebody else."""

    def markers_among(self, recording: Recording) -> tuple[str, list[str], list[str], str]:
        """Whose markers a recording has (the marker set's or the model's name), those expected, those that are there,
        and what lacks so that they are too few ("" where they are enough).

        Raises:
            ModelError: the markers fit no set.
        """

    def calibrate(
        self, recording: Recording, *, static: Recording | None = None, how: Calibration = AUTO
    ) -> CalibratedModel:
        """The model of one person, calibrated on a recording; an OpenSim model brings its own lengths and places.

        Args:
            static: a recording of the same person and markers, standing; lengths and marker places come from it.
            how: what is said by hand of sides, directions, priors and bounds.

        Raises:
            ModelError, RecordingError: the model, the markers and the recording do not fit; one line says what was
                found and expected.
        """


@dataclass(frozen=True, eq=False)
class ModelDefinition:
    """What ``load_model`` returns; ``calibrate`` measures it on a recording.

    Attributes:
        model: the model file.
        path: where it came from.
        subject: mass, height, sex, as far as they are given.
        marker_set: None: chosen by the recording's markers.
        table: inertial parameters for the subject's sex.
        functional: recordings that show where a joint lies, by joint ("hip_r", "knee_l").
    """

    model: ModelFile
    path: Path
    subject: Subject
    marker_set: MarkerSetFile | None
    table: BodyTable
    functional: Mapping[str, Recording] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The model's name."""
        return self.model.name

    @property
    def planar(self) -> bool:
        """Whether it moves in the sagittal plane only."""
        return self.model.planar

    @property
    def floating(self) -> bool:
        """Whether the body may be anywhere and head anywhere."""
        return self.model.floating

    @property
    def has_mass(self) -> bool:
        """Whether a mass is known without a recording."""
        return self.subject.mass_kg is not None

    def with_subject(self, subject: Subject) -> ModelDefinition:
        """The same model of somebody else."""
        return replace(self, subject=subject)

    def markers_among(self, recording: Recording) -> tuple[str, list[str], list[str], str]:
        """The marker set's name, its markers, those that the recording has, and what lacks: it is enough where a pelvis
        and a leg are there, or half of the usual markers."""
        came = recording.marker_names
        try:
            chosen = self.marker_set or choose_marker_set(recording.seen_names, recording.name)
            match = match_markers(chosen, came, recording.seen, recording.name)
        except ModelError as error:
            if self.marker_set is not None:
                raise
            try:
                match = recognise(recording).match  # places are guessed
            except ModelError:
                raise error.reworded(f"{error.message}; what came: {', '.join(came)}") from None
        known = [(m, names[0]) for m in match.marker_set.markers for side in SIDES if (names := m.aliases(side))]
        usual = {marker.name for marker in match.marker_set.usual}
        found_n = sum(marker in usual for marker, _ in match.names)
        missing = lacking(match.marker_set, match.names)
        too_few = missing and 2 * found_n < sum(marker.name in usual for marker, _ in known)
        lacks = f"nothing {'; '.join(missing)}" if too_few else ""
        return match.marker_set.name, [name for _, name in known], list(match.names.values()), lacks

    def calibrate(
        self, recording: Recording, *, static: Recording | None = None, how: Calibration = AUTO
    ) -> CalibratedModel:
        """As ``Definition.calibrate``: lengths and marker places from the first (or standing) frames, inertia from the
        table, coordinates from landmarks and, in space, markers."""
        asked = Asked(
            self.model, self.path, self.subject, self.table, self.marker_set, self.functional, recording, static, how
        )  # fmt: skip
        with told_of_the_static(recording, static):
            plan, rest = measure(asked)
            begun = started(plan, rest.trial, rest.unplaced, rest.still) if plan.model.sided else None
        messages, speeds, held = list(rest.messages), dict[str, float](), rest.held
        if begun is not None:
            plan, speeds = begun.plan, begun.speeds
            messages += begun.messages
            held = held | begun.held
        marked = plan.marked()
        unmarked_kg = sum(body.mass for name, body in plan.inertia.items() if name not in marked)
        messages += _held_knees(held, marked)
        held = _not_known(plan, held)
        spec = to_core(plan)
        state, said = starting_state(
            spec,
            bounds=plan.bounds(how.bounds, how.priors),
            prior=plan.prior(how.priors),
            table=plan.table_values(),
            speeds=speeds,
        )
        messages += said
        return CalibratedModel(
            spec=spec,
            **vars(state),
            marker_variance=np.array([site.variance for site in plan.sites]),
            soft_tissue_m=np.array([site.soft_tissue_m for site in plan.sites]),
            unmodelled_m=_MODEL_M if plan.model.sided else 0.0,
            ground=rest.ground,
            plate_centre=first_centre_of_pressure(recording, rest.ground),
            recorded_markers=tuple(site.recorded for site in plan.sites),
            side=rest.side,
            mass_kg=rest.mass_kg,
            height_m=rest.height_m,
            height_stated=any([self.subject.height_m, *(r.subject.get("height_m") for r in (recording, static) if r)]),
            parts=rest.parts,
            messages=tuple(messages),
            plan=plan,
            markers_of_fixed_feet={} if plan.model.feet else rest.trial.match.foot_markers,
            feet=plan.model.feet,
            unmarked_kg=unmarked_kg,
            held=held,
            joint_prior=plan.joint_prior(how.priors),
            provenance=rest.provenance,
        )


def _held_knees(held: Collection[str], marked: Collection[str]) -> list[Message]:
    """A warning of knees held between a pelvis and a foot that markers show: hip and ankle make up for them."""
    sides = [side for side, s in SUFFIXES.items() if f"knee_angle{s}" in held and {"pelvis", f"foot{s}"} <= set(marked)]
    if not sides:
        return []
    knees = listed([f"the {side} knee" for side in sides])
    return [
        warning(
            "held",
            f"no marker shows the bending of {knees}, which is held, while pelvis and foot are seen: angles and "
            "moments of that hip and ankle are tens of degrees and N m off.",
        )
    ]


def _not_known(plan: ModelPlan, held: Mapping[str, str]) -> dict[str, str]:
    """Held coordinates of which results have none, and why: those of unmarked segments and of all that hangs on these,
    but for what hardly moves against a neighbour that is seen (`WithoutMarkers.still`)."""
    marked, unknown = plan.marked(), set[str]()
    found: dict[str, str] = {}
    for segment in plan.model.segments:  # parents stand before their children
        own = list(dict.fromkeys(axis.coordinate for axis in segment.axes))
        still = segment.without_markers is not None and segment.without_markers.still
        if segment.parent in unknown and segment.name not in marked:
            found |= {name: held.get(name, f"it hangs on {segment.parent}, which has no markers") for name in own}
        elif still and segment.name not in marked:
            continue
        found |= {name: held[name] for name in own if name in held}
        if segment.name not in marked and any(name in found for name in own):
            unknown.add(segment.name)
    return found


def load_model(
    name_or_path: str | Path,
    subject: Subject | None = None,
    markers: str | Path = "auto",
    table: str | Path = "dumas",
    opensim: OpenSimOptions | None = None,
    functional: Mapping[FunctionalJoint, Path] | None = None,
) -> ModelDefinition | OpenSimDefinition:
    """A built-in model ("sagittal7", "squat7"), a TOML file, or an OpenSim model (.osim, versions 3 and 4).

    An OpenSim model brings its own markers and inertia.

    Args:
        subject: who is measured; nothing is known where not given.
        markers: "auto" (by the recording's names), a built-in set ("opencap", "plug-in-gait"), or a TOML
            file.
        table: "dumas", "deleva" or a CSV file of the same shape.
        opensim: what of an OpenSim model can be estimated; other models do not read it.
        functional: functional trials by joint ("hip_r", "hip_l", "knee_r", "knee_l"), for models in space.

    Raises:
        ModelError: an unknown name (the nearest is suggested), or a wrong file (file and key are named).
    """
    if not isinstance(name_or_path, str | Path):
        raise ModelError(f"load_model: found {name_or_path!r}, expected the name of a model or a file")
    name = str(name_or_path)
    if Path(name_or_path).suffix.casefold() == ".osim":
        if str(markers) != "auto":
            raise ModelError(f"markers is {str(markers)!r}, expected auto: {name} has markers of its own")
        if functional:
            raise ModelError(
                f"functional is given, but {name} has joints of its own; expected a model such as fullbody"
            )
        return load_opensim(name, subject, opensim)
    if opensim is not None and opensim.marker_places == "kept":
        raise ModelError(
            f"marker_places is 'kept', but {name} has no marker places of its own; expected an .osim model with it"
        )
    definition = load_built_in_or_toml(name, subject, markers, table)
    if not functional:
        return definition
    recordings = {path: read(path) for path in set(functional.values())}
    return replace(definition, functional={joint: recordings[path] for joint, path in functional.items()})


def load_built_in_or_toml(
    name: str, subject: Subject | None = None, markers: str | Path = "auto", table: str | Path = "dumas"
) -> ModelDefinition:
    """``load_model`` of what is no OpenSim model."""
    known = available_models()
    path = Path(str(_FOLDER / f"{name}.toml")) if name in known else Path(name)
    if name not in known and (path.suffix != ".toml" or not is_file(path)):
        raise ModelError(
            f"model {name!r}: unknown{nearest(name, known)}; expected {', '.join(known)}, or a .toml or .osim file "
            "that exists"
        )
    model = validate(ModelFile, read_toml(path), str(path))
    who = subject or Subject()
    body = load_table(table, who.sex)
    for segment in model.segments:
        for part in segment.parts:
            body.part(part)  # a misspelt part is said now, with the table's own names
    marker_set = None if str(markers) == "auto" else load_marker_set(markers)
    return ModelDefinition(model, path, who, marker_set, body)
