"""Where OpenSim's frames lie: names and paths of frames (version 4's sockets) resolved to a body and an offset."""

from __future__ import annotations

import posixpath

from dynakin.model.opensim.description import GROUND, Offset
from dynakin.model.opensim.xml_file import Node


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
