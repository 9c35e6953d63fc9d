"""Finds the markers of a set among a recording's names, however a laboratory spells them."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from dynakin.errors import ModelError
from dynakin.model.markers.schema import Marker, MarkerSetFile
from dynakin.model.markers.sides import SIDE_WORDS, SideLetters, side_letters, words_of
from dynakin.model.mirroring import OTHER_SIDE
from dynakin.recordings.landmarks import FacingPairs, plain_name

MarkerKey = tuple[str, str]
"""(name of the marker in its set, "right", "left" or "centre")."""

SIDES = ("right", "left", "centre")
_SIDE_WORDS = {"r": "right", "right": "right", "l": "left", "left": "left"}
_SEPARATORS = re.compile(r"[\s._\-()]+")
_LAST_WORD = re.compile(r"[ _.:-]+")
_UNLABELLED = re.compile(r"(?:\*|(?:unlabel|uname|unnamed|unidentified)).*", re.IGNORECASE)
_FEWEST_OF_A_PERSON = 3  # names behind a prefix by which it counts as a person's


@dataclass(frozen=True)
class MarkerMatch:
    """Which name in the recording each marker of the set has.

    Attributes:
        names: of each marker of the set that the recording has, its name there.
        recorded: all names in the recording.
        where: the recording, for messages.
        left_out: markers that the recording has under the set's name, but not at their place; why not.
        guessed: recorded names whose places on pelvis and legs no set of that name has: guessed.
    """

    marker_set: MarkerSetFile
    names: dict[MarkerKey, str]
    recorded: tuple[str, ...]
    where: str
    left_out: dict[MarkerKey, str] = field(default_factory=dict)
    guessed: tuple[str, ...] = ()

    @property
    def facing_pairs(self) -> FacingPairs:
        """The recorded names of the markers that show which way the person faces and stands."""
        feet = [self.heel_toe(side) or self._pair(side, None, _ANKLES, _TOES) for side in ("right", "left")]
        pelvis = [
            self._pair(side, self.marker_set.pelvis_back_front, ("PSI", "SACR"), ("ASI",)) for side in ("right", "left")
        ]
        return FacingPairs(
            heel_toe=tuple(pair for pair in feet if pair),
            pelvis=tuple(pair for pair in pelvis if pair),
            across=tuple(
                (self.names[name, "right"], self.names[name, "left"])
                for name in dict.fromkeys(name for name, _ in self.names)
                if name in _ACROSS and (name, "right") in self.names and (name, "left") in self.names
            ),
            above=self._of(_HIGH),
            below=self._of(_LOW),
        )

    def heel_toe(self, side: str) -> tuple[str, str] | None:
        """The recorded names of heel and toe of a foot: the set's own pair, or what is there in its place."""
        return self._pair(side, self.marker_set.heel_toe, _HEELS, _TOES)

    def _pair(
        self, side: str, own: tuple[str, str] | None, back: Sequence[str], front: Sequence[str]
    ) -> tuple[str, str] | None:
        """The first pair whose both markers are there; a middle marker counts for either side."""
        for pair in (*((own,) if own else ()), *((b, f) for b in back for f in front)):
            found = [self.names.get((name, side)) or self.names.get((name, "centre")) for name in pair]
            if found[0] and found[1]:
                return found[0], found[1]
        return None

    def _of(self, places: Sequence[str]) -> tuple[str, ...]:
        return tuple(name for (marker, _), name in self.names.items() if marker in places)

    @property
    def foot_markers(self) -> dict[str, list[str]]:
        """Side -> the recorded names of the markers on its foot: those on the segment of heel and toe. None of a foot
        that is `half_marked`: where its sole is, and what it bears, nobody sees."""
        half = self.half_marked
        return {side: [] if side in half else names for side, names in self._on_feet().items()}

    @property
    def half_marked(self) -> dict[str, tuple[str, str]]:
        """Side of a foot that has a single marker while the other has several -> the recorded names of that marker and
        of one on the other foot whose like is not seen."""
        found = {}
        feet = self._on_feet()
        for side, other in OTHER_SIDE.items():
            if len(feet[side]) == 1 and len(feet[other]) > 1:
                lone = next(key for key, name in self.names.items() if name == feet[side][0])
                lost = next(
                    name
                    for (key, own), name in self.names.items()
                    if own == other and name in feet[other] and key != lone[0]
                )
                found[side] = (feet[side][0], lost)
        return found

    def _on_feet(self) -> dict[str, list[str]]:
        set_ = self.marker_set
        segments = {set_.marker(name).segment for name in set_.heel_toe or ()} | {"foot", "toes"}
        own = [marker.name for marker in set_.markers if marker.segment in segments]
        return {
            side: [self.names[name, side] for name in own if (name, side) in self.names] for side in ("right", "left")
        }

    def sites(self, side: str, planar: bool = True) -> list[tuple[Marker, MarkerKey, str]]:
        """Markers that become sites of a planar model on "right", "left" or "both" sides, or of one in space; in the
        order of the set."""
        sides = ("centre", "right", "left") if side == "both" else ("centre", side)
        keys = [(m, (m.name, s)) for m in self.marker_set.markers if m.measures(planar) for s in sides if m.aliases(s)]
        return [(marker, key, self.names[key]) for marker, key in keys if key in self.names]

    def absent(self, name: str) -> str:
        """Words for a marker that the recording lacks: why it is left out, or the aliases tried."""
        for (left_out, _), why in self.left_out.items():
            if left_out == name:
                return f"marker {name} cannot be used: {why}"
        marker = self.marker_set.marker(name)
        return (
            f"marker {name} is not in the recording (tried {', '.join((*marker.right, *marker.left, *marker.centre))})"
        )

    def without(self, keys: Iterable[MarkerKey], why: str) -> MarkerMatch:
        """The same without some markers."""
        gone = set(keys)
        kept = {key: name for key, name in self.names.items() if key not in gone}
        return replace(self, names=kept, left_out=self.left_out | dict.fromkeys(sorted(gone), why))

    def exchanged(self, one: MarkerKey, other: MarkerKey) -> MarkerMatch:
        """The same with two markers that bear each other's names."""
        names = {**self.names, one: self.names[other], other: self.names[one]}
        return replace(self, names=names)

    @property
    def unexplained(self) -> tuple[str, ...]:
        """Recorded names, apart from those that a system gives to markers without one, that the set does not know."""
        known = set(self.names.values())
        gone = set(self.left_out)
        spelt = {
            plain_name(a) for m in self.marker_set.markers for s in SIDES if (m.name, s) in gone for a in m.aliases(s)
        }
        return tuple(
            name
            for name in self.recorded
            if name not in known and plain_name(name) not in spelt and not is_unlabelled(name)
        )


# Places of the body (anatomy.toml) that give directions where the set's own pairs are not seen.
_HEELS = ("HEE", "HEL", "HEM")
_ANKLES = ("AJ", "ANK", "AJC", "ANM")
_TOES = ("TOE", "MT1", "MT5", "HAL", "SMT")
_ACROSS = ("ASI", "HJ", "HJC", "PSI", "GTR", "ILC", "SHO", "SJ", "KNE", "KJ", "KJC", "ANK", "AJ", "AJC")
_HIGH = ("ASI", "PSI", "SACR", "ILC", "HJ", "HJC", "GTR", "SHO", "SJ", "C7", "CLAV", "STRN", "T10")
_LOW = ("ANK", "ANM", "AJ", "AJC", "HEE", "HEL", "HEM", *_TOES)


def is_unlabelled(name: str) -> bool:
    """Whether a name is what systems call points that nobody named (``*115``)."""
    return not name.strip() or _UNLABELLED.fullmatch(name.rsplit(":", 1)[-1].strip()) is not None


@dataclass(frozen=True)
class Spellings:
    """A recording's names, ready to be looked up.

    Attributes:
        plain: name without prefix, case and separators -> names so spelt.
        of_side: (side, rest of the name) -> names that say their side by a letter or word before or behind the rest.
    """

    plain: dict[str, list[str]]
    of_side: dict[tuple[str, str], list[str]]

    @classmethod
    def of(cls, names: Iterable[str]) -> Spellings:
        """Looks at the names together: a prefix that all share is none of their own."""
        plain: dict[str, list[str]] = defaultdict(list)
        of_side: dict[tuple[str, str], list[str]] = defaultdict(list)
        proper = without_prefix(tuple(names))
        letters = side_letters(proper)
        for name, own in proper.items():
            plain[plain_name(own)].append(name)
            side, rest = _side_and_rest(letters.english.get(name, own) if letters else own)
            if side:
                of_side[side, rest].append(name)
        return cls(dict(plain), dict(of_side))

    def named(self, alias: str, side: str) -> list[str]:
        """Names for an alias of a set on a side ("centre": without one)."""
        spelt = plain_name(alias)
        found = self.plain.get(spelt)
        if found or side == "centre":
            return found or []
        return self.of_side.get((side, _rest_of(spelt, side)), [])


def without_prefix(names: tuple[str, ...]) -> dict[str, str]:
    """Each name without what stands before a colon and without the prefix that all of them share ("S01_LASI"), or
    that distinguishes persons ("S1_LASI", "S2_LASI"); ones without a label are left away."""
    own = {name: name.rsplit(":", 1)[-1].strip() for name in names if not is_unlabelled(name)}
    if len(own) < _FEWEST_OF_A_PERSON:
        return own
    ordered = sorted(word.casefold() for word in own.values())
    differ = (k for k, (a, b) in enumerate(zip(ordered[0], ordered[-1], strict=False)) if a != b)
    shared = ordered[0][: next(differ, len(ordered[0]))]
    ends = [match.end() for match in _SEPARATORS.finditer(shared)]
    for end in reversed(ends):
        words = [word for word in _SEPARATORS.split(shared[:end]) if word]
        if words and words[-1] not in _SIDE_WORDS:
            return {name: word[end:] for name, word in own.items()}
    persons = {} if side_letters(own) else _persons(own)
    return {name: persons.get(name, word) for name, word in own.items()}


def letters_of_sides(names: Iterable[str]) -> SideLetters | None:
    """The letters of another language by which a recording's names say their side, None where there are none."""
    return side_letters(without_prefix(tuple(names)))


def _persons(own: dict[str, str]) -> dict[str, str]:
    """Names without the first word, where all begin with one of a few words, followed by the same rests."""
    split = {name: _SEPARATORS.split(word, maxsplit=1) for name, word in own.items()}
    if any(len(parts) < 2 or parts[0].casefold() in SIDE_WORDS for parts in split.values()):
        return {}
    groups: dict[str, set[str]] = defaultdict(set)
    for first, rest in split.values():
        groups[first.casefold()].add(plain_name(rest))
    sizes = sorted(len(rests) for rests in groups.values())
    in_all = set.intersection(*groups.values())
    if len(groups) < 2 or sizes[0] < _FEWEST_OF_A_PERSON or 2 * len(in_all) < sizes[-1]:
        return {}
    return {name: rest for name, (_, rest) in split.items()}


def by_last_word(names: Iterable[str]) -> dict[str, list[str]]:
    """Last word of names ("2" of "LASI_2", "(2)" of two markers of one name) -> what stands before it, of words that as
    many names have as a person needs."""
    groups: dict[str, list[str]] = defaultdict(list)
    for name in names:
        parts = _LAST_WORD.split(name.strip())
        if len(parts) > 1 and not is_unlabelled(name):
            groups[parts[-1]].append(name.strip()[: -len(parts[-1]) - 1])
    return {word: rests for word, rests in groups.items() if len(rests) >= _FEWEST_OF_A_PERSON}


def _side_and_rest(name: str) -> tuple[str, str]:
    words = words_of(name)
    if len(words) > 1:
        for at, rest in ((0, words[1:]), (-1, words[:-1])):
            side = _SIDE_WORDS.get(words[at].casefold())
            if side:
                return side, plain_name("".join(rest))
    plain = plain_name(name)
    for word in ("right", "left", "r", "l"):
        if plain.startswith(word) and len(plain) > len(word):
            return _SIDE_WORDS[word], plain[len(word) :]
    return "", plain


def _rest_of(plain_alias: str, side: str) -> str:
    for word in (side, side[0]):
        if plain_alias.startswith(word):
            return plain_alias[len(word) :]
    for word in (side, side[0]):
        if plain_alias.endswith(word):
            return plain_alias[: -len(word)]
    return plain_alias


def match_markers(
    marker_set: MarkerSetFile, recorded: Iterable[str], present: Iterable[bool], where: str
) -> MarkerMatch:
    """Finds each marker of the set among the recorded names.

    Args:
        recorded: names of the recording, in its order.
        present: whether that marker is seen at all; one that is blank everywhere counts as absent.

    Raises:
        ModelError: two recorded names fit the same marker (two subjects in one file, say).
    """
    names = tuple(recorded)
    seen = [name for name, there in zip(names, present, strict=True) if there]
    found, doubled = found_markers(marker_set, Spellings.of(seen))
    if doubled:
        alias, fits = next(iter(doubled.items()))
        more = f", and so it is with {len(doubled) - 1} more" if len(doubled) > 1 else ""
        raise ModelError(
            f"{where}: {' and '.join(fits)} both fit marker {alias} of set {marker_set.name}{more}; expected one "
            "subject in a recording: export one person's markers only"
        )
    return MarkerMatch(marker_set, found, names, where)


def found_markers(marker_set: MarkerSetFile, spelt: Spellings) -> tuple[dict[MarkerKey, str], dict[str, list[str]]]:
    """The name of each marker that is there, and aliases that several names fit, with these.

    An earlier alias wins over a later one, and no name is given to two markers: the first in the set has it.
    """
    found: dict[MarkerKey, str] = {}
    doubled: dict[str, list[str]] = {}
    taken: set[str] = set()
    for marker in marker_set.markers:
        for side in SIDES:
            for alias in marker.aliases(side):
                fits = [name for name in spelt.named(alias, side) if name not in taken]
                if len(fits) > 1:
                    doubled[alias] = fits
                if fits:
                    found[marker.name, side] = fits[0]
                    taken.add(fits[0])
                    break
    return found, doubled
