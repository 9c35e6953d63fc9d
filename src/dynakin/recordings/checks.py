"""Are the force plates' data what they should be? Checked before a run uses them; each finding gives its
number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dynakin.arrays import Array
from dynakin.messages import Findings, Message, note, warning
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.contact import COP_REFUSED_M, NEAR_M
from dynakin.recordings.feet.loads import FootLoads
from dynakin.recordings.feet.places import foot_places
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.orientation import nearest_axis
from dynakin.recordings.plates.ground_plate import SHOE_M
from dynakin.recordings.plates.limits import beyond_limits
from dynakin.recordings.pushes import BEARS_N, JUDGED_N, UNLOADED_N
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.standing import standing_window
from dynakin.recordings.weight import TILT_WARNING_DEG, check_steps, check_weight, likely_unit, while_loaded

ABOVE_SURFACE_M = (-0.01, SHOE_M)
"""Height of a foot's lowest marker over the centre of pressure under it, in a quarter of its load: 17 to 78 mm in 18
real recordings, 9 to 40 in simulated ones; a foot that shows nothing but an ankle, 0.1 m."""
HEIGHT_REFUSED_M = (-0.30, 0.45)
"""The same, beyond which the plate's height is refused: people step onto boxes on a plate, but not into a plate."""
_HEIGHT_S = 0.1
"""So long a foot must be seen under a load for its height to be judged."""
OVER_EDGE_M = 0.01
"""How far a sole that stands may reach over its plate's edge and still bring all of its load there: in the two standing
trials that we have of which 11 kg are missing it is 18 and 27 mm, in the four that show the weight 0."""
FREE_MOMENT_WARNING_M = 0.05
"""Free moment over vertical force: two feet twisting on the ground rarely exceed 10 N m at 400 N."""
LYING_N, LYING = (BEARS_N, 4000.0), 0.25
"""Forces of so much on average while they are loaded, as people weigh (more is a unit or scale), and a vertical one of
less than this part of it: a force across the vertical is at most 1.5 times as large as that by friction
(`limits`), 4 times leaves room for plates that are tilted or drift, and other axes make it tens of times."""


@dataclass(frozen=True)
class PlateCheck:
    """What ``check_plates`` found.

    Attributes:
        mass_kg_from_plates: standing vertical force over g; None where the person does not stand still on
            plates, or where a sole reaches over a plate's edge.
        mean_mass_kg: the same from the mean over all loaded frames of a movement; right only where it ends as it
            began and nothing but the ground pushes. None where the person stands still, or nothing is loaded.
        messages: sentences with numbers; warnings of what is wrong.
        refusal: why the plates cannot be used, None where they can. The caller decides what follows from it.
        unused: they carry nobody although a foot may be on them: a run does without them.
        under_no_foot: name of the first plate that is refused for where it is pressed: it may be a contact's.
    """

    mass_kg_from_plates: float | None
    mean_mass_kg: float | None
    messages: tuple[Message, ...]
    refusal: str | None
    unused: bool = False
    under_no_foot: str | None = None


def check_plates(
    recording: Recording,
    ground: GroundFrame,
    mass_kg: float | None = None,
    foot_markers: Mapping[str, Sequence[str]] | None = None,
    loads: FootLoads | None = None,
    steps_kg: float | None = None,
) -> PlateCheck:
    """Check the plates while the person stands still: the vertical force is positive and near m g, each
    centre of pressure lies under a foot and at the height of its sole, the force is near vertical, the free
    moment acts about the vertical and is small.

    Over all frames, no plate may be beyond the limits of friction or of its own edges.

    Where nobody stands still, the mean over all loaded frames takes its place for all but the mass, which is
    only reported.

    Args:
        ground: gives the vertical; its origin does not matter.
        mass_kg: declared body mass, None if it is to come from the plates.
        foot_markers: foot -> names of the markers on it; where not given no pressure is held against a foot.
        loads: the assignment of plates to these feet, where a run has it already.
        steps_kg: declared body mass of who may step off the plates: only another unit is found by it.
    """
    if not recording.plates:
        return PlateCheck(None, None, (), "no force plates in this recording, expected at least one")
    findings = Findings("plates")
    standing = _on_plates(standing_window(recording), recording, ground)
    if not np.all([np.isfinite(plate.force).all(axis=1) for plate in recording.plates], axis=0).any():
        findings.warn(
            "the plates are measured together in no frame: it is run as one without plates, and the ground reaction "
            "follows from the motion."
        )
        return PlateCheck(None, None, tuple(findings.messages), None, unused=True)
    frames = standing if standing is not None else slice(None)
    places = _feet(recording, ground, foot_markers or {}, findings)
    feet = {foot: place[:, :, [0, 2]] for foot, place in places.items()}
    given = () if loads is None else loads.given
    if lying := _lying([plate for p, plate in enumerate(recording.plates) if p not in given], ground):
        return PlateCheck(None, None, tuple(findings.messages), lying)
    if mass_kg is None and (idle := _idle(recording, ground, feet, steps_kg)):
        findings.messages.append(idle)
        return PlateCheck(None, None, tuple(findings.messages), None, unused=idle.level == "warning")
    mass = check_weight(recording, ground, mass_kg, steps_kg, standing, findings)
    if loads is None:
        loads = foot_loads(recording, ground, foot_markers or {})
    if steps_kg is not None:
        check_steps(recording, ground, steps_kg, loads, findings)
    under: dict[str, str] = {}
    under_no_foot: str | None = None
    over_edge = standing is not None and _over_the_edge(recording, ground, loads, frames, findings)
    for p, plate in enumerate(recording.plates):
        if (beyond := beyond_limits(plate, recording, ground)) is not None:
            findings.refuse(beyond)
        push = ground.vectors_to_ground(plate.force)[frames, 1]
        loaded = np.flatnonzero(np.abs(np.nan_to_num(push)) > JUDGED_N) + (frames.start or 0)
        if not len(loaded):
            findings.say(f"{plate.name} carries nothing ({'standing' if standing else 'the whole recording'}).")
            continue
        if p in loads.given:
            findings.say(f"{plate.name} bears the {' and the '.join(loads.given[p])}.")
            continue
        hidden = [name for name, own in (foot_markers or {}).items() if not own]
        refused = len(findings.refusals)
        pressed = _by_feet(plate, loaded, loads, p, ground)
        foot = _check_pressure(plate, pressed, feet, _owner(loads, pressed, p), ground, hidden, findings)
        if len(findings.refusals) > refused:
            under_no_foot = under_no_foot or plate.name
        _check_height(plate, loaded, places, recording.rate, ground, findings)
        _check_free_moment(plate, loaded, ground, findings)
        _check_level(plate, ground, findings)
        if standing is not None and foot in under:
            findings.warn(f"{under[foot]} and {plate.name} both have their centre of pressure under the {foot} foot.")
        if foot:
            under[foot] = plate.name
    refusal = "; ".join(findings.refusals) or None
    standing_mass, mean_mass = (mass, None) if standing is not None else (None, mass)
    if over_edge:
        standing_mass = None
    return PlateCheck(standing_mass, mean_mass, tuple(findings.messages), refusal, under_no_foot=under_no_foot)


def _on_plates(standing: slice | None, recording: Recording, ground: GroundFrame) -> slice | None:
    """The frames of standing, unless the plates are loaded at other times only: who stands is on a box then, say."""
    total = ground.vectors_to_ground(np.sum([plate.force for plate in recording.plates], axis=0))
    loaded = np.abs(np.nan_to_num(total[:, 1])) > JUDGED_N
    return None if standing is not None and loaded.any() and not loaded[standing].any() else standing


def _lying(plates: Sequence[Plate], ground: GroundFrame) -> str | None:
    """A sentence on forces of the feet's plates that are large, and all across the vertical: they have other axes than
    the markers. A declared contact may be pushed in any direction (a wall)."""
    if not plates:
        return None
    total = _total_force(plates)
    size = np.linalg.norm(total, axis=1)
    mean = total[size > 0.5 * size.max()].mean(axis=0) if size.max() > LYING_N[0] else np.zeros(3)
    along, upwards = np.abs(mean).max(), abs(ground.vectors_to_ground(mean)[1])
    if not LYING_N[0] < along < LYING_N[1] or upwards > LYING * along:
        return None
    axis = nearest_axis(mean)
    return (
        f"the forces lie along {axis} ({along:.0f} N on average while loaded), vertical is {ground.vertical}: "
        f"give the forces in the axes of the markers; of a person who lies, give the vertical (--vertical {axis})"
    )


def _idle(
    recording: Recording, ground: GroundFrame, feet: Mapping[str, Array], steps_kg: float | None
) -> Message | None:
    """A sentence on plates none of which is ever loaded, a warning unless their corners and the feet (T, K, 2) show
    that nobody steps on them: under a foot they are dead, or in another unit. None where one is loaded."""
    pushes = [np.nan_to_num(ground.vectors_to_ground(plate.force)[:, 1]) for plate in recording.plates]
    most = max(np.abs(push).max() for push in pushes)
    if most > JUDGED_N:
        return None
    if len(feet) > 1 and all(_beside(plate, ground, feet) for plate in recording.plates):
        return note("plates", "Nobody steps on the plates: they carry nothing, and no foot is on any.")
    known = np.all([np.isfinite(plate.force).all(axis=1) for plate in recording.plates], axis=0)
    without = "it is run as one without plates, and the ground reaction follows from the motion"
    if not known.all():
        return warning(
            "plates",
            f"the plates carry nobody in the {np.count_nonzero(known)} of {len(known)} frames in which they are "
            f"measured (they read {most:.1f} N at most): {without}.",
        )
    threshold = recording.read_with.get("force_threshold_n")
    if threshold is not None and threshold > JUDGED_N:
        return warning(
            "plates",
            f"the plates carry nobody in this recording: force_threshold_n (--force-threshold-n) takes all below "
            f"{threshold:g} N for nothing: {without}. Leave it out, or give the plates' noise (10 N, say).",
        )
    unit = likely_unit(while_loaded(np.sum(pushes, axis=0)), steps_kg)
    perhaps = f", and whether they are in {unit}, not N" if unit else ""
    mean = _total_force(recording.plates).mean(axis=0)
    axis, along = nearest_axis(mean), np.abs(mean).max()
    lies = (
        f" They are pushed along {axis} ({along:.0f} N on average), the vertical is {ground.vertical}: of a person who "
        f"lies, or is on hands and feet, give the vertical (--vertical {axis})."
    )
    return warning(
        "plates",
        f"the plates carry nobody in this recording (they read {most:.1f} N at most): {without}. If somebody steps on "
        f"them, look whether their channels were connected{perhaps}.{lies if along > JUDGED_N else ''}",
    )


def _total_force(plates: Sequence[Plate]) -> Array:
    """(T, 3) N of all plates; a plate without numbers gives nothing."""
    return np.asarray(np.sum([np.nan_to_num(plate.force) for plate in plates], axis=0))


def _beside(plate: Plate, ground: GroundFrame, feet: Mapping[str, Array]) -> bool:
    """Whether no foot comes near a plate, as far as its corners are known."""
    if plate.corners is None:
        return False
    place = ground.points_to_ground(plate.corners)[:, [0, 2]]
    for outline in feet.values():
        away = distance_to_hull(outline.reshape(-1, 2), place)
        if not np.isfinite(away).any() or np.nanmin(away) < NEAR_M:
            return False
    return True


def _over_the_edge(
    recording: Recording, ground: GroundFrame, loads: FootLoads, frames: slice, findings: Findings
) -> bool:
    """Whether a sole that stands reaches over the edge of its plate, onto what no plate measures."""
    ahead = ground.vectors_to_ground(ground.forward)[[0, 2]]
    found = False
    for k, foot in enumerate(loads.feet):
        on = [p for p in range(len(recording.plates)) if loads.on[frames, k, p].mean() > 0.5]
        middle = loads.soles.middle[frames, k][:, [0, 2]]
        seen = np.isfinite(middle).all(axis=1)
        if len(on) != 1 or recording.plates[on[0]].corners is None or not seen.any():
            continue
        ends = np.median(middle[seen], axis=0) + np.outer([1.0, -1.0], ahead * loads.soles.half_m[k, 0])
        place = ground.points_to_ground(np.asarray(recording.plates[on[0]].corners))[:, [0, 2]]
        over = float(distance_to_hull(ends, place).max())
        if over > OVER_EDGE_M:
            found = True
            findings.warn(
                f"the {foot} foot's sole reaches {1000 * over:.0f} mm over the edge of {recording.plates[on[0]].name} "
                "while the person stands: the plates do not carry all of the weight."
            )
    return found


def _feet(
    recording: Recording, ground: GroundFrame, markers: Mapping[str, Sequence[str]], findings: Findings
) -> dict[str, Array]:
    """Places (T, K, 3) m of each foot's markers, ground frame."""
    feet = {foot: place for foot, (_, place) in foot_places(recording, ground, markers).items()}
    if not feet:
        findings.warn("no foot markers, so it was not checked that the centres of pressure lie under the feet.")
    return feet


def _owner(loads: FootLoads, frames: np.ndarray, p: int) -> str | None:
    """The foot that stands on a plate in most of these frames."""
    counts = loads.on[frames, :, p].sum(axis=0)
    most = int(np.argmax(counts)) if len(counts) else 0
    return loads.feet[most] if len(counts) and counts[most] > 0.5 * len(frames) else None


def _by_feet(plate: Plate, loaded: np.ndarray, loads: FootLoads, p: int, ground: GroundFrame) -> np.ndarray:
    """Those of the frames in which nothing else bears on a plate under both feet, which the assignment has said (a seat
    on it, say); of the whole recording where that leaves none, and all of them where it has none either."""
    else_too = loads.elsewhere & (loads.on[:, :, p].sum(axis=1) > 1)
    push = np.abs(np.nan_to_num(ground.vectors_to_ground(plate.force)[:, 1]))
    for frames in (loaded, np.flatnonzero(push > JUDGED_N)):
        if len(free := frames[~else_too[frames]]):
            return np.asarray(free)
    return loaded


def _check_pressure(
    plate: Plate,
    loaded: np.ndarray,
    feet: dict[str, Array],
    owner: str | None,
    ground: GroundFrame,
    hidden: Sequence[str],
    findings: Findings,
) -> str | None:
    """Compare with the feet while all of them are seen; gives the foot that stands on the plate (``owner``, the nearest
    one where none is known), None where both or none do, or one without markers (``hidden``) may."""
    if not feet:
        return None
    seen = np.all([np.isfinite(outline[:, :, 0]).any(axis=1) for outline in feet.values()], axis=0)
    if not seen[loaded].any():
        findings.say(f"{plate.name} bears load only while a foot is not seen: nothing is held against its place.")
        return owner
    loaded = loaded[seen[loaded]]
    cop = ground.points_to_ground(plate.cop[loaded])[:, [0, 2]]
    if not np.isfinite(cop).any():
        return None
    distances = {foot: distance_to_hull(cop, outline[loaded]) for foot, outline in feet.items()}
    medians = {foot: float(np.nanmedian(d)) for foot, d in distances.items() if np.isfinite(d).any()}
    if not medians:
        return None
    foot = min(medians, key=lambda name: medians[name])
    if owner in medians and medians[owner] <= NEAR_M:
        foot = owner
    nearest = np.fmin.reduce([distances[name] for name in medians])
    # While nobody stands still one plate may carry one foot after the other: each frame's nearest foot
    # counts.
    away = float(np.nanmedian(nearest))
    if away <= NEAR_M:
        where = "within its outline" if away == 0 else f"{1000 * away:.0f} mm outside its markers' outline"
        findings.say(f"{plate.name}: centre of pressure under the {foot} foot, {where}.")
        return foot
    both = distance_to_hull(cop, np.concatenate([outline[loaded] for outline in feet.values()], axis=1))
    if float(np.nanmedian(both)) <= NEAR_M:
        findings.say(f"{plate.name}: centre of pressure between the feet, {1000 * away:.0f} mm from the {foot} one.")
        return None
    text = f"{plate.name}: centre of pressure {1000 * away:.0f} mm away from the nearest foot ({foot})"
    if hidden:
        findings.say(f"{text}: it may be the {' or the '.join(hidden)} foot's, which has no markers.")
        return None
    push = np.abs(ground.vectors_to_ground(plate.force)[:, 1])
    if np.nanmin(push) > UNLOADED_N and np.ptp(np.nanpercentile(nearest, (10.0, 90.0))) > COP_REFUSED_M:
        findings.refuse(
            f"{plate.name} reads {np.nanmedian(push):.0f} N and never nothing, wherever the feet are: zero it with "
            "nobody on it"
        )
    elif away > COP_REFUSED_M:
        findings.refuse(f"{text}, expected it under the foot (at most {1000 * COP_REFUSED_M:.0f} mm)")
    else:
        findings.warn(f"{text}, expected at most {1000 * NEAR_M:.0f} mm.")
    return None


def _check_height(
    plate: Plate, loaded: np.ndarray, feet: Mapping[str, Array], rate: float, ground: GroundFrame, findings: Findings
) -> None:
    """Compare with the lowest markers of the feet under which the centre of pressure lies."""
    cop = ground.points_to_ground(plate.cop[loaded])
    above, over = np.full(len(loaded), np.inf), ""
    for foot, places in feet.items():
        own = places[loaded]
        lowest = np.where(np.isfinite(own[..., 1]), own[..., 1], np.inf).min(axis=1) - cop[:, 1]
        under = distance_to_hull(cop[:, [0, 2]], own[..., [0, 2]]) <= NEAR_M
        if (under & (lowest < above)).any():
            over = f"{over} or {foot}" if over else foot
        above = np.where(under, np.fmin(above, lowest), above)
    above = above[np.isfinite(above)]
    if not len(above) >= max(_HEIGHT_S * rate, 1.0):  # a rate that is NaN, too
        return
    height = float(np.percentile(above, 25.0))
    low, high = ABOVE_SURFACE_M
    if low <= height <= high:
        return
    where = f"{1000 * abs(height):.0f} mm {'below' if height > 0.0 else 'above'}"
    text = (
        f"{plate.name}: its surface lies {where} the lowest marker of the {over} foot that stands on it, expected at "
        f"most {1000 * (high if height > 0.0 else -low):.0f} mm. Correct its height in the file (of its corners, or of "
        "the centres of pressure)"
    )
    if HEIGHT_REFUSED_M[0] <= height <= HEIGHT_REFUSED_M[1]:
        findings.warn(f"{text}{', unless a box stands on it' if height > 0.0 else ''}.")
    else:
        findings.refuse(text)


def _check_free_moment(plate: Plate, loaded: np.ndarray, ground: GroundFrame, findings: Findings) -> None:
    free = ground.vectors_to_ground(plate.free_moment[loaded]).mean(axis=0)
    push = float(ground.vectors_to_ground(plate.force[loaded])[:, 1].mean())
    about, across = float(free[1]), float(np.hypot(free[0], free[2]))
    findings.say(f"{plate.name}: free moment {about:.2f} N m about the vertical.")
    if abs(about) > FREE_MOMENT_WARNING_M * abs(push):
        findings.warn(f"{plate.name}: free moment {about:.1f} N m is large for a vertical force of {push:.0f} N.")
    if across > 1.0 + 0.1 * abs(about):
        findings.warn(f"{plate.name}: free moment has {across:.1f} N m about horizontal axes, expected none.")


def _check_level(plate: Plate, ground: GroundFrame, findings: Findings) -> None:
    if plate.corners is None:
        return
    sides = [b - a for a, b in pairwise(plate.corners)]
    normal = np.cross(sides[0], sides[1])
    cosine = abs(float(normal @ ground.rotation[1])) / float(np.linalg.norm(normal))
    tilt = float(np.degrees(np.arccos(min(1.0, cosine))))
    if tilt > TILT_WARNING_DEG:
        findings.warn(f"{plate.name}: its surface is tilted by {tilt:.0f} deg against the horizontal.")
