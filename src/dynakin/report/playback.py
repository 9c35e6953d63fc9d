"""The movement for the page's player, which turns it: whole numbers, few enough for a light page.

A planar model is seen from the right and does not turn.
"""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from dynakin.arrays import Array
from dynakin.report.body import chain_of, painted
from dynakin.report.labels import short_marker_names
from dynakin.report.sides import Joint, joints_of, normalising_mass
from dynakin.report.styles import INK, MEASURED, SIDE_COLOURS
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import reported
from dynakin.results.measures.feet import foot_sources
from dynakin.results.measures.pressure import centre_of_pressure, floor_height, support_height
from dynakin.results.measures.sources import ABSENT, DERIVED, PRIOR, moment_sources, wrench_sources
from dynakin.results.naming import number, sentence, words
from dynakin.units import GRAVITY_M_S2

_PICTURES_PER_SECOND = 30.0
_MOST_BYTES = 375_000  # of base64 in the page, about: where each number takes one byte
_STEPS = {
    "points": 1.0,
    "measured": 1.0,
    "estimated": 1.0,
    "centre": 1.0,
    "mass_centre": 1.0,
    "angles": 0.1,
    "moments": 0.01,
    "moment_sources": 1.0,
    "sources": 1.0,
} | {f"{kind}_{what}": 1.0 for kind in ("measured", "estimated") for what in ("points", "forces", "sizes")}
"""What the numbers are rounded to: no finer than they are drawn (mm, N) or written (degrees, N m/kg)."""
_FOLLOWED_FROM_MM = 1200.0
"""A person whose middle covers more ground than this is followed."""
_MOST_SQUARES = 200  # along the floor
_VIEWS = {"Right": (0, 0), "Front": (90, 0), "Left": (180, 0), "Back": (-90, 0), "Above": (0, 90), "Aslant": (40, 12)}
"""Azimuth and elevation in degrees: 0 looks from the right, 90 from the front."""


_SOURCES = ("sources", "moment_sources")
"""The arrays that say where the arrows and the moments come from."""


@dataclass(frozen=True)
class Playback:
    """What the template needs, and the numbers as JSON."""

    rows: list[dict[str, Any]]
    views: dict[str, tuple[int, int]]
    curve: str
    curve_label: str
    last: int
    end_time: str
    feet: list[str]
    has_reaction: bool
    has_measured: bool
    has_mass_centre: bool
    has_derived: bool
    has_prior: bool
    moment_unit: str
    colours: dict[str, str]
    note: str
    data: Markup


def playback(estimate: Estimate) -> Playback:
    """The player's content; segments where the estimate holds joint centres, arrows where it holds wrenches."""
    planar, mass = estimate.planar, normalising_mass(estimate)
    chain, joints = chain_of(estimate), joints_of(estimate)
    colours, key = painted(estimate, chain)
    measured, estimated = (_seen(estimate, estimate.values(f"markers_{k}")) for k in ("measured", "estimated"))
    points = _seen(estimate, chain.points)
    view, centre = _view(estimate, np.concatenate([points, measured, estimated], axis=1))
    arrays: dict[str, Array] = {
        "points": points.reshape(len(points), -1),
        "measured": measured.reshape(len(measured), -1),
        "estimated": estimated.reshape(len(estimated), -1),
        "centre": centre,
        **_joint_values(estimate, joints),
    }
    arrows = _arrows(estimate, arrays)
    forces = np.concatenate([arrays[f"{kind}_sizes"].ravel() for kind in ("measured", "estimated")])
    forces = forces[np.isfinite(forces)]
    heaviest = (estimate.mass_kg or 0.0) * GRAVITY_M_S2 or float(forces.max(initial=0.0)) or 1.0
    view["mm_per_newton"] = float(f"{0.5 * view['height'] / heaviest:.6g}")
    if "mass_centre" in estimate.data and not planar:
        arrays["mass_centre"] = 1000.0 * estimate.values("mass_centre")
    frames = _frames_shown(estimate, sum(array.shape[1] for array in arrays.values()))
    carriers, names = estimate.marker_segments, short_marker_names(estimate.marker_names)
    content = {
        "time": [round(float(t), 3) for t in estimate.time[frames]],
        "bones": [[b.start, b.end, colours[b.segment]] for b in chain.bones],
        "markers": [[names[n], colours.get(carriers.get(n, ""), SIDE_COLOURS[""])] for n in estimate.marker_names],
        "arrows": arrows,
        "view": view,
        "arrays": {name: _packed(array[frames], _STEPS[name]) for name, array in arrays.items()},
    }
    curve, label = _curve(estimate)
    return Playback(
        rows=[*_rows(estimate, joints, 2 if mass else 1), *([] if estimate.foot_names else _reaction_rows(arrays))],
        views={} if planar else _VIEWS,
        curve=curve,
        curve_label=label,
        last=len(frames) - 1,
        end_time=f"{estimate.time[frames[-1]]:.2f} s",
        feet=estimate.contact_names,
        has_reaction=bool(len(forces)),
        has_measured=bool(np.isfinite(arrays["measured_sizes"]).any()),
        has_mass_centre="mass_centre" in arrays,
        has_derived=any(bool((arrays[name] == DERIVED).any()) for name in _SOURCES),
        has_prior=any(bool((arrays[name] == PRIOR).any()) for name in _SOURCES),
        moment_unit="N m/kg" if mass else "N m",
        colours=key,
        note=" ".join(_notes(estimate, planar)),
        data=Markup(json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")),
    )


def _notes(estimate: Estimate, planar: bool) -> list[str]:
    notes = ["Angles are those of angles.sto."] if reported(estimate).asked else []
    return [*notes, *(["Moments of legs and arms are those of both sides together."] if planar else [])]


def _seen(estimate: Estimate, points: Array) -> Array:
    """Points (T, P, 3) in mm, NaN where they are not known; those of a planar model lie in its plane."""
    known = np.where(np.isfinite(points), points, np.nan)
    return np.asarray(1000.0 * np.where(estimate.modelled_axes(), known, 0.0))


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
    radius = max(round(float(np.nanmax(away))) if known.any() else 500, 300)
    turns = not estimate.planar
    azimuth, elevation = _VIEWS["Aslant" if turns else "Right"]
    return {
        "azimuth": azimuth,
        "elevation": elevation,
        "turns": turns,
        "follow": follow,
        "x": round(float(middle[0])),
        "z": round(float(middle[1])),
        "middle": round(0.5 * (low + top)),
        "floor": round(floor),
        "height": max(round(top - low), 100),
        "radius": radius,
        "square": 500 * max(1, -(-2 * radius // (500 * _MOST_SQUARES))),
    }, centre


def _arrows(estimate: Estimate, arrays: dict[str, Array]) -> list[dict[str, Any]]:
    """Adds points of action (mm), forces and their sizes (N) to ``arrays``; what to draw of them, measured ones
    behind."""
    entries: list[dict[str, Any]] = []
    feet, modelled = estimate.contact_names, estimate.modelled_axes()
    total = wrench_sources(estimate.data)
    total = total[:, (total != ABSENT).any(axis=0)].max(axis=1, initial=0, keepdims=True)  # what is modelled
    arrays["sources"] = (foot_sources(estimate.data) if feet else total).astype(float)
    for kind, name in (("measured", "foot_wrench_measured"), ("estimated", "foot_wrench")):
        wrench = estimate.values(name) if feet else estimate.values(f"wrench_{kind}")[:, None]
        every = [wrench[:, k] for k in range(wrench.shape[1])]
        heights = [support_height(estimate, own) if feet else floor_height(estimate) for own in every]
        points = [centre_of_pressure(own, height)[0] for own, height in zip(every, heights, strict=True)]
        point = np.where(modelled, np.stack(points, axis=1), 0.0)
        known = np.isfinite(point).all(axis=2, keepdims=True)
        force = np.where(known, np.where(modelled, wrench[..., :3], 0.0), np.nan)
        arrays[f"{kind}_points"] = 1000.0 * point.reshape(len(point), -1)
        arrays[f"{kind}_forces"] = force.reshape(len(force), -1)
        arrays[f"{kind}_sizes"] = np.linalg.norm(force, axis=2)
        entries += [
            {
                "points": f"{kind}_points",
                "forces": f"{kind}_forces",
                "k": k,
                "colour": MEASURED if kind == "measured" else SIDE_COLOURS.get(feet[k], INK) if feet else INK,
                "width": 6 if kind == "measured" else 2.5,
                "behind": kind == "measured",
                "sourced": kind == "estimated",
            }
            for k in range(wrench.shape[1])
        ]
    return entries


def _joint_values(estimate: Estimate, joints: list[Joint]) -> dict[str, Array]:
    """Angles in degrees (mm) and moments, in space per kg, of the joints' columns, in the order of `_rows`."""
    columns = [k for joint in joints for k in joint.columns.values()]
    moments = estimate.values("moments") / (normalising_mass(estimate) or 1.0)
    sources = moment_sources(estimate.data).astype(float)
    return {
        "angles": _degrees(estimate)[:, columns],
        "moments": moments[:, columns],
        "moment_sources": sources[:, columns],
    }


def _degrees(estimate: Estimate) -> Array:
    shown = reported(estimate).of(estimate.known("coordinates"))
    return np.asarray(shown * np.where(estimate.is_rotation(), 180.0 / np.pi, 1000.0))


def _rows(estimate: Estimate, joints: list[Joint], moment_digits: int) -> list[dict[str, Any]]:
    """A row a joint: the packed column of each side ("" stands across both), and (array, digits) below angle and
    moment. Where an angle grows against its name, the title says which way."""
    rows: list[dict[str, Any]] = []
    ways, at = reported(estimate).way, 0
    for joint in joints:
        columns = {side: at + k for k, side in enumerate(joint.columns)}
        at += len(columns)
        moment = None if joint.region == "Whole body" else ("moments", moment_digits)
        shown = (("angles", 1 if joint.rotation else 0), moment)
        title = joint.title + ways[next(iter(joint.columns.values()))]
        rows.append({"title": title, "columns": columns, "shown": shown})
    return rows


def _reaction_rows(arrays: dict[str, Array]) -> list[dict[str, Any]]:
    """Sizes of the ground reaction, where it is one arrow."""
    return [
        {"title": f"Ground reaction, {kind}, N", "columns": {"": 0}, "shown": (None, (f"{kind}_sizes", 0))}
        for kind in ("measured", "estimated")
        if np.isfinite(arrays[f"{kind}_sizes"]).any()
    ]


def _frames_shown(estimate: Estimate, columns: int) -> np.ndarray:
    """Frames that are shown: thirty a second, fewer where the page would become heavy."""
    frames = len(estimate.time)
    bytes_in_all = frames * columns * 4 / 3
    rate = estimate.recording.rate if frames > 1 else 0.0  # one frame has none
    step = max(round(rate / _PICTURES_PER_SECOND), int(np.ceil(bytes_in_all / _MOST_BYTES)), 1)
    return np.arange(0, frames, step)


def _packed(values: Array, step: float) -> dict[str, Any]:
    """(N, C) in whole steps, column after column, as base64 of the changes from one frame to the next: most are one
    byte, where the numbers themselves take two.

    A change d is the number 1 + 2 d, or -2 d where it is negative, in LEB128 (seven bits a byte, the lowest first, the
    highest bit set where more follow); 0 stands for a missing value. A column's first change is from zero.
    """
    known = np.isfinite(values).T
    numbers = np.round(np.where(np.isfinite(values), values, 0.0) / step).astype(np.int64).T
    codes = np.zeros(known.shape, dtype=np.int64)
    for own, seen, code in zip(numbers, known, codes, strict=True):
        change = np.diff(own[seen], prepend=0)
        code[seen] = np.where(change < 0, -2 * change, 2 * change + 1)
    return {
        "step": step,
        "columns": values.shape[1],
        "values": base64.b64encode(_leb128(codes.ravel())).decode(),
    }


def _leb128(numbers: npt.NDArray[np.int64]) -> bytes:
    groups = numbers[:, None] >> np.arange(0, 63, 7)
    used = groups > 0
    used[:, 0] = True
    more = np.column_stack([used[:, 1:], np.zeros(len(used), dtype=bool)])
    return ((groups & 0x7F) | (more << 7))[used].astype(np.uint8).tobytes()


def _curve(estimate: Estimate) -> tuple[str, str]:
    """The coordinate that moves most as an SVG path in a box of 1000 x 100, above the slider, and its label."""
    rotations, angles = np.flatnonzero(estimate.is_rotation()), _degrees(estimate)
    if not len(rotations):
        return "", ""
    known = np.flatnonzero(np.isfinite(angles[:, rotations]).all(axis=1))  # lost frames are empty
    if not len(known):
        return "", ""
    index = int(rotations[int(np.argmax(np.ptp(angles[known][:, rotations], axis=0)))])
    kept = known[np.unique(np.linspace(0, len(known) - 1, 500).astype(int))]
    t, values = estimate.time[kept], angles[kept, index]
    low, high = float(values.min()), float(values.max())
    x = 1000.0 * (t - t[0]) / max(float(t[-1] - t[0]), 1e-9)
    y = 95.0 - 90.0 * (values - low) / max(high - low, 1e-9)
    path = "M" + "L".join(f"{a:.0f} {b:.1f}" for a, b in zip(x, y, strict=True))
    name = sentence(words(estimate.coordinate_names[index]))
    return path, f"{name}, {number(low)} to {number(high, 'deg')}"
