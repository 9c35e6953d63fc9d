"""The forces that a motion takes, shared out to what the person stands and sits on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.errors import ConfigError
from dynakin.simulation.bodies.body import Contact, SimulatedBody
from dynakin.simulation.mechanics import Dynamics, Motion, TreeMotion, dynamics, kinematics
from dynakin.simulation.motions.movement import Movement, Seat
from dynakin.simulation.support import carried_by_contacts, pressed

SIDEWAYS_SHARE = 0.06  # of the vertical force: the feet stand apart and push outward against each other


@dataclass(frozen=True)
class MechanicalState:
    """All that is true of the body over time: its motion, the forces, and what each contact carries of them, (T, 6)
    about the ground origin by the contact's name; plates: the contacts below which they lie, and what presses on
    each; segments: on which each contact acts, points: where (T, 3) m, both of a body in space only."""

    motion: Motion
    moving: TreeMotion
    forces: Dynamics
    carried: dict[str, Array]
    plates: tuple[tuple[Contact, Array], ...]
    segments: dict[str, str] = field(default_factory=dict)
    points: dict[str, Array] = field(default_factory=dict)


def mechanical_state(body: SimulatedBody, movement: Movement, time: Array) -> MechanicalState:
    """The movement at times (T,) s and the forces that it takes.

    Raises:
        ConfigError: the motion gives something that is no number.
    """
    motion = movement.at(time)
    for what, values in (("q", motion.q), ("qd", motion.qd), ("qdd", motion.qdd)):
        if values.shape != (len(time), len(motion.names)) or not np.isfinite(values).all():
            raise ConfigError(
                f"simulation: {what} of motion {movement.name!r} has shape {values.shape} or is not finite, expected "
                f"finite numbers of shape {(len(time), len(motion.names))}"
            )
    moving = kinematics(body.tree, motion)
    forces = dynamics(body.tree, motion, moving)
    if movement.support is not None:
        return _in_space(body, movement, time, MechanicalState(motion, moving, forces, {}, ()))
    contacts = contacts_of(body, movement.seat)
    carried = share_wrench(forces.wrench, body.feet, movement.seat)
    outside: dict[str, Array] = {}
    for contact, wrench in zip(contacts, carried, strict=True):
        if contact.segment is not None:
            outside[contact.segment] = outside.get(contact.segment, np.zeros_like(wrench)) + wrench
    if outside:
        forces = replace(dynamics(body.tree, motion, moving, outside), wrench=forces.wrench)
    by_name = {c.name: w for c, w in zip(contacts, carried, strict=True)}
    return MechanicalState(motion, moving, forces, by_name, tuple(zip(contacts, carried, strict=True)))


def _in_space(body: SimulatedBody, movement: Movement, time: Array, state: MechanicalState) -> MechanicalState:
    """The state with what hands, feet and seat carry, each on its segment."""
    assert movement.support is not None
    hands = {} if movement.held is None else movement.held(time, state.moving)
    rest = state.forces.wrench
    for hand in hands.values():
        rest = rest - hand.wrench
    carried, points = carried_by_contacts(rest, movement.support(time))
    carried |= {name: hand.wrench for name, hand in hands.items()}
    points |= {name: hand.point for name, hand in hands.items()}
    known = {foot.name: foot.segment for foot in body.feet} | dict(movement.segments)
    segments = {name: segment for name in carried if (segment := known[name]) is not None}
    outside: dict[str, Array] = {}
    for name, segment in segments.items():
        outside[segment] = outside.get(segment, 0.0) + carried[name]
    forces = replace(
        dynamics(body.tree, state.motion, state.moving, outside), wrench=state.forces.wrench
    )  # the sum of all that acts on the person, as the motion takes it
    plates = tuple(
        (Contact(f.plate, f.plate, None, f.centre, f.half_m), pressed(carried, time, f)) for f in movement.footings
    )
    return replace(state, forces=forces, carried=carried, plates=plates, segments=segments, points=points)


def contacts_of(body: SimulatedBody, seat: Seat | None) -> tuple[Contact, ...]:
    """The feet and, last, the seat; the seat's plate lies on the floor below it."""
    if seat is None:
        return body.feet
    below = np.array([seat.point[0], body.floor_m, seat.point[2]])
    return (*body.feet, Contact("seat", seat.plate, seat.segment, below))


def share_wrench(wrench: Array, feet: Sequence[Contact], seat: Seat | None) -> list[Array]:
    """Wrenches (T, 6) about the ground origin of each foot and, last, of the seat; they add up to ``wrench``.

    Mechanics give only the sum. The seat pushes up as much as the feet's centre of pressure needs not to go
    behind its limit; what is left goes to the feet by the place of its centre of pressure between them.
    """
    seated = [] if seat is None else [seat_wrench(wrench, seat)]
    on_feet = wrench - seated[0] if seated else wrench
    if len(feet) == 1:
        return [on_feet, *seated]
    right, left = split_wrench(on_feet, float(feet[0].centre[2]), float(feet[1].centre[2]))
    return [right, left, *seated]


def seat_wrench(wrench: Array, seat: Seat) -> Array:
    """The seat's push (T, 6) about the ground origin: vertical, at its point, N >= 0.

    The feet keep F_x, F_y - N and M_z - x_s N, which act at x = (M_z - x_s N + y_f F_x) / (F_y - N) on the floor y_f;
    that is the limit x_r where N = (x_r F_y - M_z - y_f F_x) / (x_r - x_s).
    """
    limit, x = seat.feet_rear_x, float(seat.point[0])
    about_floor = wrench[:, 5] + seat.floor_m * wrench[:, 0]
    push = np.maximum((limit * wrench[:, 1] - about_floor) / (limit - x), 0.0)
    force = np.outer(push, [0.0, 1.0, 0.0])
    return np.hstack([force, cross(np.broadcast_to(seat.point, force.shape), force)])


def split_wrench(wrench: Array, right_z: float, left_z: float) -> tuple[Array, Array]:
    """The wrench (T, 6) shared by the right and the left foot, at ``right_z`` and ``left_z`` (m).

    Each carries the part of force and free moment that its place gives: half where the whole's centre of pressure
    lies in the middle, all of it where that lies under the foot. Both press at the same x, so the sideways forces
    with which they push apart cancel in the sum, and so do their moments.
    """
    force = wrench[:, :3]
    # The wrench acts along a line that meets y = 0 at (x, 0, z), with a free moment about the vertical:
    # m_z = x f_y, m_x = -z f_y.
    x, z = wrench[:, 5] / force[:, 1], -wrench[:, 3] / force[:, 1]
    zero = np.zeros_like(x)
    free = wrench[:, 4] - (z * force[:, 0] - x * force[:, 2])
    share = np.clip((z - left_z) / (right_z - left_z), 0.0, 1.0)
    excess = z - (share * right_z + (1.0 - share) * left_z)  # 0 unless the whole leaves the feet sideways
    feet = []
    for side, part, at in ((1.0, share, right_z), (-1.0, 1.0 - share, left_z)):
        own = part[:, None] * force
        # The push apart fades with the lesser loaded foot.
        own[:, 2] -= side * 2.0 * SIDEWAYS_SHARE * share * (1.0 - share) * force[:, 1]
        point = np.stack([x, zero, at + excess], axis=1)
        feet.append(np.hstack([own, cross(point, own) + np.outer(part * free, [0.0, 1.0, 0.0])]))
    return feet[0], feet[1]
