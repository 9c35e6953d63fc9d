"""The motion tables of an output folder: coordinates, speeds, accelerations, moments and the wrench."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dynakin.results.estimate import AXES, Estimate
from dynakin.results.files.storage import (
    DECIMALS_OF_LOADS,
    DIGITS,
    DIGITS_OF_LOADS,
    DIGITS_OF_RATES,
    DIGITS_OF_SD,
    write_storage,
)
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.sources import ABSENT, NOTES, moment_sources
from dynakin.units import COMPONENTS

_SIDES = {"right": "r", "left": "l"}
"""OpenSim's names of the sides in the columns of ground forces; another foot keeps its own name."""


def force_stem(foot: str) -> str:
    """What OpenSim calls the ground's force on a foot: ``ground_force_r``."""
    return f"ground_force_{_SIDES.get(foot, foot)}"


def moment_columns(estimate: Estimate) -> list[str]:
    """Column names of ``moments.sto``, as OpenSim's inverse dynamics writes them: `knee_moment`, `pelvis_tx_force`."""
    return [
        f"{name}_{'moment' if rotation else 'force'}"
        for name, rotation in zip(estimate.coordinate_names, estimate.is_rotation(), strict=True)
    ]


def write_coordinates(estimate: Estimate, path: Path) -> None:
    """``coordinates.mot``: degrees and metres, without coordinates that no marker shows, coupled ones last."""
    _write_motion(
        estimate, path, "Coordinates", "coordinates", "Rotations in degrees, translations in metres.",
    )  # fmt: skip


def write_speeds(estimate: Estimate, path: Path) -> None:
    """``speeds.sto``: degrees/s and m/s, with inDegrees=yes as OpenSim's own Kinematics analysis writes them."""
    _write_motion(
        estimate, path, "Speeds", "speeds", "Rotations in degrees per second, translations in metres per second.",
    )  # fmt: skip


def write_accelerations(estimate: Estimate, path: Path) -> None:
    """``accelerations.sto``: degrees/s2 and m/s2, with inDegrees=yes as OpenSim's own Kinematics analysis does."""
    _write_motion(
        estimate, path, "Accelerations", "accelerations",
        "Rotations in degrees per second squared, translations in metres per second squared.",
    )  # fmt: skip


def _write_motion(estimate: Estimate, path: Path, title: str, variable: str, units: str) -> None:
    seen = _seen(estimate)
    names = [name for name, own in zip(estimate.coordinate_names, seen, strict=True) if own]
    held = [name for name, own in zip(estimate.coordinate_names, seen, strict=True) if not own]
    notes = [units, _frame(estimate)]
    radians = [*_in_radians(estimate, "coordinate"), *_in_radians(estimate, "coupled_coordinate")]
    if radians:
        notes.append(f"In radians, as OpenSim takes what moves its joint by a function alone: {', '.join(radians)}.")
    if held:
        notes.append(f"Left out, because no marker shows them: {', '.join(held)}.")
    values, digits = _in_degrees(estimate, variable)[:, seen], DIGITS_OF_RATES
    if variable == "coordinates":
        digits = DIGITS
        coupled, more = _coupled(estimate)
        names, values = [*names, *coupled], np.hstack([values, more])
        if coupled:
            notes.append(f"Follow others by the model's couplers: {', '.join(coupled)}.")
        if any(str(name).startswith("soft_tissue/") for name in estimate.data["element"].values):
            notes.append("The markers of markers.trc lie where skin has moved them, not where the model has them.")
    write_storage(path, title, estimate.time, names, values, in_degrees=True, notes=notes, digits=digits)


def _coupled(estimate: Estimate) -> tuple[list[str], np.ndarray]:
    """Names and values (T, K), degrees or m, of the coordinates that follow others, but for those of held ones."""
    if "coupled_coordinates" not in estimate.data:
        return [], np.empty((len(estimate.time), 0))
    data = estimate.data
    shown = ~np.isin(data["coupled_coordinate_follows"].values, list(estimate.held))
    values = data["coupled_coordinates"].transpose("time", ...).values
    values = _turned(values, data["coupled_coordinate_file_unit"].values)
    return [str(name) for name in data["coupled_coordinate"].values[shown]], values[:, shown]


def _seen(estimate: Estimate) -> np.ndarray:
    """(C,) coordinates that are not merely held because no marker shows them."""
    return np.array([name not in estimate.held for name in estimate.coordinate_names], dtype=bool)


def write_moments(estimate: Estimate, path: Path) -> None:
    """``moments.sto``: N m about rotations, N along translations (radians: inDegrees=no)."""
    write_storage(
        path,
        "Inverse Dynamics Generalized Forces",
        estimate.time,
        moment_columns(estimate),
        estimate.values("moments"),
        in_degrees=False,
        notes=[
            "Moments in N m, forces in N. In a model that lumps both sides, leg moments are the sum of both legs.",
            "moments_source.sto says of each whether it is measured, derived, a prior or absent (nan).",
        ],
        digits=DIGITS_OF_LOADS,
        decimals=DECIMALS_OF_LOADS,
    )


def write_moment_sources(estimate: Estimate, path: Path) -> None:
    """``moments_source.sto``: the rows and columns of ``moments.sto``, each with the code of where it comes from."""
    write_sources(path, "Sources of the moments", estimate, moment_columns(estimate), moment_sources(estimate.data))


def write_sources(path: Path, title: str, estimate: Estimate, names: list[str], codes: np.ndarray) -> None:
    """A table of codes (T, N) of `results.measures.sources`, which the header explains."""
    write_storage(path, title, estimate.time, names, codes.astype(float), in_degrees=False, notes=NOTES)


def write_deviations(estimate: Estimate, path: Path) -> None:
    """``uncertainty.sto``: standard deviations of the motion, moments, the wrench and the feet's forces.

    Columns ``NAME``, ``NAME_speed``, ``NAME_acceleration`` in degrees or metres (a second, a second squared), moments
    as in ``moments.sto``, ``fx`` ... ``mz`` in N and N m, the feet's forces (``ground_force_r_vx`` ...) in N; what an
    estimate does not hold has no column.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    for variable, suffix in (("coordinates", ""), ("speeds", "_speed"), ("accelerations", "_acceleration")):
        if f"{variable}_sd" in estimate.data:
            seen = _seen(estimate)
            names += [f"{name}{suffix}" for name, own in zip(estimate.coordinate_names, seen, strict=True) if own]
            columns.append(_in_degrees(estimate, f"{variable}_sd")[:, seen])
    if "moments_sd" in estimate.data:
        names += moment_columns(estimate)
        deviations = estimate.values("moments_sd")
        columns.append(np.where(moment_sources(estimate.data) == ABSENT, np.nan, deviations))
    if "wrench_sd" in estimate.data:
        values = estimate.values("wrench_sd")
        known = np.isfinite(values).any(axis=0)
        names += [name for name, seen in zip(COMPONENTS, known, strict=True) if seen]
        columns.append(values[:, known])
    if "foot_wrench_sd" in estimate.data:
        forces = estimate.values("foot_wrench_sd")[:, :, :3]
        forces = np.where((foot_sources(estimate.data) == ABSENT)[:, :, None], np.nan, forces)
        names += [f"{force_stem(foot)}_v{axis}" for foot in estimate.contact_names for axis in AXES]
        columns.append(forces.reshape(len(forces), -1))
    write_storage(
        path,
        "Standard deviations",
        estimate.time,
        names,
        np.hstack(columns) if columns else np.empty((len(estimate.time), 0)),
        in_degrees=True,
        notes=[
            "One standard deviation: the filter's, with what is not known of joints, of skin that follows them and of "
            "the plates' clock; the zero of an angle is not in it. Degrees, metres, seconds, N, N m.",
            "Of moments and feet's forces that are derived or a prior too (moments_source.sto, feet_source.sto); nan "
            "where absent.",
        ],
        digits=DIGITS_OF_SD,
    )


def write_wrench(estimate: Estimate, path: Path) -> None:
    """``wrench.sto``: N and N m, ground frame, about the model's ground origin, what the ground does to the person.

    Columns ``fx_measured`` ... ``mz_measured``, ``fx_estimated`` ... ``mz_estimated`` and, where contacts give the
    total, ``fx_needed`` ... ``mz_needed``; a component that is never measured, or that the model does not explain, has
    no column.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    kinds = [kind for kind in ("measured", "estimated", "needed") if f"wrench_{kind}" in estimate.data]
    for kind in kinds:
        values = estimate.values(f"wrench_{kind}")
        for index, component in enumerate(COMPONENTS):
            if np.isfinite(values[:, index]).any():
                names.append(f"{component}_{kind}")
                columns.append(values[:, index])
    table = np.column_stack(columns) if columns else np.empty((len(estimate.time), 0))
    write_storage(
        path,
        "External wrench",
        estimate.time,
        names,
        table,
        in_degrees=False,
        notes=[
            "Forces in N, moments in N m about the origin of the frame, acting from the ground on the person. "
            "Estimated where it is not measured, derived from the motion.",
            *(
                ["Estimated where it is measured: the sum of feet.sto. Needed: by the movement and the model alone."]
                if "needed" in kinds
                else []
            ),
            _frame(estimate),
        ],
        digits=DIGITS,
    )


def _frame(estimate: Estimate) -> str:
    return f"Frame: {estimate.ground.in_words}."


def _in_degrees(estimate: Estimate, variable: str) -> np.ndarray:
    return _turned(estimate.values(variable), estimate.data["coordinate_file_unit"].values)


def _in_radians(estimate: Estimate, dimension: str) -> list[str]:
    if dimension not in estimate.data.coords:
        return []
    units = estimate.data[f"{dimension}_file_unit"].values
    return [str(name) for name in estimate.data[dimension].values[units == "rad"]]


def _turned(values: np.ndarray, units: np.ndarray) -> np.ndarray:
    """(T, N) of radians and metres in these units (N,) of a table."""
    return np.asarray(np.where(units == "deg", np.degrees(values), values), dtype=float)
