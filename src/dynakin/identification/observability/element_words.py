"""Elements of the state, and sums of inertial numbers, as people say them."""

from __future__ import annotations

from collections.abc import Sequence

from dynakin.bindings import _core
from dynakin.elements import element
from dynakin.results.naming import listed, number, words
from dynakin.validation.reference.base_parameters import BaseParameters

INERTIA = {
    "mass": "mass",
    "mx": "first moment (forward)",
    "my": "first moment (up)",
    "mz": "first moment (right)",
    "ixx": "moment of inertia xx",
    "iyy": "moment of inertia yy",
    "izz": "moment of inertia",
    "ixy": "product of inertia xy",
    "ixz": "product of inertia xz",
    "iyz": "product of inertia yz",
}
_PLANE = frozenset({"mass", "mx", "my", "izz"})


def inertia_words(name: str, *, planar: bool) -> str:
    """`inertia/thigh/izz` -> `thigh moment of inertia`."""
    _, segment, number_name = element(name)
    said = INERTIA[number_name] + (" zz" if number_name == "izz" and not planar else "")
    return f"{words(segment)} {said}"


def is_planar(names: Sequence[str]) -> bool:
    """Whether these inertial numbers are only those of a motion in the plane."""
    return all(name.rpartition("/")[2] in _PLANE for name in names)


def base_words(base: BaseParameters, spec: _core.ModelSpec) -> list[str]:
    """Each base parameter as the sum that it is; numbers with the same factor are put together, and all that a segment
    carries is called that."""
    planar = is_planar(base.over)
    children: dict[str, list[str]] = {segment.name: [] for segment in spec.segments}
    for entry in spec.segments:
        if entry.parent in children:
            children[entry.parent].append(entry.name)
    massive = {element(name).owner for name in base.over if name.endswith("/mass")}
    said = []
    for name, row in zip(base.names, base.K, strict=True):
        head = inertia_words(name, planar=planar)
        carried = _carried(element(name).owner, children) & massive
        terms: dict[tuple[str, float], list[str]] = {}
        for factor, other in zip(row, base.over, strict=True):
            if other != name and abs(factor) > 1e-6:
                _, segment, kind = element(other)
                terms.setdefault((kind, float(f"{factor:.5g}")), []).append(segment)
        for (kind, factor), segments in terms.items():
            every = set(segments) == carried and len(segments) > 1
            of = "all that it carries" if every else listed([words(s) for s in segments], 10)
            size = "" if abs(abs(factor) - 1.0) < 1e-9 else f"{number(abs(factor), _unit(name, kind))} × "
            head += f" {'+' if factor > 0 else '−'} {size}{_noun(kind, planar)} of {of}"
        said.append(head)
    return said


def _noun(kind: str, planar: bool) -> str:
    return INERTIA[kind] + (" zz" if kind == "izz" and not planar else "")


def _unit(head: str, kind: str) -> str:
    """Unit of the factor of a number of this kind: mass to first moment m, to moment of inertia m²."""
    order = {"mass": 0, "mx": 1, "my": 1, "mz": 1}
    power = order.get(head.rpartition("/")[2], 2) - order.get(kind, 2)
    return {1: "m", 2: "m²"}.get(power, "")


def _carried(segment: str, children: dict[str, list[str]]) -> set[str]:
    found: set[str] = set()
    for child in children.get(segment, []):
        found |= {child} | _carried(child, children)
    return found
