"""Which marker set a recording has: the one whose names explain most of its markers, checked on the body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from dynakin.errors import ModelError, RecordingError
from dynakin.messages import Message, note, together, warning
from dynakin.model.markers.anatomy import anatomy, enlarged
from dynakin.model.markers.draft.draft import drafted, further
from dynakin.model.markers.draft.guess import Guess, names_of
from dynakin.model.markers.fit import LEG, LISTED, ROOT, choice_words, fits, lacking, usable_of
from dynakin.model.markers.geometry import (
    Expected,
    Found,
    body_height_m,
    deviations,
    frames_of,
    places_of,
)
from dynakin.model.markers.marker_set import contents_of, set_of
from dynakin.model.markers.match import (
    MarkerKey,
    MarkerMatch,
    by_last_word,
    letters_of_sides,
    match_markers,
    without_prefix,
)
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.model.markers.sides import other_letter
from dynakin.model.markers.swaps import Swap, distance_words, find_swaps
from dynakin.recordings.landmarks import plain_name
from dynakin.recordings.recording import Recording
from dynakin.units import PERSON_HEIGHT_M

CORRECT = "correct the labels"
_ABOUT_AS_MANY = 0.9  # of the markers that the first set explains
_IMPOSSIBLE = 4.5  # deviations of a distance beyond which it is none of a body (2.9 at most in shared/data)
_FEW_WRONG, _MANY_WRONG = 2, 0.25
_HALF, _START_S = 0.5, 0.2
_SHORT = 0.05  # of a trial: exchanged labels that the filter's own outlier rules are for


@dataclass(frozen=True)
class Recognised:
    """A recording's markers by a set.

    Attributes:
        match: without the markers that are not where their names say.
        messages: the choice, and a warning for each of these.
        wrong_n: markers whose places contradict a body, apart from exchanged ones.
        contents: what the file of the set would say, as far as the names decided on it; None where it was asked for.
    """

    match: MarkerMatch
    messages: tuple[Message, ...]
    wrong_n: int = 0
    contents: Mapping[str, Any] | None = None


_Found = list[tuple[MarkerSetFile | None, Recognised]]  # by the set that was asked for
_FOUND: WeakKeyDictionary[Recording, _Found] = WeakKeyDictionary()
"""Of each recording, as long as it is there: it does not change, and identification and comparisons calibrate on it
several times. Exchanged labels take seconds to find."""


def recognise(recording: Recording, asked: MarkerSetFile | None = None) -> Recognised:
    """The markers of a recording by the set that is asked for, or by the built-in one that explains most of its names;
    found once.

    Names decide, then the body is asked: markers that lie elsewhere than their names say, or bear each other's names,
    are left out and said. Of sets that explain about as many names one that the body contradicts gives way.

    Raises:
        ModelError: no marker is seen, no set fits, two persons in one file, a size that nobody has, or what is left out
            leaves no pelvis or no leg.
    """
    known = _FOUND.setdefault(recording, [])
    for own, found in known:
        if own == asked:
            return found
    found = _recognised(recording, asked)
    known.append((asked, found))
    return found


def _recognised(recording: Recording, asked: MarkerSetFile | None) -> Recognised:
    where = str(recording.path or recording.name)
    if not recording.seen.any():
        raise ModelError(f"{where}: no marker is seen in {recording.n_frames} frames, expected those of a person")
    if asked is not None:
        found = checked(recording, match_markers(asked, recording.marker_names, recording.seen, where))
        _refuse_wrong_set(found, where)
        return replace(found, messages=(*found.messages, *half_marked_words(found.match)))
    found = _unasked(recording, where)
    _refuse_half(found.match)
    letters = letters_of_sides(recording.seen_names)
    if letters is None:
        return found
    said = note("marker set", f"{letters.right} is read as right and {letters.left} as left.")
    return replace(found, messages=(*found.messages, said))


def _unasked(recording: Recording, where: str) -> Recognised:
    """By the built-in set that explains most of the names, or by guesses."""
    ranked = fits(recording.seen_names)
    try:
        usable = usable_of(ranked, where)
    except ModelError as unknown:
        _refuse_several(recording, where)
        return _guessed(recording, unknown)
    best: Recognised | None = None
    for fit in usable:
        if best is not None and (not best.wrong_n or fit.explained_n < _ABOUT_AS_MANY * usable[0].explained_n):
            break
        if best is not None and fit.doubled:
            continue  # no better account of the names
        own = checked(recording, match_markers(fit.marker_set, recording.marker_names, recording.seen, where))
        if best is None or own.wrong_n < best.wrong_n:
            best = own
    assert best is not None
    _refuse_wrong_set(best, where)
    best, more = _enlarged(recording, replace(best, contents=contents_of(best.match.marker_set.name)))
    choice = choice_words(best.match, ranked)
    if more:
        choice = f"{choice.removesuffix('.')}; used by what their names say: {_places(more)}."
    doubtful, said = _doubtful(recording, more)
    messages = [note("marker set", choice), *said, *best.messages, *half_marked_words(best.match)]
    match = replace(best.match, guessed=tuple(guess.recorded for guess in doubtful))
    return replace(best, match=match, messages=tuple(messages))


def _refuse_several(recording: Recording, where: str) -> None:
    """Where names that end in one word, and those that end in another, are those of a person each.

    Raises:
        ModelError: two persons in one file.
    """
    persons = {word: own for word, own in by_last_word(recording.seen_names).items() if fits(own)[0].usable}
    if len(persons) > 1:
        words = together([repr(word) for word in persons])
        raise ModelError(
            f"{where}: the names that end in {words} are a person's each; expected one subject in a recording: export "
            "one person's markers only"
        )


def recognise_standing(static: Recording, recording: Recording, known: Recognised) -> Recognised:
    """The markers of a standing trial by the set that a recording of the same person is known to have; where that was
    not asked for, also those by what their names say which the person wears while standing only.

    Raises:
        ModelError: as `recognise`; no name is in both.
    """
    found = recognise(static, known.match.marker_set)
    where = found.match.where
    if _own_names(recording).isdisjoint(_own_names(static)):
        raise ModelError(
            f"{where}: none of its {len(static.seen_names)} markers is in {recording.name}; expected a standing trial "
            "(--static) of the same person with the same markers"
        )
    found, more = _enlarged(static, replace(found, contents=known.contents))
    found = replace(found, messages=(*_doubtful(static, more)[1], *found.messages))
    return replace(found, messages=tuple(message.of(f"standing trial {static.name}") for message in found.messages))


def _own_names(recording: Recording) -> set[str]:
    return set(map(plain_name, without_prefix(tuple(recording.seen_names)).values()))


def _refuse_half(match: MarkerMatch) -> None:
    """Where one leg is known, and names that differ from its markers' by a letter or word alone are left out.

    Raises:
        ModelError: names both letters.
    """
    sides = {side for _, side in match.names if side != "centre"}
    if len(sides) != 1:
        return
    (side,) = sides
    proper = without_prefix(match.recorded)
    used = [proper[name] for (_, own), name in match.names.items() if own == side]
    known = {*match.names.values()}
    other = other_letter(used, [own for name, own in proper.items() if name not in known])
    if other is None:
        return
    ours, theirs, names = other
    raise ModelError(
        f"{match.where}: {ours} in names is read as {side}, {theirs} is not understood and would leave half of the "
        f"body out ({', '.join(names[:LISTED])}); expected R and L for right and left, or a set of your own: "
        "dynakin markers new TRIAL -o my.toml"
    )


def half_marked_words(match: MarkerMatch) -> list[Message]:
    """A warning of each foot of which a single marker is left while the other has several."""
    return [
        warning(
            "labels",
            f"the {side} foot is seen by {lone} alone, the other by {lost} as well: what stands under it is not known "
            "by its markers, and the angles of its ankle are hardly. Look in the file whether its other markers are "
            "there under another name, or empty.",
        )
        for side, (lone, lost) in match.half_marked.items()
    ]


def _enlarged(recording: Recording, found: Recognised) -> tuple[Recognised, list[Guess]]:
    """With markers whose names the set does not know but say a place that it leaves free, and these; without those that
    the body contradicts, and without any that have a marker of the set left out. What is left out stays so."""
    more = further(recording, found.match)
    while more and found.contents is not None:
        contents = enlarged(found.contents, names_of(more))
        match = match_markers(set_of(contents), recording.marker_names, recording.seen, found.match.where)
        names = {key: name for key, name in match.names.items() if key not in found.match.left_out}
        match = replace(match, names=names | found.match.names, left_out=found.match.left_out)
        try:
            own = checked(recording, match)
        except ModelError:
            break
        own = replace(own, messages=tuple(dict.fromkeys((*found.messages, *own.messages))))
        gone = {match.names[key] for key in own.match.left_out if key in match.names}
        kept = [guess for guess in more if guess.recorded not in gone]
        if len(kept) == len(more):
            if found.match.names.items() <= own.match.names.items():
                return replace(own, wrong_n=own.wrong_n + found.wrong_n, contents=contents), more
            break
        more = kept
    return found, []


def _places(guesses: Sequence[Guess]) -> str:
    words = [f"{guess.recorded} ({guess.place or guess.segment})" for guess in guesses]
    more = f" and {len(words) - LISTED} more" if len(words) > LISTED else ""
    return ", ".join(words[:LISTED]) + more


def _on_leg_or_pelvis(guess: Guess) -> bool:
    return anatomy()["places"][guess.place].get("segment") in (ROOT, *LEG)


def _doubtful(recording: Recording, more: Sequence[Guess]) -> tuple[list[Guess], list[Message]]:
    """Guesses at places of pelvis and legs that only likely say so, and a warning of them."""
    found = [guess for guess in more if guess.place and guess.sure != "sure" and _on_leg_or_pelvis(guess)]
    return found, [_guessed_words(recording, len(found), f" ({_places(found)})")] if found else []


def _guessed_words(recording: Recording, n: int, which: str = "") -> Message:
    return warning(
        "guessed",
        f"no marker set has these names; {n} of {len(recording.seen_names)} markers{which} are used at places "
        "guessed from their names and from where they lie. Joint centres, angles and moments are as wrong as a place "
        "that is guessed wrongly. Look at them: "
        f"dynakin markers new {recording.path or 'TRIAL'} -o my.toml, then --markers my.toml",
    )


def _guessed(recording: Recording, unknown: ModelError) -> Recognised:
    """By a set of places guessed from names and from where markers lie, as far as that is likely and no body
    contradicts it.

    Raises:
        ModelError: `unknown`, where what can be guessed is too little.
    """
    where = str(recording.path or recording.name)
    try:
        contents = drafted(recording)
    except RecordingError as error:
        why = error.message.removeprefix(f"{where}: ")
        raise unknown.reworded(f"{unknown.message}; nor can places be guessed: {why}") from None
    if contents is None:
        raise unknown
    guessed = set_of(contents)
    found = checked(recording, match_markers(guessed, recording.marker_names, recording.seen, where))
    if found.wrong_n or lacking(guessed, found.match.names):
        raise unknown
    match = replace(found.match, guessed=tuple(found.match.names.values()))
    return Recognised(match, (_guessed_words(recording, len(match.names)), *found.messages), contents=contents)


def checked(recording: Recording, match: MarkerMatch) -> Recognised:
    """A match without the markers that lie elsewhere than their names say, each with a warning.

    Raises:
        ModelError: exchanged labels without which there is no pelvis or no leg, or a size that nobody has.
    """
    keys = list(match.names)
    if not keys or not recording.n_frames:
        return Recognised(match, ())
    expected = Expected.of(match, keys)
    found = Found.of(places_of(recording, match, keys, frames_of(recording)), expected)
    _refuse_wrong_size(found, expected, match.where)
    swaps, found, order = find_swaps(recording, match, keys, found, expected)
    wrong = _misplaced(match, keys, found, expected, body_height_m(found.ordered(order), expected), order)
    messages = list[Message]()
    for swap in swaps:
        match, said = _without_swap(match, swap, float(recording.time[0]))
        messages.append(said)
    for k, why in wrong.items():
        if keys[k] in match.names:
            match = match.without([keys[k]], f"{why}: it is not where its name says")
            messages.append(warning("labels", f"{why}; {recording_name(match, keys[k])} is left out: check its label."))
    return Recognised(match, tuple(messages), len(wrong))


def _refuse_wrong_size(found: Found, expected: Expected, where: str) -> None:
    """Where neither the distances that names expect nor the largest one at all can be a person's."""
    if not np.isfinite(found.distance).any():
        return
    height_m, largest_m = body_height_m(found, expected), float(np.nanmax(found.distance))
    low, high = PERSON_HEIGHT_M
    if min(height_m, largest_m) > high or max(height_m, largest_m) < low:
        raise ModelError(
            f"{where}: a person {height_m:.3g} m tall by the distances of the markers (the largest is {largest_m:.3g} "
            f"m), expected {low} to {high} m: the unit of length is probably wrong"
        )


def recording_name(match: MarkerMatch, key: MarkerKey) -> str:
    """The name of a marker by its set, for messages."""
    return match.marker_set.marker(key[0]).aliases(key[1])[0]


def _without_swap(match: MarkerMatch, swap: Swap, start_s: float) -> tuple[MarkerMatch, Message]:
    """Exchanged for less than half of the trial, and not at its start, on which places are measured: as they are."""
    when = ""
    if swap.span_s is not None:
        when = f" from {swap.span_s[0]:.2f} to {swap.span_s[1]:.2f} s"
    who = swap.what if swap.what.startswith("all ") else f"markers {swap.what}"  # no name begins a sentence
    looks = f"{who} look swapped{when} ({swap.evidence})"
    later = swap.span_s is not None and swap.span_s[0] > start_s + _START_S
    if swap.share < _SHORT or (later and swap.share < _HALF):
        return match, warning(
            "labels", f"{looks}: correct the labels; they are used as they are, and refused where they jump."
        )
    one_place = len(swap.pairs) == 1 and len({place for place, _ in swap.keys}) == 1
    here = swap.keys <= match.names.keys()  # another exchange may have had one left out
    if swap.span_s is None and one_place and here:
        # right for left of one place: both are seen, and nothing else would put both where a body has them
        return match.exchanged(*swap.pairs[0]), warning(
            "labels", f"{looks}; each is used as the other: correct the labels."
        )
    left = match.without(swap.keys, f"{looks}: {CORRECT}")
    if not lacking(match.marker_set, match.names) and (lacks := lacking(left.marker_set, left.names)):
        raise ModelError(
            f"{match.where}: {looks}, and without them there is nothing {'; '.join(lacks)}; expected the labels "
            "corrected"
        )
    both = "both are" if len(swap.keys) == 2 else "they are"
    return left, warning("labels", f"{looks}; {both} left out: correct the labels in the recording.")


def _misplaced(
    match: MarkerMatch, keys: Sequence[MarkerKey], found: Found, expected: Expected, height_m: float, order: np.ndarray
) -> dict[int, str]:
    """Markers at distances that no body has, and what shows it; one by one, the worst first."""
    far = np.abs(deviations(found.ordered(order), expected, height_m).distance)
    known = np.isfinite(expected.distance) & np.isfinite(found.distance[np.ix_(order, order)])
    wrong: dict[int, str] = {}
    while True:
        beyond = (far > _IMPOSSIBLE) & known
        n = beyond.sum(axis=1)
        if not n.any():
            return wrong
        k = int(np.argmax(n + far.sum(axis=1) / (1.0 + far.sum())))
        j = int(np.argmax(np.where(beyond[k], far[k], 0.0)))
        wrong[k] = "markers " + distance_words(
            match.names[keys[k]], match.names[keys[j]], float(found.distance[order[k], order[j]]),
            float(expected.distance[k, j]) * height_m,
        )  # fmt: skip
        known[k], known[:, k] = False, False
        if n[k] == 1 and not known[j].any():  # two alone: either may be the wrong one
            wrong[j] = wrong[k]


def _refuse_wrong_set(found: Recognised, where: str) -> None:
    total = len(found.match.names) + len(found.match.left_out)
    if found.wrong_n > max(_FEW_WRONG, _MANY_WRONG * total):
        example = found.messages[0]  # `checked` says nothing but warnings
        raise ModelError(
            f"{where}: the names fit marker set {found.match.marker_set.name}, but {found.wrong_n} of {total} markers "
            f"are not where it says ({example.text.split(';')[0]}); expected the set that was "
            "used, or one of your own: dynakin markers new TRIAL -o my.toml"
        )


def foot_markers_of(recording: Recording) -> dict[str, list[str]]:
    """Side -> markers on its foot by the built-in set that fits a recording best; none where none fits."""
    try:
        return recognise(recording).match.foot_markers
    except ModelError:
        return {"right": [], "left": []}
