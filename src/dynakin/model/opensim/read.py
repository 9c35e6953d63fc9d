"""Reads an .osim file, version 3 (joints inside bodies) or 4 (a set of joints between frames), without OpenSim."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from pathlib import Path

import numpy as np

from dynakin.model.opensim.description import GROUND, Body, Coordinate, Coupler, Joint, Marker, Offset, OpenSimModel
from dynakin.model.opensim.functions import function_of, joined, polynomial, read_function
from dynakin.model.opensim.joints import read_axes, read_coordinate
from dynakin.model.opensim.xml_file import Node, read_xml
from dynakin.settings.strict import nearest
from dynakin.units import GRAVITY_M_S2, inertia_problem

_OLDEST = 20000  # before that, OpenSim 1's files are built otherwise
_MOST = 1000  # bodies or joints: whole bodies with fingers and vertebrae have a fifth
_ENTRIES = ("inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz")
_NOT_MECHANICS = {
    "ForceSet": "muscles and other forces",
    "ControllerSet": "controllers",
    "ContactGeometrySet": "contact geometry",
    "ProbeSet": "probes",
}


def read_osim(path: str | Path) -> OpenSimModel:
    """The bodies, joints, coordinate couplers and markers of an OpenSim model.

    Raises:
        ModelError: not an OpenSim model, damaged, or with a part of its mechanics that is not supported (other joints,
            functions and constraints): file, line and element are named, what was found and what was expected.
    """
    path = Path(path)
    root = read_xml(path)
    if root.tag != "OpenSimDocument":
        root.fail("expected an OpenSimDocument")
    version = int(root.name) if re.fullmatch("[0-9]{1,9}", root.name) else 0
    model = root.need("Model")
    for tag in ("BodySet", "JointSet"):
        if (count := len(model.objects(tag))) > _MOST:
            model.fail(f"found {count} entries in {tag}, expected at most {_MOST}")
    if version < _OLDEST:
        root.fail(f"found version {root.name or 'none'}, expected {_OLDEST} or more (OpenSim 2 to 4)")
    newer = bool(model.objects("JointSet"))
    joints = _joints_4(model) if newer else _joints_3(model)
    bodies = tuple(_body(node) for node in model.objects("BodySet") if node.name != GROUND)
    if not bodies:
        model.fail("expected bodies in BodySet")
    _refuse_other_mechanics(model)
    names = Counter(c.name for _, joint in joints for c in joint.coordinates)
    for name, count in names.items():
        if count > 1:
            model.fail(f"coordinate {name!r} is in two joints")
    couplers, said = _couplers(model, set(names))
    markers = _markers(model, Frames(model) if newer else None, {GROUND, *(body.name for body in bodies)})
    gravity = model.numbers("gravity", 3, (0.0, -GRAVITY_M_S2, 0.0))
    return OpenSimModel(
        name=model.name or path.stem,
        path=path,
        gravity=(gravity[0], gravity[1], gravity[2]),
        bodies=bodies,
        joints=_in_order(model, joints, [body.name for body in bodies]),
        couplers=couplers,
        markers=markers,
        left_out=(*said, *_left_out(model)),
    )


def _coordinates(joint: Node, nodes: list[Node]) -> tuple[Coordinate, ...]:
    return tuple(read_coordinate(node, f"{joint.name}_coord_{k}") for k, node in enumerate(nodes))


def _joints_4(model: Node) -> list[tuple[Node, Joint]]:
    frames = Frames(model)
    found = []
    for node in model.objects("JointSet"):
        base = f"/jointset/{node.name}"
        coordinates = _coordinates(node, (node.find("coordinates") or Node("", "", 0, node.path)).children)
        axes = read_axes(node, coordinates)  # first, so that an unknown joint is refused as such
        parent, parent_offset = frames.resolve(node, base, "parent_frame")
        child, child_offset = frames.resolve(node, base, "child_frame")
        joint = Joint(node.name, node.tag, parent, parent_offset, child, child_offset, coordinates, axes)
        found.append((node, joint))
    return found


def _joints_3(model: Node) -> list[tuple[Node, Joint]]:
    found = []
    for body in model.objects("BodySet"):
        holder = body.find("Joint") or body.find("joint")
        node = holder.children[0] if holder is not None and holder.children else None
        if node is None:
            continue  # ground; another body is missed when the joints are put in order
        if node.flag("reverse"):
            node.fail("a reversed joint is not supported")
        coordinates = _coordinates(node, node.objects("CoordinateSet"))
        axes = read_axes(node, coordinates)
        parent_offset = read_offset(node, "location_in_parent", "orientation_in_parent")
        child_offset = read_offset(node, "location", "orientation")
        parent = node.word("parent_body") or node.fail("expected an element parent_body")
        joint = Joint(node.name, node.tag, parent, parent_offset, body.name, child_offset, coordinates, axes)
        found.append((node, joint))
    return found


def _in_order(model: Node, joints: list[tuple[Node, Joint]], bodies: list[str]) -> tuple[Joint, ...]:
    """Joints from the ground outwards; refuses what is no tree."""
    known = {GROUND, *bodies}
    hung: dict[str, str] = {}
    for node, joint in joints:
        for role, end in (("parent", joint.parent), ("child", joint.child)):
            if end not in known:
                node.fail(f"{role} body {end!r} is not in the model{nearest(end, known)}")
        if joint.child == GROUND:
            node.fail("its child is the ground; expected the ground as parent")
        if joint.child in hung:
            node.fail(
                f"body {joint.child!r} is a child of joint {hung[joint.child]!r} already: loops are not supported"
            )
        hung[joint.child] = joint.name
    for body in model.objects("BodySet"):
        if body.name in bodies and body.name not in hung:
            body.fail("no joint carries this body")
    waiting, done, order = [joint for _, joint in joints], {GROUND}, []
    while waiting:
        ready = [joint for joint in waiting if joint.parent in done]
        if not ready:
            model.fail(f"joint {waiting[0].name!r} is in a loop that does not reach the ground")
        order.append(ready[0])  # one at a time, so that an order that will do is kept
        done.add(ready[0].child)
        waiting.remove(ready[0])
    return tuple(order)


def _markers(model: Node, frames: Frames | None, bodies: set[str]) -> tuple[Marker, ...]:
    found: dict[str, Marker] = {}
    nodes = [(f"/markerset/{node.name}", node) for node in model.objects("MarkerSet") if node.tag == "Marker"]
    for path, node in [*nodes, *(frames.markers if frames is not None else ())]:
        x, y, z = node.numbers("location", 3)
        if frames is not None:
            body, offset = frames.resolve(node, path, "parent_frame")
            x, y, z = offset.then(Offset((x, y, z))).translation
        else:
            body = node.word("body")
            if body not in bodies:
                node.fail(f"body {body!r} is not in the model{nearest(body, bodies)}")
        if node.name in found:
            node.fail("a marker of this name is there already")
        found[node.name] = Marker(node.name, body, (x, y, z), node.flag("fixed"))
    return tuple(found.values())


def _refuse_other_mechanics(model: Node) -> None:
    """Joints, bodies and constraints outside their sets would change the mechanics without being seen."""
    for owner in ("components", "ComponentSet", "MiscellaneousComponentSet"):
        for node in (model.find(owner) or Node("", "", 0, model.path)).walk():
            if node.tag.endswith(("Joint", "Constraint")) or node.tag == "Body":
                node.fail(f"found in {owner}, expected in JointSet, ConstraintSet or BodySet")


def _left_out(model: Node) -> list[str]:
    parts = [f"{len(model.objects(tag))} {words}" for tag, words in _NOT_MECHANICS.items() if model.objects(tag)]
    return (
        [f"Of the OpenSim model left out, as not part of its mechanics: {', '.join(parts)}, geometry."] if parts else []
    )


def _body(node: Node) -> Body:
    """Mass, centre and tensor about the centre: one list of six (version 4) or six elements (version 3)."""
    mass = node.number("mass", 0.0)
    if mass < 0.0:
        node.need("mass").fail(f"found {mass:g} kg, expected 0 or more")
    x, y, z = node.numbers("mass_center", 3, (0.0, 0.0, 0.0))
    if node.find("inertia") is not None:
        entries = node.numbers("inertia", 6)
    else:
        entries = [node.number(name, 0.0) for name in _ENTRIES]
    if mass == 0.0:
        return Body(node.name, 0.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    xx, yy, zz, xy, xz, yz = entries
    principal = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).tolist()
    if problem := inertia_problem(mass, principal):
        node.fail(f"{problem}. Correct its inertia (about its centre of mass; kg m^2, not kg mm^2)")
    return Body(node.name, mass, (x, y, z), tuple(entries))


def _couplers(model: Node, coordinates: set[str]) -> tuple[tuple[Coupler, ...], list[str]]:
    """Coordinate couplers that are in force, and sentences on the constraints that are switched off.

    Raises:
        ModelError: another constraint, a function of several coordinates, or an unknown coordinate.
    """
    couplers: list[Coupler] = []
    said: list[str] = []
    for node in model.objects("ConstraintSet"):
        if not node.flag("isEnforced", True) or node.flag("isDisabled"):
            said.append(f"Constraint {node.name} is switched off in the file: left out.")
            continue
        if node.tag != "CoordinateCouplerConstraint":
            node.fail("this kind of constraint is not supported; expected a CoordinateCouplerConstraint")
        independent = node.word("independent_coordinate_names").split()
        dependent = node.word("dependent_coordinate_name")
        if len(independent) != 1:
            node.fail(f"found {len(independent)} independent coordinates, expected 1")
        for name in (dependent, *independent):
            if name not in coordinates:
                node.fail(f"coordinate {name!r} is in no joint of the model")
        if any(coupler.dependent == dependent for coupler in couplers):
            node.fail(f"coordinate {dependent!r} is coupled twice")
        function = function_of(node.need("coupled_coordinates_function"))
        if function is None:
            node.fail("expected a function in coupled_coordinates_function")
        chain = joined([*read_function(function), polynomial(0.0, node.number("scale_factor", 1.0))])
        couplers.append(Coupler(node.name, dependent, independent[0], chain))
    _refuse_circles(model, couplers)
    return tuple(couplers), said


def _refuse_circles(model: Node, couplers: list[Coupler]) -> None:
    onward = {coupler.dependent: coupler.independent for coupler in couplers}
    for start in onward:
        name, steps = start, 0
        while name in onward:
            name, steps = onward[name], steps + 1
            if steps > len(onward):
                model.need("ConstraintSet").fail(f"coordinate {start!r} is coupled to itself in a circle")


def read_offset(node: Node, translation: str, orientation: str) -> Offset:
    """Three metres and three angles by the names of their elements; absent ones are 0."""
    x, y, z = node.numbers(translation, 3, (0.0, 0.0, 0.0))
    a, b, c = node.numbers(orientation, 3, (0.0, 0.0, 0.0))
    return Offset((x, y, z), (a, b, c))


class Frames:
    """Every frame of a version 4 model by its path: ground, bodies, and the offset frames in joints and bodies.

    Attributes:
        markers: those that stand in bodies, frames and the model itself instead of the MarkerSet, with their paths.
    """

    def __init__(self, model: Node) -> None:
        self._bodies = {f"/bodyset/{node.name}": node.name for node in model.objects("BodySet")}
        self._bodies |= {"/ground": GROUND}
        self._offsets: dict[str, Node] = {}
        self.markers: list[tuple[str, Node]] = []
        for place, owners in (("bodyset", "BodySet"), ("jointset", "JointSet")):
            for owner in model.objects(owners):
                self._collect(f"/{place}/{owner.name}", owner, ("frames", "components"))
        for tag in ("Ground", "ComponentSet"):
            if (node := model.find(tag)) is not None:
                self._collect(f"/{tag.casefold()}", node, ("frames", "components", "objects"))
        self._collect("", model, ("components",))

    def _collect(self, base: str, owner: Node, lists: tuple[str, ...]) -> None:
        for name in lists:
            for node in owner.find(name) or ():
                if node.tag == "Marker":
                    self.markers.append((f"{base}/{node.name}", node))
                if node.tag == "PhysicalOffsetFrame":
                    self._offsets[f"{base}/{node.name}"] = node
                    self._collect(f"{base}/{node.name}", node, ("components",))

    def resolve(self, owner: Node, base: str, socket: str, depth: int = 0) -> tuple[str, Offset]:
        """Body (or ground) and offset of the frame that a socket of ``owner``, at path ``base``, is plugged into.

        Raises:
            ModelError: the socket is not there, or names no frame of the model.
        """
        tag = f"socket_{socket}"
        written = owner.word(tag)
        if not written:
            owner.fail(f"expected an element {tag}")
        path = self._known(written, base)
        if path in self._bodies:
            return self._bodies[path], Offset()
        if path is None or depth > 20:
            known = ", ".join(sorted(self._bodies.values()))
            owner.need(tag).fail(f"found {written!r}, expected a frame of the model (bodies: {known})")
        node = self._offsets[path]
        body, offset = self.resolve(node, path, "parent", depth + 1)
        return body, offset.then(read_offset(node, "translation", "orientation"))

    def _known(self, written: str, base: str) -> str | None:
        """The path itself, one relative to its owner (or its owner's surroundings), or a body's bare name."""
        last = written.rsplit("/", 1)[-1]
        tries = [posixpath.normpath(posixpath.join(start, written)) for start in (base, posixpath.dirname(base), "/")]
        if "/" not in written.replace("../", "") or written.startswith(".."):  # older files: ../torso, torso
            tries += [f"/bodyset/{last}", f"/{last}"]
        return next((path for path in tries if path in self._bodies or path in self._offsets), None)
