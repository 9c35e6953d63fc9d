"""Masses of an OpenSim file that are hardly a person's: a limb without any, or far lighter than its other side."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.messages import Message, warning
from dynakin.model.markers.draft.by_name import sided
from dynakin.model.opensim.description import GROUND, Joint, OpenSimModel

LIGHTEST_PER_M = 0.01
"""Of the whole mass, that a body weighs at least for each metre between its joints: 0.3 kg of a shank of somebody of
75 kg. Upper arms, feet and shanks of OpenCap's, Rajagopal's and Gait2354 have 8 to 12 %; a tube in a shank's place has
more than 1 %."""
SHORTEST_M = 0.1
"""Between joints, from which it is asked: ankle and subtalar joint of a talus lie 0.04 to 0.05 m apart."""
OTHER_SIDE = 4.0
"""How often a body's other side may have its mass: a prosthetic shank or foot has half of the other's, a third at
least."""
COUNTS_SHARE = 0.005
"""Of the whole mass, that the heavier of both sides has where they are compared: patella and talus weigh 0.1 %."""
_ALONG = 0.5  # rad: a bone that turns about its own length (a radius) moves no mass; the other beside it may have it


def doubtful_masses(source: OpenSimModel) -> list[Message]:
    """A warning that names the bodies which have too little mass between two joints, or far less than their other side.

    Bodies that do not move against each other are taken together: a file may hang a limb's mass on it.
    """
    free = {joint.child: _free(source, joint) for joint in source.joints}
    host: dict[str, str] = {}
    for joint in source.joints:  # parents stand before their children
        alone = free[joint.child] or joint.parent == GROUND
        host[joint.child] = joint.child if alone else host[joint.parent]
    mass = dict.fromkeys(host.values(), 0.0)
    for body in source.bodies:
        mass[host[body.name]] += body.mass
    said = [
        f"{name} {mass[name]:.3g} kg, {length:.2f} m long between its joints"
        for name, length in _lengths(source, free).items()
        if length > SHORTEST_M and mass[name] < LIGHTEST_PER_M * length * source.mass
    ]
    sides = {sided(name): name for name in mass}
    for (side, rest), name in sides.items():
        other = sides.get(("left" if side == "right" else "right", rest)) if side else None
        if other and OTHER_SIDE * mass[name] < mass[other] > COUNTS_SHARE * source.mass:
            said.append(f"{name} {mass[name]:.3g} kg beside {mass[other]:.3g} kg of {other}")
    if not said:
        return []
    return [
        warning(
            "masses",
            f"masses of {source.path.name} that are hardly a person's: {'; '.join(said)}. What is missing there the "
            "other bodies have too much, and moments are wrong by it.",
        )
    ]


def _free(source: OpenSimModel, joint: Joint) -> bool:
    """Whether its bodies move against each other by a coordinate of their own."""
    driven = {coupler.dependent for coupler in source.couplers}
    moving = {axis.coordinate for axis in joint.axes}
    return any(c.name in moving and not c.locked and c.name not in driven for c in joint.coordinates)


def _lengths(source: OpenSimModel, free: dict[str, bool]) -> dict[str, float]:
    """Body -> m from the joint that it hangs on to the furthest that hangs on it, of those that both move."""
    own = {joint.child: joint for joint in source.joints if free[joint.child] and joint.parent != GROUND}
    found: dict[str, float] = {}
    for joint in source.joints:
        if free[joint.child] and joint.parent in own:
            held = own[joint.parent]
            span = np.array(joint.parent_offset.translation) - np.array(held.child_offset.translation)
            if _swings(held, span):
                found[joint.parent] = max(found.get(joint.parent, 0.0), float(np.linalg.norm(span)))
    return found


def _swings(joint: Joint, span: Array) -> bool:
    """Whether the joint moves its body otherwise than about ``span``, a line in it."""
    turn, reach = joint.child_offset.rotation, np.sin(_ALONG) * np.linalg.norm(span)
    return any(
        axis.kind == "translation" or float(np.linalg.norm(np.cross(turn @ np.array(axis.direction), span))) > reach
        for axis in joint.axes
        if axis.coordinate is not None
    )
