"""A model file measured on a recording: lengths, marker places, inertia, first posture."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from dynakin.errors import ModelError
from dynakin.model.calibration.body import check_body_mass, find_height, find_mass
from dynakin.model.calibration.checks import check_masses, fixed_lengths, reach, refuse_moving_origin, report
from dynakin.model.calibration.completion import Completed, completed, free
from dynakin.model.calibration.frames import Trial, choose_side
from dynakin.model.calibration.functional import functional_landmarks
from dynakin.model.calibration.landmarks import SIDES, LandmarkFinder, slope
from dynakin.model.calibration.legs_in_motion import LEG_JOINTS, Legs, legs_in_motion
from dynakin.model.calibration.lumping import PlacedPart, segment_inertia
from dynakin.model.calibration.posture import Posture, find_geometry, find_posture, frame_landmarks
from dynakin.model.calibration.sites import Candidate, as_marked, candidates, find_locks, place_sites
from dynakin.model.markers.anatomy import standing_at
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.markers.recognise import CORRECT, LEG, lacking, recognise
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.model.plan import Geometry, ModelPlan
from dynakin.model.schema import ModelFile
from dynakin.model.table import BodyTable
from dynakin.recordings.companions import another_person
from dynakin.recordings.feet.contact import foot_contacts
from dynakin.recordings.frame import GroundFrame, find_ground_frame, find_laboratory_frame
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window
from dynakin.results.naming import listed, words
from dynakin.results.records import NEVER_FLAT
from dynakin.settings.subject import Subject

Array = npt.NDArray[np.float64]

_USUAL_OFF_DEG, _UNKNOWN_OFF_DEG = 5, 15
"""Of the zero of an ankle's angle where heel and toes count as an adult's on a flat foot, and where there is no such
line: by simulated walks 1 to 4 deg and 5 to 15."""


@dataclass(frozen=True, eq=False)
class Measured:
    """What ``measure`` found apart from the plan itself; attributes as in ``CalibratedModel``."""

    ground: GroundFrame
    side: str
    mass_kg: float
    height_m: float | None
    parts: dict[str, list[PlacedPart]]
    messages: tuple[str, ...]
    trial: Trial
    unplaced: tuple[Candidate, ...]  # markers of a model in space that the calibration frames do not show
    held: dict[str, str]  # coordinate -> why nothing shows it
    unmarked_joints: tuple[str, ...]  # knees and ankles that no marker shows
    one_sided_joints: tuple[str, ...]  # those with a lateral marker alone and no measured width
    still: bool  # the person stands still in the calibration frames


def measure(
    model: ModelFile,
    subject: Subject,
    table: BodyTable,
    asked_markers: MarkerSetFile | None,
    recording: Recording,
    ground: GroundFrame | None,
    *,
    static: Recording | None,
    side: str,
    vertical: str,
    forward: str | tuple[float, float, float],
    functional: Mapping[str, Recording],
) -> tuple[ModelPlan, Measured]:
    """The model filled with what the recording shows; arguments and errors as of ``Definition.calibrate``."""
    if functional and not model.sided:
        raise ModelError(f"functional is given, but model {model.name} is planar; expected a model in space (fullbody)")
    recognised = recognise(recording, asked_markers)
    messages = list(recognised.messages)
    find = partial(find_laboratory_frame if model.floating else find_ground_frame, vertical=vertical, forward=forward)
    as_asked = Trial.of(
        recording, recognised.match, ground or find(recording, pairs=recognised.match.facing_pairs)
    )  # fmt: skip
    messages += as_asked.ground.how
    trial = as_asked.facing() if model.floating else as_asked  # what is measured on landmarks takes X for forward
    if not model.sided:
        side, how = choose_side(trial.match, recording, side)
        messages.append(how)
    else:
        side = "both"
    source = trial
    if static is not None:
        stands = recognise(static, recognised.match.marker_set)
        messages += [f"{said} ({static.name})" for said in stands.messages]
        source = Trial.of(static, stands.match, find(static, pairs=stands.match.facing_pairs))
        source = source.facing() if model.floating else source
        if other := another_person(recording, static):
            messages.append(f"Warning: {other}. Lengths and marker places are those of {static.name}.")
    # A planar model starts from the trial's own landmarks; in space it starts from markers (pose_start).
    common = source.match if model.sided else _common(trial.match, source.match)
    finder = LandmarkFinder(common, side, subject.sex, model.planar, in_space=model.sided)
    if model.sided:
        finder, apart = seen_together(model, finder, trial.match, source)
        messages += apart
    model = as_marked(model, trial.match, finder)
    chosen, left_out = candidates(model, trial.match, side)
    locks, bare, locked = find_locks(model, trial.match, chosen)
    messages += left_out + locked

    if model.sided:
        entries = [r for r in (static, recording) if r is not None]
        height_m, how_high = find_height(subject, entries, source, finder)
        finder.height_m = height_m
        finder.widths_m, said = _joint_widths(entries, finder)
        messages += said
        finder.sole = flat_slopes(source)
    needed = needed_markers(model, finder, locks)
    refuse_moving_origin(model, trial, finder)
    wished = needed | table_markers(model, table, finder)
    if static is None or not model.sided:  # else the trial may lack markers that only the standing person wears
        frames, which = trial.calibration_frames(needed, wished)
        trial = _at_origin(model, trial, finder, frames)
    if static is not None:
        frames, which = source.calibration_frames(needed, wished)
    source = trial if static is None else _at_origin(model, source, finder, frames)
    messages.append(f"Lengths and marker places: {which}.")
    window = standing_window(source.recording)
    still = window is not None and window.start <= frames[0] < window.stop
    standing = source.median(frames)
    found, unmarked = Completed(finder.find(standing)), tuple[str, ...]()
    if model.sided:
        if not still:
            flat, usual = finder.sole, usual_slopes(finder)
            finder.sole = usual | dict(flat)
            messages += _never_flat(model, flat, usual, chosen)
        landmarks = finder.find_in_space(standing)
        if functional:
            landmarks, how_found = functional_landmarks(functional, landmarks, finder, source, frames)
            messages += how_found
        legs = Legs(landmarks)
        if finder.height_m is not None:
            legs = legs_in_motion(landmarks, trial.recording, source, frames, finder.height_m)
            messages += legs.messages
        try:
            found = completed(
                model, table, locks, legs.landmarks, standing, finder.height_m or np.nan, trial.match.where
            )
        except ModelError as error:
            reasons = dict.fromkeys(source.match.left_out.values())
            raise ModelError("; ".join([error.message, *reasons])) from None
        supposed = _supposed_legs(found, legs, chosen)
        if supposed and not still:
            raise ModelError(_no_legs(supposed, source, static, legs))
        unmarked = tuple(name for name in LEG_JOINTS if name in (*legs.joints, *supposed))
        if unmarked:
            joints = listed([words(name) for name in sorted(unmarked)])
            messages.append(
                f"Warning: no marker shows {joints}: they are where the movement, or else the "
                "proportions of an adult who stands, has them, to one or two centimetres. Give a standing trial with "
                "markers on knees and ankles (--static)."
            )
    landmarks = found.landmarks

    set_, names = source.match.marker_set, source.match.names
    mass_kg, how = find_mass(
        subject,
        [(t.recording, t.ground) for t in ([source, trial] if static is not None else [trial])],
        source.match.foot_markers,
        [name for (marker, _), name in names.items() if set_.marker(marker).segment == "pelvis"],
        finder.height_m if model.sided else None,
    )
    messages.append(how)
    if not model.sided:
        height_m, how_high = find_height(subject, [r for r in (static, recording) if r is not None], source)
    messages.append(how_high)
    messages += found.messages
    check_body_mass(subject, mass_kg, height_m)
    if subject.sex is None:
        messages.append(
            "Sex not given: regressions and table are the mean of both sexes (masses, centres, signed tensors)."
        )

    unmeasured = _unmeasured_lengths(model, table, landmarks, height_m, messages)
    geometry, posture = find_geometry(model, landmarks, locks, unmeasured)
    sites, placed = place_sites(chosen, (source, posture, frames), trial, finder, geometry, model, needed)
    messages += placed
    inertia, parts = segment_inertia(
        model, table, landmarks, posture, mass_kg, height_m if height_m is not None else np.nan
    )
    check_masses(model, inertia, parts, mass_kg, height_m, messages)
    start = posture if model.sided else _first_posture(model, geometry, finder, trial, needed, posture, messages)
    plan = ModelPlan(
        model, geometry, start.coordinates, fixed_lengths(model, set(bare), set(found.added)), inertia,
        {s.name: reach(model, s.name, geometry, parts[s.name]) for s in model.segments}, tuple(sites),
    )  # fmt: skip
    report(model, plan, mass_kg, messages)
    placed_names = {site.recorded for site in sites}
    left = tuple(c for c in chosen if c.recorded not in placed_names)
    held = {name: f"segment {segment} has no markers" for segment, names in bare.items() for name in names}
    trial = as_asked if model.floating else trial
    one_sided = tuple(name for name in LEG_JOINTS if name in finder.usual_widths - {*(functional or ())})
    return plan, Measured(
        trial.ground, side, mass_kg, height_m, parts, tuple(messages), trial, left, held, unmarked, one_sided, still
    )


def _never_flat(
    model: ModelFile, flat: Collection[str], usual: Collection[str], chosen: Sequence[Candidate]
) -> list[str]:
    """Sentences on marked feet of a person who does not stand still, but for those of ``flat`` sides, whose heel and
    toes show how they stand: the line between these is the usual one's, or there is none and the foot counts as flat in
    a frame in which it may not be."""
    marked = {candidate.segment for candidate in chosen}
    own = [s.side for s in model.segments if s.side is not None and "foot" in s.parts and s.name in marked]
    found = []
    for off_deg, feet in (
        (_USUAL_OFF_DEG, [f"the {side} foot" for side in own if side in usual and side not in flat]),
        (_UNKNOWN_OFF_DEG, [f"the {side} foot" for side in own if side not in usual and side not in flat]),
    ):
        if feet:
            found.append(
                f"Warning: {NEVER_FLAT}{listed(feet)} (heel and toes together on the ground, or standing still): the "
                f"zero of the ankle's angle may be {off_deg} deg off. Give a standing trial (--static)."
            )
    return found


def _supposed_legs(found: Completed, legs: Legs, chosen: Sequence[Candidate]) -> list[str]:
    """Knees and ankles of marked segments that are where an adult who stands has them."""
    marked = {candidate.segment for candidate in chosen}
    return [n for n in LEG_JOINTS if n not in legs.landmarks and n in found.added and found.added[n] in marked]


def _no_legs(supposed: Sequence[str], source: Trial, static: Recording | None, legs: Legs) -> str:
    """Laid out as those of an adult who stands, they are tens of degrees off where nobody does."""
    expected = "a standing trial with markers on knees and ankles (--static)"
    if static is not None:
        expected = "another one, of the person standing still with markers on knees and ankles (--static)"
    said = f"no marker shows {listed([words(name) for name in supposed])}, and nobody stands still in it"
    match = source.match
    on_legs = [why for (name, _), why in match.left_out.items() if match.marker_set.marker(name).segment in LEG]
    whys = (why.removesuffix(f": {CORRECT}") for why in on_legs)
    if reasons := "; ".join(dict.fromkeys(whys)):
        return f"{match.where}: {said}, because markers are left out: {reasons}; expected the labels corrected."
    return " ".join([f"{source.match.where}: {said}; expected {expected}.", *legs.failed])


def _common(match: MarkerMatch, other: MarkerMatch) -> MarkerMatch:
    """Only markers that both recordings have, so that a joint centre is the same recipe in both."""
    if other is match:
        return match
    names = {key: name for key, name in match.names.items() if key in other.names}
    recorded = tuple(name for name in match.recorded if name in other.recorded)
    where, left_out = f"{match.where} with {other.where}", match.left_out | other.left_out
    return MarkerMatch(match.marker_set, names, recorded, where, left_out)


def needed_markers(model: ModelFile, finder: LandmarkFinder, locks: dict[str, float | None]) -> set[MarkerKey]:
    """Markers of every landmark that the lengths and frames need. In the plane a recording without one of them is
    refused; in space the others are completed (`completion`)."""
    wanted: dict[str, str] = {}
    for segment in model.segments:
        if not free(segment, locks):
            continue  # its pose follows from its parent's
        for name in frame_landmarks(segment):
            wanted.setdefault(name, f"segment {segment.name!r} of model {model.name}")
    if model.ground.origin:
        wanted.setdefault(model.ground.origin, f"the ground origin of model {model.name}")
    if not model.sided:
        finder.require(wanted)
    keys: set[MarkerKey] = set()
    for name in wanted:
        own, plain = finder.of_side(name)
        if own.known(plain):
            keys |= own.markers_of(plain)
    for length in model.lengths:
        if length.between is not None and all(finder.known(name) for name in length.between):
            keys |= finder.markers_of(length.between[0]) | finder.markers_of(length.between[1])
    return keys


def seen_together(
    model: ModelFile, finder: LandmarkFinder, match: MarkerMatch, source: Trial
) -> tuple[LandmarkFinder, list[str]]:
    """The finder without markers that are never seen with the others of the landmarks, whose recipes fall back on what
    is left, and a sentence on them. They stay markers of their segments.

    Raises:
        ModelError: what is seen together is no pelvis and leg.
    """
    apart: dict[MarkerKey, str] = {}
    while True:
        marked = as_marked(model, match, finder)
        locks = find_locks(marked, match, candidates(marked, match, "both")[0])[0]
        needed = needed_markers(marked, finder, locks)
        gone = source.seen_apart(needed)
        if not gone:
            break
        apart |= {key: finder.match.names[key] for key in sorted(gone)}
        left = finder.match.without(gone, "it is never seen together with the others")
        if lacks := lacking(left.marker_set, left.names):
            raise ModelError(
                f"{source.match.where}: no frame shows all {len(needed)} markers of the joint centres, and frames that "
                f"show most of them have nothing {'; '.join(lacks)}; expected a frame with pelvis and leg"
            )
        finder = replace(finder, match=left, _chosen={})
    if not apart:
        return finder, []
    return finder, [
        f"Warning: no frame of {source.recording.name} shows all markers of the joint centres: measured without "
        f"{', '.join(apart.values())}, which {'is' if len(apart) == 1 else 'are'} not seen when the others are."
    ]


def flat_slopes(trial: Trial) -> dict[str, float]:
    """Side -> slope (rad) of the line from heel to toe while that foot stands flat; none for a foot that never does."""
    found: dict[str, float] = {}
    for side in SIDES:
        names = trial.match.heel_toe(side)
        own = {side: list(names)} if names else {}
        contact = foot_contacts(trial.recording, trial.ground, own).get(side)
        if contact is None or contact.touching.shape[1] != 2:
            continue
        flat = contact.touching.all(axis=1)
        if flat.any():
            heel, toe = (trial.ground.points_to_ground(trial.recording.marker(n)) for n in own[side])
            found[side] = float(np.median(slope((toe - heel)[flat])))
    return found


def usual_slopes(finder: LandmarkFinder) -> dict[str, float]:
    """Side -> slope (rad) of the line from heel to toe on an adult's flat foot, by the places that these are of."""
    found: dict[str, float] = {}
    for side in SIDES:
        recipes = [finder.recipe(name, side) for name in ("heel", "toe")]
        inputs = [recipe.inputs if recipe is not None else () for recipe in recipes]
        if all(inputs) and all(name in standing_at() for names in inputs for name in names):
            heel, toe = (np.mean([standing_at()[name][0] for name in names], axis=0) for names in inputs)
            found[side] = float(slope(toe - heel))
    return found


def table_markers(model: ModelFile, table: BodyTable, finder: LandmarkFinder) -> set[MarkerKey]:
    """Markers of the landmarks at which the inertia table's parts lie, as far as the recording has them."""
    names: set[str] = set()
    for segment in model.segments:
        for part in (table.part(name) for name in segment.parts):
            for point in (part.axis_from, part.axis_to, part.origin, part.length_from, part.length_to):
                names |= {point.start, point.end}
    keys: set[MarkerKey] = set()
    for name in sorted(names):
        keys |= finder.markers_of(name)
    return keys


def _at_origin(model: ModelFile, trial: Trial, finder: LandmarkFinder, frames: npt.NDArray[np.intp]) -> Trial:
    if model.ground.origin is None:
        return trial
    # the middle of the landmark's markers, out of plane as well, so that the ground origin is a point of the
    # laboratory
    keys = sorted(finder.markers_of(model.ground.origin))
    spatial = LandmarkFinder(trial.match, finder.side, finder.sex, planar=False)
    origin_G = spatial.find(trial.median(frames))[model.ground.origin]
    assert keys and np.isfinite(origin_G).all()
    return trial.about(trial.ground.points_to_laboratory(origin_G))


def _joint_widths(entries: list[Recording], finder: LandmarkFinder) -> tuple[dict[str, float], list[str]]:
    """Widths (m) of knee and ankle by joint and side ("knee_r") as recordings say them, and a sentence where used."""
    keys = {f"{joint}_{side[0]}": side for joint in ("knee", "ankle") for side in SIDES}
    found: dict[str, float] = {}
    for key in keys:
        joint, side = key.split("_")
        given = [e.subject[f"{joint}_width_m_{side}"] for e in entries if f"{joint}_width_m_{side}" in e.subject]
        recipe = finder.recipe(joint, keys[key])
        if given and recipe is not None and recipe.offset is not None and recipe.offset.width == joint:
            found[key] = given[0]
    if not found:
        return {}, []
    words = ", ".join(f"{keys[key]} {key.split('_')[0]} {1000.0 * width:.0f} mm" for key, width in found.items())
    return found, [f"Joint widths: the recording's own ({words})."]


def _unmeasured_lengths(
    model: ModelFile, table: BodyTable, landmarks: dict[str, Array], height_m: float | None, messages: list[str]
) -> dict[str, float]:
    found: dict[str, float] = {}
    for length in model.lengths:
        if length.between is None or all(name in landmarks for pair in length.pairs() for name in pair):
            continue
        part = table.parts.get(length.name)
        if part is None or part.length_per_height is None or height_m is None:
            raise ModelError(
                f"length {length.name!r}: its landmarks {' and '.join(length.between)} are not measured, "
                f"and neither the table {table.name} nor the subject's height gives it"
            )
        found[length.name] = part.length_per_height * height_m
        messages.append(
            f"Length {length.name}: {1000 * found[length.name]:.0f} mm from the height ({table.name}), no markers."
        )
    return found


def _first_posture(
    model: ModelFile,
    geometry: Geometry,
    finder: LandmarkFinder,
    trial: Trial,
    needed: set[MarkerKey],
    standing: Posture,
    messages: list[str],
) -> Posture:
    usable = np.flatnonzero(trial.usable(needed))
    if not len(usable):
        raise ModelError(f"{trial.match.where}: no frame shows all markers of the joint centres")
    first = int(usable[0])
    if first > 0:
        messages.append(f"Start from frame {first} ({trial.recording.time[first]:.2f} s): markers are missing before.")
    positions = trial.median(np.array([first]))
    return find_posture(model, geometry, finder.find(positions), standing)
