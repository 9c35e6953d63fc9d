"""Where a moment or a force comes from: measured, derived, a prior, or absent; and what that says in words.

A moment depends on the external force at every contact that lies behind its joint. Where one contact is not measured,
but all others are, its force follows from the motion and is *derived*. Where several are not measured, or two share a
plate, only their sum is known: how they divide it is assumed, and what depends on that is a *prior*, with the deviation
of the assumption. What a contact that nobody declared can reach is *absent* (NaN).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Codes, runs
from dynakin.recordings.feet.contact import SHARED_PLATE, UNMEASURED
from dynakin.recordings.times import span
from dynakin.results.estimate import Estimate, tree_of, values_of
from dynakin.results.naming import listed, sentence, words
from dynakin.results.records import REFUSED

if TYPE_CHECKING:
    import xarray as xr

Hidden = dict[str, npt.NDArray[np.bool_]]

UNSEEN_S = 0.2
"""Longest time without any marker of a segment over which its motion is carried on: by truth a foot in a walk is 20 to
30 deg off after 0.3 s."""

MEASURED, DERIVED, PRIOR, ABSENT = range(4)
"""Codes of ``moment_source``, ``joint_source`` and ``foot_source``, the worse the larger."""
MEANINGS = ("measured", "derived", "prior", "absent")
NOTES = (
    "0 measured: the ground's reaction behind it is measured, or there is none (a foot in the air, an arm).",
    "1 derived: from the motion, because one contact behind it is not measured.",
    "2 prior: several contacts are not measured each on its own; how they divide the load is assumed.",
    "3 absent: not known, the value is nan.",
)
"""What the codes say, for the headers of files."""
_JOINTS = {"hip": "hip", "knee": "knee", "tibia": "knee", "ankle": "ankle", "subtalar": "ankle"}
"""The joint that a coordinate of a leg is of, by what its name holds; another is its own."""
UNKNOWN: dict[str, Any] = {
    "legs": {},
    "frames": 0,
    "reasons": [],
    "verdict": "Which moments are measured is not known: their block in metrics.json was not made.",
}
"""In the place of `moment_figures` where these failed."""


def moment_sources(data: xr.Dataset) -> Codes:
    """(T, C) of the moments; what has no codes is measured, what is NaN is absent."""
    return _sources(data, "moment_source", "moments", "coordinate")


def joint_sources(data: xr.Dataset) -> Codes:
    """(T, J) of the loads of the joints; components out of a planar model's plane do not count."""
    return _sources(data, "joint_source", "joint_loads", "joint")


LEAST_OF_ROOT = 2
"""Markers of a pelvis that show with the legs how it lies, where it has as many. Chosen by truth on persons 1 and 2, a
walk and a squat each: two are as sure as said, one was 2.7 and 3 times further off in a walk. Judged on person 3:
by two the squat holds, of the walk tilt does and list is 2.2 to 2.5 deg off, said 0.7 to 0.8."""


def out_of_sight(seen: npt.NDArray[np.bool_], owners: Sequence[str], time: Array, root: str = "") -> Hidden:
    """Segment with markers -> (T,) frames that lie in a stretch of more than `UNSEEN_S` in which none of them is seen,
    of the root fewer than `LEAST_OF_ROOT`; of one of which that many never are, no frame.

    Args:
        seen: (T, M) the markers. owners: (M,) their segments. root: the one that floats, if any.
    """
    found: Hidden = {}
    for segment in dict.fromkeys(name for name in owners if name):
        count = seen[:, [name == segment for name in owners]].sum(axis=1)
        own = np.asarray(count < min(LEAST_OF_ROOT if segment == root else 1, count.max()))
        found[segment] = np.zeros(len(time), dtype=bool)
        for first, end in runs(own):
            found[segment][first:end] = too_long(time[end - 1] - time[first]) and not own.all()
    return found


def taken_back(seen: npt.NDArray[np.bool_], refused: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """(T, M) ``seen`` without frames in which a marker is back, but the filter, which may have lost where its segment
    is meanwhile, still refuses it."""
    found = seen.copy()
    for k in range(seen.shape[1]):
        for first, end in runs(refused[:, k]):
            if first > 0 and not seen[first - 1, k]:
                found[first:end, k] = False
    return found


def unseen_in_words(hidden: Hidden, time: Array, root: str = "") -> str:
    """A sentence on segments that are `out_of_sight`, and when; "" where none is."""
    spans = {name: [span(time, a, b) for a, b in runs(own)] for name, own in hidden.items()}
    each = {name: f"of {words(name)} from {listed(own, 3)}" for name, own in spans.items() if own}
    pelvis, said = each.pop(root, ""), []
    if pelvis:
        said.append(f"Fewer than {LEAST_OF_ROOT} markers are seen {pelvis}.")
    if each:
        said.append(f"No marker is seen {listed(list(each.values()))}.")
    return " ".join(said)


def floating_root(data: xr.Dataset) -> str:
    """The segment that nothing holds but what is seen of it; "" of a model that stands on its root."""
    if "joint_parent" not in data.coords or "coordinate_segment" not in data.coords:
        return ""
    root = str(data["joint_segment"].values[np.argmin(data["joint_parent"].values)])
    return root if (data["coordinate_segment"].values == root).sum() == 6 else ""


def too_long(unseen_s: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Whether nobody knows any more where something is that was lost so long ago (s)."""
    return np.asarray(np.asarray(unseen_s) > UNSEEN_S + 1e-9)


def in_use(seen: npt.NDArray[np.bool_], time: Array) -> npt.NDArray[np.bool_]:
    """(T, M) markers that show where the body is: seen (T, M), or not for up to `UNSEEN_S`."""
    hidden = out_of_sight(seen, [str(k) for k in range(seen.shape[1])], time)
    return np.stack([~own for own in hidden.values()], axis=1) & seen.any(axis=0)


def contact_sources(contact: Codes, undeclared: npt.NDArray[np.bool_] | None = None) -> Codes:
    """Codes (T, C) of contacts' forces, by their status (T, C) (`recordings.feet.contact`).

    Args:
        undeclared: (T,) frames in which something bears the person that no plate measures: a contact that no plate
            measures either may be what it bears, and is absent.
    """
    unmeasured = contact == UNMEASURED
    unknown = np.where(unmeasured.sum(axis=1) > 1, PRIOR, DERIVED)
    if undeclared is not None:
        unknown[undeclared] = ABSENT
    codes = np.where(unmeasured, unknown[:, None], MEASURED)
    return np.where(contact == SHARED_PLATE, PRIOR, codes).astype(np.uint8)


BRIDGED_S = 0.05
"""A stretch of frames whose plates were refused, at most, that rests on the plates before and after it: one frame of
215 took peaks, work and symmetry of a good walk with it."""


def refused_for_long(data: xr.Dataset) -> npt.NDArray[np.bool_]:
    """(T,) frames whose plates were refused, without such stretches of `BRIDGED_S` at most between others; all of them
    of a model that stands on its root, behind whose joints nothing but the plates is."""
    time, refused = np.asarray(data["time"].values), plates_refused(data)
    if "foot_contact" not in data:
        return refused
    for first, end in runs(refused):
        if first > 0 and end < len(time) and time[end] - time[first] <= BRIDGED_S + 1e-9:
            refused[first:end] = False
    return refused


def plates_refused(data: xr.Dataset) -> npt.NDArray[np.bool_]:
    """(T,) frames whose plates were refused: no number of the estimate rests on them."""
    if "verdict" not in data:
        return np.zeros(data.sizes["time"], dtype=bool)
    return np.asarray(values_of(data, "verdict")[:, -1] == REFUSED)


def wrench_sources(data: xr.Dataset) -> Codes:
    """(T, 6) of the estimated total wrench: derived from the motion alone where the plates do not measure it, or
    were refused. How contacts divide it does not matter, so no prior is in it."""
    estimated = values_of(data, "wrench_estimated")
    codes = np.zeros(estimated.shape, dtype=np.uint8)
    if "wrench_measured" in data:
        codes[np.isnan(values_of(data, "wrench_measured"))] = DERIVED
    codes[plates_refused(data)] = DERIVED
    codes[np.isnan(estimated)] = ABSENT
    return codes


def needed_wrench(data: xr.Dataset) -> Array:
    """(T, 6) N and N m: the total wrench that the movement needs, by the model. How far the plates are from it shows
    how well the two agree, which ``wrench_estimated``, made of the plates where they measure all, cannot."""
    return values_of(data, "wrench_needed" if "wrench_needed" in data else "wrench_estimated")


def measured_only(values: Array, sources: Codes) -> Array:
    """Values, NaN where they are not measured: what peaks, work, symmetry and mean curves are made of."""
    return np.where(sources == MEASURED, values, np.nan)


def measured_moments(data: xr.Dataset) -> Array:
    """(T, C) N m or N, NaN where they are not measured."""
    return measured_only(values_of(data, "moments"), moment_sources(data))


def measured_wrench(data: xr.Dataset) -> Array:
    """(T, 6) N and N m: the estimated total wrench, NaN where the plates do not measure it."""
    return measured_only(values_of(data, "wrench_estimated"), wrench_sources(data))


def legs_of(data: xr.Dataset) -> list[str]:
    """(C,) name of the foot on whose leg each coordinate moves a segment, "" for trunk, arms and root.

    A leg reaches from its foot up to, but without, the first segment that all feet share, and holds what hangs on it.
    Of a model whose feet are not known, legs are the sided limbs that hang on the root: ``thigh_r``, not ``humerus_r``.
    """
    if "coordinate_segment" not in data.coords or "joint_parent" not in data.coords:
        return [""] * data.sizes["coordinate"]
    tree, legs = tree_of(data), dict[str, str]()
    if "foot_segment" in data.coords:
        others = data["foot_declared"].values if "foot_declared" in data.coords else np.zeros(data.sizes["foot"], bool)
        chains = {
            str(foot): tree.up(str(segment))
            for foot, segment, declared in zip(data["foot"].values, data["foot_segment"].values, others, strict=True)
            if not declared
        }
        for foot, chain in chains.items():
            shared = {name for other, every in chains.items() if other != foot for name in every}
            legs |= {name: foot for name in chain if name not in shared and name not in tree.roots}
    else:
        legs = {name: _side(name) for name, parent in tree.parents.items() if parent in tree.roots and _side(name)}
    return [legs.get(tree.nearest(str(name), legs), "") for name in data["coordinate_segment"].values]


def _side(segment: str) -> str:
    for side in ("right", "left"):
        if segment.endswith((f"_{side[0]}", f"_{side}")) or segment.startswith(f"{side}_"):
            return side
    return ""


def moment_figures(estimate: Estimate, lost: str = "") -> dict[str, Any]:
    """The block ``moments`` of ``metrics.json``: in how many frames of the recording the moments are measured, derived,
    a prior and absent, by coordinate and by leg (as the worst of its moments), why, and in words by leg and joint.

    Args:
        lost: the sentence on frames in which the person was lost.
    """
    said = [str(text) for text in estimate.config.get("ground", {}).get("reasons", [])]
    reasons = [*said, *([lost] if lost else [])]
    return source_figures(estimate.data, moment_sources(estimate.data), reasons, plates=bool(estimate.recording.plates))


def source_figures(data: xr.Dataset, sources: Codes, reasons: Sequence[str], *, plates: bool) -> dict[str, Any]:
    """`moment_figures` of codes (T, C).

    Args:
        data: with the coordinates of an estimate; none of its variables is read. reasons: sentences.
        plates: whether there are any; without any, what is known is of a foot in the air.
    """
    groups = _groups(data)
    legs = {name: _count(sources[:, columns].max(axis=1)) for name, columns in groups.items()}
    why: list[str] = []
    if any(count["measured"] < len(sources) for count in legs.values()):
        why = [sentence(text) for text in reasons]
    names = [str(name) for name in data["coordinate"].values]
    moving = {str(name) for name in data["element"].values}
    spoken = {leg: [k for k in own if names[k] in moving] or own for leg, own in groups.items()}  # not of locked joints
    return {
        "what": "frames of the whole recording; measured: by plates, or nothing touches (a foot in the air); "
        "derived: from the motion, because one contact behind the joint is not "
        "measured; prior: how several contacts divide the load is assumed; absent: not known",
        "frames": len(sources),
        "legs": legs,
        "coordinates": {name: _count(sources[:, k]) for k, name in enumerate(names)},
        "reasons": list(dict.fromkeys(why)),
        "verdict": _words({leg: _by_joint(sources, names, own) for leg, own in spoken.items()}, len(sources), plates),
    }


def _groups(data: xr.Dataset) -> dict[str, list[int]]:
    """Columns by leg; all of a model whose legs are not distinguished."""
    legs, toes = legs_of(data), _toes(data)
    groups = {
        leg: [k for k, own in enumerate(legs) if own == leg and k not in toes] for leg in dict.fromkeys(legs) if leg
    }
    return groups or {"": list(range(len(legs)))}


def _toes(data: xr.Dataset) -> set[int]:
    """Columns of coordinates that move what hangs on a foot: absent when it bears load, which says nothing of a leg."""
    if "foot_segment" not in data.coords or "joint_parent" not in data.coords:
        return set()
    tree = tree_of(data)
    feet = {str(name) for name in data["foot_segment"].values}.difference(tree.roots)
    hung = {name for name, parent in tree.parents.items() if parent in feet}
    return {k for k, name in enumerate(data["coordinate_segment"].values) if str(name) in hung}


def _count(codes: Codes) -> dict[str, int]:
    return {meaning: int((codes == code).sum()) for code, meaning in enumerate(MEANINGS)}


def _by_joint(sources: Codes, names: list[str], columns: list[int]) -> dict[str, dict[str, int]]:
    """Counts by joint of a leg: of one with several coordinates, the worst of them counts."""
    joints: dict[str, list[int]] = {}
    for k in columns:
        stem = names[k].removesuffix("_r").removesuffix("_l")
        joint = next((joint for part, joint in _JOINTS.items() if part in stem), words(stem))
        joints.setdefault(joint, []).append(k)
    return {joint: _count(sources[:, own].max(axis=1)) for joint, own in joints.items()}


def _words(legs: dict[str, dict[str, dict[str, int]]], frames: int, plates: bool) -> str:
    """By leg, and by joint where these differ, those that are measured longest first."""
    what = "Moments" if "" in legs else "Leg moments"
    for meaning in MEANINGS:
        if all(count[meaning] == frames for joints in legs.values() for count in joints.values()):
            return f"{what}: {_how(meaning, plates)} in all {frames} frames."
    each, of = [], f" of {frames} frames"
    for leg, joints in legs.items():
        alike: dict[tuple[int, ...], list[str]] = {}
        for joint, count in joints.items():
            alike.setdefault(tuple(count[meaning] for meaning in MEANINGS), []).append(joint)
        parts = []
        for counts, names in sorted(alike.items(), reverse=True):
            said = []
            for meaning, number in zip(MEANINGS, counts, strict=True):
                if number or (meaning == "measured" and not any(counts)):
                    said.append(f"{_how(meaning, plates)} in {number}{of}")
                    of = ""
            parts.append((f"{listed(names)} " if len(alike) > 1 else "") + listed(said))
        each.append(f"{leg}{':' if leg and len(alike) > 1 else ''} {', '.join(parts)}".strip())
    return f"{what}: {'; '.join(each)}."


def _how(meaning: str, plates: bool) -> str:
    if meaning == "measured" and not plates:
        return "known (in the air)"
    return {"derived": "derived from the motion", "prior": "estimated with a prior"}.get(meaning, meaning)


def _sources(data: xr.Dataset, name: str, of: str, across: str) -> Codes:
    values = data[of].transpose("time", across, ...).values
    known = np.isfinite(values.reshape(*values.shape[:2], -1)).any(axis=2)
    codes = data[name].transpose("time", across).values if name in data else np.zeros(known.shape)
    return np.where(known, codes, ABSENT).astype(np.uint8)
