"""Which points of a file are markers, which a model's outputs."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from dynakin.arrays import Array
from dynakin.messages import Message, note

_UNLABELLED = re.compile(r"^(\*\d*|_?(unlabell?ed|unidentified|unnamed|uname)\W*\d*)$", re.IGNORECASE)
# What outputs are called, where no list names them: LHipAngles, RKneeMoment_1, r_knee_moment (an
# l_inferior_angle may be the scapula's)
_OUTPUT = re.compile(r"([a-z0-9](Angles?|Forces?|Moments?|Powers?|GRF)|_(forces?|moments?|powers?|grf))(_\w+)?$")
_CENTRE_OF_MASS = re.compile(
    r"^(cent(re|er)_?of_?(mass|gravity)(_?(floor|[xyz]))?|com(floor)?|cog|whole_?body_?com)$", re.I
)
# Origin and ends of a segment's axes: PELO, PELA, PELL, PELP (Plug-in Gait), PELVIS_O, PELVIS_X, ... (CGM2)
_AXES = ("OALP", "OXYZ")
_SQUARE = 0.01
"""Cosine of the angle between axes, and relative difference of their lengths, up to which four points are a segment's
axes and no markers: computed ones are square and equal but for rounding (1e-6 in the recordings at hand), although the
length may change with time; no four markers come near both."""


@dataclass(frozen=True)
class Points:
    """Indices of a file's points that are markers, their names, and those of the points that a model computed; how many
    have no label."""

    markers: list[int]
    names: tuple[str, ...]
    outputs: list[int]
    labels: tuple[str, ...]
    notes: list[Message]
    unlabelled: int = 0


def sort_points(labels: Sequence[str], points: Array, listed: Collection[str] = ()) -> Points:
    """Sort the points (3, N, T), NaN where missing, into markers and what is none, with notes on the latter.

    Modelled markers (a knee's marker that a static trial gave, say) stay: nothing marks them off from measured ones.

    Args:
        labels: of the points. listed: those that the file itself says a model computed.
    """
    count = points.shape[1]
    unlabelled = {k for k, label in enumerate(labels) if not label or _UNLABELLED.match(_plain(label))}
    outputs = [k for k, label in enumerate(labels) if k not in unlabelled and _is_output(label, listed)]
    rest = [k for k in range(count) if k not in unlabelled and k not in set(outputs)]
    masses = [k for k in rest if _CENTRE_OF_MASS.match(_plain(labels[k]))]
    stems, axes = _axes([k for k in rest if k not in masses], labels, points)
    keep = [k for k in rest if k not in {*masses, *axes}]
    notes = []
    if unlabelled:
        notes.append(note("routine", f"{len(unlabelled)} unlabelled points left out."))
    if outputs:
        notes.append(
            note("routine", f"{len(outputs)} computed points left out: {', '.join(labels[k] for k in outputs)}.")
        )
    if axes:
        notes.append(
            note("routine", f"{len(axes)} ends of segments' axes are no markers and left out: {', '.join(stems)}.")
        )
    if masses:
        notes.append(
            note(
                "routine", f"Computed centre of mass is no marker and left out: {', '.join(labels[k] for k in masses)}."
            )
        )
    return Points(keep, tuple(labels[k] for k in keep), outputs, tuple(labels), notes, len(unlabelled))


def _plain(label: str) -> str:
    """Without the subject's prefix ("S1:LASI")."""
    return label.rpartition(":")[2].strip()


def _is_output(label: str, listed: Collection[str]) -> bool:
    return label in listed or _OUTPUT.search(_plain(label)) is not None


def _axes(rest: Sequence[int], labels: Sequence[str], points: Array) -> tuple[list[str], list[int]]:
    """Labels of the segments' axes (PELO-A-L-P), and the points that they are."""
    spots: dict[str, int] = {labels[k]: k for k in reversed(rest)}
    words, found = [], []
    for label in (labels[k] for k in rest):
        for letters in _AXES:
            stem = label[:-1]
            four = [spots[stem + letter] for letter in letters if stem + letter in spots]
            if label.endswith("O") and len(stem) > 1 and len(four) == len(letters) and _square(points[:, four]):
                words.append("-".join([stem + "O", *letters[1:]]))
                found += four
    return words, [k for k in rest if labels[k] in {labels[j] for j in found}]


def _square(four: Array) -> bool:
    """Whether points (3, 4, T) are an origin and the ends of three equal axes at right angles, or never seen at all."""
    arms = (four[:, 1:] - four[:, :1])[:, :, np.isfinite(four).all(axis=(0, 1))]  # (3, 3, T)
    if not arms.shape[2]:
        return not np.isfinite(four).any()
    lengths = np.linalg.norm(arms, axis=0)  # (3, T)
    seen = lengths.min(axis=0) > 0.0
    if not seen.any() or (np.ptp(lengths, axis=0) > _SQUARE * lengths.mean(axis=0)).any():
        return False
    arms = arms[:, :, seen] / lengths[:, seen]
    return all(
        float(np.abs((arms[:, i] * arms[:, j]).sum(axis=0)).max()) < _SQUARE for i, j in combinations(range(3), 2)
    )
