"""A draft of a marker set: every marker of a recording with the place or segment that it probably has, and why.

Which markers keep their distance to which was tried as a third source and left out: skin makes a thigh less rigid than
pelvis and trunk are together, and 5 of 230 clusters of recordings with hidden names came out worse, none better.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Container, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.model.markers.anatomy import anatomy
from dynakin.model.markers.draft.by_geometry import (
    Stature,
    alike_on_both_sides,
    fit_person,
    lies_at,
    mirrored_node,
    segment_at,
)
from dynakin.model.markers.draft.by_name import Said, Sure, places, said_together
from dynakin.model.markers.draft.guess import Guess, contents, is_text, names_in_set, printable, rest_of
from dynakin.model.markers.match import MarkerMatch, is_unlabelled
from dynakin.recordings.frame import UPRIGHT
from dynakin.recordings.landmarks import DEFAULT_PAIRS, plain_name
from dynakin.recordings.orientation import find_forward
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window
from dynakin.recordings.vertical import find_vertical

GUESSED = "guessed"
"""Name of the marker set of places that a recording's markers probably have."""
_BONES = re.compile(r"^(PEL|[LR](?:FE|TI|FO|TO|CL|HU|RA|HN)|HED|TRX)[OALP]$")
_COMPUTED = re.compile(r"cent(er|re)ofmass|ground$|virtual|^mid(asis|psis|clavicle)")
_LIKELY_MARGIN, _LEAST_MARGIN = 3.0, 1.0
"""By how much the next best place must fit worse (standard deviations squared). On 14 recordings of six laboratories
with their names hidden 104 of 106 likely places are right, and 94 of 138 unsure ones; limits were set with them in
view. Of six simulated persons 129 of 131 likely ones are right: how far people lean was chosen with these in view."""
_FIRM_FIT, _FIT = 8.0, 9.0
"""Mean cost of a marker up to which the person stands as the list of places has it, and beyond which nobody does."""
_FOLLOWED = ("pelvis", "thigh", "shank", "foot")
"""Segments to which markers that a set does not know, and that mark no place, are added: those of an arm that a set
leaves out (opencap's forearm) say little."""
_RANK: dict[Sure, int] = {"sure": 0, "likely": 1, "unsure": 2}


def guess_markers(recording: Recording) -> list[Guess]:
    """A guess for each marker that is seen, in the order of the recording.

    Raises:
        RecordingError: no marker with a name is seen, or two have one name but for case and separators.
    """
    names, at = _standing(recording)
    where = recording.path or recording.name
    if not names:
        raise RecordingError(f"{where}: no marker with a name is seen, expected some")
    alike: dict[str, list[str]] = defaultdict(list)
    for name in names:
        alike[plain_name(name)].append(name)
    doubled = next((same for same in alike.values() if len(same) > 1), None)
    if doubled is not None:
        raise RecordingError(
            f"{where}: markers {' and '.join(map(printable, doubled))} have one name but for case, separators or what "
            "stands before a colon, expected names that differ, of one person"
        )
    stands = standing_window(recording) is not None
    spoken = said_together(names)
    by_name = {k: spoken[name] for k, name in enumerate(names) if name in spoken}
    named = {k: (f.place, f.side) for k, f in by_name.items() if f.place in places() and f.side is not None}
    person = _person(recording, at, {k: (str(place), str(side)) for k, (place, side) in named.items()})
    guesses = []
    for k, name in enumerate(names):
        spelt = by_name.get(k)
        lies = _placed(name, person, k, stands)
        if spelt is not None and spelt.segment == "head" and _segment_of(lies) == "head" and lies.place:
            guesses.append(replace(lies, why=f"{spelt.why}, and {lies.why}"))  # a head needs places, not only markers
        elif spelt is not None:
            guess = Guess(name, spelt.place, spelt.segment, spelt.side or "", spelt.sure, spelt.why)
            guesses.append(_checked(guess, person, k, stands))
        else:
            guesses.append(lies)
    return _without_rivals(_as_on_the_other_side(_one_each(guesses), spoken), names, person, spoken)


def drafted(recording: Recording) -> dict[str, Any] | None:
    """What the file of a marker set says that holds what is at least likely among the guesses; None where nothing is.

    Raises:
        RecordingError: as `guess_markers`.
    """
    guesses = [guess for guess in guess_markers(recording) if _RANK[guess.sure] <= _RANK["likely"]]
    if not any(guess.place for guess in guesses):
        return None
    places_, clusters = contents(guesses)
    return {
        "schema_version": 1,
        "name": GUESSED,
        "places": {place: names_in_set(own) for place, own in places_.items()},
        "clusters": {segment: [entry for entry, _ in own] for segment, own in clusters.items()},
    }


def further(recording: Recording, match: MarkerMatch) -> list[Guess]:
    """Guesses at names that a match does not know, as far as the name says them, the body agrees, and the place is free
    and no other name's."""
    left, taken = set(match.unexplained), {*match.names, *match.left_out}
    if not left or not any(_may_be_used(own) for name, own in _spoken(recording).items() if name in left):
        return []  # before all is guessed: where markers lie takes long
    try:
        guesses = guess_markers(recording)
    except RecordingError:
        return []  # names that differ by case alone: which is which nobody knows
    spoken = said_together(guess.recorded for guess in guesses)
    claims = Counter((own.place, own.side) for name, own in spoken.items() if name in left)
    sided = {marker.name: not marker.centre for marker in match.marker_set.markers}
    found = []
    for guess in guesses:
        if guess.recorded not in left or guess.sure == "unsure" or guess.recorded not in spoken:
            continue
        if guess.place is None:
            fits = guess.segment in _FOLLOWED
        else:
            computed = anatomy()["places"][guess.place].get("landmark_only", False)
            free = (guess.place, guess.side) not in taken and claims[guess.place, guess.side] == 1
            fits = free and not computed and sided.get(guess.place, guess.side != "centre") == (guess.side != "centre")
        if fits:
            found.append(guess)
    return found


def _spoken(recording: Recording) -> dict[str, Said]:
    return said_together(_standing(recording)[0])


def _may_be_used(own: Said) -> bool:
    """Whether `further` may use a marker whose name says this; a head's may get a place by where they lie."""
    return own.place is not None or own.segment in (*_FOLLOWED, "head")


def _standing(recording: Recording) -> tuple[list[str], Array]:
    """Names and places (M, 3) m, laboratory frame, of what a person wears, while standing or at the start."""
    bones = [name for name in recording.marker_names if _BONES.match(name)]
    drawn = {name[:-1] for name in bones if sum(other[:-1] == name[:-1] for other in bones) >= 3}
    window = standing_window(recording)
    found: dict[str, Array] = {}
    for name in recording.marker_names:
        if not is_text(name):
            continue  # no file can hold the name
        if (name in bones and name[:-1] in drawn) or _COMPUTED.search(plain_name(name)) or is_unlabelled(name):
            continue  # points of a model that software drew, unlabelled trajectories
        path = recording.marker(name)
        seen: npt.NDArray[np.bool_] = np.asarray(np.isfinite(path).all(axis=1))
        here = seen.copy()
        if window is not None:
            here[: window.start], here[window.stop :] = False, False
        if seen.any():
            found[name] = np.median(path[here if here.any() else seen][:50], axis=0)
    return list(found), np.array(list(found.values())).reshape(-1, 3)


def _person(recording: Recording, at: Array, named: dict[int, tuple[str, str]]) -> Stature | None:
    axis, _ = find_vertical(recording, DEFAULT_PAIRS)
    turned = np.array(UPRIGHT[axis][0])
    forward = None
    if standing_window(recording) is None:
        try:
            ahead = turned @ find_forward(recording, turned[1], DEFAULT_PAIRS)[0]
            forward = ahead[[0, 2]]
        except RecordingError:
            pass  # nobody walks: the posture shows it
    person = fit_person(at @ turned.T, named, forward)
    if person is None or person.cost > _FIT * len(at):
        return None
    return person


def _checked(guess: Guess, person: Stature | None, marker: int, stands: bool) -> Guess:
    """What a name says, held against where the marker lies."""
    if person is None:
        if guess.side:
            return guess
        return replace(guess, place=None, segment=None, side="centre", sure="unsure", why=f"{guess.why}, side unknown")
    fits, side = lies_at(person, marker, guess.place) if guess.place else (True, lies_at(person, marker, "")[1])
    if not guess.side and side == "centre" and guess.place:
        return replace(guess, place=None, side=side, sure="unsure", why=f"{guess.why}, but in the middle: computed?")
    if not guess.side:
        return replace(guess, side=side, sure="unsure", why=f"{guess.why}; the side is where it lies")
    if not stands:
        return guess
    if not fits:
        return replace(guess, sure="unsure", why=f"{guess.why}, BUT IT LIES ELSEWHERE")
    if "centre" not in (side, guess.side) and side != guess.side and abs(person.scaled[marker][2]) > 0.03:
        return replace(guess, sure="unsure", why=f"{guess.why}, BUT IT LIES ON THE {side.upper()}")
    return guess


def _placed(name: str, person: Stature | None, marker: int, stands: bool) -> Guess:
    """What the place says where the name says nothing."""
    if person is None:
        return Guess(name, None, None, "centre", "unsure", "its name says nothing, and nobody stands in the recording")
    node, margin = person.nodes[marker], float(person.margins[marker])
    side = lies_at(person, marker, "")[1]
    if node is not None and margin >= _LEAST_MARGIN:
        firm = (
            stands
            and person.cost <= _FIRM_FIT * len(person.nodes)
            and margin >= _LIKELY_MARGIN
            and not places()[node[0]].get("loose")
        )
        sure: Sure = "likely" if firm and alike_on_both_sides(person, marker) else "unsure"
        return Guess(name, node[0], None, node[1], sure, f"where it lies (next best is worse by {margin:.1f})")
    mirrored = mirrored_node(person, marker, _LEAST_MARGIN)
    if mirrored is not None:
        return Guess(name, mirrored[0], None, mirrored[1], "unsure", "it lies as the one on the other side")
    segment = segment_at(person, marker)
    return Guess(name, None, segment, side, "unsure", "where it lies, at no usual place")


_ALONE = ("CLAV", "STRN")  # places of one kind: a marker there alone may as well be at the other, or between
_OUTWARD = {"ANK": 1.0, "ANM": -1.0}  # side of the line from heel to toe, which shows better than where the foot stands
_OFF_LINE = 0.006  # of the height
_TURNED_OUT = np.array([0.98, 0.0, 0.17])  # a right foot, as people stand


def _without_rivals(
    guesses: list[Guess], names: list[str], person: Stature | None, spoken: Container[str]
) -> list[Guess]:
    """Places known only by where markers lie, as markers that follow the segment where a neighbour of the place is as
    good a reading."""
    if person is None:
        return guesses
    at = {(g.place, g.side): person.scaled[names.index(g.recorded)] for g in guesses if g.place}
    found = []
    for guess in guesses:
        doubt = ""
        if guess.place in _ALONE and sum((place, "centre") in at for place in _ALONE) == 1:
            doubt = f"; {' or '.join(_ALONE)}, or near them"
        if guess.place in _OUTWARD and not _on_its_side(guess, at):
            doubt = f"; {' or '.join(_OUTWARD)}"
        if doubt and guess.sure == "likely" and guess.recorded not in spoken:
            segment = str(anatomy()["places"][guess.place]["segment"])
            guess = replace(guess, place=None, segment=segment, why=guess.why + doubt)
        found.append(guess)
    return found


def _on_its_side(guess: Guess, at: Mapping[tuple[str, str], Array]) -> bool:
    """Whether an ankle's marker lies on its place's side of the foot."""
    heel, toe = at.get(("HEE", guess.side)), at.get(("TOE", guess.side))
    if heel is None:
        return False
    right = 1.0 if guess.side == "right" else -1.0
    ahead, _, aside = (_TURNED_OUT if toe is None else toe - heel) * [1.0, 1.0, right if toe is None else 1.0]
    own = at[str(guess.place), guess.side] - heel
    outward = right * (own[2] * ahead - own[0] * aside) / np.hypot(ahead, aside)
    return bool(outward * _OUTWARD[str(guess.place)] > _OFF_LINE)


def _one_each(guesses: list[Guess]) -> list[Guess]:
    """One marker a place and side: the surest; the others follow its segment."""
    best: dict[tuple[str, str], Guess] = {}
    for guess in guesses:
        key = (guess.place or "", guess.side)
        if guess.place and (key not in best or _RANK[guess.sure] < _RANK[best[key].sure]):
            best[key] = guess
    found = []
    for guess in guesses:
        if guess.place and best[guess.place, guess.side] is not guess:
            segment = anatomy()["places"][guess.place].get("segment")
            why = f"{guess.why}: {guess.place}, which {best[guess.place, guess.side].recorded} is"
            guess = replace(guess, place=None, segment=segment, sure="unsure", why=why)
        found.append(guess)
    return found


def _as_on_the_other_side(guesses: list[Guess], spoken: Container[str]) -> list[Guess]:
    """Names that say nothing and differ in the side only mark one place: that of whichever has one."""
    unsaid = [guess for guess in guesses if guess.side != "centre" and guess.recorded not in spoken]
    taken = {(guess.place, guess.side) for guess in guesses}
    found = []
    for guess in guesses:
        mates = [g for g in unsaid if g.side != guess.side and rest_of(g.recorded) == rest_of(guess.recorded)]
        if guess in unsaid and not guess.place and len(mates) == 1 and mates[0].place:
            place = mates[0].place
            if (place, guess.side) not in taken:
                why = f"it is named as {mates[0].recorded} on the other side"
                guess = replace(guess, place=place, segment=None, sure="unsure", why=why)
        found.append(guess)
    return found


def _segment_of(guess: Guess) -> str:
    return str(guess.segment or anatomy()["places"].get(guess.place, {}).get("segment", ""))
