"""The types of force plate of the C3D standard: what their channels hold, in which units, and how a
wrench comes of them.

| type | channels | calibration matrix |
|---|---|---|
| 1 | F_x, F_y, F_z, centre of pressure x, y, free moment z | |
| 2 | F_x, F_y, F_z, M_x, M_y, M_z | |
| 3 | f_x12, f_x34, f_y14, f_y23, f_z1, f_z2, f_z3, f_z4 (Kistler) | |
| 4 | as 2 | 6 by 6 |
| 5 | eight signals of any kind | 6 by 8, gives the channels of type 2 |
| 6 | F_x, F_y, F_z of sensor 1, 2, 3, 4 | 12 by 12 |
| 7 | as 3 | 8 by 8 |

Source of types 5 to 7, which no recording at hand has and ezc3d does not read: the tables of BTK's
``btkForcePlatform`` and of Visual3D's documentation (FP_Type). Types 11, 12 (split belts) and 21 (stairs) are makers'
own and published nowhere.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.messages import Message, note, together, warning
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.plates.dead import LEVER_M, Channels
from dynakin.recordings.pushes import JUDGED_N
from dynakin.units import force_factor, length_factor, moment_factor

Signal = Literal["force", "moment", "point"]
_WRENCH: tuple[Signal, ...] = ("force",) * 3 + ("moment",) * 3
_WITHIN_EDGES = 1.01  # corners are measured, distances of sensors a maker's


@dataclass(frozen=True)
class PlateType:
    """One type.

    Attributes:
        names: of the channels that the file lists, as makers call them: the numbers are those of the sensors.
        outputs: what they hold, after the calibration where there is one.
        calibrated: the matrix (outputs, channels) comes from the file.
        uncalibrated: the type that it is where the file has no matrix, as its channels are calibrated already; None
            where that cannot be.
    """

    names: tuple[str, ...]
    outputs: tuple[Signal, ...]
    calibrated: bool = False
    uncalibrated: int | None = None

    @property
    def channels(self) -> int:
        """How many the file lists."""
        return len(self.names)


_AXES = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_HOLD = {"Fx": "Fx", "Fy": "Fy", "Fz": "Fz", "My": "Px", "Mx": "Py", "Mz": "Tz"}
"""What a channel holds, or a part of it: a force, or what tells where along an axis it acts."""
_KISTLER = ("Fx12", "Fx34", "Fy14", "Fy23", "Fz1", "Fz2", "Fz3", "Fz4")
_SENSORS = tuple(f"F{axis}{k}" for k in range(1, 5) for axis in "xyz")
TYPES: dict[int, PlateType] = {
    1: PlateType(("Fx", "Fy", "Fz", "Px", "Py", "Tz"), ("force",) * 3 + ("point",) * 2 + ("moment",)),
    2: PlateType(_AXES, _WRENCH),
    3: PlateType(_KISTLER, ("force",) * 8),
    4: PlateType(_AXES, _WRENCH, calibrated=True, uncalibrated=2),
    5: PlateType(tuple(f"signal {k}" for k in range(1, 9)), _WRENCH, calibrated=True),
    6: PlateType(_SENSORS, ("force",) * 12, calibrated=True, uncalibrated=6),
    7: PlateType(_KISTLER, ("force",) * 8, calibrated=True, uncalibrated=3),
}


def checked_origin(name: str, origin: Array, kind: int, corners: Array) -> tuple[Array, list[Message]]:
    """A plate's origin (3,) m as the file gives it, and what there is to say of it. Of types 3, 6 and 7 it holds how
    far its sensors lie from its axes, which is within its edges by the corners (4, 3) m.

    Raises:
        RecordingError: it cannot be that of this plate.
    """
    if not np.isfinite(origin).all():
        raise RecordingError("FORCE_PLATFORM:ORIGIN holds no numbers for it")
    if TYPES[kind].outputs.count("force") == 3:
        return origin, []
    sensors = np.abs(origin[:2])
    edges = 0.5 * np.linalg.norm([corners[0] - corners[1], corners[0] - corners[3]], axis=1)
    if not (sensors > 0.0).all():
        raise RecordingError("FORCE_PLATFORM:ORIGIN has its sensors on its axes (a, b), where none lie")
    if (sensors <= _WITHIN_EDGES * edges).all():
        return origin, []
    (a, b), (x, y) = 1000.0 * sensors, 1000.0 * edges
    text = (
        f"by FORCE_PLATFORM:ORIGIN its sensors lie {a:.0f} and {b:.0f} mm (a, b) from its middle, by the corners its "
        f"edges {x:.0f} and {y:.0f} mm"
    )
    if (sensors[::-1] <= _WITHIN_EDGES * edges).all():
        raise RecordingError(f"{text}: a and b have been exchanged. Exchange them, or correct the corners, in the file")
    return origin, [warning("plates", f"{name}: {text}: sensors lie within. Correct what is wrong in the file.")]


def plate_wrench(
    kind: int, channels: Array, *, origin: Array, calibration: Array | None, units: Array
) -> tuple[Array, Array]:
    """Force (N, 3) N and moment (N, 3) N m about the centre of the surface, in the plate's frame (z into the
    floor).

    Args:
        kind: a key of `TYPES`.
        channels: (C, N) as the file scales them.
        origin: (3,) m. Where the channels are a wrench: between the transducers' origin and the surface's centre;
            types 3, 6, 7: distances a, b of the sensors from the axes, and their depth. Files differ in the sign of
            its depth: the transducers lie below the surface, that is settled here.
        calibration: (outputs, C), None where the channels are calibrated.
        units: (outputs,) factor to N, N m or m.
    """
    if calibration is not None:
        channels = calibration @ channels
    values = channels * units[:, None]
    if kind == 1:
        force = values[:3].T
        arm = np.column_stack([values[3], values[4], np.zeros(values.shape[1])])
        return force, np.cross(arm, force) + np.outer(values[5], [0.0, 0.0, 1.0])
    if kind == 6:
        x, y, z = values[0::3], values[1::3], values[2::3]  # (4, N) each
        values = np.stack([x[0] + x[1], x[2] + x[3], y[0] + y[3], y[1] + y[2], *z])
    if kind in (3, 6, 7):
        return _eight_forces(values, a=abs(origin[0]), b=abs(origin[1]), depth=abs(origin[2]))
    # From the transducers' origin T to the surface's centre S, which lies above it, at negative z: a file
    # with a positive depth holds the opposite vector. M_S = M_T + F x (S - T).
    to_surface = -origin if origin[2] > 0 else origin
    force = values[:3].T
    return force, values[3:].T + np.cross(force, to_surface)


def as_recorded(
    plate: str,
    kind: int,
    channels: Array,
    push: Array,
    listed: Sequence[str],
    *,
    origin: Array,
    calibration: Array | None,
    units: Array,
) -> Channels:
    """A plate's channels (C, N) by what each one makes of its wrench.

    Args:
        push: (N,) N, along its normal. listed: which ones of the file they are, in words. The rest: of `plate_wrench`.
    """
    if kind == 1:
        sizes = units / [1.0, 1.0, 1.0, 1.0, 1.0, LEVER_M]
    else:
        alone = np.eye(len(channels))
        force, moment = plate_wrench(kind, alone, origin=origin, calibration=calibration, units=units)
        sizes = np.hypot(np.linalg.norm(force, axis=1), np.linalg.norm(moment, axis=1) / LEVER_M)
    names, used = TYPES[kind].names, np.flatnonzero(sizes > 0.0).tolist()
    return Channels(
        plate,
        push,
        (channels[used] * sizes[used, None]).T,
        tuple(f"its {names[k]} ({listed[k]})" for k in used),
        tuple(_HOLD.get(names[k][:2], names[k]) for k in used),
        tuple(names[k].startswith("P") for k in used),
    )


def _eight_forces(values: Array, a: float, b: float, depth: float) -> tuple[Array, Array]:
    """Kistler: f_x12, f_x34, f_y14, f_y23, f_z1 to f_z4; sensors at (+-a, +-b), ``depth`` below the
    surface."""
    x12, x34, y14, y23, z1, z2, z3, z4 = values
    force = np.column_stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
    moment = np.column_stack(
        [
            b * (z1 + z2 - z3 - z4),
            a * (z2 + z3 - z1 - z4),
            b * (x34 - x12) + a * (y14 - y23),
        ]
    )
    return force, moment + np.cross(force, [0.0, 0.0, -depth])


_FACTORS = {"force": force_factor, "moment": moment_factor, "point": length_factor}
_TAKEN = {"force": "N", "moment": "N times the unit of its points", "point": "the unit of its points"}
_WORDS = {"force": "forces", "moment": "moments", "point": "centre of pressure"}
_CENTRED_M = 0.003
_MOST_VOLTS = 15.0
"""No converter reads more (10 V): what does was scaled to another unit, and "V" is what it was scaled from."""
Strange = Mapping[tuple[Signal, str], float]
"""Signals and the word for their unit that is not known -> the largest reading of such channels."""


class Units(NamedTuple):
    """Factor to N, N m or m of each output of a plate; whether the file gives the moments' unit; and what it gives that
    is not known."""

    factors: Array
    known: bool
    strange: Strange


def units_of(
    parameters: Parameters, channels: Sequence[int], signals: Array, unit_m: float, kind: int, calibrated: bool
) -> Units:
    """By default forces are in N, moments in N times the points' unit of length, of ``unit_m``.

    Channels (C, N) that go through a calibration are in volts, so the unit is that of the calibration, which the file
    does not name: the default.
    """
    factors = {"force": 1.0, "moment": unit_m, "point": unit_m}
    outputs = TYPES[kind].outputs
    found = [factors[signal] for signal in outputs]
    if calibrated:
        return Units(np.array(found), False, {})
    words, given, strange = parameters.texts("ANALOG", "UNITS"), True, dict[tuple[Signal, str], float]()
    for spot, (channel, signal) in enumerate(zip(channels, outputs, strict=True)):
        word = words[channel] if channel < len(words) else ""
        known = _FACTORS[signal](word)
        found[spot] = found[spot] if known is None else known
        given &= signal != "moment" or known is not None
        if word and known is None:
            most = float(np.nanmax(np.abs(signals[spot]), initial=0.0))
            strange[signal, word] = max(most, strange.get((signal, word), 0.0))
    return Units(np.array(found), given, strange)


def volts(word: str) -> bool:
    """Whether a unit is that of a converter."""
    return re.fullmatch(r"[munk\u00b5]?v(olts?)?", word.casefold()) is not None


def strange_in_words(plates: Mapping[str, Strange]) -> list[Message]:
    """What there is to say of units that are not known, of all plates by name: a warning, but a note of volts that are
    none."""
    most = max((read for strange in plates.values() for (_, word), read in strange.items() if volts(word)), default=0.0)
    found = list[Message]()
    names = dict[tuple[Signal, str], list[str]]()
    for name, strange in plates.items():
        for key in strange:
            names.setdefault(key, []).append(name)
    if most > _MOST_VOLTS:
        scaled = {key: own for key, own in names.items() if volts(key[1])}
        everybody = list(dict.fromkeys(name for own in scaled.values() for name in own))
        taken = " and ".join(f"{_WORDS[signal]} in {_TAKEN[signal]}" for signal in dict.fromkeys(s for s, _ in scaled))
        found.append(
            note(
                "plates",
                f"{together(everybody)}: the channels read up to {most:.3g} and are not in volts, which ANALOG:UNITS "
                f"says: {taken} taken.",
            )
        )
        names = {key: own for key, own in names.items() if key not in scaled}
    return found + [
        warning(
            "plates",
            f"{together(own)}: unknown unit {word!r} of its {_WORDS[signal]} in ANALOG:UNITS, {_TAKEN[signal]} taken.",
        )
        for (signal, word), own in names.items()
    ]


def fitting_moments(name: str, raw: Array, units: Units, half_m: float) -> tuple[Array, list[Message]]:
    """Factors (6,) of a plate's raw wrench (6, N), with N m of its moments where by those given it would be pressed at
    its middle all the time, as nobody stands, and by N m on its surface, of which half a diagonal is given; and what
    there is to say of it."""
    factors = units.factors
    if _pressed_within(raw * factors[:, None]) >= _CENTRED_M:
        return factors, []
    stays = f"the centre of pressure would stay within {1000.0 * _CENTRED_M:.0f} mm of the plate's centre"
    newton_metres = np.where(np.arange(6) < 3, factors, 1.0)
    if _pressed_within(raw * newton_metres[:, None]) > half_m or (newton_metres == factors).all():
        text = f"{name}: by the unit of its moments {stays}, which nobody does. Correct it in the file."
        return factors, [warning("plates", text)]
    if not units.known:
        text = f"{name}: the file gives no unit for its moments: N m taken, as else {stays}."
        return newton_metres, [note("plates", text)]
    text = f"{name}: by the unit that the file gives for its moments {stays}: N m taken. Correct it in the file."
    return newton_metres, [warning("plates", text)]


def _pressed_within(wrench: Array) -> float:
    """How far from the middle of its plate a wrench (6, N), N and N m, acts nearly all the time, m; inf where nobody
    stands on it."""
    loaded = wrench[:, np.isfinite(wrench).all(axis=0) & (np.abs(np.nan_to_num(wrench[2])) > JUDGED_N)]
    if not loaded.size:
        return float("inf")
    return float(np.percentile(np.hypot(loaded[3], loaded[4]) / np.abs(loaded[2]), 95.0))
