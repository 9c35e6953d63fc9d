"""The movement for the page's player: every position as a small whole number, few enough to keep the page light."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from dynakin.report.body import chain_of, colours_of, floor_height, marker_segments, reaction
from dynakin.report.labels import is_planar, short_marker_names
from dynakin.results.estimate import Estimate
from dynakin.results.measures.sources import DERIVED, moment_sources, wrench_sources
from dynakin.results.naming import number, sentence, words

_PICTURES_PER_SECOND = 30.0
_MOST_BYTES = 750_000  # of base64 in the page
_MISSING = -32768
_FOLLOWED_FROM_M = 2.6  # a person who covers more ground than this is followed
_MARGIN_MM = 90.0
_MOST_TICKS = 200  # half a metre apart: no person is followed for longer than that in one page


@dataclass(frozen=True)
class Playback:
    """What the template needs: elements to draw, the view in millimetres, and the numbers as JSON."""

    bones: list[dict[str, str]]
    markers: list[dict[str, str]]
    rows: list[str]
    view: tuple[float, float, float, float]
    floor_mm: float
    ticks_mm: list[float]
    curve: str
    curve_label: str
    last: int
    end_time: str
    has_reaction: bool
    has_derived: bool
    segments: dict[str, str]
    note: str
    data: Markup


def playback(estimate: Estimate) -> Playback:
    """The player's content; segments where the estimate holds joint centres, arrows where it holds a wrench."""
    chain, colours = chain_of(estimate), colours_of(estimate)
    measured, estimated = (_plane(estimate.data[f"markers_{kind}"].values) for kind in ("measured", "estimated"))
    floor = floor_height(estimate)
    arrows, forces = _arrows(estimate, floor, np.nanmax([_height(measured), _height(estimated)]))
    angles = estimate.data["coordinates"].transpose("time", "coordinate").values
    angles = angles * np.where(estimate.is_rotation(), 180.0 / np.pi, 1000.0)
    moments = estimate.data["moments"].transpose("time", "coordinate").values
    derived = np.column_stack([moment_sources(estimate.data), wrench_sources(estimate.data)[:, :2].max(axis=1)])
    points = _plane(chain.points)
    arrays = {
        "points": points,
        "measured": measured,
        "estimated": estimated,
        "arrows": arrows,
        "forces": forces,
        "angles": angles,
        "moments": moments,
        "derived": (derived == DERIVED).astype(float),
    }
    frames = frames_shown(estimate, sum(array.shape[1] for array in arrays.values()))
    view, followed = _view([points, measured, estimated, arrows], floor)
    carriers, names = marker_segments(estimate), short_marker_names(estimate.marker_names)
    content: dict[str, Any] = {
        "time": [round(float(t), 3) for t in estimate.time[frames]],
        "bones": [[bone.start, bone.end] for bone in chain.bones],
        "units": [["deg", "N m"] if rotation else ["mm", "N"] for rotation in estimate.is_rotation()],
        "follow": followed,
        "view": view,
        **{name: packed(array[frames]) for name, array in arrays.items()},
    }
    curve, curve_label = curve_of(estimate, angles)
    left, right = _extent([points, measured, estimated], 0)
    half = 500.0 * max(1.0, np.ceil((right - left) / (500.0 * _MOST_TICKS)))
    return Playback(
        bones=[{"segment": words(bone.segment), "colour": colours[bone.segment]} for bone in chain.bones],
        markers=[
            {"name": names[name], "colour": colours.get(carriers.get(name, ""), "#1d2530")}
            for name in estimate.marker_names
        ],
        rows=[sentence(words(name)) for name in estimate.coordinate_names],
        view=view,
        floor_mm=-1000.0 * floor,
        ticks_mm=[float(x) for x in np.arange(half * np.floor(left / half) - half, right + 2.0 * half, half)],
        curve=curve,
        curve_label=curve_label,
        last=len(frames) - 1,
        end_time=f"{estimate.time[frames[-1]]:.2f} s",
        has_reaction=bool(np.isfinite(arrows).any()),
        segments={words(name): colours[name] for name in dict.fromkeys(bone.segment for bone in chain.bones)},
        note="Moments of legs and arms are those of both sides together." if is_planar(estimate) else "",
        has_derived=bool((derived == DERIVED).any()),
        data=Markup(json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")),
    )


def _plane(points: np.ndarray) -> np.ndarray:
    """Points (T, P, 3) m as (T, 2 P) mm of the picture: forward to the right, up as negative."""
    flat = np.stack([1000.0 * points[:, :, 0], -1000.0 * points[:, :, 1]], axis=2)
    return np.asarray(flat.reshape(len(points), -1))


def _height(plane: np.ndarray) -> float:
    return float(np.ptp(plane[:, 1::2][np.isfinite(plane[:, 1::2])])) if np.isfinite(plane[:, 1::2]).any() else np.nan


def _arrows(estimate: Estimate, floor: float, height_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Measured and estimated arrows (T, 8) mm, x0 y0 x1 y1 each, and their sizes (T, 2) N."""
    pairs = [
        reaction(estimate.data[f"wrench_{kind}"].transpose("time", "component").values, floor)
        for kind in ("measured", "estimated")
    ]
    sizes = np.column_stack([np.linalg.norm(force, axis=1) for _, force in pairs])
    # Half the height of the markers at the usual load, so that the arrow ends inside the picture.
    scale = 0.5 * height_mm / float(np.nanpercentile(sizes, 90)) if np.isfinite(sizes).any() else 0.0
    parts = []
    for point, force in pairs:
        start = 1000.0 * point * [1.0, -1.0]
        parts += [start, start + scale * force * [1.0, -1.0]]
    return np.hstack(parts), sizes


def frames_shown(estimate: Estimate, columns: int) -> np.ndarray:
    """Frames that are shown: thirty a second, fewer where the page would become heavy."""
    frames = len(estimate.time)
    bytes_in_all = frames * columns * 2 * 4 / 3
    rate = estimate.recording.rate if frames > 1 else 0.0  # one frame has none
    step = max(round(rate / _PICTURES_PER_SECOND), int(np.ceil(bytes_in_all / _MOST_BYTES)), 1)
    return np.arange(0, frames, step)


def packed(values: np.ndarray) -> dict[str, Any]:
    """(N, C) as little-endian 16-bit numbers in base64: value = scale x number, -32768 missing."""
    finite = values[np.isfinite(values)]
    scale = float(np.max(np.abs(finite), initial=0.0)) / 32000.0 or 1.0
    numbers = np.where(
        np.isfinite(values), np.round(np.nan_to_num(values, posinf=0.0, neginf=0.0) / scale), _MISSING
    ).astype("<i2")
    return {
        "scale": float(f"{scale:.6g}"),
        "columns": values.shape[1],
        "values": base64.b64encode(numbers.tobytes()).decode(),
    }


def _extent(planes: list[np.ndarray], axis: int) -> tuple[float, float]:
    every = np.concatenate([plane[:, axis::2].ravel() for plane in planes])
    every = every[np.isfinite(every)]
    return (float(every.min()), float(every.max())) if len(every) else (-500.0, 500.0)


def _view(planes: list[np.ndarray], floor: float) -> tuple[tuple[float, float, float, float], bool]:
    """View box (x, y, width, height) mm, and whether it follows the person."""
    top, bottom = _extent(planes, 1)
    top, bottom = top - _MARGIN_MM, max(bottom, -1000.0 * floor) + _MARGIN_MM
    left, right = _extent(planes, 0)
    followed = right - left > 1000.0 * _FOLLOWED_FROM_M
    if followed:
        middle, half = 0.5 * (left + right), 0.5 * (bottom - top)
        left, right = middle - half, middle + half
    left, right = left - _MARGIN_MM, right + _MARGIN_MM
    spare = 0.62 * (bottom - top) - (right - left)  # never so slim that the figure stands in a slit
    if spare > 0.0:
        left, right = left - 0.5 * spare, right + 0.5 * spare
    return (round(left), round(top), round(right - left), round(bottom - top)), followed


def curve_of(estimate: Estimate, angles: np.ndarray) -> tuple[str, str]:
    """The coordinate that moves most as an SVG path in a box of 1000 x 100, above the slider, and its label."""
    rotations = np.flatnonzero(estimate.is_rotation())
    if not len(rotations):
        return "", ""
    ranges = np.nan_to_num(np.ptp(angles[:, rotations], axis=0))
    index = int(rotations[int(np.argmax(ranges))])
    kept = np.unique(np.linspace(0, len(angles) - 1, 500).astype(int))
    t, values = estimate.time[kept], angles[kept, index]
    low, high = float(values.min()), float(values.max())
    x = 1000.0 * (t - t[0]) / max(float(t[-1] - t[0]), 1e-9)
    y = 95.0 - 90.0 * (values - low) / max(high - low, 1e-9)
    path = "M" + "L".join(f"{a:.0f} {b:.1f}" for a, b in zip(x, y, strict=True))
    name = sentence(words(estimate.coordinate_names[index]))
    return path, f"{name}, {number(low)} to {number(high, 'deg')}"
