"""From which markers the landmarks of a model are found: those that it needs, those of the table, those that are seen
together."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from dynakin.errors import ModelError
from dynakin.messages import Message, warning
from dynakin.model.calibration.completion import free
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.calibration.needs import in_words, needs
from dynakin.model.calibration.posture import frame_landmarks
from dynakin.model.calibration.sites import as_marked, candidates, find_locks
from dynakin.model.markers.fit import lacking
from dynakin.model.markers.match import MarkerKey, MarkerMatch
from dynakin.model.schema import ModelFile
from dynakin.model.table import BodyTable
from dynakin.results.naming import words


def in_both(match: MarkerMatch, other: MarkerMatch) -> MarkerMatch:
    """Only markers that both recordings have, so that a joint centre is the same recipe in both."""
    if other is match:
        return match
    names = {key: name for key, name in match.names.items() if key in other.names}
    recorded = tuple(name for name in match.recorded if name in other.recorded)
    where, left_out = f"{match.where} with {other.where}", match.left_out | other.left_out
    return MarkerMatch(match.marker_set, names, recorded, where, left_out)


def _refuse_unnamed(model: ModelFile, finder: LandmarkFinder, wanted: Collection[str]) -> None:
    """Refuse a set that has no place from which a landmark follows, with the places that would do (`needs.missing`)."""
    said = []
    for need in needs(model):
        if need.landmark in wanted and not finder.has_recipe(need.landmark):
            parts = " and ".join(words(name) for name in need.segments)
            line = f"no marker shows where the {words(need.landmark)} is, which {parts} need: {in_words(need)}"
            said.append(f"{line} (or no marker on {parts}, which is then held still)" if need.optional else line)
    if said:
        raise ModelError(
            f"{finder.match.where}, marker set {finder.match.marker_set.name}, model {model.name}: {'; '.join(said)}. "
            "Expected one of these places in the set (dynakin markers places says what they are)"
        )


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
        _refuse_unnamed(model, finder, wanted)
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


def seen_together(
    model: ModelFile, finder: LandmarkFinder, match: MarkerMatch, source: MarkedTrial
) -> tuple[LandmarkFinder, list[Message]]:
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
        warning(
            "calibration",
            f"no frame of {source.recording.name} shows all markers of the joint centres: measured without "
            f"{', '.join(apart.values())}, which {'is' if len(apart) == 1 else 'are'} not seen when the others are.",
        )
    ]
