"""A motion from a coordinates file (.mot, .sto), smoothed so that speeds and accelerations follow from it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy

from dynakin.arrays import Array
from dynakin.errors import ConfigError
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.resampling import low_pass
from dynakin.recordings.times import step_of
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.simulation.bodies.body import SimulatedBody
from dynakin.simulation.mechanics import Motion
from dynakin.simulation.motions.movement import Movement

_DEGREE = 5  # a quintic spline: forces, from its second derivative, have no corners
_FEWEST_ROWS = 20


def file_movement(path: Path, body: SimulatedBody, cutoff_hz: float = CUTOFF_HZ) -> Movement:
    """The coordinates of a file, low-passed (4th-order zero-lag Butterworth) and joined by a quintic spline.

    Time begins at 0 with the file's first row. Before the first and after the last row the motion rests at the
    ends' values; only plates that are shifted in time ask for that.

    Raises:
        ConfigError: a coordinate of the body has no column, a cell is no number, rows are few or uneven, or the
            cut-off does not fit the rate.
        RecordingError: the file cannot be read.
    """
    table = read_table(path)
    names = body.coordinates
    absent = [name for name in names if name not in table.names]
    if absent:
        raise ConfigError(
            f"{path}: no column for coordinate {absent[0]!r} of {body.name}, expected {', '.join(names)}; "
            f"it has {', '.join(table.names[:12])}{', ...' if len(table.names) > 12 else ''}"
        )
    radians = table.radians([name for name in names if name not in body.translations])
    values = np.stack([radians.column(name) for name in names], axis=1)
    if not np.isfinite(values).all():
        row, column = np.argwhere(~np.isfinite(values))[0]
        raise ConfigError(f"{path}: {names[column]} is no number at {table.time[row]:g} s, expected one in each row")
    time = table.time - table.time[0]
    rate_hz = _even_rate(path, time)
    if not 0.0 < cutoff_hz < 0.5 * rate_hz:
        raise ConfigError(
            f"simulation: motion_cutoff_hz is {cutoff_hz:g}, expected 0 to {0.5 * rate_hz:g} Hz ({path} has "
            f"{rate_hz:g} rows a second)"
        )
    spline = scipy.interpolate.make_interp_spline(time, low_pass(values, rate_hz, cutoff_hz), k=_DEGREE)
    rate, second = spline.derivative(1), spline.derivative(2)
    end_s = float(time[-1])

    def at(asked: Array) -> Motion:
        inside = np.clip(asked, 0.0, end_s)
        within = ((asked >= 0.0) & (asked <= end_s))[:, None]
        return Motion(names, spline(inside), np.where(within, rate(inside), 0.0), np.where(within, second(inside), 0.0))

    description = (
        f"coordinates of {path.name}, low-passed at {cutoff_hz:g} Hz (4th-order zero-lag Butterworth) and joined "
        "by a quintic spline"
    )
    return Movement(path.stem, at, description, end_s=end_s)


def _even_rate(path: Path, time: Array) -> float:
    if len(time) < _FEWEST_ROWS:
        raise ConfigError(f"{path}: {len(time)} rows, expected at least {_FEWEST_ROWS} to make a motion of")
    steps = np.diff(time)
    middle = step_of(time)
    if np.abs(steps - middle).max() > 0.01 * middle:
        row = int(np.argmax(np.abs(steps - middle)))
        raise ConfigError(
            f"{path}: rows {row + 1} and {row + 2} are {steps[row]:g} s apart, the others {middle:g} s; expected "
            "evenly spaced rows"
        )
    return 1.0 / middle
