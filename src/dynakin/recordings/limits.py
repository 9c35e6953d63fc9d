"""What no laboratory measures: beyond these a value is damaged, or in another unit than it is said to be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.recordings.pushes import LOADED_N
from dynakin.recordings.times import step_of

SLOWEST_HZ, FASTEST_HZ = 5.0, 1e5
"""Rates of markers and plates. A movement cannot be followed from a sample every 0.2 s; times in milliseconds are the
usual reason for that. No camera or amplifier comes near the other end."""
LONGEST_GAP_S = 3600.0
"""Between two samples of one recording: who stops for longer begins a new one."""
FARTHEST_M = 1e4
"""Of a marker from the laboratory's origin: ten times the largest volume that is filmed (a ski slope)."""
LARGEST_FORCE_N = 1e5
"""Of one plate: ten tonnes, ten times a landing of the heaviest athlete, and beyond what plates survive."""
APART_M = 5.0
"""Between the line of a plate's force by its moment and by its centre of pressure: as far as a laboratory is wide."""
LARGEST_MOMENT_NM = 1e8
"""Of one plate, about the laboratory's origin: that force a kilometre away."""


def rate_problem(time: Array) -> str | None:
    """What is wrong with the rate of increasing times (T,) s, None where nothing is."""
    if len(time) < 2:
        return None
    step = step_of(time)
    if SLOWEST_HZ * step <= 1.0 <= FASTEST_HZ * step:
        return None
    units = {"milliseconds": 1e-3, "microseconds": 1e-6}
    fits = [unit for unit, s in units.items() if SLOWEST_HZ * s * step <= 1.0 <= FASTEST_HZ * s * step]
    hint = f"; they seem to be in {fits[0]}, expected seconds" if step > 1.0 and fits else ""
    if (time == np.rint(time)).all() and step == 1.0:
        hint = "; they seem to count frames, expected seconds (frames over the rate of the cameras)"
    return (
        f"found times that are {step:.4g} s apart ({1.0 / step:.4g} Hz), expected {SLOWEST_HZ:g} to "
        f"{FASTEST_HZ:g} Hz{hint}"
    )


def check_markers(where: str, time: Array, names: Sequence[str], markers: Array) -> None:
    """Times (T,) s increase, and every marker of (T, M, 3) m is missing (NaN) or where somebody could have measured it.

    Raises:
        RecordingError: the first that is not, with its frame and marker.
    """
    for k in np.flatnonzero(~np.isfinite(time))[:1]:
        raise RecordingError(f"{where}: time of frame {k + 1} is {time[k]}, expected a number")
    for k in np.flatnonzero(np.diff(time) <= 0)[:1]:
        raise RecordingError(
            f"{where}: time {time[k + 1]:g} s of frame {k + 2} does not come after {time[k]:g} s, "
            "expected increasing times"
        )
    for frame, m in _beyond(markers, FARTHEST_M):
        raise RecordingError(
            f"{where}: marker {names[m]!r} at frame {frame + 1} is at "
            f"{_listed(markers[frame, m])} m, expected at most {FARTHEST_M:g} m from the origin: "
            "the value is damaged, or the length unit wrong"
        )


def check_wrench(name: str, time: Array, force: Array, moment: Array, where: str) -> None:
    """A plate's force (T, 3) N and moment (T, 3) N m about the laboratory's origin are missing or possible.

    Raises:
        RecordingError: the first sample that is not, with its time.
    """
    limits = ((force, LARGEST_FORCE_N, "force", "N"), (moment, LARGEST_MOMENT_NM, "moment", "N m"))
    for values, most, what, unit in limits:
        for k, _ in _beyond(values[:, None], most):
            raise RecordingError(
                f"{where}: {name} at frame {k + 1} ({time[k]:g} s) has a {what} of {_listed(values[k])} {unit}, "
                f"expected at most {most:g} {unit}: the value is damaged, or its unit wrong"
            )


def check_place(name: str, time: Array, force: Array, moment: Array, cop: Array, where: str) -> None:
    """A plate's moment (T, 3) N m about the laboratory's origin and its centre of pressure (T, 3) m say of its force
    (T, 3) N that it acts in one place, within `APART_M`.

    Raises:
        RecordingError: they do not in most frames, as of moments in N mm; the first is named.
    """
    size = np.linalg.norm(force, axis=1)
    with np.errstate(invalid="ignore"):
        about = moment - np.cross(cop, force)  # the free moment, if they agree; what is across the force moves its line
        across = np.linalg.norm(np.cross(about, force), axis=1)
        loaded = np.flatnonzero((size > LOADED_N) & np.isfinite(across))
    away = across[loaded] / size[loaded] ** 2
    apart = loaded[away > APART_M]
    if 2 * len(apart) > len(loaded):
        k = int(apart[0])
        raise RecordingError(
            f"{where}: {name} at frame {k + 1} ({time[k]:g} s) has a moment of {_listed(moment[k])} N m about the "
            f"laboratory's origin, where its force and centre of pressure ask for {_listed(np.cross(cop, force)[k])} "
            "N m; expected both in m and N m (moments in N mm are 1000 times too large)"
        )


def numbers(given: object, what: str) -> Array:
    """An array, or lists made one, of real numbers.

    Raises:
        RecordingError: it is something else; ``what`` opens the message.
    """
    if isinstance(given, np.ma.MaskedArray):
        raise RecordingError(f"{what} is a masked array, expected one with NaN where something is missing (filled)")
    try:
        found = np.asarray(given)
    except ValueError:  # lists of different lengths
        found = np.empty(0, dtype=object)
    if found.dtype.kind not in "fiu":
        kind = f"an array of {found.dtype}" if isinstance(given, np.ndarray) else f"a {type(given).__name__}"
        raise RecordingError(f"{what} is {kind}, expected an array of numbers")
    return np.asarray(found, dtype=float)


def _beyond(values: Array, most: float) -> npt.NDArray[np.intp]:
    """(frame, item) of values (T, K, 3) that are infinite or larger; NaN is neither."""
    return np.argwhere((np.abs(values) > most).any(axis=2))


def _listed(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
