"""What calibrating an OpenSim model on a recording takes: mass, first frame, limits, which way it faces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from dynakin.arrays import Array
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.body import find_mass
from dynakin.model.opensim.description import Marker, OpenSimModel
from dynakin.model.opensim.sites import with_mass
from dynakin.model.opensim.spec import independent_coordinates
from dynakin.model.schema import Interval, kinds_of
from dynakin.model.spec import free_coordinates
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.landmarks import DEFAULT_PAIRS, FacingPairs
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject

_MOST = 0.9  # a first frame shows at least this part of the markers of the fullest one
_A_TURN = 1e-3  # rad: files write pi with few digits
_APART_M, _LEVEL_M = 0.08, 0.03  # of markers that show which way a body points; of markers that lie side by side


def limits_of(source: OpenSimModel) -> dict[str, Interval]:
    """Limits (rad or m) of the free coordinates; a turn that is clamped to a whole one or more has none, nor has the
    root of a body that is fixed nowhere: its ranges are those of the laboratory that the file was made in."""
    kinds = kinds_of(source.joints)
    found = {}
    for c in independent_coordinates(source):
        low, high = (-np.inf, np.inf) if c.name in source.floating else c.limits
        whole = kinds.get(c.name) == "rotation" and high - low > 2.0 * np.pi - _A_TURN
        found[c.name] = (-np.inf, np.inf) if whole else (low, high)
    return found


def beyond_range(source: OpenSimModel, start: dict[str, float]) -> list[Message]:
    """Says where the root starts beyond what the file clamps it to: OpenSim would draw it at the end of that range."""
    clamped = [c for c in independent_coordinates(source) if c.name in source.floating]
    names = [c.name for c in clamped if not c.limits[0] <= start[c.name] <= c.limits[1]]
    if not names:
        return []
    return [
        warning(
            "range",
            f"{', '.join(names)} begin beyond the range to which {source.path.name} clamps them; OpenSim may not "
            "follow coordinates.mot there. Widen the range in the file, or give --forward: X is then the way the "
            "person faces.",
        )
    ]


def of_subject(
    source: OpenSimModel,
    subject: Subject,
    recordings: list[Recording],
    ground: GroundFrame,
    feet: dict[str, list[str]],
    messages: list[Message],
) -> OpenSimModel:
    """The model with the subject's mass: as given, or as the plates say, or as it stands in the file."""
    try:
        mass, how = find_mass(subject, [(recording, ground) for recording in recordings], feet)
    except ModelError:
        messages.append(
            note("mass", f"Mass {source.mass:.2f} kg: the OpenSim file's, as it is neither given nor measured.")
        )
        return source
    messages += how
    messages.append(
        note(
            "details",
            f"Masses and inertias of the OpenSim file ({source.mass:.2f} kg) times {mass / source.mass:.3f}.",
        )
    )
    return with_mass(source, mass)


def estimated_bodies(source: OpenSimModel, lightest_share: float, messages: list[Message]) -> list[str]:
    """Bodies whose ten numbers are estimated, of this share of the mass at least; says which are not."""
    heavy = [b for b in source.bodies if b.mass > 0.0 and b.mass >= lightest_share * source.mass]
    impossible = [body.name for body in heavy if not body.rigid.possible()]
    if impossible:
        messages.append(
            note(
                "calibration", f"Inertia of {', '.join(impossible)} belongs to no real body in the file: not estimated."
            )
        )
    chosen = [body.name for body in heavy if body.name not in impossible]
    kept = [body.name for body in source.bodies if body.name not in (*chosen, *impossible)]
    if kept:
        messages.append(
            note(
                "calibration",
                f"Inertia of bodies below {100.0 * lightest_share:g} % of the mass is the file's: {', '.join(kept)}.",
            )
        )
    return chosen


def refuse_too_few(source: OpenSimModel, spec: _core.ModelSpec, names: list[str], recording: Recording) -> None:
    """Markers that measure less than the coordinates say nothing of a posture.

    Raises:
        ModelError: so few are they.
    """
    free = len(free_coordinates(spec))
    if 3 * len(names) < free:
        raise ModelError(
            f"{recording.path or recording.name}: {len(names)} of the {len(source.markers)} markers of "
            f"{source.path.name} are there ({', '.join(names)}), expected at least {-(-free // 3)} for its {free} free "
            "coordinates: name them alike"
        )


def first_frame(measured: Array) -> int:
    """The first frame that shows nearly as many markers as the fullest."""
    seen = np.isfinite(measured).all(axis=2).sum(axis=1)
    return int(np.flatnonzero(seen >= _MOST * seen.max())[0])


def reach_of(source: OpenSimModel) -> dict[str, float]:
    """Length that a body's first moments are compared with: to the furthest joint on it, else twice to its centre."""
    found = {body.name: 2.0 * float(np.linalg.norm(body.centre)) for body in source.bodies}
    for name in found:
        joints = [
            float(np.linalg.norm(np.array(joint.parent_offset.translation)))
            for joint in source.joints
            if joint.parent == name
        ]
        found[name] = max([found[name], *joints])
    return found


def facing_pairs(source: OpenSimModel, chosen: Sequence[tuple[Marker, str]], feet: Mapping[str, str]) -> FacingPairs:
    """Recorded markers that lie behind each other on feet and pelvis: bodies of OpenSim's models have X forward."""

    def on(body: str) -> list[tuple[float, float, str]]:
        return sorted((m.location[0], m.location[2], name) for m, name in chosen if m.body == body)

    def ends(body: str) -> list[tuple[str, str]]:
        """Backmost and foremost; of each side, where there are several."""
        places = on(body)
        if not places or places[-1][0] - places[0][0] < _APART_M:
            return []
        back = sorted((z, name) for x, z, name in places if x - places[0][0] < _LEVEL_M)
        front = sorted((z, name) for x, z, name in places if places[-1][0] - x < _LEVEL_M)
        return [(back[0][1], front[0][1]), (back[-1][1], front[-1][1])]

    along = [pair for body in feet.values() for pair in ends(body)]
    pelvis = [pair for body in source.bodies if "pelvis" in body.name.casefold() for pair in ends(body.name)]
    return FacingPairs((*along, *DEFAULT_PAIRS.heel_toe), (*pelvis, *DEFAULT_PAIRS.pelvis))


def foot_markers(
    source: OpenSimModel, chosen: Sequence[tuple[Marker, str]], feet: Mapping[str, str]
) -> dict[str, list[str]]:
    """Side -> the recorded names of the markers on its foot, and on what hangs on that (toes)."""
    found = {}
    for side, foot in feet.items():
        bodies = (foot, *source.tree.below(foot))
        found[side] = [name for marker, name in chosen if marker.body in bodies]
    return found
