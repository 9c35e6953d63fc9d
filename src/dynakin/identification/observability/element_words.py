"""Elements of the state, and sums of inertial numbers, as people say them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from dynakin.bindings import _core
from dynakin.elements import element
from dynakin.identification.observability.gauges import ZERO, Gauge
from dynakin.results.naming import listed, number, plural, words
from dynakin.tree import Tree
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
    tree = Tree.of(spec.segments)
    massive = {element(name).owner for name in base.over if name.endswith("/mass")}
    said = []
    for name, row in zip(base.names, base.K, strict=True):
        head = inertia_words(name, planar=planar)
        carried = massive.intersection(tree.below(element(name).owner))
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


def gauges_in_words(gauges: tuple[Gauge, ...], spec: _core.ModelSpec) -> list[str]:
    """A sentence a gauge, or for all that are said alike; the displacements of skin, each marker's own, in one."""
    skin = [gauge for gauge in gauges if _is_skin(gauge)]
    alike = Counter(gauge_in_words(gauge, spec) for gauge in gauges if not _is_skin(gauge))
    said = [text if count == 1 else f"{text}, in {count} directions" for text, count in alike.items()]
    if len(skin) > 1:
        markers = {element(name).owner for gauge in skin for name in gauge.direction}
        said.append(
            f"{plural(len(markers), 'marker')} ({plural(len(skin), 'direction')}): the mean displacement of the skin "
            "under each against its place on the segment"
        )
    else:
        said += [gauge_in_words(gauge, spec) for gauge in skin]
    return said


def gauge_in_words(gauge: Gauge, spec: _core.ModelSpec) -> str:
    """What moves against what, unseen."""
    names = list(gauge.direction)
    joints = {segment.name: _joint(segment) for segment in spec.segments}
    tree = Tree.of(spec.segments)
    homes = {marker.name: marker.segment for marker in spec.markers}
    zeros = [name.removeprefix(ZERO) for name in names if name.startswith(ZERO)]
    masses = {element(name).owner: gauge.direction[name] for name in names if name.endswith("/mass")}
    segments = {_segment(name, homes) for name in names if not name.startswith((ZERO, "length/", "plates/"))}
    if len(names) == 1:
        return f"{_element(names[0], homes)}: nothing that is measured depends on it"
    if _is_skin(gauge):
        marker = element(names[0]).owner
        return f"{marker}: the mean displacement of the skin under it against its place on the {words(homes[marker])}"
    if all(name.startswith("inertia/") for name in names):
        if len(masses) == 2:
            one, other = sorted(masses, key=list(tree.parents).index)  # parents before their children
            if tree.adjacent(one, other) and abs(masses[one] + masses[other]) < 1e-6 * abs(masses[one]):
                return f"{joints[other]}: a mass at it may belong to the {words(one)} or to the {words(other)}"
        if len(segments) == 1:
            numbers = listed([INERTIA[name.rpartition("/")[2]] for name in names], 10)
            return f"{words(segments.pop())}: {numbers} against each other"
    if len(zeros) == 1 and len(segments) == 1 and not any(name.startswith(("length/", "plates/")) for name in names):
        (segment,) = segments
        against = []
        if any(name.startswith(("marker/", "soft_tissue/")) for name in names):
            against.append("its markers' places")
        if any(name.startswith("inertia/") for name in names):
            against.append("its first moments" if not masses else "its inertia")
        return f"{words(segment)}: a turn about the {words(zeros[0])}: the angle's zero against {listed(against)}"
    if any(name.startswith("plates/") for name in names) and masses:
        errors = listed([element(name).owner for name in names if name.startswith("plates/")])
        return f"{listed([words(s) for s in masses])} mass against a constant error of the plates ({errors})"
    lengths = [name for name in names if name.startswith("length/")]
    rest = _summary([name for name in names if name not in lengths], homes)
    if lengths:
        return f"{listed([_element(name, homes) for name in lengths])} against {listed(rest)}"
    return f"{rest[0]} against {listed(rest[1:])}" if len(rest) > 1 else f"{rest[0]} against each other"


def _is_skin(gauge: Gauge) -> bool:
    kinds = {element(name).kind for name in gauge.direction}
    return kinds == {"marker", "soft_tissue"} and len({element(name).owner for name in gauge.direction}) == 1


def _joint(segment: _core.SegmentSpec) -> str:
    coordinates = {axis.coordinate for axis in segment.axes}
    return words(coordinates.pop()) if len(coordinates) == 1 else f"joint of the {words(segment.name)}"


def _segment(name: str, homes: dict[str, str]) -> str:
    kind, owner, _ = element(name)
    return owner if kind == "inertia" else homes[owner]


def _element(name: str, homes: dict[str, str]) -> str:
    kind, owner, number = element(name)
    if kind == "zero":
        return f"{words(owner)} zero"
    if kind == "length":
        return f"{words(owner)} length"
    if kind == "plates":
        return f"plates' error of {owner}"
    if kind == "inertia":
        return f"{words(owner)} {INERTIA[number]}"
    what = "place" if kind == "marker" else "skin"
    return f"{what} of {owner} on the {words(homes[owner])}, {number}"


def _summary(names: list[str], homes: dict[str, str]) -> list[str]:
    """The elements, those of a kind and a segment in one."""
    found: dict[str, None] = {}
    for name in names:
        kind, owner, _ = element(name)
        if kind in ("marker", "soft_tissue"):
            found[f"the markers' places on the {words(homes[owner])}"] = None
        elif kind == "inertia":
            found[f"the {words(owner)}'s inertia"] = None
        elif kind == "zero":
            found[f"the zero of the {words(owner)}"] = None
        else:
            found[f"the {_element(name, homes)}"] = None
    return list(found)
