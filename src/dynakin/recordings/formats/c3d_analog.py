"""Analog channels of a C3D file as its words and offsets are meant: ezc3d reads all words as signed, and takes the size
of an offset without its sign.

By the C3D user guide a value is (word - OFFSET) SCALE GEN_SCALE, where both are signed numbers of 16 bits, or unsigned
ones where ANALOG:FORMAT says so (an offset of 32768 is then written like -32768).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dynakin.arrays import Array
from dynakin.recordings.formats.c3d_parameters import Parameters

_WORDS, _HALF = 65536.0, 32768.0


def analog_values(data: Any, parameters: Parameters) -> Array:
    """(channels, samples) of what ezc3d read, scaled as the file says."""
    read: Array = np.asarray(data["data"]["analogs"], dtype=float)[0]
    offset = parameters.continued("ANALOG", "OFFSET")[: len(read)]
    scale = parameters.continued("ANALOG", "SCALE")[: len(read)] * (parameters.number("ANALOG", "GEN_SCALE") or 0.0)
    unsigned = _unsigned(parameters, offset)
    if len(offset) != len(read) or len(scale) != len(read) or not (unsigned or (offset < 0.0).any()):
        return read
    scale, offset = scale[:, None], offset[:, None]
    stored = np.divide(read, scale, out=np.zeros_like(read), where=scale != 0.0) + np.abs(offset)
    if unsigned and (parameters.number("POINT", "SCALE") or 0.0) > 0.0:  # words, not floating-point numbers
        stored = np.rint(stored) % _WORDS
    if unsigned:  # of a number below 0, which floats can be, the offset is no unsigned one
        offset = np.where(stored.min(axis=1, keepdims=True, initial=0.0) < 0.0, offset, offset % _WORDS)
    return np.asarray((stored - offset) * scale)


def _unsigned(parameters: Parameters, offset: Array) -> bool:
    """Where the file does not say it, by an offset that no signed word lies below."""
    said = parameters.text("ANALOG", "FORMAT").upper()
    return said == "UNSIGNED" or (not said and bool((offset == -_HALF).any()))
