"""Markers of the pelvis that the person who stands does not show: an arm or a belly hides them.

Everything hangs on the pelvis, and one marker of it that lacks leaves its width, its heading and both hips to the
proportions of an adult. The trial has its place beside the others, which move as one with it; else the other side has
it, in the mirror of the middle plane that a pair of markers shows. (Of limbs the movement finds the joints:
`legs_in_motion`.)
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.calibrated import Hips
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.joint_motion import off_their_line, rigid_motion
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.markers.fit import ROOT
from dynakin.model.markers.match import MarkerKey
from dynakin.model.mirroring import OTHER_SIDE, SIDES
from dynakin.model.schema import ModelFile
from dynakin.results.naming import listed, words

_FEWEST, _LEAST = 3, 2
"""Markers beside it that show where one is, and with which that is known but for a turn about the line through them."""
_ALONG_M = 0.01
"""Root mean square distance from the line through them, from which on they show how the pelvis turns about it."""
_HOLD_M = 0.002
"""Of points about the middle of two markers that hold the turn about their line: too near to it to turn the line."""
_BEST = 0.25
"""Part of the trial's frames that count: those in which the pelvis is most as it stands."""
_FRAMES = 400
_HIPS = {"hip_l", "hip_r"}


@dataclass(frozen=True, eq=False)
class Pelvis:
    """Where lengths and places are measured, with what that does not show of the pelvis.

    Attributes:
        source: with the markers of the pelvis that only the trial has, and with those that the hips' regressions need
            and neither has where the other side does.
        supposed: markers that are put there by two others or by the other side, and a sentence on each.
        messages: notes on the others that are put there.
    """

    source: MarkedTrial
    supposed: dict[MarkerKey, str] = field(default_factory=dict)
    messages: tuple[Message, ...] = ()

    @classmethod
    def of(cls, source: MarkedTrial, trial: MarkedTrial, model: ModelFile) -> Pelvis:
        """Of models in space; those in a plane measure no pelvis.

        Args:
            source: where the person stands; the trial itself where there is no such recording.
        """
        if not model.sided:
            return cls(source)
        messages: list[Message] = []
        supposed: dict[MarkerKey, str] = {}
        seen, moving = _on_the_pelvis(source), _on_the_pelvis(trial)
        stands = source.recording.name
        for key in sorted(moving - seen):
            place, sure = _beside(source, trial, sorted(seen & moving), key)
            if place is None:
                continue
            name = trial.match.names[key]
            source = _with(source, key, name, place)
            text = f"{stands} does not show {name}, which is put where {trial.recording.name} has it beside "
            if sure:
                messages.append(note("calibration", f"{text}the other markers of the pelvis."))
            else:
                others = listed([trial.match.names[other] for other in sorted(seen & moving)])
                supposed[key] = f"{text}{others}, the pelvis held as upright as it is there"
        for key in sorted(_needed(source) - _on_the_pelvis(source)):
            place = _mirrored(source, key)
            if place is not None:
                aliases = source.match.marker_set.marker(key[0]).aliases
                name, other = aliases(key[1])[0], aliases(OTHER_SIDE[key[1]])[0]
                source = _with(source, key, name, place)
                supposed[key] = f"nothing shows {name}, so it is put where {other} is on the other side of the pelvis"
        return cls(source, supposed, tuple(messages))

    def said(self, finder: LandmarkFinder) -> list[Message]:
        """The notes, and a warning of what hangs on each marker whose place is supposed."""
        hips = finder.markers_of("hip")
        off = "angles of pelvis and hips may be off by up to 5 deg because of it, in all frames alike"
        farther = ", and hip centres by 2 cm, which the deviations of moments hold"
        return [
            *self.messages,
            *(
                warning(
                    "joints",
                    f"{text}: {off}{farther if key in hips else ''}.",
                )
                for key, text in self.supposed.items()
            ),
        ]

    def hips(
        self,
        finder: LandmarkFinder,
        added: Collection[str],
        functional: Collection[str],
        moved: bool = False,
    ) -> Hips:
        """Where their centres come from, the less sure one.

        Args:
            added: landmarks that were completed. functional: joints that movement shows. moved: whether markers
                of the hips sit otherwise in the trial.
        """
        if not _HIPS - {*functional}:
            return "functional"
        if _HIPS & {*added}:
            return "supposed" if _framed(self.source) else "proportions"
        return "supposed" if moved or finder.markers_of("hip") & self.supposed.keys() else "measured"


def hips_of_proportions(added: Collection[str], source: MarkedTrial) -> list[Message]:
    """A warning where hips are not measured at all, nor laid into a pelvis that markers show.

    Args:
        added: landmarks that were completed.
    """
    hips = [words(name) for name in sorted(_HIPS & {*added})]
    if not hips or _framed(source):
        return []
    names = listed([source.match.names[key] for key in sorted(_on_the_pelvis(source))])
    text = (
        f"too few markers show the pelvis of {source.recording.name} ({names or 'none'}): {listed(hips)} are where the "
        "proportions of an adult have them, to some centimetres. Angles and moments of the legs are not to be relied "
        "on; both ASIS, and a PSIS or the sacrum, would show them."
    )
    return [warning("joints", text)]


def _segment(trial: MarkedTrial, name: str) -> str | None:
    return trial.match.marker_set.marker(name).segment


def _on_the_pelvis(trial: MarkedTrial) -> set[MarkerKey]:
    """Its markers that some frame shows."""
    own = {key: path for key, path in trial.paths.items() if _segment(trial, key[0]) == ROOT}
    return {key for key, path in own.items() if np.isfinite(path).all(axis=1).any()}


def _framed(source: MarkedTrial) -> bool:
    """Whether both ASIS and something else show how the pelvis lies, though no regression has all that it needs (a
    sacral cluster instead of PSIS)."""
    own, needed = _on_the_pelvis(source), _needed(source)
    return bool(needed) and needed < own


def _needed(source: MarkedTrial) -> set[MarkerKey]:
    """Markers of both sides that regressions of the hips need."""
    recipes = [each for found in source.match.marker_set.recipes(False).values() for each in found]
    return {(each.pelvis.asis, side) for each in recipes if each.pelvis is not None for side in SIDES}


def _beside(
    source: MarkedTrial, trial: MarkedTrial, others: list[MarkerKey], key: MarkerKey
) -> tuple[Array | None, bool]:
    """Where a marker of the trial would be in the standing trial (T, 3) m by others of its segment, and whether these
    show it; None where they are too few."""
    if len(others) < _LEAST:
        return None, False
    here = np.stack([source.paths[other] for other in others], axis=1)
    there = np.stack([trial.paths[other] for other in (*others, key)], axis=1)
    standing, moving = here[_seen(here)], there[_seen(there)]
    if not len(standing) or not len(moving):
        return None, False
    moving = moving[:: -(-len(moving) // _FRAMES)]
    shape = standing[len(standing) // 2]
    if len(others) >= _FEWEST and off_their_line(shape) > _ALONG_M:
        motion = rigid_motion(shape, moving[:, :-1])
        local = np.swapaxes(motion.rotations, 1, 2) @ (moving[:, -1] - motion.translations)[:, :, None]
        best = motion.misfit_m <= np.quantile(motion.misfit_m, _BEST)
        place, fitted = np.median(local[best, :, 0], axis=0), rigid_motion(shape, here)
        return np.asarray(fitted.rotations @ place + fitted.translations), True
    high = moving[:, :-1, 1].mean(axis=1)
    turned = _turned_to(shape[1] - shape[0], moving[high >= np.quantile(high, 1.0 - _BEST)])
    whole = np.median(turned - turned[:, :-1].mean(axis=1, keepdims=True), axis=0)
    hold = np.concatenate([_HOLD_M * np.eye(3), -_HOLD_M * np.eye(3)])
    held = np.concatenate([here, here.mean(axis=1, keepdims=True) + hold], axis=1)
    fitted = rigid_motion(np.concatenate([whole[:-1], hold]), held)
    return np.asarray(fitted.rotations @ whole[-1] + fitted.translations), False


def _seen(paths: Array) -> npt.NDArray[np.bool_]:
    """(T,) frames that show all of (T, K, 3)."""
    return np.asarray(np.isfinite(paths).all(axis=(1, 2)))


def _turned_to(line: Array, paths: Array) -> Array:
    """Points (T, K, 3), Y up, each frame turned about the vertical so that the line from the first to the second heads
    as a line (3,) does."""
    own = paths[:, 1] - paths[:, 0]
    angle = np.arctan2(own[:, 2], own[:, 0]) - np.arctan2(line[2], line[0])
    x, z = paths[..., 0], paths[..., 2]
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([c * x + s * z, paths[..., 1], c * z - s * x], axis=-1)


def _mirrored(source: MarkedTrial, key: MarkerKey) -> Array | None:
    """The path (T, 3) m of a marker in the mirror of the middle plane, which pairs of markers show; None where there
    are none, or the other side has no such marker."""
    seen = _on_the_pelvis(source)
    other = (key[0], OTHER_SIDE[key[1]])
    pairs = [name for name, side in sorted(seen) if side == "right" and (name, "left") in seen]
    if not pairs or other not in seen:
        return None
    right, left = (np.array([source.paths[name, side] for name in pairs]) for side in SIDES)
    across = (right - left).sum(axis=0)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    from_middle = source.paths[other] - 0.5 * (right + left).mean(axis=0)
    return np.asarray(source.paths[other] - 2.0 * (from_middle * across).sum(axis=1, keepdims=True) * across)


def _with(trial: MarkedTrial, key: MarkerKey, name: str, path: Array) -> MarkedTrial:
    """The trial with one more marker, or the path (T, 3) m of one that it never shows."""
    recording, match = trial.recording, trial.match
    kept = [k for k, own in enumerate(recording.marker_names) if own != name]
    names = (*(recording.marker_names[k] for k in kept), name)
    markers = np.concatenate([recording.markers[:, kept], trial.ground.points_to_laboratory(path)[:, None]], axis=1)
    return MarkedTrial.of(
        replace(recording, marker_names=names, markers=markers),
        replace(match, names={**match.names, key: name}),
        trial.ground,
    )
