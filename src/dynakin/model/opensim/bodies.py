"""Bodies, markers and coordinate couplers of either version of the format."""

from __future__ import annotations

from dynakin.model.opensim.description import Body, Coupler
from dynakin.model.opensim.functions import function_of, joined, polynomial, read_function
from dynakin.model.opensim.xml_file import Node

_ENTRIES = ("inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz")


def read_body(node: Node) -> Body:
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
    return Body(node.name, mass, (x, y, z), tuple(entries))


def read_couplers(model: Node, coordinates: set[str]) -> tuple[tuple[Coupler, ...], list[str]]:
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
