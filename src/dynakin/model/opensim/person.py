"""What of an OpenSim model is the person: the tree of bodies that carries the markers."""

from __future__ import annotations

from dataclasses import replace

from dynakin.errors import ModelError
from dynakin.model.opensim.description import GROUND, OpenSimModel


def person_of(source: OpenSimModel) -> OpenSimModel:
    """The model without bodies that hang on the ground apart from the person (a chair, a treadmill, a bar), which would
    share the person's mass; a sentence in ``left_out`` names them. Without markers nothing is told apart.

    Raises:
        ModelError: markers on several trees, or a coordinate of the person that follows one of what is left out.
    """
    root: dict[str, str] = {}
    for joint in source.joints:  # parents stand before their children
        root[joint.child] = joint.child if joint.parent == GROUND else root[joint.parent]
    marked: dict[str, list[str]] = {}
    for marker in source.markers:
        if marker.body != GROUND:
            marked.setdefault(root[marker.body], []).append(marker.name)
    if not marked or len(set(root.values())) == 1:
        return source
    if len(marked) > 1:
        found = " and ".join(f"{name} ({', '.join(markers[:3])})" for name, markers in marked.items())
        raise ModelError(
            f"{source.path}: markers lie on bodies that hang on the ground apart from each other: {found}; expected "
            "one person. Delete the markers of what is not the person from the file"
        )
    person = next(iter(marked))
    others = {body for body, own in root.items() if own != person}
    lost = {c.name for joint in source.joints if joint.child in others for c in joint.coordinates}
    couplers = tuple(coupler for coupler in source.couplers if coupler.dependent not in lost)
    for coupler in couplers:
        if coupler.independent in lost:
            raise ModelError(
                f"{source.path}: coupler {coupler.name!r}: {coupler.dependent} follows {coupler.independent}, "
                f"expected a coordinate of the person (of the tree of {person}). Delete the coupler from the file"
            )
    named = ", ".join(f"{body.name} ({body.mass:g} kg)" for body in source.bodies if body.name in others)
    return replace(
        source,
        bodies=tuple(body for body in source.bodies if body.name not in others),
        joints=tuple(joint for joint in source.joints if joint.child not in others),
        couplers=couplers,
        left_out=(*source.left_out, f"Left out, as no part of the person whose markers are on {person}: {named}."),
    )
