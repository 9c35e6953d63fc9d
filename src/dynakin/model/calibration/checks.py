"""What a measured model is held against: fixed feet, masses, and the sentences that report it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.messages import Message, note, warning
from dynakin.model.calibration.frames import MarkedTrial
from dynakin.model.calibration.landmarks import LandmarkFinder
from dynakin.model.calibration.lumping import PlacedPart
from dynakin.model.inertia import RigidBody
from dynakin.model.plan import Geometry, ModelPlan
from dynakin.model.schema import ModelFile
from dynakin.model.table import BodyTable

BENT_DEG = 30.0
"""Of a knee, or of a thigh against the vertical, from which on a standing trial is doubted: in the standing trials that
we have, and simulated ones, 1 to 17; with one leg ahead or lifted 25; a deep squat and sitting 74 to 99."""
_NOWHERE = (np.nan, np.nan, np.nan)


def refuse_moving_origin(model: ModelFile, trial: MarkedTrial, finder: LandmarkFinder) -> None:
    """Refuse a trial in which the landmark that the model holds fixed in the ground moves, on either foot.

    Raises:
        ModelError: with the distance, the norm of the 10 to 90 percentile ranges (a marker that is
            swapped or flies off for a moment has not moved) of its three coordinates.
    """
    limit, name = model.ground.fixed_within_m, model.ground.origin
    if limit is None or name is None:
        return
    for side in ("right", "left"):  # lumped models hold both feet to be fixed
        each = LandmarkFinder(trial.match, side, finder.sex, finder.planar)
        for key in sorted(each.markers_of(name)):
            path = trial.paths[key][np.isfinite(trial.paths[key]).all(axis=1)]
            low, high = np.percentile(path, [10.0, 90.0], axis=0)
            moved = float(np.linalg.norm(high - low))
            if moved > limit:
                raise ModelError(
                    f"{trial.match.where}: marker {trial.match.names[key]} moves {1000 * moved:.0f} mm "
                    "during the trial, but "
                    f"model {model.name} holds the {name} fixed in the ground (at most {1000 * limit:.0f} "
                    "mm): walking and "
                    "other movements of the feet need a model that is not rooted there"
                )


def check_standing(landmarks: Mapping[str, Array], name: str, height_m: float | None = None) -> list[Message]:
    """A warning where somebody who holds still does so with bent legs: a squat, or sitting.

    Args:
        landmarks: of the frames on which places are measured, Y up. name: of the recording. height_m: where it is
            estimated from markers.
    """
    bent: dict[str, float] = {}
    for side, word in (("r", "right"), ("l", "left")):
        hip, knee, ankle = (
            np.asarray(landmarks.get(f"{joint}_{side}", _NOWHERE)) for joint in ("hip", "knee", "ankle")
        )
        bent[f"{word} knee"] = _angle_deg(hip - knee, knee - ankle)
        bent[f"{word} thigh"] = _angle_deg(hip - knee, np.array([0.0, 1.0, 0.0]))
    worst = max(bent, key=lambda part: np.nan_to_num(bent[part]))
    if not bent[worst] > BENT_DEG:
        return []
    of = "against the vertical" if worst.endswith("thigh") else "bent"
    said = f"nobody stands upright in {name}: the {worst} is {bent[worst]:.0f} deg {of}"
    short = "" if height_m is None else f" So is the height, {height_m:.2f} m, if nobody stands upright: give --height."
    return [
        warning(
            "standing",
            f"{said}, and places of markers measured there are off where the legs are straight.{short} Give a standing "
            "trial of the person upright with straight knees (--static).",
        )
    ]


def _angle_deg(a: Array, b: Array) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def reach(model: ModelFile, name: str, geometry: Geometry, parts: list[PlacedPart]) -> float:
    """Length of a segment for the bounds of its first moments: to the next joint, else over its parts."""
    own = next(segment for segment in model.segments if segment.name == name)
    joints = [np.linalg.norm(geometry.placement(s)) for s in model.segments if s.parent == name]
    if joints:
        return float(max(joints))
    lengths = [part.length for part in parts] or [0.0]
    return float(sum(lengths) if own.straight is not None else max(lengths))


def check_masses(
    model: ModelFile,
    inertia: dict[str, RigidBody],
    parts: dict[str, list[PlacedPart]],
    mass_kg: float,
    height_m: float | None,
    messages: list[Message],
) -> None:
    """Say which lengths of the table came from the height, and whether the segments hold the whole body.

    Raises:
        ModelError: a length has to come from the height, and the height is not known.
    """
    for segment, entries in parts.items():
        by_height = [part for part in entries if not part.measured]
        if by_height and height_m is None:
            raise ModelError(
                f"height_m is needed: no markers give the length of {by_height[0].name} (segment {segment})"
            )
        for part in by_height:
            text = f"Length of {part.name} for the inertia table: {1000 * part.length:.0f} mm, from the height."
            said = note("details", text)
            if said not in messages:  # right and left say the same
                messages.append(said)
    total = sum(body.mass for body in inertia.values())
    if abs(total - mass_kg) > 1e-9 * mass_kg:
        messages.append(
            note(
                "calibration", f"The segments of model {model.name} hold {total:.2f} kg of the body's {mass_kg:.2f} kg."
            )
        )


def report(model: ModelFile, plan: ModelPlan, mass_kg: float, messages: list[Message]) -> None:
    """Say the lengths and masses that were found."""
    known = plan.geometry.lengths.items()
    lengths = ", ".join(f"{name} {1000 * value:.0f}" for name, value in known if value)  # corrections start at 0
    masses = ", ".join(f"{name} {body.mass:.2f}" for name, body in plan.inertia.items())
    messages.append(note("details", f"Lengths (mm): {lengths}."))
    messages.append(
        note("details", f"Masses (kg, {'both sides; ' if model.planar else ''}{mass_kg:.2f} in all): {masses}.")
    )
    if model.planar:
        messages.append(
            note(
                "calibration",
                "Markers are projected on the sagittal plane (forward and up); sideways motion is not modelled.",
            )
        )


def fixed_lengths(model: ModelFile, bare: set[str], added: set[str]) -> frozenset[str]:
    """Lengths that are not estimated: by the file, or because nothing on their segment is measured.

    Args:
        bare: segments without markers. added: landmarks that no marker gives; what lies between one of them and a
            segment without markers has its length from proportions.
    """
    fixed = {length.name for length in model.lengths if not length.estimated}
    ends = {length.name: {name for pair in length.pairs() for name in pair} for length in model.lengths}
    shown: set[str] = set()
    for segment in model.segments:
        for length in {term.length for term in segment.placement}:
            by_proportion = segment.name in bare and bool(ends[length] & added or segment.without_markers is None)
            if segment.parent in bare or by_proportion:
                fixed.add(length)
            else:
                shown.add(length)
        for length in {axis.scale for axis in segment.axes if axis.scale}:
            (fixed if {segment.name, segment.parent} & bare else shown).add(length)
    return frozenset(name for name in fixed if name not in shown or not _estimated(model, name))


def _estimated(model: ModelFile, name: str) -> bool:
    return next(length.estimated for length in model.lengths if length.name == name)


def unmeasured_lengths(
    path: Path,
    model: ModelFile,
    table: BodyTable,
    landmarks: dict[str, Array],
    height_m: float | None,
    messages: list[Message],
) -> dict[str, float]:
    """Lengths, m, whose landmarks no marker shows: by the height and the table.

    Raises:
        ModelError: neither gives one of them.
    """
    found: dict[str, float] = {}
    for length in model.lengths:
        if length.between is None or all(name in landmarks for pair in length.pairs() for name in pair):
            continue
        part = table.parts.get(length.name)
        if part is None or part.length_per_height is None or height_m is None:
            raise ModelError(
                f"{path}: length {length.name!r}: its landmarks {' and '.join(length.between)} are not measured, "
                f"and neither the table {table.name} nor the subject's height gives it"
            )
        found[length.name] = part.length_per_height * height_m
        messages.append(
            note(
                "calibration",
                f"Length {length.name}: {1000 * found[length.name]:.0f} mm from the height ({table.name}), no markers.",
            )
        )
    return found
