"""Units of the channels of a C3D's force plates, and whether they can be those of somebody who stands there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynakin.messages import Message, note, warning
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.formats.c3d_plate_types import TYPES
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Array
from dynakin.units import force_factor, length_factor, moment_factor

_FACTORS = {"force": force_factor, "moment": moment_factor, "point": length_factor}
_TAKEN = {"force": "N", "moment": "N times the unit of its points", "point": "the unit of its points"}
_WORDS = {"force": "forces", "moment": "moments", "point": "centre of pressure"}
_CENTRED_M = 0.003


def fitting_moments(name: str, raw: Array, factors: Array, known: bool, half_m: float) -> tuple[Array, list[Message]]:
    """Factors (6,) of a plate's raw wrench (6, N), with N m of its moments where by those given it would be pressed at
    its middle all the time, as nobody stands, and by N m on its surface, of which half a diagonal is given; and what
    there is to say of it. ``known``: whether the file gives the moments' unit."""
    if _pressed_within(raw * factors[:, None]) >= _CENTRED_M:
        return factors, []
    stays = f"the centre of pressure would stay within {1000.0 * _CENTRED_M:.0f} mm of the plate's centre"
    newton_metres = np.where(np.arange(6) < 3, factors, 1.0)
    if _pressed_within(raw * newton_metres[:, None]) > half_m or (newton_metres == factors).all():
        text = f"{name}: by the unit of its moments {stays}, which nobody does. Correct it in the file."
        return factors, [warning("plates", text)]
    if not known:
        text = f"{name}: the file gives no unit for its moments: N m taken, as else {stays}."
        return newton_metres, [note("plates", text)]
    text = f"{name}: by the unit that the file gives for its moments {stays}: N m taken. Correct it in the file."
    return newton_metres, [warning("plates", text)]


def _pressed_within(wrench: Array) -> float:
    """How far from the middle of its plate a wrench (6, N), N and N m, acts nearly all the time, m; inf where nobody
    stands on it."""
    loaded = wrench[:, np.abs(wrench[2]) > JUDGED_N]
    if not loaded.size:
        return float("inf")
    return float(np.percentile(np.hypot(loaded[3], loaded[4]) / np.abs(loaded[2]), 95.0))


def unit_factors(
    name: str, parameters: Parameters, channels: Sequence[int], unit_m: float, kind: int, calibration: Array | None
) -> tuple[Array, bool, list[Message]]:
    """Factor to N, N m or m of each output, whether the file gives the moments' unit, and a warning of each unit that
    is not known; by default forces are in N, moments in N times the points' length unit.

    Channels that go through a calibration are in volts, so the unit is that of the calibration, which the file does
    not name: the default.
    """
    factors = {"force": 1.0, "moment": unit_m, "point": unit_m}
    outputs = TYPES[kind].outputs
    found = [factors[signal] for signal in outputs]
    if calibration is not None:
        return np.array(found), False, []
    words, given, strange = parameters.texts("ANALOG", "UNITS"), True, dict[tuple[str, str], None]()
    for spot, (channel, signal) in enumerate(zip(channels, outputs, strict=True)):
        word = words[channel] if channel < len(words) else ""
        known = _FACTORS[signal](word)
        found[spot] = found[spot] if known is None else known
        given &= signal != "moment" or known is not None
        if word and known is None:
            strange[signal, word] = None
    said = [
        f"{name}: unknown unit {word!r} of its {_WORDS[signal]} in ANALOG:UNITS, {_TAKEN[signal]} taken."
        for signal, word in strange
    ]
    return np.array(found), given, [warning("plates", text) for text in said]
