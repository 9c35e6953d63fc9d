"""Plates whose moments have a wrong sign, or are exchanged: their centre of pressure moves against the foot on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.messages import together
from dynakin.recordings.feet.contact import FootContact
from dynakin.recordings.hull import distance_to_hull
from dynakin.recordings.plates.ground_plate import SAME_LEVEL_M, GroundPlate
from dynakin.recordings.pushes import JUDGED_N
from dynakin.recordings.recording import Array

Flags = npt.NDArray[np.bool_]

MIRRORED: tuple[tuple[str, Array], ...] = (
    ("it is mirrored along the first axis (from corner 2 to 1), as by a wrong sign of My", np.diag([-1.0, 1.0])),
    ("it is mirrored along the second axis (from corner 4 to 1), as by a wrong sign of Mx", np.diag([1.0, -1.0])),
    ("it is turned by half a turn about the plate's middle, as by a wrong sign of all moments", -np.eye(2)),
    ("its coordinates are exchanged, as by exchanged Mx and My", np.array([[0.0, -1.0], [-1.0, 0.0]])),
)
"""What wrong moments do to a centre of pressure, along a plate's axes and about its middle."""
AWAY_M, LESS, JUDGED_S = 0.03, 0.4, 0.3
"""What presses is the part of a foot that touches: from it a centre of pressure lies so far on average, by load and
over so long at least, and mirrored within it and by so much less. Walks of `truth3d`, which chose: right 0.008 to 0.014
m, mirrored 0.03 to 0.07 (0.08 to 0.25 times that once put right). Of 25 plates in shared/data 5 lie as far off (0.036
to 0.157), and mirrored 0.5 times as far and more."""
OVER_M = 0.03
"""How far beyond its edges a marker may be that bears on a plate."""


def turned_moments(contacts: Sequence[FootContact | None], plates: Sequence[GroundPlate], rate_hz: float) -> str:
    """A sentence on plates, all together or one, whose centre of pressure lies under what touches of the feet once it
    is mirrored, and not as it is; "" where none does, or nothing can be said."""
    feet = [foot for foot in contacts if foot is not None]
    pressed = {plate.name: found for plate in plates if (found := _Pressed.of(plate, feet)) is not None}
    every = list(pressed)
    for names in (every, *([name] for name in every if len(every) > 1)):
        chosen = [pressed[name] for name in names]
        if not sum(len(each.push) for each in chosen) >= max(JUDGED_S * rate_hz, 1.0):  # one frame has no rate
            continue
        now = _away(chosen, np.eye(2))
        if not now > AWAY_M:
            continue
        least, words = min((_away(chosen, turn), words) for words, turn in MIRRORED)
        if least < min(LESS * now, AWAY_M):
            return (
                f"the centre of pressure of {together(names)} does not go with the feet: it lies {now:.2f} m on "
                f"average from what of them touches the ground, and {least:.2f} m once {words}"
            )
    return ""


class _Pressed:
    """A plate while something of a foot touches it: its centre of pressure (K, 2) m along its axes and about its
    middle, those markers (K, M, 2) likewise, NaN where they do not touch, and its load (K,) N."""

    def __init__(self, cop: Array, markers: Array, push: Array) -> None:
        self.cop, self.markers, self.push = cop, markers, push

    @staticmethod
    def of(plate: GroundPlate, feet: Sequence[FootContact]) -> _Pressed | None:
        """None where it has no corners, or nobody touches it."""
        if plate.corners is None or not feet:
            return None
        middle, rows = plate.axes
        touching = [foot.touching & (plate.beyond(foot.outline) < OVER_M) & _level(foot, plate) for foot in feet]
        markers = np.concatenate(
            [np.where(on[:, :, None], foot.outline, np.nan) for on, foot in zip(touching, feet, strict=True)], axis=1
        )
        seen = np.isfinite(markers).all(axis=2).any(axis=1) & np.isfinite(plate.cop).all(axis=1)
        on: Flags = np.asarray(seen & plate.known & (plate.push > JUDGED_N))
        if not on.any():
            return None
        return _Pressed((plate.cop[on] - middle) @ rows.T, (markers[on] - middle) @ rows.T, plate.push[on])


def _level(foot: FootContact, plate: GroundPlate) -> Flags:
    """(T, 1) frames in which a foot stands on the level of a plate: under a seat that is one, it does not."""
    height = np.nan if plate.height_m is None else plate.height_m
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(foot.support_m - height) < SAME_LEVEL_M)[:, None]


def _away(plates: Sequence[_Pressed], turn: Array) -> float:
    """How far centres of pressure lie from the feet once turned, m, on average by load."""
    away = np.concatenate([distance_to_hull(each.cop @ turn.T, each.markers) for each in plates])
    return float(np.average(away, weights=np.concatenate([each.push for each in plates])))
