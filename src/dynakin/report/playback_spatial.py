"""The movement in space for the page's player, which turns it: positions as small whole numbers."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from dynakin.report.body import chain_of, marker_segments
from dynakin.report.colours import SIDE_COLOURS, side_of
from dynakin.report.labels import short_marker_names
from dynakin.report.playback import curve_of, frames_shown, packed
from dynakin.report.plot import MEASURED
from dynakin.report.sides import Joint, joints_of
from dynakin.results.estimate import Estimate
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.pressure import centre_of_pressure, floor_height
from dynakin.results.measures.sources import DERIVED, moment_sources, wrench_sources
from dynakin.units import GRAVITY_M_S2

Array = npt.NDArray[np.float64]

_FOLLOWED_FROM_MM = 1200.0
"""A person whose middle covers more ground than this is followed."""
_START = (40.0, 12.0)
VIEWS = {"Right": (0, 0), "Front": (90, 0), "Left": (180, 0), "Back": (-90, 0), "Above": (0, 90), "Aslant": _START}
"""Azimuth and elevation in degrees: 0 looks from the right, 90 from the front."""


@dataclass(frozen=True)
class SpatialPlayback:
    """What the template needs, and the numbers as JSON."""

    rows: list[dict[str, Any]]
    views: dict[str, tuple[float, float]]
    curve: str
    curve_label: str
    last: int
    end_time: str
    feet: list[str]
    has_reaction: bool
    has_measured: bool
    has_mass_centre: bool
    has_derived: bool
    moment_unit: str
    sides: dict[str, str]
    data: Markup


def spatial_playback(estimate: Estimate) -> SpatialPlayback:
    """The player's content; segments where the estimate holds joint centres, arrows where it holds wrenches."""
    chain = chain_of(estimate)
    measured, estimated = (
        1000.0 * estimate.data[f"markers_{kind}"].transpose("time", "marker", "axis").values
        for kind in ("measured", "estimated")
    )
    points = 1000.0 * chain.points
    every = np.concatenate([points, measured, estimated], axis=1)
    view, centre = _view(estimate, every)
    joints = joints_of(estimate)
    arrays: dict[str, Array] = {
        "points": points.reshape(len(points), -1),
        "measured": measured.reshape(len(measured), -1),
        "estimated": estimated.reshape(len(estimated), -1),
        "centre": centre,
        **_joint_values(estimate, joints),
    }
    arrows = _arrows(estimate, arrays)
    forces = [arrays[entry["forces"]] for entry in arrows]
    load = np.concatenate([np.linalg.norm(f.reshape(len(f), -1, 3), axis=2).ravel() for f in forces] or [np.zeros(0)])
    load = load[np.isfinite(load)]
    heaviest = (estimate.mass_kg or 0.0) * GRAVITY_M_S2 or (float(load.max()) if len(load) else 1.0)
    view["mm_per_newton"] = float(f"{0.5 * view['height'] / heaviest:.6g}")
    if "mass_centre" in estimate.data:
        arrays["mass_centre"] = 1000.0 * estimate.data["mass_centre"].transpose("time", "axis").values
    frames = frames_shown(estimate, sum(array.shape[1] for array in arrays.values()))
    carriers, names = marker_segments(estimate), short_marker_names(estimate.marker_names)
    content = {
        "time": [round(float(t), 3) for t in estimate.time[frames]],
        "bones": [[b.start, b.end, SIDE_COLOURS[side_of(b.segment)]] for b in chain.bones],
        "markers": [[names[n], SIDE_COLOURS[side_of(carriers.get(n, ""))]] for n in estimate.marker_names],
        "arrows": arrows,
        "view": view,
        "arrays": {name: packed(array[frames]) for name, array in arrays.items()},
    }
    angles = estimate.data["coordinates"].transpose("time", "coordinate").values
    curve, label = curve_of(estimate, angles * np.where(estimate.is_rotation(), 180.0 / np.pi, 1000.0))
    return SpatialPlayback(
        rows=_rows(joints),
        views={name: (float(a), float(e)) for name, (a, e) in VIEWS.items()},
        curve=curve,
        curve_label=label,
        last=len(frames) - 1,
        end_time=f"{estimate.time[frames[-1]]:.2f} s",
        feet=estimate.foot_names,
        has_reaction=bool(len(load)),
        has_measured=bool(np.isfinite(arrays["measured_forces"]).any()),
        has_mass_centre="mass_centre" in arrays,
        has_derived=bool(arrays["derived"].any() or arrays["moments_derived"].any()),
        moment_unit="N m/kg" if estimate.mass_kg else "N m",
        sides=SIDE_COLOURS,
        data=Markup(json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")),
    )


def _view(estimate: Estimate, every: Array) -> tuple[dict[str, Any], Array]:
    """What the camera has to hold, mm, and the middle of the body on the floor (T, 2) that it may follow."""
    known = np.isfinite(every).all(axis=2, keepdims=True)
    count = np.maximum(known.sum(axis=1), 1)
    filled = np.where(known, every, 0.0)
    centre = (filled.sum(axis=1) / count)[:, [0, 2]]
    middle = 0.5 * (centre.min(axis=0) + centre.max(axis=0))
    follow = bool(np.linalg.norm(np.ptp(centre, axis=0)) > _FOLLOWED_FROM_MM)
    about = centre if follow else np.broadcast_to(middle, centre.shape)
    away = np.linalg.norm(every[:, :, [0, 2]] - about[:, None], axis=2)
    heights = every[:, :, 1]
    floor = 1000.0 * floor_height(estimate)
    top = float(np.nanmax(heights)) if known.any() else floor + 1000.0
    low = min(float(np.nanmin(heights)), floor) if known.any() else floor
    return {
        "azimuth": _START[0],
        "elevation": _START[1],
        "follow": follow,
        "x": round(float(middle[0])),
        "z": round(float(middle[1])),
        "middle": round(0.5 * (low + top)),
        "floor": round(floor),
        "height": max(round(top - low), 100),
        "radius": max(round(float(np.nanmax(away))) if known.any() else 500, 300),
    }, centre


def _arrows(estimate: Estimate, arrays: dict[str, Array]) -> list[dict[str, Any]]:
    """Adds points of action (mm) and forces (N) to ``arrays``; what to draw of them, measured ones behind."""
    entries: list[dict[str, Any]] = []
    feet = estimate.foot_names
    derived = foot_sources(estimate.data) if feet else wrench_sources(estimate.data).max(axis=1, keepdims=True)
    arrays["derived"] = (derived == DERIVED).astype(float)
    for kind in ("measured", "estimated"):
        if feet:
            name = "foot_wrench_measured" if kind == "measured" else "foot_wrench"
            wrench = estimate.data[name].transpose("time", "foot", "component").values
        else:
            wrench = estimate.data[f"wrench_{kind}"].transpose("time", "component").values[:, None]
        point = np.stack(
            [centre_of_pressure(wrench[:, k], floor_height(estimate))[0] for k in range(wrench.shape[1])], axis=1
        )
        force = np.where(np.isfinite(point).all(axis=2, keepdims=True), wrench[..., :3], np.nan)
        arrays[f"{kind}_points"] = 1000.0 * point.reshape(len(point), -1)
        arrays[f"{kind}_forces"] = force.reshape(len(force), -1)
        for k in range(wrench.shape[1]):
            colour = SIDE_COLOURS.get(feet[k], "#1d2530") if feet else "#1d2530"
            entries.append(
                {
                    "points": f"{kind}_points",
                    "forces": f"{kind}_forces",
                    "k": k,
                    "colour": MEASURED if kind == "measured" else colour,
                    "width": 6 if kind == "measured" else 2.5,
                    "behind": kind == "measured",
                    "derived": kind == "estimated",
                }
            )
    return entries


def _joint_values(estimate: Estimate, joints: list[Joint]) -> dict[str, Array]:
    """Angles in degrees (mm) and moments per kg of the joints' columns, in the order of `_rows`."""
    columns = [k for joint in joints for k in joint.columns.values()]
    values = estimate.data["coordinates"].transpose("time", "coordinate").values
    values = values * np.where(estimate.is_rotation(), 180.0 / np.pi, 1000.0)
    moments = estimate.data["moments"].transpose("time", "coordinate").values / (estimate.mass_kg or 1.0)
    derived = (moment_sources(estimate.data) == DERIVED).astype(float)
    return {"angles": values[:, columns], "moments": moments[:, columns], "moments_derived": derived[:, columns]}


def _rows(joints: list[Joint]) -> list[dict[str, Any]]:
    """A row a joint: which packed column stands under right and left; a middle one stands across both."""
    rows, at = [], 0
    for joint in joints:
        columns = {}
        for side in joint.columns:
            columns[side] = at
            at += 1
        rows.append(
            {
                "title": joint.title,
                "unit": "deg" if joint.rotation else "mm",
                "columns": columns,
                "digits": 1 if joint.rotation else 0,
                "moments": joint.region != "Whole body",
            }
        )
    return rows
