"""Carries a table of body segment inertial parameters into the segments of a model.

Each part of the body is scaled by the subject's mass and its own length, then taken through three maps
(``inertia.py``): turned from the part's frame into the model segment's, moved from the part's origin
(proximal joint) to the segment's own (the joint by which it hangs, distal in a toe-rooted chain), and lumped
with the other side and the other parts.
Sideways offsets of the limbs from the sagittal plane are left out: no number of a planar model depends on
them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.model.calibration.posture import Posture, axes_from
from dynakin.model.inertia import RigidBody
from dynakin.model.mirroring import SUFFIXES
from dynakin.model.schema import ModelFile, Segment
from dynakin.model.table import PAIRED, BodyTable, Part


@dataclass(frozen=True, eq=False)
class PlacedPart:
    """A part of the table, scaled to the subject and placed in a segment's frame (right side)."""

    name: str
    length: float  # m
    measured: bool  # False: the length comes from the height
    rotation: Array  # R_SB
    origin: Array  # (3,) m, in the segment's frame
    body: RigidBody  # in its own frame, one side


def part_length(part: Part, landmarks: Mapping[str, Array], height_m: float, where: str) -> tuple[float, bool]:
    """Length L (m) of a part: between its landmarks where both are known (True), else from the height
    (False)."""
    points = [point.at(dict(landmarks)) for point in (part.length_from, part.length_to)]
    if points[0] is not None and points[1] is not None:
        length = float(np.linalg.norm(points[1] - points[0]))
        if length > 1e-3:
            return length, True
        raise ModelError(f"{where}: the length of part {part.name!r} is 0; its landmarks lie at one place")
    if part.length_per_height is None:
        raise ModelError(
            f"{where}: part {part.name!r} needs landmarks {part.length_from.end} and {part.length_to.end} "
            "(or a "
            "length_per_height in the table), and the markers do not give them"
        )
    return part.length_per_height * height_m, False


def scaled_body(part: Part, mass_kg: float, length: float) -> RigidBody:
    """One side's part in its own frame, for a person of this mass and a part of this length."""
    mass = part.mass_fraction * mass_kg
    return RigidBody.from_centre(mass, part.centre * length, part.inertia * mass * length**2)


def place_parts(
    segment: Segment,
    table: BodyTable,
    landmarks: Mapping[str, Array],
    posture: Posture,
    mass_kg: float,
    height_m: float,
) -> list[PlacedPart]:
    """The parts of one segment in its frame, from the standing posture (``straight``: one after the
    other)."""
    where = f'segments "{segment.name}"'
    placed: list[PlacedPart] = []
    end = np.zeros(3)
    landmarks = of_side(landmarks, segment.side)
    for name in segment.parts:
        part = table.part(name)
        length, measured = part_length(part, landmarks, height_m, where)
        origin_G = part.origin.at(dict(landmarks))
        if segment.straight is not None:
            along = np.array(segment.straight)
            origin, rotation = end, axes_from(part.axis, -along if part.axis == "y" else along)
            end = end + length * along
        else:
            own = (segment.origin or "").removesuffix(SUFFIXES.get(segment.side or "", ""))
            if origin_G is None and part.origin.end == own:
                origin_G = posture.origins[segment.name]  # its own joint, which nothing but the length gives
            if origin_G is None:
                raise ModelError(f"{where}: part {name!r} starts at landmark {part.origin.end!r}, which is not known")
            origin = posture.to_local(segment.name, origin_G)
            rotation = _part_rotation(part, landmarks, posture.rotations[segment.name])
        body = scaled_body(part, mass_kg, length)
        body = body.mirrored() if segment.side == "left" else body  # the table's frames are the right side's
        placed.append(PlacedPart(name, length, measured, rotation, origin, body))
    return placed


def of_side(landmarks: Mapping[str, Array], side: str | None) -> Mapping[str, Array]:
    """One side's landmarks under their plain names, where a limb's sides are modelled apart."""
    if side is None:
        return landmarks
    suffix = SUFFIXES[side]
    return {name.removesuffix(suffix): place for name, place in landmarks.items() if name.endswith(suffix)}


def _part_rotation(part: Part, landmarks: Mapping[str, Array], R_GS: Array) -> Array:
    """R_SB from the landmarks of the part's axis; the segment's own axis where one is not known (head
    without vertex)."""
    start, end = part.axis_from.at(dict(landmarks)), part.axis_to.at(dict(landmarks))
    if start is None or end is None:
        return np.eye(3)
    return axes_from(part.axis, R_GS.T @ (end - start))


def lump(segment: Segment, placed: list[PlacedPart]) -> RigidBody:
    """All parts of a segment as one body about the segment's origin, both sides where the segment says so."""
    total = RigidBody.nothing()
    for part in placed:
        body = part.body.rotated(part.rotation).moved(part.origin)
        total = total + body
        if segment.both_sides and part.name in PAIRED:
            total = total + body.mirrored()
    return total


def segment_inertia(
    model: ModelFile,
    table: BodyTable,
    landmarks: Mapping[str, Array],
    posture: Posture,
    mass_kg: float,
    height_m: float,
) -> tuple[dict[str, RigidBody], dict[str, list[PlacedPart]]]:
    """Inertia of all segments about their origins, and the parts in each."""
    inertia: dict[str, RigidBody] = {}
    parts: dict[str, list[PlacedPart]] = {}
    for segment in model.segments:
        parts[segment.name] = place_parts(segment, table, landmarks, posture, mass_kg, height_m)
        inertia[segment.name] = (
            RigidBody.from_vector(segment.inertia) if segment.inertia else lump(segment, parts[segment.name])
        )
        if inertia[segment.name].mass > 0.0 and model.planar and not inertia[segment.name].possible_in_plane():
            raise ModelError(
                f'segments "{segment.name}": the inertial parameters belong to no '
                "real body (expected m izz > mx^2 + my^2)"
            )
    return inertia, parts
