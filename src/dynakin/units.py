"""Conversion factors to SI at the edges of dynakin: files and reports; inside, everything is SI and
radians. How large persons and bodies are, by which a wrong unit shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

GRAVITY_M_S2 = 9.80665
"""Standard gravity, m/s^2 (CGPM 1901): the value in every model's gravity vector (0, -9.80665, 0)."""
GRAVITY_ON_EARTH_M_S2 = (9.7, 9.9)
"""Between which it lies wherever people are measured (9.764 to 9.834, Hirt et al. 2013), 9.8 and 9.81 too."""


def gravity_problem(gravity: Sequence[float]) -> str:
    """What is wrong with a model's gravity (3,) m/s^2, what was found and expected; empty where it is the earth's."""
    x, y, z = gravity
    low, high = GRAVITY_ON_EARTH_M_S2
    if low <= -y <= high and abs(x) + abs(z) <= 1e-9:
        return ""
    return f"found {x:g} {y:g} {z:g}, expected 0 -{GRAVITY_M_S2} 0 (along -Y, {low:g} to {high:g} m/s^2)"


_LIGHT_KG_M2 = 0.05  # a foot has less: what is light moves no moment by much
_ROUNDED = 0.01  # of the largest principal moment: entries are written with few digits
_UNEVEN = 1.25  # times the sum of the other two, by two digits of what is not light; a disc has 1
_WIDEST_M = 2.0  # radius of gyration; a bar of 2.2 m with all of its weight at the ends has 1.1, a trunk 0.3


def inertia_problem(mass_kg: float, principal: Sequence[float]) -> str:
    """What is wrong with principal moments of inertia (3,) kg m^2 about a body's centre of mass, what was found and
    expected; empty where there is a body that has them, or what is wrong is too small to matter."""
    low, middle, high = sorted(map(float, principal))
    if low < -_ROUNDED * high:
        expected = "none below 0"
    elif high > _UNEVEN * (low + middle) and high > _LIGHT_KG_M2:
        expected = f"the largest at most the sum of the others ({low + middle:.3g})"
    elif high > mass_kg * _WIDEST_M**2 and high > _LIGHT_KG_M2:
        size = (high / mass_kg) ** 0.5
        expected = f"at most {mass_kg * _WIDEST_M**2:.3g} of {mass_kg:g} kg, whose radius of gyration is {size:.3g} m"
    else:
        return ""
    return f"found principal moments of inertia {low:.4g}, {middle:.4g} and {high:.4g} kg m^2, expected {expected}"


PERSON_MASS_KG = (5.0, 400.0)
"""Of persons, as plates and files say it: beyond it the unit is another one. A mass that is given may be smaller, as
models of animals have it."""
PERSON_HEIGHT_M = (0.3, 2.8)
"""Of persons: no other unit of length brings one into this range, too."""

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
"""Of a wrench: N, N m."""
_LENGTH = {
    1.0: ("m", "meter", "meters", "metre", "metres"),
    1e-2: ("cm", "centimeter", "centimeters", "centimetre", "centimetres"),
    1e-3: ("mm", "millimeter", "millimeters", "millimetre", "millimetres"),
    0.0254: ("in", "inch", "inches"),
    0.3048: ("ft", "foot", "feet"),
}
_FORCE = {
    1.0: ("n", "newton", "newtons"),
    1e3: ("kn", "kilonewton", "kilonewtons"),
    4.4482216152605: ("lbf", "lb", "lbs", "pound", "pounds", "poundforce"),
    GRAVITY_M_S2: ("kgf", "kp"),
}


def _clean(unit: str) -> str:
    return "".join(c for c in unit.casefold() if c not in " .*·-()[]")


def _find(unit: str, table: Mapping[float, tuple[str, ...]]) -> float | None:
    word = _clean(unit)
    return next((factor for factor, names in table.items() if word in names), None)


def length_factor(unit: str) -> float | None:
    """Metres per ``unit`` ("mm", "Meters", "(cm)", ... in any case), or None where the unit is unknown."""
    return _find(unit, _LENGTH)


def force_factor(unit: str) -> float | None:
    """Newtons per ``unit`` ("N", "kN", ...), or None where the unit is unknown (a plate's raw volts, say)."""
    return _find(unit, _FORCE)


def moment_factor(unit: str) -> float | None:
    """Newton metres per ``unit`` ("Nm", "N.mm", "Newton millimetres", "in-lbf", ...), or None where it is unknown."""
    word = _clean(unit)  # "mN" is a force
    for force, force_names in _FORCE.items():
        for length, length_names in _LENGTH.items():
            if any(word in {f + m, m + f} - {"mn"} for f in force_names for m in length_names):
                return force * length
    return None
