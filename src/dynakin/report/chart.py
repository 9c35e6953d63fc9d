"""Small panels over time, written as SVG by hand: a whole body has two hundred of them, and a plotting library takes
50 ms and 20 kB for each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, runs
from dynakin.report.styles import GRID, LIMIT, by_source, thin
from dynakin.results.measures.sources import MEASURED

Points = npt.NDArray[np.complex128]
Place = Callable[[Array], Array]

# The picture in tenths of a point, so that whole numbers place a point to a quarter of a screen's pixel.
_WIDTH, _HEIGHT = 2592, 1440
_LEFT, _RIGHT, _TOP, _BOTTOM = 400, 2560, 70, 1140
_MARGIN = 0.08
_MOST_POINTS = 240
_UNSEEN = 3.0
"""Less than half of a screen's pixel, and a third of a line's width."""
_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
_ROUNDING = 1e-10  # of a step
_LEAST_RANGE = 1e-3
"""Of the values: what moves less is drawn as the flat line that it is, and its levels differ in few digits."""
_RARE = 2.0
"""Per cent of derived values and priors that may leave the panel at either end: a centre of pressure is far off where a
foot sets down."""


@dataclass(frozen=True)
class Panel:
    """One figure with its title and a line below the title."""

    title: str
    note: str
    svg: str


@dataclass(frozen=True, eq=False)
class Line:
    """values (T,), NaN where there is nothing to draw; ``sd`` (T,) adds a band of two standard deviations.

    source: (T,) where the values come from (`results.measures.sources`): derived ones are dashed, a prior's dotted, and
    rare ones far out leave the panel. width in points. dashes: of what is measured, or all, in tenths of a point.
    """

    values: Array
    colour: str
    width: float = 1.2
    sd: Array | None = None
    source: npt.NDArray[np.uint8] | None = None
    dashes: str = ""


@dataclass(frozen=True)
class Bound:
    """A level that is drawn across the panel, with what it is."""

    value: float
    word: str


def chart(
    title: str,
    unit: str,
    time: Array,
    lines: Sequence[Line],
    *,
    note: str = "",
    bounds: Sequence[Bound] = (),
    least_range: float = 0.0,
    x_label: str = "time, s",
) -> Panel:
    """Lines over time (T,) in one panel, the first at the bottom.

    Args:
        least_range: in ``unit``; less than this is not blown up to fill the panel.
    """
    low, high = value_range(lines, least_range, [bound.value for bound in bounds])
    start, end = float(time[0]), float(time[-1])
    if end <= start:
        end = start + 1.0

    def x(at: Array) -> Array:
        return np.asarray(np.round(_LEFT + (_RIGHT - _LEFT) * (at - start) / (end - start)))

    def y(value: Array) -> Array:
        return np.asarray(np.round(_BOTTOM - (_BOTTOM - _TOP) * (value - low) / (high - low)))

    bands = [_band(time, line, low, high, x, y) for line in lines]
    drawn = [
        (line, dashes, _stretches(*thin(time, part, _MOST_POINTS), x, y))
        for line in lines
        for part, dashes in by_source(np.clip(line.values, low, high), line.source)
    ]
    simple = iter(_simplified([path for paths in (*bands, *(paths for *_, paths in drawn)) for path in paths]))
    parts = [_axes(low, high, start, end, x, y, unit, x_label)]
    for line, edges in zip(lines, bands, strict=True):
        if edges:
            areas = "".join(_steps(np.concatenate([next(simple), next(simple)])) + "z" for _ in edges[::2])
            parts.append(f'<path d="{areas}" class="spread" fill="{line.colour}"/>')
    for bound in bounds:
        level = int(y(np.array(bound.value)))
        text = f"{bound.word} {bound.value:.3g}".replace("-", "−")
        parts.append(
            f'<path d="M{_LEFT} {level}H{_RIGHT}" stroke="{LIMIT}" stroke-width="10" stroke-dasharray="50 30"/>'
            f'<text x="{_RIGHT}" y="{level - 18}" text-anchor="end" style="fill:{LIMIT}">{escape(text)}</text>'
        )
    for line, dashes, stretches in drawn:
        if stretches:
            path = "".join(_steps(next(simple)) for _ in stretches)
            more = " ".join(f"{10.0 * length:.0f}" for length in dashes) or line.dashes
            pattern = f' stroke-dasharray="{more}"' if more else ""
            parts.append(f'<path d="{path}" stroke="{line.colour}" stroke-width="{10 * line.width:.0f}"{pattern}/>')
    label = escape(f"{title} in {unit} over {x_label.partition(',')[0]}", quote=True)
    svg = f'<svg class="chart" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{label}">{"".join(parts)}</svg>'
    return Panel(title, note, svg)


def _filling(line: Line) -> Array:
    """The values that a panel has to hold: all that are measured, and of the others all but the rare ones far out."""
    known = np.isfinite(line.values)
    if line.source is None:
        return line.values[known]
    others = line.values[known & (line.source != MEASURED)]
    rare = np.percentile(others, [_RARE, 100.0 - _RARE]) if len(others) else others
    return np.concatenate([line.values[known & (line.source == MEASURED)], rare])


def value_range(lines: Sequence[Line], least: float = 0.0, levels: Sequence[float] = ()) -> tuple[float, float]:
    """Ends of the axis of values: what is drawn decides, and of the bands what lies near it.

    Args:
        least: less than this is not blown up to fill the panel. levels: that have to be in it.
    """
    values = np.concatenate([*(_filling(line) for line in lines), np.asarray(levels, dtype=float)])
    if not len(values):
        return -1.0, 1.0
    low, high = float(values.min()), float(values.max())
    least = max(least, _LEAST_RANGE * max(abs(low), abs(high)), 1e-9)
    if high - low < least:
        low, high = 0.5 * (low + high - least), 0.5 * (low + high + least)
    # a band of measured values ends where its doubt does, within reason; one that says how little is known may be cut
    bottom, top, spread = low, high, high - low
    for line in lines:
        if line.sd is None:
            continue
        sure = np.ones(len(line.values), bool) if line.source is None else line.source == MEASURED
        for frames, most in ((sure, 0.75), (~sure, 0.25)):
            edges = (line.values + 2.0 * np.outer((-1.0, 1.0), line.sd))[:, frames]
            edges = np.clip(edges[np.isfinite(edges)], low - most * spread, high + most * spread)
            bottom, top = float(np.min(edges, initial=bottom)), float(np.max(edges, initial=top))
    low, high = bottom, top
    more = (0.2 if levels else _MARGIN) * (high - low)
    return low - more, high + more


def _axes(low: float, high: float, start: float, end: float, x: Place, y: Place, unit: str, x_label: str) -> str:
    parts = []
    ticks = round_levels(low, high, 5)
    levels = "".join(f"M{_LEFT} {int(y(np.array(tick)))}H{_RIGHT}" for tick in ticks)
    parts.append(f'<path d="{levels}" stroke="{GRID}" stroke-width="7"/>')
    parts += [
        f'<text x="{_LEFT - 30}" y="{int(y(np.array(tick))) + 28}" text-anchor="end">{text}</text>'
        for tick, text in zip(ticks, _labels(ticks), strict=True)
    ]
    moments = round_levels(start, end, 6, (1.0, 2.0, 2.5, 5.0))
    marks = "".join(f"M{int(x(np.array(at)))} {_BOTTOM}v30" for at in moments)
    parts.append(f'<path d="M{_LEFT} {_BOTTOM}H{_RIGHT}{marks}" stroke="#b8c0c8" stroke-width="7"/>')
    parts += [
        f'<text x="{int(x(np.array(at)))}" y="{_BOTTOM + 115}" text-anchor="middle">{text}</text>'
        for at, text in zip(moments, _labels(moments), strict=True)
    ]
    middle = (_TOP + _BOTTOM) // 2
    parts.append(f'<text x="{(_LEFT + _RIGHT) // 2}" y="{_HEIGHT - 70}" text-anchor="middle">{escape(x_label)}</text>')
    parts.append(f'<text transform="translate(65 {middle}) rotate(-90)" text-anchor="middle">{escape(unit)}</text>')
    return "".join(parts)


def round_levels(low: float, high: float, most: int, steps: Sequence[float] = _STEPS) -> Array:
    """Levels from ``low`` to ``high`` that are multiples of a round step, ``most`` of them and one at most, two at
    least (one where there is no range): Matplotlib's ``MaxNLocator``, which takes as long to load as the page to write.

    Args:
        steps: that count as round, from 1 to below 10.
    """
    if not high > low:
        return np.array([low])
    wanted = (high - low) / most
    scale = 10.0 ** np.floor(np.log10(wanted))
    rounds = [ten * scale * step for ten in (0.1, 1.0, 10.0) for step in steps]
    first = next(k for k, step in enumerate(rounds) if step >= wanted)
    for step in rounds[first::-1]:
        levels = step * np.arange(np.ceil(low / step - _ROUNDING), np.floor(high / step + _ROUNDING) + 1.0)
        if len(levels) > 1:
            break
    return np.asarray(levels)


def _labels(ticks: Array) -> list[str]:
    """With as many decimals as the step between them asks for."""
    step = float(np.min(np.diff(ticks))) if len(ticks) > 1 else abs(float(ticks[0])) if len(ticks) else 1.0
    decimals = 0
    while decimals < 12 and abs(step * 10**decimals - round(step * 10**decimals)) > 1e-3 * step * 10**decimals:
        decimals += 1
    return [f"{tick + 0.0:.{decimals}f}".replace("-", "−") for tick in ticks]


def _stretches(at: Array, values: Array, x: Place, y: Place) -> list[Points]:
    """Points (N,) between gaps, across and down as the real and the imaginary part; one alone is not seen."""
    return [
        x(at[first:last]) + 1j * y(values[first:last]) for first, last in runs(np.isfinite(values)) if last - first > 1
    ]


def _simplified(paths: Sequence[Points]) -> list[Points]:
    """The corners without which lines would be drawn more than `_UNSEEN` off their places (Douglas and Peucker 1973,
    all stretches of all lines at once)."""
    if sum(map(len, paths)) < 3:
        return list(paths)
    points = np.concatenate(paths)
    ends = np.cumsum([len(path) for path in paths])
    kept = np.zeros(len(points), dtype=bool)
    kept[ends - 1] = True
    kept[[0, *ends[:-1]]] = True
    while True:
        corners = np.flatnonzero(kept)
        stretch = np.cumsum(kept) - 1
        stretch[-1] -= 1
        chords = np.diff(points[corners])  # from one line to the next there is nothing between
        lateral = ((points - points[corners][stretch]) * chords.conj()[stretch]).imag
        away = np.abs(lateral) / np.maximum(np.abs(chords), 1.0)[stretch]
        worst = np.maximum.reduceat(away, corners[:-1])
        far = (away > _UNSEEN) & (away == worst[stretch])
        if not far.any():
            return [path[own] for path, own in zip(paths, np.split(kept, ends[:-1]), strict=True)]
        kept |= far


def _steps(points: Points) -> str:
    """Moves and relative steps of whole numbers."""
    across, down = points.real.astype(int), points.imag.astype(int)
    steps = np.diff(np.column_stack([across, down]), axis=0)
    moved = "".join(f"{dx}{' ' if dy >= 0 else ''}{dy} " for dx, dy in steps.tolist())
    return f"M{across[0]} {down[0]}l{moved.rstrip()}"


def _band(time: Array, line: Line, low: float, high: float, x: Place, y: Place) -> list[Points]:
    """Edges of a line's band, above and back below, from few points: it only says how wide the doubt is."""
    if line.sd is None:
        return []
    kept = np.unique(np.linspace(0, len(time) - 1, _MOST_POINTS // 2).astype(int))
    values, half = line.values[kept], 2.0 * line.sd[kept]
    edges = []
    for first, last in runs(np.isfinite(values) & np.isfinite(half)):
        own = slice(first, last)
        across = x(time[kept][own])
        above, below = (y(np.clip(values[own] + side * half[own], low, high)) for side in (1.0, -1.0))
        edges += [across + 1j * above, across[::-1] + 1j * below[::-1]]
    return edges


def band_is_too_wide(values: np.ndarray, sd: np.ndarray) -> bool:
    """Whether a band of two standard deviations hides how the values move; what is NaN has no band."""
    if not np.isfinite(sd).any() or not np.isfinite(values).any():
        return False
    return bool(2.0 * np.nanmedian(sd) > max(0.6 * float(np.nanmax(values) - np.nanmin(values)), 1e-12))
