"""The ground frame of every model (X forward, Y up, Z right) in the laboratory of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.errors import ConfigError
from dynakin.recordings.facing import find_forward, horizontal
from dynakin.recordings.landmarks import DEFAULT_PAIRS, FacingPairs
from dynakin.recordings.recording import Array, Recording
from dynakin.recordings.vertical import axis_vector, find_vertical


@dataclass(frozen=True, eq=False)
class GroundFrame:
    """Ground frame G in the laboratory L: p_G = R_GL (p_L - origin_L).

    Attributes:
        rotation: R_GL (3, 3); its rows are forward, up and right in the laboratory.
        origin_L: (3,) m, the ground's origin in the laboratory.
        vertical: laboratory axis that points up, "+Y", "+Z", ...
        forward: (3,) unit vector in the laboratory, horizontal.
        how: sentences on how each was found.
    """

    rotation: Array
    origin_L: Array
    vertical: str
    forward: Array
    how: tuple[str, ...] = ()

    def with_origin(self, origin_L: npt.ArrayLike) -> GroundFrame:
        """The same directions about another origin (3,) m, laboratory frame (a model's toe landmark)."""
        return replace(self, origin_L=np.asarray(origin_L, dtype=float))

    def vectors_to_ground(self, vectors: Array) -> Array:
        """Free vectors (..., 3) from laboratory to ground."""
        return np.asarray(vectors @ self.rotation.T)

    def vectors_to_laboratory(self, vectors: Array) -> Array:
        """Free vectors (..., 3) from ground to laboratory."""
        return np.asarray(vectors @ self.rotation)

    def points_to_ground(self, points: Array) -> Array:
        """Points (..., 3) m from laboratory to ground; NaN stays NaN."""
        return self.vectors_to_ground(points - self.origin_L)

    def points_to_laboratory(self, points: Array) -> Array:
        """Points (..., 3) m from ground to laboratory."""
        return self.vectors_to_laboratory(points) + self.origin_L

    def wrench_to_ground(self, wrench: Array) -> Array:
        """Wrenches (..., 6) [N, N m] about the laboratory origin, there, to those about the ground's origin,
        in ground."""
        force, moment = wrench[..., :3], wrench[..., 3:]
        moved = moment - np.cross(self.origin_L, force)
        return np.concatenate([self.vectors_to_ground(force), self.vectors_to_ground(moved)], axis=-1)

    def wrench_to_laboratory(self, wrench: Array) -> Array:
        """The way back of ``wrench_to_ground``."""
        force = self.vectors_to_laboratory(wrench[..., :3])
        moment = self.vectors_to_laboratory(wrench[..., 3:]) + np.cross(self.origin_L, force)
        return np.concatenate([force, moment], axis=-1)


def find_ground_frame(
    recording: Recording,
    *,
    vertical: str = "auto",
    forward: str | Sequence[float] | Array = "auto",
    origin_L: npt.ArrayLike | None = None,
    pairs: FacingPairs = DEFAULT_PAIRS,
) -> GroundFrame:
    """Find up and forward in a recording, or take what is given.

    Args:
        vertical: "auto" or a laboratory axis ("+Y", "-Z", ...).
        forward: "auto", a laboratory axis, or a vector (3,); only its horizontal part counts.
        origin_L: (3,) m; the laboratory's own origin where not given.
        pairs: markers that show the facing direction; ``find_marker``'s rules for their spelling.

    Raises:
        RecordingError: not given and not to be found.
        ConfigError: an unknown axis, or a forward direction that is vertical.
    """
    if vertical.casefold() == "auto":
        axis, how = find_vertical(recording, pairs)
        up = axis_vector(axis)
    else:
        up = axis_vector(vertical)
        axis = ("+" if up.sum() > 0 else "-") + "XYZ"[int(np.argmax(np.abs(up)))]
        how = [f"Vertical {axis}: given."]
    if isinstance(forward, str) and forward.casefold() == "auto":
        ahead, found = find_forward(recording, up, pairs)
        how += found
    else:
        given = axis_vector(forward) if isinstance(forward, str) else np.asarray(forward, dtype=float)
        flat = horizontal(given, up) if given.shape == (3,) else None
        if flat is None:
            raise ConfigError(f"found forward {forward!r}, expected three numbers with a part across vertical {axis}")
        ahead = flat
        how.append(f"Forward ({', '.join(f'{value:.3f}' for value in ahead + 0.0)}) in the laboratory: given.")
    rotation = np.vstack([ahead, up, np.cross(ahead, up)])
    origin = np.zeros(3) if origin_L is None else np.asarray(origin_L, dtype=float)
    return GroundFrame(rotation, origin, axis, ahead, tuple(how))
