"""Names of what the filter estimates: `marker/RKNE/x`, `inertia/thigh/mass`, `length/thigh`, `plates/delay`.

Who it belongs to may have a slash in its name (a marker `A/B`, a segment `thigh/shank`): kind and number do not, so
that a name is read from both ends.
"""

from __future__ import annotations

from typing import NamedTuple

_NUMBERED = frozenset({"marker", "soft_tissue", "inertia"})


class Element(NamedTuple):
    """Parts of an element's name.

    Attributes:
        kind: "marker", "soft_tissue", "inertia", "length", "plates", "zero"; "" of a coordinate and its derivatives.
        owner: marker, segment or length; of the plates, which error.
        number: axis, or inertial number; "" of others.
    """

    kind: str
    owner: str
    number: str


KINDS = frozenset({*_NUMBERED, "length", "plates", "zero"})


def element(name: str) -> Element:
    """The parts of a name: `marker/A/B/x` -> marker, A/B, x."""
    kind, _, rest = name.partition("/")
    if kind not in KINDS or not rest:
        return Element("", name, "")
    owner, _, number = rest.rpartition("/") if kind in _NUMBERED else (rest, "", "")
    return Element(kind, owner, number)
