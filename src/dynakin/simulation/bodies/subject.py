"""A person who does not exist: lengths, masses, centres of mass and inertias drawn around the anthropometric
table.

Every body is a pseudo-inertia J (4, 4) = [[S, h], [h', m]]: mass m, first moment h and second moments S of
its mass distribution about the frame's origin. Stretching, shifting and mirroring the distribution are J -> T
J T' with T an affine map, and bodies joined are the sum of their J. So a positive definite J stays so, and
what is drawn is always a possible body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError, ModelError
from dynakin.model.table import PAIRED, BodyTable, load_table
from dynakin.settings.subject import Subject

# Distances between joint centres over body height: Drillis & Contini (1966) as in Winter, Biomechanics and
# Motor Control of Human Movement (2009), fig. 4.1, where it gives them; the toe landmark is the marker on the
# second toe's nail, 2.5 % up.
FRACTIONS: Mapping[str, float] = {
    "foot": 0.092,  # toe landmark to ankle
    "shank": 0.246,
    "thigh": 0.245,
    "pelvis": 0.052,  # hip to L5/S1
    "trunk": 0.236,  # L5/S1 to shoulder; shoulder at 0.818 of the height
    "upper_arm": 0.186,
    "forearm": 0.146,
    "hand": 0.049,  # wrist to the metacarpal heads
    "torso": 0.260,  # L5/S1 to the cervical joint
    "head": 0.155,  # cervical joint to vertex
    "instep": 0.075,  # ankle to the metatarsal heads, the table's foot length
    "hip_width": 0.110,  # between the hip joint centres, and the feet below them
    "shoulder_width": 0.220,
}
# Joints of a body in space that lie off their landmarks, and coordinates about axes of the person's own.
JOINTS = ("hip", "lumbar", "knee", "ankle")
HINGES = ("knee_angle", "ankle_angle", "subtalar_angle")
T12_ON_TORSO = 0.30  # T12/L1 from L5/S1 up, over the torso
ANKLE_DIRECTION = np.array([-0.988, 0.152, 0.0])  # from the toe landmark, foot flat
LUMBAR_DIRECTION = np.array([-0.30, 0.954, 0.0])  # from the hip, pelvis frame (X from mid-PSIS to mid-ASIS)


@dataclass(frozen=True)
class Spread:
    """Relative standard deviations around the table: how unlike an average person the subject may be.

    length: of each length; mass: of each part's mass; size: of the stretch of a part's mass distribution
    along each axis (second moments go with its square); centre: of the centre of mass, over the part's
    length. Of a body in space: joint, of the centres of hips, L5/S1, knees and ankles off where landmarks have
    them, an axis, over the body height (5 mm: regressions err by 5 to 8 mm, the middle of two landmarks by 4 to 8;
    Harrington et al. 2007, J Biomech 40:595; Della Croce et al. 2005, Gait Posture 21:226); axis, of the turn of the
    axes of knees, ankles and feet, rad (5 deg: between a knee's 3 and the 4 to 11 of ankle and foot, Isman and Inman
    1969).

    Raises:
        ConfigError: a value below 0 or above 0.5; the message names it.
    """

    length: float = 0.03
    mass: float = 0.08
    size: float = 0.05
    centre: float = 0.02
    joint: float = 0.003
    axis: float = 0.09

    def __post_init__(self) -> None:
        for key, value in vars(self).items():
            if not 0.0 <= value <= 0.5:
                raise ConfigError(f"spread of the subject: {key} is {value:g}, expected 0 to 0.5")

    @classmethod
    def none(cls) -> Spread:
        """The table itself."""
        return cls().times(0.0)

    def times(self, factor: float) -> Spread:
        """All of them ``factor`` times as large.

        Raises:
            ConfigError: the factor is negative, or makes a value too large.
        """
        if not factor >= 0.0:
            raise ConfigError(f"spread of the subject: the factor is {factor:g}, expected 0 or more")
        return Spread(*(factor * value for value in vars(self).values()))


@dataclass(frozen=True)
class SimulatedSubject:
    """A person before it is put into a model.

    lengths: m, by the names of `FRACTIONS`; parts: pseudo-inertia (4, 4) of one side of each part of the table,
    about the part's own origin; centres: (3,) m from where landmarks have a joint of `JOINTS` to where it is, turns:
    (3,) rad of the axes of `HINGES` from an average person's, both of the right side, the left is its mirror image.
    """

    mass_kg: float
    height_m: float
    sex: str | None
    lengths: Mapping[str, float]
    parts: Mapping[str, Array]
    centres: Mapping[str, Array]
    turns: Mapping[str, Array]

    def placed(self, part: str, shift: Array) -> Array:
        """A part moved to ``shift`` (3,) m."""
        return affine(self.parts[part], shift=shift)


def pseudo_inertia(mass: float, com: Array, inertia: Array) -> Array:
    """J (4, 4) from mass (kg), centre of mass (3,) m and inertia tensor (3, 3) kg m^2 about the centre of
    mass."""
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia + mass * np.outer(com, com)
    return np.block([[second, mass * com[:, None]], [mass * com[None, :], np.array([[mass]])]])


def mass_com_inertia(J: Array) -> tuple[float, Array, Array]:
    """The inverse of `pseudo_inertia`."""
    mass = float(J[3, 3])
    com = J[:3, 3] / mass
    second = J[:3, :3] - mass * np.outer(com, com)
    return mass, com, np.trace(second) * np.eye(3) - second


def affine(J: Array, stretch: Array | None = None, shift: Array | None = None) -> Array:
    """J of the distribution moved by p -> stretch p + shift."""
    T = np.eye(4)
    if stretch is not None:
        T[:3, :3] = stretch
    if shift is not None:
        T[:3, 3] = shift
    return np.asarray(T @ J @ T.T)


def draw_subject(
    rng: np.random.Generator,
    mass_kg: float,
    height_m: float,
    sex: str | None,
    spread: Spread | None = None,
) -> SimulatedSubject:
    """A subject around the table of Dumas; the parts' masses add up to ``mass_kg`` exactly.

    Raises:
        ConfigError: mass, height or sex that nobody has (`Subject`).
    """
    try:
        Subject(mass_kg=mass_kg, height_m=height_m, sex=sex)
    except ModelError as error:
        raise ConfigError(f"simulated {error.message}") from None
    spread = spread or Spread()
    lengths = {k: f * height_m * float(np.exp(spread.length * rng.standard_normal())) for k, f in FRACTIONS.items()}
    parts = _draw_parts(rng, load_table("dumas", sex), lengths, spread)  # type: ignore[arg-type]
    total = sum(J[3, 3] * (2.0 if name in PAIRED else 1.0) for name, J in parts.items())
    parts = {name: J * (mass_kg / total) for name, J in parts.items()}
    centres = {name: spread.joint * height_m * rng.standard_normal(3) for name in JOINTS}
    turns = {name: spread.axis * rng.standard_normal(3) for name in HINGES}
    return SimulatedSubject(mass_kg, height_m, sex, lengths, parts, centres, turns)


def _draw_parts(
    rng: np.random.Generator, table: BodyTable, lengths: Mapping[str, float], spread: Spread
) -> dict[str, Array]:
    """One side of each part of the table about the part's own origin, drawn around its entry."""
    own = {
        "foot": lengths["instep"],
        "thorax": (1.0 - T12_ON_TORSO) * lengths["torso"],
        "abdomen": T12_ON_TORSO * lengths["torso"],
    }
    parts = {}
    for name, entry in table.parts.items():
        L = own[name] if name in own else lengths[name]
        mass = entry.mass_fraction * float(np.exp(spread.mass * rng.standard_normal()))
        J = pseudo_inertia(mass, np.zeros(3), mass * L**2 * entry.inertia)
        J = affine(J, stretch=np.diag(np.exp(spread.size * rng.standard_normal(3))))
        parts[name] = affine(J, shift=L * (entry.centre + spread.centre * rng.standard_normal(3)))
    return parts


def both_sides(J: Array) -> Array:
    """A body and its mirror image in the sagittal plane together."""
    return J + affine(J, stretch=np.diag([1.0, 1.0, -1.0]))


def symmetric(J: Array) -> Array:
    """A body on the midline, its mass distribution made symmetric about the sagittal plane."""
    return 0.5 * both_sides(J)
