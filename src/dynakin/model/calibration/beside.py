"""Points beside a marker: joint centres under the one marker that sits over them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from dynakin.model.markers.schema import Offset

Array = npt.NDArray[np.float64]

_BENT = 10.0
"""How much the plane of a bent limb counts beside the body's middle plane: it takes over from 6 deg of bend."""


def lateral(asis: Array, foot: Sequence[Array] | None, side: str) -> Array:
    """Horizontal unit vector (3,) away from the body's middle, of a person who stands.

    Args:
        asis: from the other side's ASIS to one's own. foot: heel and toe. Feet point outward by more than knees do, the
            pelvis by less; the mean of both is taken.
    """
    directions = [asis]
    if foot is not None:
        ahead = foot[1] - foot[0]
        right = np.array([-ahead[2], 0.0, ahead[0]])  # ahead x up
        directions.append(right if side == "right" else -right)
    flat = [d * np.array([1.0, 0.0, 1.0]) for d in directions]
    mean = np.sum([d / np.linalg.norm(d) for d in flat], axis=0)
    return np.asarray(mean / np.linalg.norm(mean))


def offset_point(
    offset: Offset, point: Callable[[str], Array], across: Array | None, side: str, size_m: float
) -> Array:
    """The point (3,) m that an `Offset` describes.

    Args:
        point: a marker's or landmark's place. across: `lateral`, for one that goes inward. size_m: height or scale.
    """
    origin = point(offset.origin)
    fraction = offset.per_height if offset.per_height is not None else offset.per_scale
    assert fraction is not None
    distance = fraction * size_m + offset.add_m
    if offset.along is not None:
        start, end = (point(name) for name in offset.along)
        direction = end - start
    else:
        assert across is not None and offset.square_to is not None
        outward = across
        if offset.bend is not None:
            upper, middle, lower = (point(name) for name in offset.bend)
            a, b = lower - middle, upper - middle
            plane = np.cross(a, b) / (np.linalg.norm(a) * np.linalg.norm(b))  # to the right of a flexed arm
            outward = across + _BENT * (plane if side == "right" else -plane)
        start, end = (point(name) for name in offset.square_to)
        line = (end - start) / np.linalg.norm(end - start)
        direction = -(outward - line * float(outward @ line))
    return np.asarray(origin + distance * direction / np.linalg.norm(direction))
