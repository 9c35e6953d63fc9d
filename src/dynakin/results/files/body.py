"""Tables of what is read of a body: powers, centre of mass, centres of pressure, loads of the joints and the feet."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dynakin.recordings.pushes import LOADED_N
from dynakin.results.estimate import AXES, Estimate
from dynakin.results.files.motion import force_stem, write_sources
from dynakin.results.files.storage import DECIMALS_OF_LOADS, DIGITS, DIGITS_OF_LOADS, write_storage
from dynakin.results.measures.angles import angle_columns
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.pressure import foot_pressure
from dynakin.results.measures.sources import joint_sources
from dynakin.units import COMPONENTS


def write_body_files(estimate: Estimate, folder: Path) -> None:
    """Every table for which the estimate holds what it needs."""
    write_powers(estimate, folder / "powers.sto")
    write_centre_of_pressure(estimate, folder / "centre_of_pressure.sto")
    if "mass_centre" in estimate.data:
        write_mass_centre(estimate, folder / "centre_of_mass.sto")
    if "joint_loads" in estimate.data:
        write_joint_reactions(estimate, folder / "joint_reactions.sto")
        write_joint_sources(estimate, folder / "joint_reactions_source.sto")
    if "zero_offset" in estimate.data:
        write_angles(estimate, folder / "angles.sto")
    if estimate.foot_names:
        write_feet(estimate, folder / "feet.sto")
        write_foot_sources(estimate, folder / "feet_source.sto")


def write_powers(estimate: Estimate, path: Path) -> None:
    """``powers.sto``: W, a column a coordinate, ``knee_angle_r_power``."""
    notes = [
        "Moment times speed in W, positive where energy is added to the body.",
        "moments_source.sto says of each moment whether it is measured, derived, a prior or absent (nan).",
    ]
    _write(
        path,
        "Joint powers",
        estimate,
        [f"{name}_power" for name in estimate.coordinate_names],
        estimate.powers(),
        notes,
    )


def write_angles(estimate: Estimate, path: Path) -> None:
    """``angles.sto``: joint angles in degrees from the zero and with the names and signs that were asked for."""
    names, values, lines = angle_columns(estimate)
    write_storage(
        path, "Joint angles", estimate.time, names, values, in_degrees=True, notes=["Degrees.", *lines], digits=DIGITS
    )


def write_mass_centre(estimate: Estimate, path: Path) -> None:
    """``centre_of_mass.sto``: ``com_x`` ... m, ``com_vx`` ... m/s, ground frame; modelled axes only."""
    names, columns = [], []
    for variable, prefix in (("mass_centre", "com_"), ("mass_centre_velocity", "com_v")):
        values = estimate.values(variable)
        for k in np.flatnonzero(estimate.modelled_axes()):
            names.append(prefix + AXES[k])
            columns.append(values[:, k])
    notes = [f"Whole-body centre of mass in m and its velocity in m/s, {estimate.ground.in_words}."]
    table = np.column_stack(columns)
    write_storage(path, "Centre of mass", estimate.time, names, table, in_degrees=False, notes=notes, digits=DIGITS)


def write_centre_of_pressure(estimate: Estimate, path: Path) -> None:
    """``centre_of_pressure.sto``: ``total_px`` ... m and, where the feet's wrenches are known, ``right_px`` ...; NaN
    below the threshold. What a planar model does not give has no column."""
    names, columns = [], []
    for foot in (None, *estimate.contact_names):
        point, free = foot_pressure(estimate, foot)
        for label, values in zip(("px", "py", "pz", "free_moment"), [*point.T, free], strict=True):
            if np.isfinite(values).any() or foot is not None:
                names.append(f"{foot or 'total'}_{label}")
                columns.append(values)
    table = np.column_stack(columns) if columns else np.empty((len(estimate.time), 0))
    notes = [
        "Centres of pressure in m on the plates' surface, free moments in N m about the vertical; "
        f"nan below {LOADED_N:g} N of vertical force. Frame: {estimate.ground.in_words}."
    ]
    if estimate.foot_names:
        notes.append("The total is derived from the motion where wrench.sto has no measured one.")
        notes.append(
            "feet_source.sto says of each foot whether its force is measured, derived, a prior or absent (nan)."
        )
    _write(path, "Centres of pressure", estimate, names, table, notes)


def write_joint_reactions(estimate: Estimate, path: Path) -> None:
    """``joint_reactions.sto``: what each joint passes on, as OpenSim's joint reaction analysis names it.

    ``knee_on_shank_in_ground_fx`` ... ``_mz`` N and N m about the joint's centre, ``_px`` ... m: the centre. The model
    loads a segment through the joint by which it hangs: force and moment of its parent on it, muscles included.
    """
    values = estimate.values("joint_loads")
    centres = estimate.values("joint_centres")
    axes = estimate.modelled_axes()
    names, columns = [], []
    joints = zip(estimate.data["joint"].values, estimate.data["joint_segment"].values, strict=True)
    for k, (joint, segment) in enumerate(joints):
        stem = f"{joint}_on_{segment}_in_ground_"
        for c, component in enumerate(COMPONENTS):
            if np.isfinite(values[:, k, c]).any():
                names.append(stem + component)
                columns.append(values[:, k, c])
        names += [f"{stem}p{AXES[a]}" for a in np.flatnonzero(axes)]
        columns += [centres[:, k, a] for a in np.flatnonzero(axes)]
    notes = [
        "Intersegmental loads: force in N and moment in N m about the joint's centre (px py pz, m), ground axes, of "
        "the parent on the named segment; muscles, ligaments and bones together.",
        f"Frame: {estimate.ground.in_words}.",
        "joint_reactions_source.sto says of each joint whether its load is measured, derived, a prior or absent (nan).",
    ]
    _write(path, "Joint reactions", estimate, names, np.column_stack(columns), notes)


def write_joint_sources(estimate: Estimate, path: Path) -> None:
    """``joint_reactions_source.sto``: a column a joint, ``knee_on_shank_in_ground``, with the code of where its load
    comes from."""
    joints = zip(estimate.data["joint"].values, estimate.data["joint_segment"].values, strict=True)
    names = [f"{joint}_on_{segment}_in_ground" for joint, segment in joints]
    write_sources(path, "Sources of the joint reactions", estimate, names, joint_sources(estimate.data))


def write_foot_sources(estimate: Estimate, path: Path) -> None:
    """``feet_source.sto``: a column a foot, ``ground_force_r``, and a declared contact, ``ground_force_seat``, with the
    code of where its wrench comes from."""
    names = [force_stem(foot) for foot in estimate.contact_names]
    write_sources(path, "Sources of the feet's ground reaction", estimate, names, foot_sources(estimate.data))


def write_feet(estimate: Estimate, path: Path) -> None:
    """``feet.sto``: the feet's wrenches, and those of declared contacts, as used for the moments, as OpenSim's external
    loads take them.

    ``ground_force_r_vx`` ... N, ``ground_force_r_px`` ... m, ``ground_torque_r_x`` ... N m. Below the threshold the
    point is the ground's origin and the torque all of the moment about it, so force, point and torque always give the
    whole wrench.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    for foot in estimate.contact_names:
        wrench = estimate.data["foot_wrench"].sel(foot=foot).transpose("time", "component").values
        point, free = foot_pressure(estimate, foot)
        loaded = np.asarray(np.isfinite(point).all(axis=1))
        torque = wrench[:, 3:].copy()
        torque[loaded] = np.column_stack([0.0 * free[loaded], free[loaded], 0.0 * free[loaded]])
        stem = force_stem(foot)
        names += [f"{stem}_v{a}" for a in AXES] + [f"{stem}_p{a}" for a in AXES]
        names += [f"{stem.replace('force', 'torque', 1)}_{a}" for a in AXES]
        unknown = np.isnan(wrench).any(axis=1)
        columns += [wrench[:, :3], np.where(loaded[:, None], point, np.where(unknown, np.nan, 0.0)[:, None]), torque]
    notes = [
        "Forces in N at points in m, torques in N m, of the ground on the feet; adjusted. Declared contacts (a "
        "seat) by their names, at points on the floor.",
        f"Frame: {estimate.ground.in_words}.",
        "feet_source.sto says of each foot whether its force is measured, derived, a prior or absent (nan).",
    ]
    _write(path, "Ground reaction of the feet", estimate, names, np.hstack(columns), notes)


def _write(
    path: Path,
    title: str,
    estimate: Estimate,
    names: list[str],
    values: np.ndarray,
    notes: list[str],
) -> None:
    """Loads, and the places that go with them."""
    write_storage(
        path,
        title,
        estimate.time,
        names,
        values,
        in_degrees=False,
        notes=notes,
        digits=DIGITS_OF_LOADS,
        decimals=DECIMALS_OF_LOADS,
    )
