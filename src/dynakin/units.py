"""Conversion factors to SI at the edges of dynakin: files and reports; inside, everything is SI and
radians. How large persons are, by which a wrong unit shows."""

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
