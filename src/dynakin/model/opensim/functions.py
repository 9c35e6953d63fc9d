"""OpenSim's functions of one coordinate as chains of the core's: polynomials and functions through points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from dynakin.model.opensim.xml_file import Node

KNOWN = (
    "Constant",
    "LinearFunction",
    "PolynomialFunction",
    "SimmSpline",
    "NaturalCubicSpline",
    "natCubicSpline",
    "PiecewiseLinearFunction",
    "MultiplierFunction",
)
_SPLINES = ("SimmSpline", "NaturalCubicSpline", "natCubicSpline")  # one class under its names of different times


@dataclass(frozen=True)
class Function:
    """sum_k coefficients[k] x^k, or a function through points (x, y), as `_core.FunctionSpec`."""

    kind: Literal["polynomial", "spline", "piecewise_linear"] = "polynomial"
    coefficients: tuple[float, ...] = ()
    x: tuple[float, ...] = ()
    y: tuple[float, ...] = ()


Chain = tuple[Function, ...]


def polynomial(*coefficients: float) -> Function:
    """sum_k coefficients[k] x^k without leading zeros."""
    c = list(coefficients)
    while len(c) > 1 and c[-1] == 0.0:
        c.pop()
    return Function("polynomial", tuple(c))


IDENTITY = polynomial(0.0, 1.0)


def joined(chain: Sequence[Function]) -> Chain:
    """The same chain without identities, factors taken into the polynomial before them."""
    result: list[Function] = []
    for f in chain:
        if f == IDENTITY:
            continue
        line = f.kind == "polynomial" and len(f.coefficients) == 2 and f.coefficients[0] == 0.0
        if line and result and result[-1].kind == "polynomial":
            result[-1] = polynomial(*(f.coefficients[1] * c for c in result[-1].coefficients))
            continue
        result.append(f)
    return tuple(result)


def is_constant(chain: Chain) -> bool:
    """Whether the last function does not depend on anything."""
    return bool(chain) and chain[-1].kind == "polynomial" and len(chain[-1].coefficients) == 1


def constant(chain: Chain) -> float:
    """Value of a constant chain."""
    return chain[-1].coefficients[0]


def is_linear(chain: Chain) -> bool:
    """Whether it is at most a straight line of its argument."""
    return all(f.kind == "polynomial" and len(f.coefficients) <= 2 for f in chain)


def is_as_steep(chain: Chain) -> bool:
    """Whether it is a straight line that rises, or falls, as much as its argument does."""
    return is_linear(chain) and len(chain) <= 1 and all(f.coefficients[1:] in ((1.0,), (-1.0,)) for f in chain)


def read_function(node: Node) -> Chain:
    """The chain of one of OpenSim's functions.

    Raises:
        ModelError: an unknown class, numbers that make no function; with its place in the file.
    """
    if node.tag == "Constant":
        return (polynomial(node.number("value", 0.0)),)
    if node.tag in ("LinearFunction", "PolynomialFunction"):
        given = node.numbers("coefficients", otherwise=(1.0, 0.0) if node.tag == "LinearFunction" else (0.0,))
        if not given or (node.tag == "LinearFunction" and len(given) != 2):
            node.fail(f"found {len(given)} coefficients, expected {'2' if node.tag == 'LinearFunction' else 'some'}")
        return joined([polynomial(*reversed(given))])
    if node.tag in _SPLINES or node.tag == "PiecewiseLinearFunction":
        x, y = node.numbers("x"), node.numbers("y")
        if len(x) != len(y) or len(x) < 2 or any(b <= a for a, b in pairwise(x)):
            node.fail(f"found {len(x)} x and {len(y)} y, expected as many of each, 2 or more, x increasing")
        return (Function("spline" if node.tag in _SPLINES else "piecewise_linear", (), tuple(x), tuple(y)),)
    if node.tag == "MultiplierFunction":
        inner = next((read_function(child) for child in node.need("function")), None)
        if inner is None:
            node.fail("expected a function to multiply")
        return joined([*inner, polynomial(0.0, node.number("scale", 1.0))])
    node.fail(f"this kind of function is not supported; expected one of {', '.join(KNOWN)}")


def function_of(node: Node) -> Node | None:
    """The element of a function in a node of either version: <function><Kind/></function>, or <Kind> as it stands."""
    wrapped = node.find("function")
    children = wrapped.children if wrapped is not None else node.children
    plain = ("coordinates", "axis", "independent_coordinate_names", "dependent_coordinate_name")
    return next((child for child in children if child.tag not in plain), None)
