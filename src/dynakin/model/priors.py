"""Bounds of equation (9) and the prior standard deviations at the first frame: every number, with its reason.

The paper gives the bounds as +-20 % and says nothing of P at the first frame; a prior of 1e6 would let the
gauges of the model (a terminal segment's length against its free markers, say) wander, so all are finite
here.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from dynakin.model.inertia import INERTIA_NAMES, RigidBody
from dynakin.model.validation import Strict

Positive = Annotated[float, Field(gt=0.0)]


class Priors(Strict):
    """Standard deviations of the state at the first frame."""

    rotation_deg: Positive = 5.0
    """Angles come from skin markers and regressed joint centres: soft tissue and regressions err by a few
    degrees."""
    translation_m: Positive = 0.05
    """Joint translations (free-floating models), from the same landmarks."""
    rotation_speed_deg_s: Positive = 60.0
    """Taken as 0 at the start; a trial may start in motion, and a squat's joints reach 100 to 150 deg/s at
    their fastest."""
    speed_m_s: Positive = 0.5
    """The same for translations."""
    rotation_acceleration_deg_s2: Positive = 600.0
    """Taken as 0 at the start; a speed of 60 deg/s built up within 0.1 s."""
    acceleration_m_s2: Positive = 5.0
    """The same for translations."""
    length_fraction: Positive = 0.05
    """Lengths, of their value: joint centres are known to 1 or 2 cm, 3 to 5 % of a leg segment."""
    marker_m: Positive = 0.01
    """Local marker positions: landmarks are found again to within 6 to 21 mm (Della Croce et al. 2005), and the frame
    that they are measured in hangs on a few of them. What skin and flesh do later is not part of it."""
    mass_fraction: Positive = 0.10
    """Segment masses, of the table's value: half of the +-20 % of (9), so that the bound lies at two
    sigma."""
    first_moment_fraction: Positive = 0.05
    """First moments, of mass times length: the centre of mass known to 5 % of the length."""
    inertia_fraction: Positive = 0.10
    """Inertia entries, of the moment izz about the joint: mostly m c^2, so as the mass."""


class Bounds(Strict):
    """Half widths of the bounds of (9)."""

    length_fraction: Positive = 0.20
    """Of the length at the start (the paper: of the literature's; lengths are measured here)."""
    marker_threshold_m: Positive = 0.10
    """Around the initial place, each axis. The paper's Threshold is symmetric about the segment's origin and
    "tuned manually"; one number about the initial place does for all markers and keeps them on their
    segment."""
    mass_fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.20
    """Of the table's mass, as in (9)."""
    first_moment_fraction: Positive = 0.20
    """Of mass times length: +-20 % of a first moment near zero is no interval (DESIGN section 3)."""
    inertia_fraction: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.20
    """Of the absolute value, as in (9)."""


Interval = tuple[float, float]


def inertia_prior(body: RigidBody, length: float, priors: Priors) -> dict[str, float]:
    """Standard deviation of each of the ten numbers."""
    moment = priors.inertia_fraction * max(float(np.trace(body.inertia)) / 2.0, 1e-12)
    planar = priors.inertia_fraction * max(float(body.inertia[2, 2]), 1e-12)
    sd = dict.fromkeys(INERTIA_NAMES, moment)
    sd |= dict.fromkeys(("mx", "my", "mz"), priors.first_moment_fraction * body.mass * length)
    return sd | {"mass": priors.mass_fraction * body.mass, "izz": planar}


def inertia_bounds(body: RigidBody, length: float, bounds: Bounds) -> dict[str, Interval]:
    """(lower, upper) of each of the ten numbers."""
    values = dict(zip(INERTIA_NAMES, body.vector, strict=True))
    found: dict[str, Interval] = {}
    for name, value in values.items():
        if name == "mass":
            half = bounds.mass_fraction * abs(value)
        elif name in ("mx", "my", "mz"):
            half = bounds.first_moment_fraction * body.mass * length
        elif name in ("ixx", "iyy", "izz"):
            half = bounds.inertia_fraction * abs(value)
        else:  # products are bounded by the moments: |ixy| <= (ixx + iyy) / 2 for every real body
            half = bounds.inertia_fraction * float(np.trace(body.inertia)) / 2.0
        found[name] = (value - half, value + half)
    return found
