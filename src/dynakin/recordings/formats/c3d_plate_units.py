"""Units of the channels of a C3D file's force plates: as the file gives them, or as they must be where it does not."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dynakin.arrays import Array
from dynakin.messages import Message, note, together, warning
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.formats.c3d_plate_types import TYPES, Signal
from dynakin.recordings.pushes import JUDGED_N
from dynakin.units import force_factor, length_factor, moment_factor

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
