"""Figure 3 of the paper: a criterion over the filter's three gains, as slices through its optimum."""

from __future__ import annotations

import csv
import itertools
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import MaxNLocator

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.report.figure import Figure
from dynakin.report.styles import INK, QUIET
from dynakin.results.files.netcdf import ONE_AT_A_TIME
from dynakin.results.naming import number

GAINS = ("log10_coordinate_variance", "log10_speed_variance", "log10_acceleration_variance")
CRITERION = "criterion"
LABEL, UNIT = "sum of RMS differences", "mm + N + N m"
"""The paper's criterion: markers and wrench together."""
GAIN_NAMES = ("gain of coordinates", "gain of speeds", "gain of accelerations")
GAIN_UNITS = ("rad²", "(rad/s)²", "(rad/s²)²")
# A criterion that spans more than this many times its least value is coloured on a logarithmic scale.
_LOG_FROM = 20.0


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """A criterion on a grid of settings: the filter's three gains, or others.

    gains: sorted arrays, log10 of each setting. criterion: a dimension a setting, NaN where the filter diverged or
    nothing was computed; in ``unit``. names, units: of the settings.
    """

    gains: tuple[Array, ...]
    criterion: Array
    label: str = LABEL
    unit: str = UNIT
    names: tuple[str, ...] = GAIN_NAMES
    units: tuple[str, ...] = GAIN_UNITS

    @property
    def optimum(self) -> tuple[int, ...]:
        """Place of the least value in the grid."""
        return tuple(int(k) for k in np.unravel_index(int(np.nanargmin(self.criterion)), self.criterion.shape))


def read_sensitivity(path: str | Path) -> Sensitivity:
    """Read a grid of gains: CSV or netCDF.

    CSV: columns ``log10_coordinate_variance``, ``log10_speed_variance``, ``log10_acceleration_variance`` and
    ``criterion``, one row a combination, in any order; a blank or ``nan`` criterion is a filter that diverged. netCDF:
    a variable ``criterion`` over coordinates of these three names; its attributes ``long_name`` and ``units`` say what
    it is.

    Raises:
        ConfigError: not such a file, or no finite criterion.
    """
    path = Path(path)
    try:
        found = _read_csv(path) if path.suffix.casefold() == ".csv" else _read_netcdf(path)
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or 'no such format'})") from None
    if not np.isfinite(found.criterion).any():
        raise ConfigError(f"{path}: no finite {CRITERION}, expected at least one combination that did not diverge")
    return found


def sensitivity_figure(grid: Sensitivity) -> Figure:
    """Slices through the optimum, each over two of the settings; over one setting a line."""
    best = grid.optimum
    values = grid.criterion[np.isfinite(grid.criterion)]
    low, high = float(values.min()), float(values.max())
    pairs = list(itertools.combinations(range(len(grid.gains)), 2))
    columns, rows = max(1, min(3, len(pairs))), max(1, -(-len(pairs) // 3))
    width = 7.2 if columns == 3 else 1.2 + 2.6 * columns
    figure = Figure(figsize=(width, 0.5 + 2.2 * rows), layout="constrained")
    every = list(figure.subplots(rows, columns, squeeze=False).ravel())
    if not pairs:
        _line(every[0], grid)
    else:
        norm = _norm(low, high)
        for axes, pair in zip(every, pairs, strict=False):
            mesh = _slice(axes, grid, pair, norm)
        for axes in every[len(pairs) :]:
            axes.set_visible(False)
        bar = figure.colorbar(mesh, ax=every, location="right", shrink=0.82, pad=0.02)
        bar.set_label("\n".join(textwrap.wrap(_in_unit(grid), 38)), color=QUIET)
        bar.outline.set_visible(False)
    at = ", ".join(f"{gains[k]:.3g}" for gains, k in zip(grid.gains, best, strict=True))
    what = "Slices through the optimum" if pairs else "Optimum"
    unit = "" if grid.unit == "1" else f", in {grid.unit}"
    lost = "; hatched: the filter diverged" if not np.isfinite(grid.criterion).all() else ""
    figure.suptitle(f"{what} (○: {number(low)}{unit}, at 10^({at})){lost}", x=0.01, ha="left", fontsize=8.5, color=INK)
    return figure


def _norm(low: float, high: float) -> Normalize:
    if 0.0 < low * _LOG_FROM < high:
        return LogNorm(low, high)
    return Normalize(low, high if high > low else low + 1.0)


def _slice(axes: Axes, grid: Sensitivity, pair: tuple[int, int], norm: Normalize) -> QuadMesh:
    x, y = pair
    best = grid.optimum
    held = [k for k in range(len(best)) if k not in pair]
    plane = grid.criterion[tuple(slice(None) if k in pair else best[k] for k in range(len(best)))].T  # rows: y
    axes.set_facecolor("white")
    axes.patch.set(hatch="////", edgecolor="#c9d0d6", linewidth=0.0)
    mesh = axes.pcolormesh(
        _edges(grid.gains[x]), _edges(grid.gains[y]), np.ma.masked_invalid(plane), cmap="cividis", norm=norm
    )
    point = (grid.gains[x][best[x]], grid.gains[y][best[y]])
    axes.plot(*point, "o", markersize=8, markerfacecolor="none", markeredgecolor="white", markeredgewidth=3.2)
    axes.plot(*point, "o", markersize=8, markerfacecolor="none", markeredgecolor="#D55E00", markeredgewidth=1.6)
    axes.set_xlabel(_axis_label(grid, x))
    axes.set_ylabel(_axis_label(grid, y))
    title = ", ".join(
        f"{grid.names[k].removeprefix('gain of ')} at $10^{{{grid.gains[k][best[k]]:.3g}}}$ {grid.units[k]}"
        for k in held
    )
    axes.set_title(title, fontsize=8, weight="normal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(7, integer=True, steps=[1, 2, 3, 5, 10]))
    axes.grid(False)
    axes.set_box_aspect(1)
    return mesh


def _line(axes: Axes, grid: Sensitivity) -> None:
    axes.plot(grid.gains[0], grid.criterion, "-o", markersize=3, color="#0072B2")
    k = grid.optimum[0]
    axes.plot(grid.gains[0][k], grid.criterion[k], "o", markersize=8, markerfacecolor="none", markeredgecolor="#D55E00")
    axes.set_xlabel(_axis_label(grid, 0))
    axes.set_ylabel(_in_unit(grid))


def _in_unit(grid: Sensitivity) -> str:
    return grid.label if grid.unit == "1" else f"{grid.label}, {grid.unit}"


def _axis_label(grid: Sensitivity, k: int) -> str:
    which = "Q in " if grid.names[k] in GAIN_NAMES else ""
    unit = grid.units[k]
    return f"{grid.names[k]}\nlog₁₀ of {'it, ' if unit.startswith('of ') else which or 'it in '}{unit}"


def _edges(centres: Array) -> Array:
    """Sides of the cells (n + 1,) around sorted centres (n,); a lone one is a decade wide."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def _read_csv(path: Path) -> Sensitivity:
    with path.open(encoding="utf-8", newline="") as file:
        lines = csv.DictReader(line for line in file if not line.startswith("#"))
        missing = [name for name in (*GAINS, CRITERION) if name not in (lines.fieldnames or ())]
        if missing:
            expected = ", ".join((*GAINS, CRITERION))
            raise ConfigError(f"{path}: no column {missing[0]}, expected {expected}")
        rows = [_row(path, k + 1, line) for k, line in enumerate(lines)]
    if not rows:
        raise ConfigError(f"{path}: no rows, expected one for each combination of gains")
    table = np.array(rows)
    return _on_grid(path, table[:, :3], table[:, 3])


def _row(path: Path, row: int, line: dict[str, str | None]) -> list[float]:
    found = []
    for name in (*GAINS, CRITERION):
        text = (line[name] or "").strip()
        try:
            value = float(text or "nan")
        except ValueError:
            raise ConfigError(f"{path}: row {row}: {name} is {text!r}, expected a number") from None
        if name != CRITERION and not np.isfinite(value):
            raise ConfigError(f"{path}: row {row}: {name} is {text or 'blank'}, expected a finite number")
        found.append(value if np.isfinite(value) else np.nan)
    return found


def _on_grid(path: Path, gains: Array, values: Array, label: str = LABEL, unit: str = UNIT) -> Sensitivity:
    axes, places = zip(*(np.unique(gains[:, k], return_inverse=True) for k in range(3)), strict=True)
    flat = np.ravel_multi_index(places, tuple(len(axis) for axis in axes))
    if len(np.unique(flat)) < len(flat):
        k = int(np.flatnonzero(np.bincount(flat)[flat] > 1)[1])
        raise ConfigError(f"{path}: the gains {gains[k].tolist()} stand there twice, expected each combination once")
    criterion = np.full(tuple(len(axis) for axis in axes), np.nan)
    criterion.ravel()[flat] = values
    return Sensitivity((axes[0], axes[1], axes[2]), criterion, label, unit)


def _read_netcdf(path: Path) -> Sensitivity:
    try:
        with ONE_AT_A_TIME, xr.open_dataset(path, engine="netcdf4") as data:
            data.load()
    except FileNotFoundError as error:
        raise OSError(2, "No such file or directory") from error
    if CRITERION not in data or set(data[CRITERION].dims) != set(GAINS) or not set(GAINS) <= set(data.coords):
        expected = ", ".join(GAINS)
        raise ConfigError(f"{path}: no variable {CRITERION} over {expected} with their values, expected it")
    values = data[CRITERION].transpose(*GAINS).astype(float)
    gains: Sequence[Array] = [np.asarray(data[name].values, dtype=float) for name in GAINS]
    if not all(np.isfinite(axis).all() for axis in gains):
        raise ConfigError(f"{path}: a gain is not finite, expected numbers along {', '.join(GAINS)}")
    grid = np.stack([axis.ravel() for axis in np.meshgrid(*gains, indexing="ij")], axis=1)
    label, unit = str(values.attrs.get("long_name", LABEL)), str(values.attrs.get("units", UNIT))
    finite = np.where(np.isfinite(values.values), values.values, np.nan)
    return _on_grid(path, grid, finite.ravel(), label, unit)
