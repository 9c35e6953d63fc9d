"""Words and letters by which names say right and left, and the language in which a recording says it."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from dynakin.recordings.landmarks import plain_name

# fmt: off
LONG_SIDE_WORDS = {
    "right": (
        "right", "rechts", "derecha", "derecho", "rechter", "direita", "direito", "droite", "droit",
        "destro", "destra", "rt", "dx", "r",
    ),
    "left": (
        "left", "links", "izquierda", "izquierdo", "linker", "esquerda", "esquerdo", "gauche", "sinistro",
        "sinistra", "lt", "sx", "l",
    ),
}
# fmt: on
"""Words for right and left in several languages."""
SHORT_SIDE_WORDS = {"right": ("re", "d"), "left": ("li", "g")}
"""German and French: only where nothing else says the side, and a letter only behind a place or a French segment: d
elsewhere counts the markers of a cluster."""
SIDE_WORDS = frozenset(word for words in (LONG_SIDE_WORDS, SHORT_SIDE_WORDS) for own in words.values() for word in own)
"""Words for right and left in all languages that names are read in."""

_ENGLISH = (("r", "l"), ("right", "left"), ("rt", "lt"))
_LETTERS = (
    ("d", "i"), ("d", "g"), ("d", "s"), ("d", "e"), ("d", "l"), ("p", "l"), ("h", "v"), ("o", "v"), ("p", "v"),
    ("j", "b"), ("d", "k"),
)  # fmt: skip
"""First letters of right and left: Spanish, French, Italian and Romanian, Portuguese and Catalan, South Slavic, West
Slavic, Scandinavian, Finnish, Estonian, Hungarian, Lithuanian. A letter alone says little (P, posterior; D, distal), so
that two of them are sides only where most names of a recording differ by them. (Latvian, whose right is an L, is not
among them.)"""
_FEWEST = 4
"""Places that both letters have: a pelvis and a leg, and more than the three of a cluster."""
_MOST = 0.5  # of a recording's names have one of the two letters
_FEWEST_LEFT_OUT = 3  # names that differ by the same letter from those that are used
_NUMBERED = re.compile(r"[a-z]{0,2}\d+")  # says no place: U101, D1
_WORDS = re.compile(r"[\s._\-()]+|(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


def words_of(name: str) -> list[str]:
    """The words of a name, parted by separators and by capitals."""
    return [word for word in _WORDS.split(name) if word]


@dataclass(frozen=True)
class _Reading:
    """A name as a word or letter at one end and the rest."""

    end: str
    word: str
    rest: str


def _readings(name: str) -> Iterator[_Reading]:
    words = words_of(name)
    if len(words) > 1:
        yield _Reading("first", words[0].casefold(), plain_name("".join(words[1:])))
        yield _Reading("last", words[-1].casefold(), plain_name("".join(words[:-1])))
    plain = plain_name(name)
    if len(plain) > 1:
        yield _Reading("first", plain[0], plain[1:])
        yield _Reading("last", plain[-1], plain[:-1])


@dataclass(frozen=True)
class SideLetters:
    """Letters of another language by which most names of a recording say their side.

    Attributes:
        right, left: as names have them, in capitals.
        english: each of these names -> the same with R or L before the rest.
    """

    right: str
    left: str
    english: dict[str, str]


def side_letters(names: Mapping[str, str]) -> SideLetters | None:
    """The language of a recording's sides, None where it is English or none is known.

    Two letters at one end of names say right and left where four places have both, half of the names has one of them,
    and fewer places differ by the English ones.

    Args:
        names: as recorded -> without what stands before the name proper.
    """
    rests: dict[tuple[str, str], dict[str, str]] = defaultdict(dict)
    named = {name: own for name, own in names.items() if not _NUMBERED.fullmatch(plain_name(own))}
    for name, own in named.items():
        for reading in _readings(own):
            rests[reading.end, reading.word].setdefault(reading.rest, name)

    def shared(end: str, pair: tuple[str, str]) -> set[str]:
        right, left = (rests.get((end, word), {}) for word in pair)
        return right.keys() & left.keys()

    ends = ("first", "last")
    usual = max(len(shared(end, pair)) for end in ends for pair in _ENGLISH)
    found, end, (right, left) = max(
        ((shared(end, pair), end, pair) for end in ends for pair in _LETTERS), key=lambda each: len(each[0])
    )
    if len(found) < max(_FEWEST, usual + 1) or 2 * len(found) < _MOST * len(named):
        return None
    other = 0 if end == "last" else -1
    both = [plain_name(names[rests[end, word][rest]]) for word in (right, left) for rest in found]
    if all(plain[other] in "rl" for plain in both):  # who says R or L at the other end counts by these
        return None
    english = {
        rests[end, word][rest]: f"{side}_{rest.upper()}" for word, side in ((right, "R"), (left, "L")) for rest in found
    }
    return SideLetters(right.upper(), left.upper(), english)


def other_letter(used: Iterable[str], left_out: Iterable[str]) -> tuple[str, str, list[str]] | None:
    """A letter or word by which three and more names that are left out differ from such that say a side and are used.

    Returns:
        That of the names in use, that of the others, and these; None where there is none.
    """
    at: dict[tuple[str, str], set[str]] = defaultdict(set)
    for name in used:
        for own in _readings(name):
            at[own.end, own.rest].add(own.word)
    found: dict[tuple[str, str, str], set[str]] = defaultdict(set)
    for name in left_out:
        for own in _readings(name):
            for word in at.get((own.end, own.rest), set()) & SIDE_WORDS:
                found[own.end, word, own.word].add(name)
    if not found:
        return None
    (_, word, other), names = max(found.items(), key=lambda each: len(each[1]))
    return (word.upper(), other.upper(), sorted(names)) if len(names) >= _FEWEST_LEFT_OUT else None
