"""Which markers become sites of the model, and where they sit on their segments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.frames import FIRST_FRAMES, MarkedTrial
from dynakin.model.calibration.joint_motion import SKIN_ANGLE_RAD
from dynakin.model.calibration.landmarks import LandmarkFinder, Positions
from dynakin.model.calibration.posture import Posture, find_posture, frame_landmarks
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.markers.schema import Marker
from dynakin.model.mirroring import SUFFIXES
from dynakin.model.plan import Geometry, Site
from dynakin.model.schema import ModelFile, WithoutMarkers

SINCE_SKIN = 1.0
"""Standard deviation along each axis of how far skin has gone once all joints are far from standing, of the size that
the marker set declares. With a half, knees of two squats that are cut to the second at their bottom err 5.2 and
5.8 N m, with one 3.6 and 4.7 (8.4 and 8.1 without); chosen on these (`truth3d`, seeds 2 and 21)."""
_LOOKS, _NEAREST, _NEAR_RAD = 200, 5.0, np.radians(15.0)
"""Frames that are looked at, the percentile of angles that is the nearest to standing, and what is as good as there:
walks come to 3 to 12 deg."""


@dataclass(frozen=True)
class Candidate:
    """A marker of the recording and the segment of the model that it belongs to."""

    marker: Marker
    key: MarkerKey
    recorded: str
    segment: str


def candidates(model: ModelFile, match: MarkerMatch, side: str) -> tuple[list[Candidate], list[Message]]:
    """Markers of the chosen side on the model's segments, and sentences on those that are left out."""
    sites = match.sites(side, not model.sided)
    homes = {key: _home(model, m.segment, key[1]) for m, key, _ in sites}
    chosen = [Candidate(m, key, name, home) for m, key, name in sites if (home := homes[key]) is not None]
    messages = [
        note("calibration", f"Marker {name} left out: model {model.name} has no segment {marker.segment!r}.")
        for marker, key, name in sites
        if homes[key] is None
    ]
    sides = ("right", "left", "centre") if side == "both" else (side, "centre")
    absent = [
        marker.aliases(s)[0]
        for marker in match.marker_set.markers
        for s in sides
        if marker.measures(not model.sided) and marker.aliases(s) and (marker.name, s) not in match.names
    ]
    if absent:
        messages.append(note("calibration", f"Markers that the recording lacks, left out: {', '.join(absent)}."))
    return chosen, messages


def _home(model: ModelFile, name: str, side: str) -> str | None:
    """The segment that has this part of the body, or this name, on this side."""
    own = [s for s in model.segments if s.side in (None, side)]
    plain = next((s.name for s in own if name in (s.name, s.name.removesuffix(SUFFIXES.get(side, "")))), None)
    return plain or next((s.name for s in own if name in (*s.parts, *s.takes_markers_of)), None)


def as_marked(model: ModelFile, match: MarkerMatch, finder: LandmarkFinder) -> ModelFile:
    """The model without the segments that need markers or landmarks which a recording lacks (`Segment.when_marked`)."""
    optional = [segment for segment in model.segments if segment.when_marked]
    if not optional:
        return model
    homes = {_home(model, marker.segment, key[1]) for marker, key, _ in match.sites("both", not model.sided)}

    def known(name: str) -> bool:
        own, plain = finder.of_side(name)
        return own.known(plain)

    return model.without([s.name for s in optional if s.name not in homes or not all(map(known, frame_landmarks(s)))])


def find_locks(
    model: ModelFile, match: MarkerMatch, chosen: list[Candidate]
) -> tuple[dict[str, float | None], dict[str, tuple[str, ...]], list[Message]]:
    """Coordinates to lock, segments without markers with the coordinates that are locked because of that, and sentences
    on them.

    Raises:
        ModelError: a segment without markers whose model file does not say what to do then.
    """
    counts = {segment.name: 0 for segment in model.segments}
    for candidate in chosen:
        counts[candidate.segment] += 1
    by_name = {segment.name: segment for segment in model.segments}
    locks: dict[str, float | None] = {
        c.name: None if c.as_measured else c.value or 0.0 for c in model.coordinates if c.locked
    }
    bare: dict[str, tuple[str, ...]] = {}
    messages, lacking = list[Message](), list[str]()
    marked = model.tree.up(*(name for name, count in counts.items() if count))
    for name, count in counts.items():
        segment = by_name[name]
        if count == 1:
            one = next(c.recorded for c in chosen if c.segment == name)
            messages.append(
                note("calibration", f"Segment {name} has one marker only ({one}): its angle leans on its neighbours.")
            )
        if count == 2 and model.sided and segment.parent == "ground":
            one, other = (c.recorded for c in chosen if c.segment == name)
            text = (
                f"the {name} is seen by {one} and {other} alone, and turns unseen about the line between them: its "
                "tilt and the hips' flexion follow from the legs, which may have them 10 deg off, more than their "
                "deviations say. A third marker of the pelvis, away from that line, would show them."
            )
            messages.append(warning("angles", text))
        if count or all(locks.get(axis.coordinate) is not None for axis in segment.axes):
            continue
        rule = segment.without_markers
        if model.sided and rule is None:
            if segment.parent == "ground" or name in marked:
                continue  # what hangs on it shows how it moves, as far as it does
            rule = WithoutMarkers(lock_to=segment.parent)
        if rule is None:
            parts = {name, *segment.parts}
            fitting = [m for m in match.marker_set.markers if m.segment in parts and m.measures(not model.sided)]
            tried = ", ".join(alias for m in fitting for alias in (*m.right, *m.left, *m.centre))
            lacking.append(f"segment {name!r} has no marker (tried {tried or 'none, the set has none on it'})")
            continue
        joint = segment if rule.lock_to == segment.parent else by_name[rule.lock_to]
        value = None if rule.value_deg is None else float(np.deg2rad(rule.value_deg))
        bare[name] = tuple(axis.coordinate for axis in joint.axes if axis.coordinate not in locks)
        for axis in joint.axes:
            locks.setdefault(axis.coordinate, value)
        names = ", ".join(axis.coordinate for axis in joint.axes)
        at = "the angle found while standing" if rule.value_deg is None else f"{rule.value_deg:g} deg"
        messages.append(
            note(
                "calibration", f"Segment {name} has no markers: locked to {rule.lock_to} (coordinate {names} at {at})."
            )
        )
    if lacking:
        raise ModelError(
            f"{match.where}: {'; '.join(lacking)}, and the model file has no without_markers rule for "
            f"{'it' if len(lacking) == 1 else 'them'}; it has {', '.join(match.recorded)}"
        )
    return locks, bare, messages


def place_sites(
    chosen: list[Candidate],
    calibration: tuple[MarkedTrial, Posture, np.ndarray],
    trial: MarkedTrial,
    finder: LandmarkFinder,
    geometry: Geometry,
    model: ModelFile,
    needed: set[MarkerKey],
) -> tuple[list[Site], list[Message]]:
    """Local positions from the calibration frames; from later frames for a marker that is not seen there.

    Args:
        calibration: trial, standing posture and frames on which the model was measured.
        needed: markers of the landmarks, all seen in frames that can give a posture.
    """
    source, posture, frames = calibration
    standing = source.median(frames)
    flat = np.array([1.0, 1.0, 0.0 if model.planar else 1.0])
    sites: list[Site] = []
    messages: list[Message] = []
    for c in chosen:
        point = standing.get(c.key)
        if point is not None and np.isfinite(point).all():
            local = posture.to_local(c.segment, point * flat)
        elif model.sided:
            continue  # placed from frames that show it, once the rest of the body stands (`in_space`)
        else:
            later = np.flatnonzero(trial.usable(needed | {c.key}))[:FIRST_FRAMES]
            if not len(later):
                messages.append(
                    note(
                        "calibration",
                        f"Marker {c.recorded} left out: never seen together with the markers of the joint centres.",
                    )
                )
                continue
            found = []
            for frame in later:
                now = find_posture(model, geometry, finder.find(trial.median(np.array([frame]))), posture)
                found.append(now.to_local(c.segment, trial.paths[c.key][frame] * flat))
            local = np.median(found, axis=0)
            messages.append(
                note(
                    "calibration",
                    f"Marker {c.recorded} is not seen in the calibration frames: placed from "
                    f"{trial.recording.time[later[0]]:.2f} s on.",
                )
            )
        sites.append(site_of(c, local, model.sided))
    if model.sided and source.recording is not trial.recording:
        share = skin_since_standing(chosen, standing, trial, _legs(model))
        gone = {segment: SINCE_SKIN * part for segment, part in share.items()}
        sites = [replace(site, since_m=gone.get(site.segment, 0.0) * site.soft_tissue_m) for site in sites]
    return sites, messages


def skin_since_standing(
    chosen: Sequence[Candidate], standing: Positions, trial: MarkedTrial, parents: Mapping[str, str]
) -> dict[str, float]:
    """Segment -> part of its skin's way, 0 to 1, that lies between the standing trial and even the frames of the trial
    that are nearest to it, by how far its joints are turned there: as far, at least, as the angle changes between a
    line through two markers of one segment and one of the other.

    Args:
        parents: segment -> parent, of the joints that are looked at.

    A trial that comes near standing has 0: then its skin comes back to where it was measured. One that does not (a hold
    in a deep squat, pedalling) has all markers of a thigh elsewhere all the time, which looks like another hip or knee.
    """
    every = slice(None, None, max(trial.recording.n_frames // _LOOKS, 1))
    lines: dict[str, tuple[Array, Array]] = {}
    for segment in {*parents, *parents.values()}:
        own = [c.key for c in chosen if c.segment == segment and np.isfinite(standing.get(c.key, np.nan)).all()]
        if len(own) > 1:
            paths = np.stack([trial.paths[key][every] for key in own], axis=1)
            lines[segment] = _directions(np.array([standing[key] for key in own]), paths)
    gone: dict[str, list[float]] = {}
    for segment, parent in parents.items():
        if segment not in lines or parent not in lines:
            continue
        before, after = (
            np.arccos(np.clip(a @ np.swapaxes(b, -2, -1), -1.0, 1.0))
            for a, b in zip(lines[parent], lines[segment], strict=True)
        )
        change = np.abs(after - before)
        seen = np.isfinite(change).any(axis=(1, 2))
        if seen.any():
            nearest = float(np.percentile(np.nanmax(change[seen], axis=(1, 2)), _NEAREST))
            for each in (segment, parent):
                gone.setdefault(each, []).append(np.tanh(max(nearest - _NEAR_RAD, 0.0) / SKIN_ANGLE_RAD))
    return {segment: float(np.sqrt(np.mean(np.square(parts)))) for segment, parts in gone.items()}


def _legs(model: ModelFile) -> dict[str, str]:
    """Segment -> parent, of hips, knees and ankles. Arms that stand otherwise than they move later move the skin of
    shoulders, and leave the rest of a trunk where it was."""
    tree = model.tree
    return {name: tree.parents[name] for name in tree.up(*model.feet.values()) if name not in tree.roots}


def _directions(standing: Array, paths: Array) -> tuple[Array, Array]:
    """Directions (D, 3) and (T, D, 3) between markers (K, 3) m of a segment that lie far apart, standing and moving."""
    one, other = np.triu_indices(len(standing), 1)
    length = np.linalg.norm(standing[one] - standing[other], axis=1)
    far = length >= 0.5 * length.max()
    between = [places[..., one[far], :] - places[..., other[far], :] for places in (standing, paths)]
    before, after = (line / np.linalg.norm(line, axis=-1, keepdims=True) for line in between)
    return before, after


def site_of(candidate: Candidate, local: np.ndarray, in_space: bool) -> Site:
    """A marker of the set at its place (3,) m on its segment."""
    marker = candidate.marker
    assert marker.variance is not None  # the schema asks for it
    name = marker.aliases(candidate.key[1])[0]
    return Site(name, candidate.recorded, candidate.segment, local, marker.variance, marker.soft_tissue_m(not in_space))
