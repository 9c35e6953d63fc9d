"""How large the systematic errors are that a filter cannot know (`systematic`), by where joints come from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from dynakin.arrays import Array
from dynakin.filter.uncertainty.joint_errors import Kind
from dynakin.filter.uncertainty.upright import Turned
from dynakin.model.calibration.calibrated import CalibratedModel, Hips
from dynakin.model.mirroring import SUFFIXES
from dynakin.model.plan import angles_of

OF_JOINTS = get_args(Kind)
KINDS = (*OF_JOINTS, "roll", "skin", "mass_centre", "limbs", "clock", "hands", "hips")
"""What `Sizes` has a size of. What is not known of inertia has none: it is in the filter's covariance."""
CENTRES = ("hinge_centre", "elbow_centre", "ball_centre", "spine_centre", "ball_across")
"""What is farther off at joints that are less sure (`less_sure_joints`)."""
BY_PLACES = (*CENTRES, "hinge_across")
"""What goes by how far markers have moved, too."""


@dataclass(frozen=True)
class Sizes:
    """Standard deviations of the errors, of each component; where they come from is in docs/derivations.md.

    Attributes:
        hinge_centre: m, of the centre of a joint with one or two axes (knee, ankle).
        hinge_across: m, by which such a centre may besides lie elsewhere along its parent's third axis (to the side),
            which is nearly the axis of knees and ankles: nothing that moves shows it, so that what is estimated of
            lengths and places takes none of it.
        elbow_centre: m, of the elbow's: its axis does not pass midway between the epicondyles' markers.
        ball_centre, ball_across: m, of the centre of one with three (hip) along the first two axes of its parent
            (forwards and up), and along the third (to the side).
        spine_centre: m, of the trunk's on the pelvis along the first two: one joint stands for all of the spine's.
        hinge_axes, pair_axes, ball_axes: rad, of the turn of a joint's one axis (knee), two (ankle and subtalar) or
            three.
        shoulder_axes: rad, of the turn of a shoulder's, whose arm shows little of how it is turned about itself.
        root_frame, frame_tilt: rad, of the turn of the pelvis' frame in the pelvis about its first two axes, and about
            the third (to the side); the trunk's in the trunk about its third.
        root_origin: m, of the place of the pelvis' origin in the pelvis, of each component.
        roll: m/rad^2, of how far the centre of a joint moves with the square of its angle (knees'), where the model
            has it move with the angle.
        skin: of the displacement of a marker that follows a joint's angle, as a fraction of the declared size.
        mass_centre: m, of the centre of mass of each segment off where the model has it.
        limbs: part of the distance from its joint by which the centres of mass of a limb that no marker shows lie
            forwards or higher than where it hangs: 0.1 to 0.3 walking, 0.7 in `truth3d`'s squats, 1 stretched out.
        clock: s, of the plates' clock off the markers': less than can be found in a walk.
        skin_found: part of the declared size that the filter finds where skin moves as usual (`skin_found`): where
            it finds more, ``skin`` is larger in proportion.
        placed: m, how far (mean) markers may be found from where the model has them, for centres of joints to be as
            sure as said: of a model that was scaled worse to the person both are off, in proportion.
        own_speeds, own_moments: what the factor on the filter's own variance of smoothed speeds and moments grows by
            with the movement's intensity (`reported.OWN_LATE`).
        vigorous: intensity beyond which what is unseen of smoothed moments grows faster (`reported.VIGOROUS_GROWS`):
            calm walks stay below it.
        own_off_plates: part of the variance by the declared noise that counts at least, of late moments that are
            measured in a recording in which some foot stands off the plates, or in a session in which one has: what
            plates do not see they do not correct, and small innovations do not show it.
        inertia: whether what a recording leaves open of inertia counts in moments at least by the declared noise, as in
            `Estimate.parameters`, where the noise that was found in the recording takes it for better known.
        hands: kg, of what both hands may hold together that the model does not have (`Ground.in_hands_kg`).
        hips: part that counts of what the priors leave open of hips' centres and a recording does not show
            (`hips_unshown`): all of it.
    """

    hinge_centre: float
    hinge_across: float
    elbow_centre: float
    ball_centre: float
    spine_centre: float
    ball_across: float
    hinge_axes: float
    pair_axes: float
    ball_axes: float
    shoulder_axes: float
    root_frame: float
    frame_tilt: float
    root_origin: float
    roll: float
    skin: float
    mass_centre: float
    limbs: float
    clock: float
    skin_found: float
    placed: float
    own_speeds: float
    own_moments: float
    vigorous: float
    own_off_plates: float
    inertia: bool = True
    hands: float = 0.0
    hips: float = 1.0

    def scaled(self, factor: float) -> Sizes:
        """The errors of joints, skin, centres of mass, limbs and clock times a factor."""
        return replace(self, **{kind: factor * getattr(self, kind) for kind in KINDS})

    def with_skin(self, found: float) -> Sizes:
        """Those of a recording in which so much of skin's displacement was found; never less skin than usual."""
        return replace(self, skin=self.skin * max(1.0, found / self.skin_found))


LANDMARKS = Sizes(
    hinge_centre=0.0015,
    hinge_across=0.0028,
    elbow_centre=0.007,
    ball_centre=0.0015,
    spine_centre=0.03,
    ball_across=0.005,
    hinge_axes=np.radians(2.8),
    pair_axes=np.radians(4.0),
    ball_axes=np.radians(1.0),
    shoulder_axes=np.radians(4.0),
    root_frame=np.radians(1.0),
    frame_tilt=np.radians(5.0),
    root_origin=0.015,
    roll=0.0041,
    skin=0.085,
    mass_centre=0.012,
    limbs=0.6,
    clock=0.002,
    skin_found=0.37,
    placed=np.inf,
    own_speeds=0.12,
    own_moments=0.02,
    vigorous=33.0,
    own_off_plates=0.14,
)
"""Joints that are found from markers on the skin. ``spine_centre``, ``frame_tilt`` and ``skin_found`` were chosen on
simulated walks and squats of four people and judged on those of four others (docs/validation/deviations.md)."""
UNMARKED = replace(LANDMARKS, hinge_centre=0.015, hinge_axes=np.radians(6.0), pair_axes=np.radians(6.0))
"""Knees and ankles that no marker shows: on simulated squats their moments err two to five times as much
(`docs/validation/geometry.md`)."""
HEAVY_CENTRE, HEAVY_SKIN = 4.5, 2.0
"""Times as far off are centres of mass, and as much skin follows joints, of somebody who is `heavy`: simulated walks
with 25 kg more on the trunk and twice the skin (`docs/validation/deviations.md`)."""
ONE_SIDED = 0.010 / LANDMARKS.hinge_centre
"""Times as far off as others is the centre of a knee or ankle with a lateral marker alone and no width that somebody
measured (`docs/validation/geometry.md`), or whose markers sit otherwise in the standing trial."""
OF_HIPS: dict[Hips, dict[str, float]] = {
    "measured": {},
    "functional": {},
    "supposed": {"thigh": 3.0},
    "proportions": dict.fromkeys(("thigh", "shank", "foot"), 10.0),
}
"""Times as far off as others are the centres at which these hang, by where hips come from. Of `truth3d`'s squats 21 and
walks 22 with markers of the pelvis left out; where proportions have the hips, lengths of the legs and the joints below
are off with them. Judged on walk 4, squat 22, and a walk with one common marker (`docs/validation/geometry.md`)."""
LAID: dict[Kind, float] = {"hinge_axes": 2.5, "pair_axes": 2.5, "elbow_centre": 2.0}
"""Times as far off as others are the axes, and an elbow's centre, of joints whose axes are not marked
(`Provenance.laid_axes`). By truth the axis of elbows with one epicondyle marked is 10 to 20 deg off (1 to 9 with both),
its centre 17 to 28 mm (8 to 18), ankles' of feet without a heel 16 to 26 deg (5 to 8). Chosen on simulated walks 1 to 3
and squats 1 to 4, judged on others (docs/validation/deviations.md)."""
SINCE_CENTRE = 0.5
"""How far off the centre of a joint may be by skin of its two segments that never comes back to where the standing
trial has it, of that skin's way (`Site.since_m`)."""
SHOWS_HIPS_RAD = np.radians(2.0)
"""How far a hip turns (`hips_turned`) where half of the variance is left that regressions leave of its centre: a
filter whose skin fades learns from a posture that is held, too, and does not know that skin stays displaced there.
Chosen for one person on one leg for 20 s; two others judge (docs/validation/deviations.md)."""
SHOWS_ACROSS_RAD = np.radians(0.5)
"""The same of a centre to the side, by what the hip is adducted beyond what follows its flexion (`Turned.across`), by
the square of that: of a small angle most is skin's itself. Slow squats have 0.1 to 0.2 deg (their truth 0.1), recorded
ones 0.8 and 1.2, walks 3. Chosen on `truth3d`'s squats 1 to 4 and slow ones, others judge
(docs/validation/deviations.md)."""
SCALED = Sizes(
    hinge_centre=0.0014,
    hinge_across=0.002,
    elbow_centre=0.0014,
    ball_centre=0.0016,
    spine_centre=0.0016,
    ball_across=0.0016,
    hinge_axes=np.radians(1.3),
    pair_axes=np.radians(1.3),
    ball_axes=np.radians(0.8),
    shoulder_axes=np.radians(1.3),
    root_frame=np.radians(0.9),
    frame_tilt=np.radians(0.9),
    root_origin=0.0,
    roll=0.0,
    skin=0.08,
    mass_centre=0.003,
    limbs=0.6,
    clock=0.002,
    skin_found=0.3,
    placed=0.003,
    own_speeds=0.06,
    own_moments=0.0,
    vigorous=54.0,
    own_off_plates=0.034,
    inertia=False,
)
"""Joints of a skeleton that was scaled to the person (.osim): as well as can be where markers lie within ``placed``."""


def usual_sizes(calibrated: CalibratedModel) -> Sizes:
    """By where the joints of a model come from, and by the person's physique."""
    if calibrated.plan is None:
        return SCALED
    sizes = UNMARKED if calibrated.provenance.unmarked_joints else LANDMARKS
    if not calibrated.heavy:
        return sizes
    farther = 1.0 if calibrated.own_inertia else HEAVY_CENTRE
    more = {name: HEAVY_SKIN * getattr(sizes, name) for name in ("skin", "skin_found")}
    return replace(sizes, mass_centre=farther * sizes.mass_centre, **more)


def hips_unshown(turned: Turned) -> Array:
    """(3,) part of what regressions leave open of a hip's centre that stays so where it turns so far (`hips_turned`):
    forwards, up and to the side."""
    within, across = turned.in_all / SHOWS_HIPS_RAD, (turned.across / SHOWS_ACROSS_RAD) ** 2
    return np.asarray(1.0 / np.hypot(1.0, [within, within, across]))


def less_sure(calibrated: CalibratedModel, kinds: Sequence[Kind], joints: Sequence[str]) -> Array:
    """(S,) how many times as far off as others each source of a joint's error may be, of these kinds at the joints of
    these segments."""
    centres, laid = less_sure_joints(calibrated), {*calibrated.provenance.laid_axes}
    found = [
        max(centres.get(joint, 1.0) if kind in CENTRES else 1.0, LAID.get(kind, 1.0) if joint in laid else 1.0)
        for kind, joint in zip(kinds, joints, strict=True)
    ]
    return np.array(found)


def less_sure_joints(calibrated: CalibratedModel) -> dict[str, float]:
    """Segment -> how many times as far off the centre of its joint may be as those of others."""
    known = calibrated.provenance
    of_hips = {f"{part}{side}": times for side in SUFFIXES.values() for part, times in OF_HIPS[known.hips].items()}
    if known.unmarked_joints:  # all are said to be as unsure
        return of_hips
    turns = angles_of((*known.one_sided_joints, *known.moved_joints))
    one_sided = {s.name: ONE_SIDED for s in calibrated.spec.segments if turns & {axis.coordinate for axis in s.axes}}
    found = of_hips | one_sided
    since: dict[str, float] = {}
    for site in calibrated.plan.sites if calibrated.plan else ():
        since[site.segment] = max(since.get(site.segment, 0.0), site.since_m)
    for segment in calibrated.spec.segments:
        skin_m = np.hypot(since.get(segment.name, 0.0), since.get(segment.parent, 0.0))
        factor = np.hypot(found.get(segment.name, 1.0), SINCE_CENTRE * skin_m / LANDMARKS.hinge_centre)
        if factor > 1.0:
            found[segment.name] = float(factor)
    return found
