"""A joint between offset frames as a segment's placement and chain of axes.

With the joint's frame J on the parent P and K on the child C, X_PC = X_PJ A X_KC, A the axes. K's turn R_CK is taken
through the axes: each direction is turned by it, and R_PJ R_CK' comes before them. What K's place leaves, -p_CK in the
child, is a last translation that no coordinate changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.model.calibration.posture import turned
from dynakin.model.opensim.description import Coupler, Joint, JointAxis
from dynakin.model.opensim.functions import Chain, Function, constant, is_constant, is_linear, joined


@dataclass(frozen=True, eq=False)
class ChainAxis:
    """As `_core.AxisSpec`."""

    coordinate: str
    kind: str
    direction: Array
    coefficients: tuple[float, ...]
    scale: str
    functions: tuple[Function, ...]


@dataclass(frozen=True, eq=False)
class Placed:
    """Rotation, fixed translation and scaled terms of a segment's placement, and its axes."""

    rotation: Array
    translation: Array
    terms: tuple[tuple[str, Array], ...]  # parameter, direction (m)
    axes: tuple[ChainAxis, ...]


def resolved(coordinate: str, couplers: Mapping[str, Coupler]) -> tuple[str, Chain]:
    """The free coordinate that this one follows, and the functions from that one to this."""
    chain: Chain = ()
    while coordinate in couplers:
        coupler = couplers[coordinate]
        coordinate, chain = coupler.independent, (*coupler.functions, *chain)
    return coordinate, chain


def place(joint: Joint, couplers: Mapping[str, Coupler], scales: Mapping[str, str]) -> Placed:
    """The segment of a joint's child; ``scales``: parameter of each body that has one."""
    R_PJ, R_CK = joint.parent_offset.rotation, joint.child_offset.rotation
    terms = _Terms()
    terms.add(scales.get(joint.parent, ""), np.array(joint.parent_offset.translation))
    axes: list[ChainAxis] = []
    R_before = np.eye(3)  # of rotations that no coordinate changes, as long as nothing turns before them
    host = next((resolved(c.name, couplers)[0] for c in joint.coordinates), None)
    for axis in joint.axes:
        scale = scales.get(joint.parent, "") if grows(axis) else ""
        if is_constant(axis.functions):
            value = constant(axis.functions)
            if axis.kind == "translation":
                terms.add(scale, R_PJ @ np.array(axis.direction) * value)
            elif host is None:
                R_before = R_before @ turned(value * np.array(axis.direction))
            elif value != 0.0:
                axes.append(ChainAxis(host, axis.kind, R_CK @ np.array(axis.direction), (value,), "", ()))
            continue
        assert axis.coordinate is not None
        coordinate, before = resolved(axis.coordinate, couplers)
        chain = joined([*before, *axis.functions])
        last: tuple[float, ...] = (0.0, 1.0)
        if chain and chain[-1].kind == "polynomial":
            chain, last = chain[:-1], chain[-1].coefficients
        axes.append(ChainAxis(coordinate, axis.kind, _unit(R_CK @ np.array(axis.direction)), last, scale, chain))
    rotation = R_PJ @ R_before @ R_CK.T
    back = -np.array(joint.child_offset.translation)
    distance = float(np.linalg.norm(back))
    if not axes:
        terms.add(scales.get(joint.child, ""), rotation @ back)
    elif distance > 0.0:
        assert host is not None
        scale = scales.get(joint.child, "")
        axes.append(ChainAxis(host, "translation", back / distance, (distance,), scale, ()))
    return Placed(rotation, terms.fixed, terms.scaled(), tuple(axes))


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)


def grows(axis: JointAxis) -> bool:
    """Whether a motion grows with the parent: translations by a function do; a plain coordinate is its own length."""
    return axis.kind == "translation" and (is_constant(axis.functions) or not is_linear(axis.functions))


class _Terms:
    """Sums placement vectors by the parameter that they grow with."""

    def __init__(self) -> None:
        self.fixed = np.zeros(3)
        self._scaled: dict[str, Array] = {}

    def add(self, parameter: str, vector: Array) -> None:
        if parameter:
            self._scaled[parameter] = self._scaled.get(parameter, np.zeros(3)) + vector
        else:
            self.fixed = self.fixed + vector

    def scaled(self) -> tuple[tuple[str, Array], ...]:
        return tuple((name, vector) for name, vector in self._scaled.items() if vector.any())
