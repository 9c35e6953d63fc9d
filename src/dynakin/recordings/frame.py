"""The ground frames of models in the laboratory of a recording: Y up; X forward (planar), or the laboratory's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, cross, wrench_about
from dynakin.errors import ConfigError, RecordingError
from dynakin.recordings.landmarks import DEFAULT_PAIRS, FacingPairs
from dynakin.recordings.orientation import (
    against_forward,
    axis_vector,
    find_forward,
    horizontal,
    refuse_mirrored,
)
from dynakin.recordings.recording import Recording
from dynakin.recordings.vertical import against_vertical, find_vertical

UPRIGHT = {
    "+Y": (((1, 0, 0), (0, 1, 0), (0, 0, 1)), ""),
    "-Y": (((1, 0, 0), (0, -1, 0), (0, 0, -1)), "X, Y, Z are x, -y, -z"),
    "+Z": (((1, 0, 0), (0, 0, 1), (0, -1, 0)), "X, Y, Z are x, z, -y"),
    "-Z": (((1, 0, 0), (0, 0, -1), (0, 1, 0)), "X, Y, Z are x, -z, y"),
    "+X": (((0, -1, 0), (1, 0, 0), (0, 0, 1)), "X, Y, Z are -y, x, z"),
    "-X": (((0, 1, 0), (-1, 0, 0), (0, 0, 1)), "X, Y, Z are y, -x, z"),
}
"""R_GL of the laboratory's own frame with Y up, by its vertical axis: a quarter or half turn about its x, or about its
z where x is vertical. OpenSim's gravity is along -Y."""


@dataclass(frozen=True, eq=False)
class GroundFrame:
    """Ground frame G in the laboratory L: p_G = R_GL (p_L - origin_L).

    Attributes:
        rotation: R_GL (3, 3); its rows are the ground's X, Y and Z in the laboratory. Y is up; X is forward, or, of
            `upright`, the laboratory's own.
        origin_L: (3,) m, the ground's origin in the laboratory.
        vertical: laboratory axis that points up, "+Y", "+Z", ...
        forward: (3,) unit vector in the laboratory, horizontal: the way the person faces.
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

    def facing(self) -> GroundFrame:
        """The same ground with X forward, Y up and Z to the right of the person."""
        up = axis_vector(self.vertical)
        return replace(self, rotation=np.vstack([self.forward, up, np.cross(self.forward, up)]))

    def upright(self) -> GroundFrame:
        """The laboratory's own axes, turned so that Y is up where they are not (`UPRIGHT`)."""
        turned = replace(self, rotation=np.array(UPRIGHT[self.vertical][0], dtype=float))
        return replace(turned, how=(*self.how, f"Coordinates, markers, wrenches: {turned.in_words}."))

    @property
    def in_words(self) -> str:
        """What these axes are, and where their origin is, for the headers of files."""
        rows, axes = UPRIGHT[self.vertical]
        if np.allclose(self.rotation, rows, atol=1e-9):
            words = "laboratory frame" + (f" with Y up ({axes} of the laboratory)" if axes else "")
        else:
            ahead = ", ".join(f"{value:.4f}" for value in self.rotation[0] + 0.0)
            words = f"ground frame with X along ({ahead}) of the laboratory, Y up ({self.vertical}), Z to the right"
        if not self.origin_L.any():
            return words
        place = ", ".join(f"{value:.4f}" for value in self.origin_L + 0.0)
        return f"{words}, its origin at ({place}) m of the laboratory"

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
        force, moved = np.split(wrench_about(wrench, self.origin_L), 2, axis=-1)
        return np.concatenate([self.vectors_to_ground(force), self.vectors_to_ground(moved)], axis=-1)

    def wrench_to_laboratory(self, wrench: Array) -> Array:
        """The way back of ``wrench_to_ground``."""
        force = self.vectors_to_laboratory(wrench[..., :3])
        moment = self.vectors_to_laboratory(wrench[..., 3:]) + cross(self.origin_L, force)
        return np.concatenate([force, moment], axis=-1)


def find_ground_frame(
    recording: Recording,
    *,
    vertical: str = "auto",
    forward: str | Sequence[float] | Array = "auto",
    pairs: FacingPairs = DEFAULT_PAIRS,
    static: Recording | None = None,
) -> GroundFrame:
    """Find up and forward in a recording, or take what is given; the frame has X forward and the laboratory's origin.

    Args:
        vertical: "auto" or a laboratory axis ("+Y", "-Z", ...).
        forward: "auto", a laboratory axis, or a vector (3,); only its horizontal part counts.
        pairs: markers that show the facing direction; ``find_marker``'s rules for their spelling.
        static: the standing trial, which may show up where the person of the recording lies.

    Raises:
        RecordingError: not given and not to be found, or the person is seen in a mirror.
        ConfigError: an unknown axis, or a forward direction that is vertical.
    """
    if vertical.casefold() == "auto":
        axis, how = find_vertical(recording, pairs, static)
        up = axis_vector(axis)
    else:
        up = axis_vector(vertical)
        axis = ("+" if up.sum() > 0 else "-") + "XYZ"[int(np.argmax(np.abs(up)))]
        how = [f"Vertical {axis}: given."]
        other, sure = against_vertical(recording, axis, pairs)
        if sure:
            raise RecordingError(
                f"{recording.path or recording.name}: vertical is {axis}, but the body above the feet and the plates' "
                f"force show {other}; expected {other}, or auto"
            )
        if other:
            how.append(f"Vertical: the body above the feet shows {other}, not {axis}; not followed.")
    refuse_mirrored(recording, up, axis, pairs)
    if isinstance(forward, str) and forward.casefold() == "auto":
        ahead, found = find_forward(recording, up, pairs)
        how += found
    else:
        given = axis_vector(forward) if isinstance(forward, str) else np.asarray(forward, dtype=float)
        flat = horizontal(given, up) if given.shape == (3,) else None
        if flat is None:
            raise ConfigError(f"found forward {forward!r}, expected three numbers with a part across vertical {axis}")
        ahead = flat
        shown, sure = against_forward(recording, up, ahead, pairs)
        if sure:
            raise RecordingError(
                f"{recording.path or recording.name}: forward is given as {forward}, but the person faces {shown}; "
                "expected the direction in which the person faces, or auto"
            )
        if shown:
            how.append(f"Forward: the person faces {shown}; not followed.")
        how.append(f"Forward ({', '.join(f'{value:.3f}' for value in ahead + 0.0)}) in the laboratory: given.")
    rotation = np.vstack([ahead, up, np.cross(ahead, up)])
    return GroundFrame(rotation, np.zeros(3), axis, ahead, tuple(how))
