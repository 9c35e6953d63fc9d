"""The numbers of the page's player, as it reads them."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    """What the player's `unpack` gives."""
    codes, code, place = [], 0, 0
    for byte in base64.b64decode(packed["values"]):
        code, place = code + ((byte & 127) << place), place + 7
        if byte < 128:
            codes.append(code)
            code, place = 0, 0
    columns = np.array(codes, dtype=float).reshape(packed["columns"], -1)
    changes = np.where(columns % 2, (columns - 1) / 2, -columns / 2)
    return np.where(columns > 0, packed["step"] * np.cumsum(changes, axis=1), np.nan).T
