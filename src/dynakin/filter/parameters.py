"""The estimated constants of a model, with where they started and how sure the filter is."""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array
from dynakin.elements import element
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.schema import kinds_of
from dynakin.results.records import Parameter, ParameterKind

_KINDS: dict[str, ParameterKind] = {"length": "length", "marker": "marker", "inertia": "inertia", "plates": "plates"}
_INERTIA_UNITS = {"mass": "kg", "mx": "kg m", "my": "kg m", "mz": "kg m"}
_NEAR = 0.1
"""Standard deviations from its bound within which an amount that the movement finds (a length that starts at 0) is on
it: what the data press there, the noise of the last frame may have moved off by as little."""
_PLATE_UNITS = {"delay": "s", "fx": "N", "fy": "N", "fz": "N"}


def parameters_of(
    initial: CalibratedModel, state: Array, sd: Array, prior_sd: Array, length_skin_fraction: float = 0.0
) -> list[Parameter]:
    """Every length, marker place and inertial parameter in the state, and the lengths that were held fixed.

    Args:
        state, sd: (n,) the last frame's. prior_sd: (n,) before the first.
        length_skin_fraction: part of the skin's declared displacement that may look like a length (the noise setting of
            the same name).
    """
    segments = {marker.name: marker.segment for marker in initial.spec.markers}
    skin = length_skin_sd(initial, length_skin_fraction)
    units = element_units(initial)
    found = []
    for k, name in enumerate(initial.names):
        word, owner, _ = element(name)
        if word not in _KINDS:
            continue  # a coordinate, speed or acceleration
        kind = _KINDS[word]
        amount = kind == "length" and initial.x0[k] == 0.0
        # the prior of a correction to a measured place is what skin hides of that place
        unseen = skin.get(owner, 0.0) if kind == "length" and not amount else 0.0
        within = min(state[k] - initial.lower[k], initial.upper[k] - state[k])
        found.append(
            Parameter(
                name=name,
                kind=kind,
                segment=segments[owner] if kind == "marker" else "plates" if kind == "plates" else owner,
                unit=units[name],
                value=float(state[k]),
                sd=float(np.hypot(sd[k], unseen)),
                initial=float(initial.x0[k]),
                table=_finite(initial.table[k]),
                lower=_finite(initial.lower[k]),
                upper=_finite(initial.upper[k]),
                at_bound=bool(within <= (_NEAR * sd[k] if amount else 0.0)),
                estimated=True,
                prior_sd=float(prior_sd[k]),
                skin_sd=unseen,
            )
        )
    of_lengths = _length_units(initial)
    for length in initial.spec.parameters:
        if not length.estimated:
            value = float(length.value)
            name = f"length/{length.name}"
            unit = of_lengths.get(length.name, "m")
            found.append(
                Parameter(name, "length", length.name, unit, value, 0.0, value, None, None, None, False, False)
            )
    return found


def element_units(initial: CalibratedModel) -> dict[str, str]:
    """The unit of each constant of the state, by its name: lengths, marker places, inertia, the plates' errors."""
    lengths = _length_units(initial)
    found = {}
    for name in initial.names:
        word, owner, last = element(name)
        if word in _KINDS:
            found[name] = lengths.get(owner) or _unit(_KINDS[word], last or owner)
    return found


def _length_units(initial: CalibratedModel) -> dict[str, str]:
    """Of lengths that are none: factors, and what scales an axis of a joint that turns, which says how far it moves
    along in a radian, or is turned itself."""
    kinds = kinds_of(initial.spec.segments)
    axes = [axis for segment in initial.spec.segments for axis in segment.axes if axis.scale]
    turning = [axis for axis in axes if kinds[axis.coordinate] == "rotation"]
    amounts = {a.scale: "m/rad" if a.kind == "translation" else "rad" for a in turning}
    return amounts | dict.fromkeys(initial.dimensionless, "1")


def length_skin_sd(initial: CalibratedModel, share: float) -> dict[str, float]:
    """Standard deviation (m) of each estimated length that comes from skin that follows joint angles.

    Such a displacement repeats with the movement, so no length of trial averages it out, and to the filter it is a
    joint elsewhere. Of a length between two joints the largest displacement declared of a marker on the two segments
    counts.
    """
    largest: dict[str, float] = {}
    for marker, declared in zip(initial.spec.markers, initial.soft_tissue_m, strict=True):
        largest[marker.segment] = max(largest.get(marker.segment, 0.0), float(declared))
    found: dict[str, float] = {}
    for segment in initial.spec.segments:
        for term in segment.lengths:
            here = share * max(largest.get(segment.name, 0.0), largest.get(segment.parent, 0.0))
            found[term.parameter] = max(found.get(term.parameter, 0.0), here)
    return found


def _unit(kind: ParameterKind, last: str) -> str:
    if kind == "inertia":
        return _INERTIA_UNITS.get(last, "kg m2")
    return _PLATE_UNITS.get(last, "N m") if kind == "plates" else "m"


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
