"""Axes of plates: which horizontal ones they are, whether feet that push against each other show other ones, and plates
that hold the person's action instead of the ground's reaction: a plate cannot pull."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.messages import Message, note
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Plate

TURNS: tuple[tuple[str, Array], ...] = (
    ("{second} points the other way", np.diag([1.0, -1.0])),
    ("{first} points the other way", np.diag([-1.0, 1.0])),
    ("both horizontal axes point the other way (half a turn)", -np.eye(2)),
    ("the horizontal axes are turned by a quarter turn", np.array([[0.0, -1.0], [1.0, 0.0]])),
    ("the horizontal axes are turned by a quarter turn", np.array([[0.0, 1.0], [-1.0, 0.0]])),
    ("the two horizontal forces are exchanged", np.array([[0.0, 1.0], [1.0, 0.0]])),
    ("the two horizontal forces are exchanged and point the other way", np.array([[0.0, -1.0], [-1.0, 0.0]])),
)
AWAY_DEG, ALONG_DEG, APART_S = 70.0, 45.0, 0.5
"""While several plates are loaded the ground pushes each foot towards the others. Of 17 real recordings (standing,
squats, chairs, walks, a drop jump) each plate's horizontal force lies 0 to 46 deg off that direction, seen from above
(one, which reads 16 N forward while somebody stands, 88), all together 0 to 41. Turned are plates that all lie more
than the first off it, and together less than the second with other axes; judged over so long."""
LEAST_PART = 0.03
"""Of the load: a lesser horizontal force shows no direction. The least loaded way to stand has 0.04 to 0.07."""

OWN_PART = 0.3
"""Of the largest push of all plates: one that reaches it bears a foot, not an offset or a drift, and has its own sign;
one that does not has that of the most loaded plate."""
_SAMPLES = 5  # as few are a spike


class PlateAxes:
    """A plate's own horizontal axes; the laboratory's own where it has no corners.

    Attributes:
        rows: (2, 2) in the ground's X and Z. names: of both.
    """

    def __init__(self, plate: Plate, ground: GroundFrame) -> None:
        x, z = (k for k in range(3) if "XYZ"[k] != ground.vertical[1])
        self.rows, self.names = ground.vectors_to_ground(np.eye(3)[[x, z]])[:, [0, 2]], ("XYZ"[x], "XYZ"[z])
        if plate.corners is not None:
            along = ground.vectors_to_ground(plate.corners[0] - plate.corners[1])[[0, 2]]
            if np.linalg.norm(along) > 1e-6:
                along = along / np.linalg.norm(along)
                self.rows = np.array([along, [-along[1], along[0]]])
                self.names = "its first axis (from corner 2 to 1)", "its second axis (from corner 4 to 1)"

    def turned(self, force: Array, turn: Array) -> Array:
        """(T, 2) N, X and Z of the ground: of horizontal forces (T, 2) what is left once these axes are turned."""
        return np.asarray(force @ self.rows.T @ turn.T @ self.rows)

    def in_words(self, how: str) -> str:
        """One of `TURNS` with the names of the axes."""
        return how.format(first=self.names[0], second=self.names[1])


def turned_feet(plates: Sequence[Plate], ground: GroundFrame, rate_hz: float) -> str | None:
    """A sentence where the ground would push the feet apart or across, and together with other axes of the plates: of
    forces that cancel in the sum over the plates. None where it does not, or nothing can be said."""
    forces = np.stack([ground.vectors_to_ground(plate.force) for plate in plates])  # (P, T, 3)
    cops = np.stack([ground.points_to_ground(plate.cop) for plate in plates])[:, :, [0, 2]]
    up = forces[:, :, 1]
    loaded = (up > JUDGED_N) & np.isfinite(cops).all(axis=2)
    loaded &= np.count_nonzero(loaded, axis=0) > 1
    judged = np.flatnonzero(np.count_nonzero(loaded, axis=1) >= APART_S * rate_hz).tolist()
    if len(judged) < 2:
        return None
    share = np.where(loaded, up, 0.0)[:, :, None]
    middle = (share * np.nan_to_num(cops)).sum(axis=0) / np.maximum(share.sum(axis=0), 1.0)
    axes = [PlateAxes(plate, ground) for plate in plates]

    def along(turn: Array) -> npt.NDArray[np.complex128]:
        """Of each plate, over its frames: how much of its force points to the middle, and across it."""
        found = []
        for k in judged:
            t = loaded[k]
            arm, force = (middle - cops[k])[t] * up[k, t, None], axes[k].turned(forces[k][t][:, [0, 2]], turn)
            found.append(np.sum((force[:, 0] + 1j * force[:, 1]) * (arm[:, 0] - 1j * arm[:, 1])))
        return np.array(found)

    sizes = [np.linalg.norm(forces[k, loaded[k]][:, [0, 2]], axis=1).mean() / up[k, loaded[k]].mean() for k in judged]
    off = np.abs(np.angle(along(np.eye(2)), deg=True))
    if off.min() < AWAY_DEG or min(sizes) < LEAST_PART:
        return None

    left_deg = [abs(float(np.angle(along(turn).sum(), deg=True))) for _, turn in TURNS]
    best = int(np.argmin(left_deg))
    if left_deg[best] > ALONG_DEG:
        return None
    exchanged = ", or if the two were exchanged" if len(judged) == 2 and off.min() > 180.0 - AWAY_DEG else ""
    names = " and ".join(plates[k].name for k in judged)
    return (
        f"the horizontal force of {names} pushes the feet apart or across: it lies "
        f"{off.min():.0f} to {off.max():.0f} deg off the direction from each foot to the other, seen from above, and "
        f"{left_deg[best]:.0f} deg if {axes[judged[0]].in_words(TURNS[best][0])}{exchanged}"
    )


def pulling(pushes: Sequence[Array]) -> npt.NDArray[np.bool_]:
    """Which of the plates hold the person's action, by the forces (N,) N of each towards the person's side."""
    known = [np.nan_to_num(push) if len(push) else np.zeros(1) for push in pushes]
    largest = np.array([np.sort(np.abs(push))[-_SAMPLES:].min() for push in known])
    pulls = np.array(
        [np.median(push[np.abs(push) >= 0.5 * size]) < 0.0 for push, size in zip(known, largest, strict=True)],
        dtype=bool,
    )  # the upper half, so that a long offset does not outweigh a short step
    if not len(largest) or largest.max() <= JUDGED_N:
        return np.zeros(len(largest), dtype=bool)
    own = largest > max(JUDGED_N, OWN_PART * float(largest.max()))
    return np.where(own, pulls, pulls[np.argmax(largest)])


def turned_in_words(names: Sequence[str], turned: npt.NDArray[np.bool_]) -> list[Message]:
    """A note that names the plates which were turned."""
    if not turned.any():
        return []
    if turned.all():
        return [note("plates", "The file stores the person's action on the plates; turned into the ground's reaction.")]
    those = " and ".join(name for name, turn in zip(names, turned, strict=True) if turn)
    text = (
        f"The file stores the person's action on {those}, unlike its other plates; turned into the ground's reaction."
    )
    return [note("plates", text)]
