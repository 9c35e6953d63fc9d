"""Values of the coordinates that couplers drive, which are no states: the model is posed by all of them. And those of
which OpenSim says *Coupled*, which is something else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from dynakin.model.calibration.calibrated import Coupled
from dynakin.model.opensim.chains import resolved
from dynakin.model.opensim.description import GROUND, ZERO, Body, Coordinate, Joint, JointAxis, Offset, OpenSimModel
from dynakin.model.opensim.functions import is_as_steep
from dynakin.model.opensim.joints import X
from dynakin.model.opensim.spec import to_spec
from dynakin.model.schema import kinds_of

Array = npt.NDArray[np.float64]


def coupled_of(source: OpenSimModel) -> Coupled | None:
    """The coupled coordinates of a model: each as the place of a slider, so that the core's own functions give them."""
    couplers = {coupler.dependent: coupler for coupler in source.couplers}
    if not couplers:
        return None
    hosts = {name: resolved(name, couplers)[0] for name in couplers}
    names = [*dict.fromkeys(hosts.values()), *couplers]
    sliders = tuple(
        Joint(name, "SliderJoint", GROUND, Offset(), name, Offset(), (Coordinate(name),), (_along(name),))
        for name in names
    )
    bodies = tuple(Body(name, 1.0, ZERO, (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)) for name in names)
    spec = to_spec(replace(source, bodies=bodies, joints=sliders, markers=()), {}, markers=[])
    kinds = kinds_of(source.joints)
    return Coupled(spec, {name: (kinds[name], host) for name, host in hosts.items()})


def in_radians(source: OpenSimModel) -> frozenset[str]:
    """Rotations that are radians in any table that OpenSim reads or writes, whatever its header says of degrees
    (motion type *Coupled*): those that turn nothing by themselves, but by a function of another slope than 1 or -1."""
    axes = [axis for joint in source.joints for axis in joint.axes if axis.kind == "rotation"]
    plain = {axis.coordinate for axis in axes if is_as_steep(axis.functions)}
    return frozenset(axis.coordinate for axis in axes if axis.coordinate is not None) - plain


def _along(name: str) -> JointAxis:
    return JointAxis("translation", X, name)
