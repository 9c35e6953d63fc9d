"""Functions of time carried with their first two derivatives.

A motion is put together from a few smooth functions by adding and multiplying them; a `Jet` applies the sum
and product rules at each step, so coordinates, speeds and accelerations are exact derivatives of each other,
not differences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array


@dataclass(frozen=True)
class Jet:
    """A function of time sampled with its derivatives.

    value: (T,) in any unit; rate: (T,) unit/s; second: (T,) unit/s^2.
    """

    value: Array
    rate: Array
    second: Array

    def __add__(self, other: Jet | float) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.value + other.value, self.rate + other.rate, self.second + other.second)
        return Jet(self.value + other, self.rate, self.second)

    def __sub__(self, other: Jet | float) -> Jet:
        return self + (-1.0 * other)

    def __mul__(self, other: Jet | float) -> Jet:
        if isinstance(other, Jet):
            return Jet(
                self.value * other.value,
                self.rate * other.value + self.value * other.rate,
                self.second * other.value + 2.0 * self.rate * other.rate + self.value * other.second,
            )
        return Jet(other * self.value, other * self.rate, other * self.second)

    __radd__ = __add__
    __rmul__ = __mul__


def constant(time: Array, value: float) -> Jet:
    """The same value at every time."""
    zero = np.zeros_like(time)
    return Jet(np.full_like(time, value), zero, zero)


def step(time: Array, start_s: float, duration_s: float) -> Jet:
    """A smooth step from 0 to 1 with three continuous derivatives: 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7, s in
    [0, 1].

    The polynomial of degree 7 rather than 5, so that jerk is continuous too: forces have no corners.
    """
    s = np.clip((time - start_s) / duration_s, 0.0, 1.0)
    value = s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3)
    rate = 140.0 * (s * (1.0 - s)) ** 3
    second = 420.0 * (s * (1.0 - s)) ** 2 * (1.0 - 2.0 * s)
    return Jet(value, rate / duration_s, second / duration_s**2)


def swift_step(time: Array, start_s: float, duration_s: float) -> Jet:
    """A step from 0 to 1 with two continuous derivatives: 10 s^3 - 15 s^4 + 6 s^5, s in [0, 1]; less steep in the
    middle than `step`."""
    s = np.clip((time - start_s) / duration_s, 0.0, 1.0)
    value = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    rate = 30.0 * (s * (1.0 - s)) ** 2
    second = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return Jet(value, rate / duration_s, second / duration_s**2)


def sinusoids(time: Array, amplitudes: Array, frequencies_hz: Array, phases: Array) -> Jet:
    """A sum of sinusoids: a smooth signal of limited bandwidth. The three arrays have one entry per
    sinusoid."""
    omega = 2.0 * np.pi * frequencies_hz
    angle = np.multiply.outer(time, omega) + phases
    return Jet(
        np.sin(angle) @ amplitudes,
        np.cos(angle) @ (amplitudes * omega),
        -np.sin(angle) @ (amplitudes * omega**2),
    )


def polynomial(argument: Jet, coefficients: Sequence[float] | Array) -> Jet:
    """sum_k coefficients[k] argument^k, by Horner's rule."""
    result = constant(argument.value, float(coefficients[-1]))
    for c in reversed(coefficients[:-1]):
        result = result * argument + float(c)
    return result
