"""The height of a jumper's centre of mass, from the vertical force that the ground is to give.

Given is the force as a sum of smooth pulses; integrated twice it is the height. In flight it is exactly zero, so the
centre of mass falls freely; the pulses' sizes follow from where and how fast each phase is to end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator, PPoly
from scipy.optimize import brentq

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.simulation.jets import Jet, step
from dynakin.simulation.mechanics import GRAVITY

Pulse = Callable[[Array], Array]

_G = -float(GRAVITY[1])
_GRID_S = 0.0005
_PUSH_S, _LANDING_S = 0.60, 1.10  # of leaving the box; of coming to rest at the end
_SOFTER = 0.6  # the second landing's impact, over the first's
_IMPACT_S = (0.035, 0.055)  # its rise and fall


@dataclass(frozen=True)
class Jump:
    """How somebody jumps: from a box of ``box_m`` at ``start_s``, leaving it at ``off_m_s``; ``impact``: vertical force
    (over body weight) of the first landing; ``up_m_s``: of the jump after it. extended_m: how much higher than standing
    the centre of mass is over the feet when they leave and touch the ground."""

    start_s: float
    box_m: float
    off_m_s: float
    impact: float
    up_m_s: float
    extended_m: float


@dataclass(frozen=True)
class Flight:
    """Vertical force over weight and height (m) of the centre of mass over that of standing on the floor; times (s) of
    the two flights."""

    force: PPoly
    jump: Jump
    leaves: tuple[float, float]
    lands: tuple[float, float]
    rests_s: float

    def height(self, time: Array) -> Jet:
        """Of the centre of mass over standing on the floor."""
        jet = _integrated(self.force, time)
        return Jet(jet.value + self.jump.box_m, jet.rate, jet.second)

    def load(self, time: Array) -> Array:
        """Vertical force over body weight; before the jump, and after it, 1."""
        return np.asarray(self.force(np.clip(time, self.force.x[0], self.force.x[-1])))

    def in_flight(self, time: Array) -> NDArray[np.bool_]:
        """Nothing touches the ground."""
        flying = [(time >= start) & (time <= end) for start, end in zip(self.leaves, self.lands, strict=True)]
        return np.asarray(flying[0] | flying[1])


def plan_flight(jump: Jump, duration_s: float) -> Flight:
    """The force of the whole trial: pushing off the box, the first landing and jump, the second landing, standing.

    Raises:
        ConfigError: no contact time gives that impact.
    """
    grid = np.arange(0.0, duration_s + 2.0, _GRID_S)

    def with_pulses(
        before: PPoly, fixed: Pulse, free: Sequence[Pulse], at_s: float, height: float, speed: float
    ) -> tuple[PPoly, Array]:
        """Sizes of two pulses so that the phase ends at ``at_s`` with this height (m) over the box and speed (m/s)."""
        known = _added(before, [(1.0, _poly(grid, fixed))])
        basis = [_poly(grid, pulse) for pulse in free]
        end = np.array([at_s])
        jet = _integrated(known, end)
        moved = [_G * np.array([p.antiderivative(2)(at_s), p.antiderivative(1)(at_s)]) for p in basis]
        sizes = np.linalg.solve(np.stack(moved, axis=1), [height - jet.value[0], speed - jet.rate[0]])
        return _added(known, list(zip(sizes, basis, strict=True))), sizes

    leaves = jump.start_s + _PUSH_S
    standing = _poly(grid, lambda t: 1.0 - step(t, leaves - 0.12, 0.12).value)
    force, _ = with_pulses(
        standing,
        np.zeros_like,
        (_pulse(jump.start_s, 0.20, jump.start_s + 0.20, 0.20), _pulse(leaves - 0.35, 0.20, leaves - 0.15, 0.15)),
        leaves,
        jump.extended_m,
        jump.off_m_s,
    )
    lands = leaves + _falling(jump.off_m_s, jump.box_m)

    def first_contact(contact_s: float) -> tuple[PPoly, Array]:
        until = lands + contact_s
        pulses = (_impact(lands), _pulse(lands + 0.035, 0.13, until - 0.14, 0.14))
        return with_pulses(force, np.zeros_like, pulses, until, jump.extended_m - jump.box_m, jump.up_m_s)

    contacts = np.arange(0.30, 0.80, 0.02)
    beyond = np.array([first_contact(c)[1][0] - jump.impact for c in contacts])
    crossing = np.flatnonzero(np.diff(np.sign(beyond)))
    if len(crossing) == 0:
        raise ConfigError(
            f"simulation: no contact lands with {jump.impact:.1f} and leaves at {jump.up_m_s:.1f} m/s (it would with "
            f"{beyond.min() + jump.impact:.1f} to {beyond.max() + jump.impact:.1f})"
        )
    k = crossing[-1]  # the softer way
    contact_s = float(brentq(lambda c: first_contact(c)[1][0] - jump.impact, contacts[k], contacts[k + 1], xtol=1e-6))
    force, _ = first_contact(contact_s)
    again = lands + contact_s
    down = again + _falling(jump.up_m_s, 0.0)
    rests = down + _LANDING_S
    force, _ = with_pulses(
        force,
        lambda t: step(t, down, 0.50).value + _SOFTER * jump.impact * _impact(down)(t),
        (_pulse(down + 0.02, 0.12, down + 0.18, 0.30), _pulse(down + 0.30, 0.30, rests - 0.40, 0.40)),
        rests,
        -jump.box_m,
        0.0,
    )
    return Flight(force, jump, (leaves, again), (lands, down), rests)


def _falling(up_m_s: float, down_m: float) -> float:
    """How long (s) a free fall takes that begins upward and ends ``down_m`` lower."""
    return float((up_m_s + np.sqrt(up_m_s**2 + 2.0 * _G * down_m)) / _G)


def _pulse(start: float, rise: float, falls: float, fall: float) -> Pulse:
    return lambda t: step(t, start, rise).value - step(t, falls, fall).value


def _impact(at: float) -> Pulse:
    return _pulse(at, _IMPACT_S[0], at + _IMPACT_S[0], _IMPACT_S[1])


def _poly(grid: Array, pulse: Pulse) -> PPoly:
    """Monotone between its samples: exactly constant where the pulse is."""
    return PchipInterpolator(grid, pulse(grid))


def _added(to: PPoly, parts: Sequence[tuple[float, PPoly]]) -> PPoly:
    return PPoly(to.c + sum(size * part.c for size, part in parts), to.x)


def _integrated(force: PPoly, time: Array) -> Jet:
    """Height (m) over the start of who begins at rest."""
    inside = np.clip(time, force.x[0], force.x[-1])
    speed, height = force.antiderivative(1), force.antiderivative(2)
    return Jet(_G * (height(inside) - 0.5 * inside**2), _G * (speed(inside) - inside), _G * (force(inside) - 1.0))
