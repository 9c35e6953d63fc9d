"""A body as a tree: which segment hangs on which."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Protocol, Self


class Hung(Protocol):
    """A segment, and the one that it hangs on."""

    @property
    def name(self) -> str:
        """Its own."""

    @property
    def parent(self) -> str:
        """Of what it hangs on."""


class Tree:
    """Segments (S,) and what each hangs on; what is no segment (the ground) is nothing to hang on.

    Attributes:
        parents: segment -> what it hangs on, parents before their children.
    """

    def __init__(self, names: Iterable[str], parents: Iterable[str]) -> None:
        self.parents = dict(zip(names, parents, strict=True))
        self._children: dict[str, list[str]] = {name: [] for name in self.parents}
        for name, parent in self.parents.items():
            self._children.setdefault(parent, []).append(name)

    @classmethod
    def of(cls, segments: Iterable[Hung]) -> Self:
        """That of a model's segments."""
        pairs = [(segment.name, segment.parent) for segment in segments]
        return cls([name for name, _ in pairs], [parent for _, parent in pairs])

    @classmethod
    def numbered(cls, names: Sequence[str], parents: Iterable[int]) -> Self:
        """That of segments (S,) and the numbers (S,) of what they hang on, below 0: on nothing."""
        return cls(names, [names[k] if k >= 0 else "" for k in parents])

    @property
    def numbers(self) -> list[int]:
        """(S,) the number of the segment that each hangs on, -1: on none."""
        place = {name: k for k, name in enumerate(self.parents)}
        return [place.get(parent, -1) for parent in self.parents.values()]

    @property
    def roots(self) -> list[str]:
        """What hangs on nothing: one segment, but of a model with several bodies."""
        return [name for name, parent in self.parents.items() if parent not in self.parents]

    @property
    def ends(self) -> list[str]:
        """Segments on which nothing hangs."""
        return [name for name in self.parents if not self._children[name]]

    def up(self, *names: str) -> list[str]:
        """These segments and all that they hang on, each once: of one, from it to its root."""
        found: dict[str, None] = {}
        for name in names:
            while name in self.parents and name not in found:
                found[name] = None
                name = self.parents[name]
        return list(found)

    def below(self, *names: str) -> list[str]:
        """All that hangs on one of these segments, parents before their children."""
        found, carrying = list[str](), set(names)
        for name, parent in self.parents.items():
            if parent in carrying:
                found.append(name)
                carrying.add(name)
        return found

    def nearest(self, name: str, chosen: Collection[str]) -> str:
        """The segment, or the next that it hangs on, that is chosen; "" where there is none."""
        return next((each for each in self.up(name) if each in chosen), "")

    def next_below(self, name: str, chosen: Collection[str]) -> list[str]:
        """The first that is chosen on each branch that hangs on a segment."""
        found, waiting = list[str](), list(self._children[name])
        while waiting:
            child = waiting.pop()
            if child in chosen:
                found.append(child)
            else:
                waiting += self._children[child]
        return found

    def adjacent(self, one: str, other: str) -> bool:
        """Whether one of two segments hangs on the other."""
        return self.parents[one] == other or self.parents[other] == one
