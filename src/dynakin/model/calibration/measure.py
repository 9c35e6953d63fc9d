"""A model file measured on a recording: lengths, marker places, inertia, first posture."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from dynakin.errors import ModelError
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.body import check_body_mass, doubtful_height, find_height, find_mass, joint_widths
from dynakin.model.calibration.calibrated import Provenance
from dynakin.model.calibration.checks import (
    check_masses,
    check_standing,
    fixed_lengths,
    reach,
    refuse_moving_origin,
    report,
    unmeasured_lengths,
)
from dynakin.model.calibration.completion import Completed, completed
from dynakin.model.calibration.flat_feet import flat_slopes, lost_on_feet, never_flat, raised_heels, usual_slopes
from dynakin.model.calibration.frames import MarkedTrial, choose_side
from dynakin.model.calibration.functional import functional_landmarks
from dynakin.model.calibration.how import Calibration
from dynakin.model.calibration.landmark_markers import in_both, needed_markers, seen_together, table_markers
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.calibration.legs_in_motion import (
    LEG_JOINTS,
    Legs,
    legs_in_motion,
    no_legs,
    not_understood,
    supposed_legs,
    unmarked_legs,
)
from dynakin.model.calibration.lumping import PlacedPart, segment_inertia
from dynakin.model.calibration.moved_markers import Moved, moved_markers
from dynakin.model.calibration.posture import Posture, find_geometry, find_posture, frame_landmarks
from dynakin.model.calibration.sites import Candidate, as_marked, candidates, find_locks, place_sites
from dynakin.model.calibration.unseen_pelvis import Pelvis, hips_of_proportions
from dynakin.model.markers.fit import refuse_unfit
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.markers.recognise import recognise, recognise_standing
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.model.mirroring import SIDES, SUFFIXES
from dynakin.model.plan import Geometry, ModelPlan
from dynakin.model.schema import ModelFile
from dynakin.model.table import BodyTable
from dynakin.recordings.companions import another_person
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.orientation import axis_vector, walks
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import MIN_STILL_S, standing_window
from dynakin.recordings.vertical import against_vertical
from dynakin.settings.subject import Subject


@dataclass(frozen=True, eq=False)
class Asked:
    """What is measured, and on what; attributes as in ``ModelDefinition`` and ``Definition.calibrate``."""

    model: ModelFile
    path: Path
    subject: Subject
    table: BodyTable
    marker_set: MarkerSetFile | None
    functional: Mapping[str, Recording]
    recording: Recording
    static: Recording | None
    how: Calibration

    @property
    def recordings(self) -> list[Recording]:
        """The standing trial first."""
        return [r for r in (self.static, self.recording) if r is not None]

    def find_ground(self, recording: Recording, match: MarkerMatch) -> GroundFrame:
        """Of one of the recordings."""
        return self.how.find_ground(recording, match.facing_pairs, self.static, floating=self.model.floating)


@dataclass(frozen=True, eq=False)
class Measured:
    """What ``measure`` found apart from the plan itself; attributes as in ``CalibratedModel``."""

    ground: GroundFrame
    side: str
    mass_kg: float
    height_m: float | None
    parts: dict[str, list[PlacedPart]]
    messages: tuple[Message, ...]
    trial: MarkedTrial
    unplaced: tuple[Candidate, ...]  # markers of a model in space that the calibration frames do not show
    held: dict[str, str]  # coordinate -> why nothing shows it
    provenance: Provenance
    still: bool  # the person stands still in the calibration frames


@dataclass(frozen=True, eq=False)
class _Trials:
    """The recordings with their markers known by name."""

    as_asked: MarkedTrial
    trial: MarkedTrial  # of a floating model with X forward: what is measured on landmarks takes it for that
    pelvis: Pelvis
    side: str
    moved: Moved

    @property
    def source(self) -> MarkedTrial:
        """Where lengths and places are measured: the standing trial, or the same."""
        return self.pelvis.source


@dataclass(frozen=True, eq=False)
class _Marked:
    """The model with its markers, and how landmarks are found from them."""

    model: ModelFile
    finder: LandmarkFinder
    chosen: list[Candidate]
    locks: dict[str, float | None]
    bare: dict[str, tuple[str, ...]]  # segment without markers -> coordinates that are locked because of that
    height: tuple[float | None, list[Message]] | None  # of a model in space, whose landmarks need it
    needed: set[MarkerKey]


@dataclass(frozen=True, eq=False)
class _Still:
    """The frames on which lengths and places are measured, about the model's ground origin."""

    trial: MarkedTrial
    source: MarkedTrial
    frames: npt.NDArray[np.intp]
    stands: bool


def measure(asked: Asked) -> tuple[ModelPlan, Measured]:
    """The model filled with what the recording shows; errors as of ``Definition.calibrate``."""
    model, subject, table = asked.model, asked.subject, asked.table
    if model.sided and asked.how.side in ("right", "left"):
        raise ModelError(
            f"side is {asked.how.side}, but model {model.name} has both legs; expected auto, or a planar model"
        )
    if asked.functional and not model.sided:
        raise ModelError(f"functional is given, but model {model.name} is planar; expected a model in space (fullbody)")
    messages: list[Message] = []
    trials = _matched(asked, messages)
    marked = _marked(asked, trials, messages)
    model, finder, locks = marked.model, marked.finder, marked.locks
    still = _calibration_frames(asked, trials, marked, messages)
    asks = asked.static is not None and not asked.how.measured and np.ptp(asked.static.time) >= MIN_STILL_S
    if asked.static is not None and asks and not still.stands:
        text = (
            f"nobody stands still in {asked.static.name} (--static): lengths and marker places are measured on frames "
            "in which the person moves. Give a trial of standing, or none."
        )
        messages.append(warning("standing", text))
    found, unmarked = _landmarks(asked, marked, still, messages)
    mass_kg, height_m = _mass_and_height(asked, marked, still, messages)
    up = axis_vector(still.source.ground.vertical)
    messages += doubtful_height(asked.subject, still.source, still.stands or walks(still.source.recording, up))
    messages += found.messages
    try:
        check_body_mass(subject, mass_kg, height_m)
    except ModelError as error:
        ground = trials.trial.ground
        other, _ = against_vertical(asked.recording, ground.vertical, trials.trial.match.facing_pairs)
        why = f"; vertical is {ground.vertical}, but the markers show {other}" if other else ""
        raise error.reworded(f"{error.message}{why}") from None
    if subject.sex is None:
        messages.append(
            note(
                "sex",
                "Sex not given: regressions and table are the mean of both sexes (masses, centres, signed tensors).",
            )
        )
    unmeasured = unmeasured_lengths(asked.path, model, table, found.landmarks, height_m, messages)
    geometry, posture = find_geometry(model, found.landmarks, locks, unmeasured)
    on_frames = (still.source, posture, still.frames)
    sites, placed = place_sites(marked.chosen, on_frames, still.trial, finder, geometry, model, marked.needed)
    messages += placed
    inertia, parts = segment_inertia(
        model, table, found.landmarks, posture, mass_kg, height_m if height_m is not None else np.nan
    )
    check_masses(model, inertia, parts, mass_kg, height_m, messages)
    start = (
        posture
        if model.sided
        else _first_posture(model, geometry, finder, still.trial, marked.needed, posture, messages)
    )
    plan = ModelPlan(
        model, geometry, start.coordinates, fixed_lengths(model, set(marked.bare), set(found.added)), inertia,
        {s.name: reach(model, s.name, geometry, parts[s.name]) for s in model.segments}, tuple(sites),
        frozenset(finder.supposed_axes - {*(asked.functional or ())}),
    )  # fmt: skip
    report(model, plan, mass_kg, messages)
    trial = trials.as_asked if model.floating else still.trial
    placed_names = {site.recorded for site in sites}
    return plan, Measured(
        ground=trial.ground,
        side=trials.side,
        mass_kg=mass_kg,
        height_m=height_m,
        parts=parts,
        messages=tuple(messages),
        trial=trial,
        unplaced=tuple(c for c in marked.chosen if c.recorded not in placed_names),
        held={name: f"segment {segment} has no markers" for segment, names in marked.bare.items() for name in names},
        provenance=Provenance(
            guessed_places=bool(trial.match.guessed),
            unmarked_joints=unmarked,
            one_sided_joints=tuple(n for n in LEG_JOINTS if n in finder.usual_widths - {*(asked.functional or ())}),
            moved_joints=trials.moved.joints(finder),
            laid_axes=_laid_axes(model, still.source.match, found.added) if model.sided else (),
            hips=trials.pelvis.hips(finder, found.added, asked.functional or (), trials.moved.hips(finder)),
        ),
        still=still.stands,
    )


def _laid_axes(model: ModelFile, match: MarkerMatch, added: Collection[str]) -> tuple[str, ...]:
    """As of `Provenance.laid_axes`.

    Args:
        match: of the trial in which joints are measured. added: landmarks that no markers give.
    """
    found = []
    for segment in model.segments:
        side, suffix = segment.side or "", SUFFIXES.get(segment.side or "", "")
        epicondyles = ("ELB", side) in match.names and any((name, side) in match.names for name in ("ELM", "EJC"))
        line = {f"heel{suffix}", f"toe{suffix}"} & {*frame_landmarks(segment)}
        if (segment.origin == f"elbow{suffix}" and not epicondyles) or line & {*added}:
            found.append(segment.name)
    return tuple(found)


def _matched(asked: Asked, messages: list[Message]) -> _Trials:
    """Markers and ground of the recordings."""
    model, recording, static = asked.model, asked.recording, asked.static
    if asked.marker_set is not None:
        refuse_unfit(asked.marker_set, recording)
    recognised = recognise(recording, asked.marker_set)
    messages += recognised.messages
    as_asked = MarkedTrial.of(
        recording, recognised.match, asked.how.ground or asked.find_ground(recording, recognised.match)
    )
    messages += [note("ground", text) for text in as_asked.ground.how]
    trial = as_asked.facing() if model.floating else as_asked
    side = "both"
    if not model.sided:
        side, how = choose_side(trial.match, recording, asked.how.side)
        messages.append(note("calibration", how))
    if static is None:
        return _Trials(as_asked, trial, Pelvis.of(trial, trial, model), side, Moved())
    stands = recognise_standing(static, recording, recognised)
    messages += stands.messages
    source = MarkedTrial.of(static, stands.match, asked.find_ground(static, stands.match))
    source = source.facing() if model.floating else source
    messages += lost_on_feet(trial, source) if model.sided else []
    if other := another_person(recording, static):
        messages.append(warning("calibration", f"{other}. Lengths and marker places are those of {static.name}."))
    moved = moved_markers(trial, source) if model.sided else Moved()
    messages += moved.messages
    return _Trials(as_asked, trial, Pelvis.of(source, trial, model), side, moved)


def _marked(asked: Asked, trials: _Trials, messages: list[Message]) -> _Marked:
    """What of the model the markers show, and the recipes of its landmarks with what they need to know of the body."""
    model, match, source = asked.model, trials.trial.match, trials.source
    # A planar model starts from the trial's own landmarks; in space it starts from markers (pose_start).
    common = source.match if model.sided else in_both(match, source.match)
    finder = LandmarkFinder(common, trials.side, asked.subject.sex, model.planar, in_space=model.sided)
    if model.sided:
        finder, apart = seen_together(model, finder, match, source)
        messages += apart
    messages += trials.pelvis.said(finder)
    model = as_marked(model, match, finder)
    chosen, left_out = candidates(model, match, trials.side)
    locks, bare, locked = find_locks(model, match, chosen)
    messages += left_out + locked
    height = None
    if model.sided:
        height = find_height(asked.subject, asked.recordings, source, finder)
        finder.height_m = height[0]
        finder.widths_m, said = joint_widths(asked.recordings, finder)
        messages += said
    return _Marked(model, finder, chosen, locks, bare, height, needed_markers(model, finder, locks))


def _calibration_frames(asked: Asked, trials: _Trials, marked: _Marked, messages: list[Message]) -> _Still:
    """Where the person stands still, or what comes nearest to it."""
    model, finder, needed = marked.model, marked.finder, marked.needed
    trial, source = trials.trial, trials.source
    refuse_moving_origin(model, trial, finder)
    wished = needed | table_markers(model, asked.table, finder)
    same = source is trial
    if same or not model.sided:  # else the trial may lack markers that only the standing person wears
        frames, which = trial.calibration_frames(needed, wished)
        trial = _at_origin(model, trial, finder, frames)
    if not same:
        frames, which = source.calibration_frames(needed, wished)
    source = trial if same else _at_origin(model, source, finder, frames)
    messages.append(note("details", f"Lengths and marker places: {which}."))
    window = standing_window(source.recording)
    return _Still(trial, source, frames, window is not None and window.start <= frames[0] < window.stop)


def _landmarks(
    asked: Asked, marked: _Marked, still: _Still, messages: list[Message]
) -> tuple[Completed, tuple[str, ...]]:
    """Landmarks of the standing person, in space completed by movement and proportions; joints that no marker shows."""
    model, finder, source = marked.model, marked.finder, still.source
    standing = source.median(still.frames)
    found = Completed(finder.find(standing))
    if not model.sided:
        return found, ()
    messages += _soles(model, finder, still, marked.chosen)
    landmarks = finder.find_in_space(standing)
    if asked.functional:
        landmarks, how_found = functional_landmarks(asked.functional, landmarks, finder, source, still.frames)
        messages += how_found
    legs = Legs(landmarks)
    if finder.height_m is not None:
        legs = legs_in_motion(landmarks, still.trial.recording, source, still.frames, finder.height_m)
        messages += legs.messages
    try:
        height_m = finder.height_m or np.nan
        found = completed(model, asked.table, marked.locks, legs.landmarks, standing, height_m, still.trial.match.where)
    except ModelError as error:
        reasons = dict.fromkeys(source.match.left_out.values())
        unknown = not_understood(source.match, str(source.recording.path or "TRIAL"))
        raise error.reworded("; ".join([error.message, *reasons]) + ("." + unknown if unknown else "")) from None
    messages += hips_of_proportions(found.added, source)
    if still.stands:
        given = asked.subject.height_m or any(each.subject.get("height_m") for each in asked.recordings)
        messages += check_standing(found.landmarks, source.recording.name, None if given else finder.height_m)
    supposed = supposed_legs(found, legs, marked.chosen)
    if supposed and not still.stands:
        raise no_legs(supposed, source, asked.static, legs, finder)
    unmarked = tuple(name for name in LEG_JOINTS if name in (*legs.joints, *supposed))
    if unmarked and not asked.how.measured:
        messages.append(unmarked_legs(unmarked, source, asked.static))
    return found, unmarked


def _soles(model: ModelFile, finder: LandmarkFinder, still: _Still, chosen: Sequence[Candidate]) -> list[Message]:
    """How heel and toes lie on a flat foot, kept in the finder; sentences on feet of which nothing shows it."""
    flat, usual = flat_slopes(still.source), usual_slopes(finder)
    raised = raised_heels(flat, usual)
    flat = {side: slope for side, slope in flat.items() if side not in raised}
    finder.sole = {side: slope for side, slope in usual.items() if side in raised or not still.stands} | flat
    known = SIDES if still.stands else tuple(flat)  # who stands still stands flat
    return never_flat(model, [side for side in known if side not in raised], usual, raised, chosen)


def _mass_and_height(
    asked: Asked, marked: _Marked, still: _Still, messages: list[Message]
) -> tuple[float, float | None]:
    """Of the person; a planar model's height is asked for only now, and by markers about its origin."""
    set_, names = still.source.match.marker_set, still.source.match.names
    weighed = [still.source, still.trial] if asked.static is not None else [still.trial]
    mass_kg, how = find_mass(
        asked.subject,
        [(trial.recording, trial.ground) for trial in weighed],
        still.source.match.foot_markers,
        [name for (marker, _), name in names.items() if set_.marker(marker).segment == "pelvis"],
        marked.finder.height_m if marked.model.sided else None,
    )
    height_m, how_high = marked.height or find_height(asked.subject, asked.recordings, still.source)
    messages += [*how, *how_high]
    return mass_kg, height_m


def _at_origin(
    model: ModelFile, trial: MarkedTrial, finder: LandmarkFinder, frames: npt.NDArray[np.intp]
) -> MarkedTrial:
    if model.ground.origin is None:
        return trial
    # the middle of the landmark's markers, out of plane as well, so that the ground origin is a point of the
    # laboratory
    keys = sorted(finder.markers_of(model.ground.origin))
    spatial = LandmarkFinder(trial.match, finder.side, finder.sex, planar=False)
    origin_G = spatial.find(trial.median(frames))[model.ground.origin]
    assert keys and np.isfinite(origin_G).all()
    return trial.about(trial.ground.points_to_laboratory(origin_G))


def _first_posture(
    model: ModelFile,
    geometry: Geometry,
    finder: LandmarkFinder,
    trial: MarkedTrial,
    needed: set[MarkerKey],
    standing: Posture,
    messages: list[Message],
) -> Posture:
    usable = np.flatnonzero(trial.usable(needed))
    if not len(usable):
        raise ModelError(f"{trial.match.where}: no frame shows all markers of the joint centres")
    first = int(usable[0])
    messages += trial.late_start(first)
    positions = trial.median(np.array([first]))
    return find_posture(model, geometry, finder.find(positions), standing)
