"""Force plates of a C3D file: from analog channels to wrenches about the laboratory origin.

The plate frame is that of the C3D user guide: corner 1 lies at (+x, +y), 2 at (-x, +y), 3 at (-x, -y), 4 at
(+x, -y), and z = x cross y points into the floor. All files seen store the ground's reaction in it (F_z
negative under a person); a plate that stores the person's action is recognised, as it cannot pull, and
turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array
from dynakin.errors import RecordingError
from dynakin.messages import Message, note, together, warning
from dynakin.recordings.formats.c3d_channels import at_end_of_range, zero_frames, zeroed
from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.recordings.formats.c3d_plate_types import (
    TYPES,
    Strange,
    as_recorded,
    checked_origin,
    fitting_moments,
    plate_wrench,
    strange_in_words,
    units_of,
    volts,
)
from dynakin.recordings.limits import check_wrench
from dynakin.recordings.plates.axes import pulling, turned_in_words
from dynakin.recordings.plates.dead import Channels, dead_channels
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.plates.stuck import frozen, frozen_in_words
from dynakin.recordings.plates.zero import zero_of
from dynakin.recordings.pushes import JUDGED_N, UNLOADED_N
from dynakin.recordings.recording import Plate
from dynakin.recordings.resampling import (
    CausalLowPass,
    ReadOptions,
    bridged,
    filled,
    low_pass,
    reach_s,
    resample,
    touched,
)

_MOST_PLATES = 100
_LEAST_SURFACE_M2 = 1e-4
_LOOK = "look at its cable and its amplifier, and at this channel in the file"


@dataclass(frozen=True)
class _Raw:
    """One plate at the analog rate, laboratory frame: force (N, 3) N, moment (N, 3) N m about the lab
    origin; and its channels as recorded."""

    name: str
    force: Array
    moment: Array
    surface: Surface
    corners: Array
    strange: Strange
    channels: Channels

    def without(self, lost: npt.NDArray[np.bool_]) -> _Raw:
        """Not measured (NaN) in these samples (N,)."""
        force, moment = (np.where(lost[:, None], np.nan, values) for values in (self.force, self.moment))
        channels = replace(self.channels, push=np.where(lost, np.nan, self.channels.push))
        return replace(self, force=force, moment=moment, channels=channels)


def read_plates(
    parameters: Parameters,
    analog: Array,
    time: Array,
    markers: Array,
    unit_m: float,
    options: ReadOptions,
) -> tuple[tuple[Plate, ...], list[Message]]:
    """All plates that can be read at the marker times, and notes; a warning for each that cannot.

    Args:
        analog: (channels, samples) as ezc3d scales them, a whole number of samples a frame.
        time: (T,) s.
        markers: (T, M, 3) m, on whose side of a plate the person is.
        unit_m: metres per unit of length of the file.
    """
    used = parameters.number("FORCE_PLATFORM", "USED") or 0.0
    if used == 0.0:
        return (), [note("routine", "The file has no force plates.")]
    if used not in range(_MOST_PLATES + 1):
        return (), [
            warning(
                "plates",
                f"no plate read: found {used:g} in FORCE_PLATFORM:USED, expected a whole number from 0 to "
                f"{_MOST_PLATES}.",
            )
        ]
    per_frame, odd = divmod(analog.shape[1], len(time))
    if per_frame == 0 or odd:
        return (), [
            warning(
                "plates",
                f"no plate read: found {analog.shape[1]} analog samples for {len(time)} frames, expected a whole "
                "number a frame.",
            )
        ]
    step = (time[1] - time[0]) / per_frame if len(time) > 1 else 1.0
    analog_time = np.arange(analog.shape[1]) * step + time[0]
    raws, numbers, notes, left_out = [], list[int](), [], dict[str, list[str]]()
    for k in range(int(used)):
        name = f"plate {k + 1}"
        try:
            raw, said = _raw(name, parameters, k, analog, (float(time[0]), step), markers, unit_m)
            check_wrench(name, analog_time, raw.force, raw.moment, "")
        except RecordingError as error:
            why = str(error).removeprefix(": ").removeprefix(f"{name} ")
            left_out.setdefault(why, []).append(name)
            continue
        raws.append(raw)
        numbers.append(k)
        notes += said
    notes = [
        *(warning("plates", f"{together(names)} left out: {why}.") for why, names in left_out.items()),
        *strange_in_words({raw.name: raw.strange for raw in raws}),
        *notes,
    ]
    raws, said = _without_shared(raws, shared_channels(parameters, numbers))
    notes += said
    turned = pulling([raw.force @ raw.surface.normal for raw in raws])
    notes += turned_in_words([raw.name for raw in raws], turned)
    raws = [
        replace(raw, force=-raw.force, moment=-raw.moment) if turn else raw
        for raw, turn in zip(raws, turned, strict=True)
    ]
    dead, said = dead_channels([raw.channels for raw in raws], analog_time, 1.0 / step, _LOOK)
    notes += said
    plates = []
    for raw in (raw.without(lost) for raw, lost in zip(raws, dead, strict=True)):
        zero = zero_of(raw.name, np.hstack([raw.force, raw.moment]), raw.surface.normal, 1.0 / step)
        notes += zero.said
        raw = replace(raw, force=raw.force - zero.wrench[:3], moment=raw.moment - zero.wrench[3:])
        plate = _at_marker_times(raw, analog_time, time, options, zero_unloaded=not zero.reads_n > 0.0)
        plates.append(replace(plate, empty_n=min(zero.reads_n, 0.0)))
    if per_frame > 1 and plates:
        how = "zero-phase FIR low-pass"
        if options.causal and len(time) > 1:
            rate = 1 / (time[1] - time[0])
            delay = CausalLowPass(rate * per_frame, 0.4 * rate).delay_s
            how = f"causal Butterworth low-pass, {1e3 * delay:.3g} ms late"
        notes.append(note("routine", f"Plates resampled from {per_frame} samples a frame ({how})."))
    return tuple(plates), notes


def _raw(
    name: str,
    parameters: Parameters,
    k: int,
    analog: Array,
    clock: tuple[float, float],
    markers: Array,
    unit_m: float,
) -> tuple[_Raw, list[Message]]:
    """Plate k, and notes; clock: time of the first sample and between samples, s.

    Raises:
        RecordingError: why it cannot be read.
    """
    start_s, step_s = clock
    types = parameters.array("FORCE_PLATFORM", "TYPE").ravel()
    found = float(types[k]) if k < len(types) else 0.0
    if found not in TYPES:
        raise RecordingError(f"found type {found:g}, expected a force plate of type 1 to {max(TYPES)}")
    corners = _slice(parameters.array("FORCE_PLATFORM", "CORNERS"), k, 12, "CORNERS").reshape(4, 3) * unit_m
    axis_x, axis_y = corners[0] - corners[1], corners[0] - corners[3]
    if not np.linalg.norm(np.cross(axis_x, axis_y)) > _LEAST_SURFACE_M2:
        raise RecordingError("its corners in the file do not span a surface")
    z = np.cross(axis_x, axis_y)
    y = np.cross(z, axis_x)
    R_LP = np.column_stack([v / np.linalg.norm(v) for v in (axis_x, y, z)])
    centre = corners.mean(axis=0)
    normal = -R_LP[:, 2]
    if np.isfinite(markers).any() and float(np.dot(np.nanmean(markers, axis=(0, 1)) - centre, normal)) < 0:
        normal = -normal  # corners listed the other way round: the person's side decides what is up
    kind = int(found)
    channels = _channels(parameters, k, TYPES[kind].channels, len(analog))
    calibration = _calibration(parameters, k, kind) if TYPES[kind].calibrated else None
    notes = []
    if TYPES[kind].calibrated and calibration is None:
        plain = TYPES[kind].uncalibrated
        words = {word for c in channels for word in parameters.texts("ANALOG", "UNITS")[c : c + 1]}
        if plain is None or any(map(volts, words)):
            raise RecordingError(f"it has type {kind} and no calibration in FORCE_PLATFORM:CAL_MATRIX")
        kind = plain
        notes.append(note("plates", f"{name} has no calibration in the file: its channels are taken as calibrated."))
    measured, said = _bridged(name, analog[channels], analog.shape[1] // len(markers))
    notes += said
    units = units_of(parameters, channels, measured, unit_m, kind, calibration is not None)
    origin = np.zeros(3)
    if kind != 1:  # which needs none
        given = _slice(parameters.array("FORCE_PLATFORM", "ORIGIN"), k, 3, "ORIGIN") * unit_m
        origin, said = checked_origin(name, given, kind, corners)
        notes += said
    signals = measured
    if (zero := zero_frames(parameters, len(markers))) is not None:
        as_it_is, _ = plate_wrench(kind, signals, origin=origin, calibration=calibration, units=units.factors)
        points = "point" in TYPES[kind].outputs
        signals, said = zeroed(name, signals, as_it_is, zero, markers, corners, normal, points=points)
        notes += said
    half_m = 0.5 * float(np.linalg.norm(corners[0] - corners[2]))
    factors = units.factors
    if TYPES[kind].outputs.count("moment") == 3:
        raw = signals if calibration is None else calibration @ signals
        factors, said = fitting_moments(name, raw, units, half_m)
        notes += said
    force, moment = plate_wrench(kind, signals, origin=origin, calibration=calibration, units=factors)
    if (ended := at_end_of_range(measured, force[:, 2])).any():
        seconds = np.count_nonzero(ended) * step_s
        notes.append(
            warning(
                "plates",
                f"{name} rests at the end of its range for {seconds:.2g} s in all, first "
                f"{np.argmax(ended) * step_s:.2f} s after the start, where it reads "
                f"{abs(force[np.argmax(ended), 2]):.0f} N: not measured there. Give it a larger range where it is "
                "recorded.",
            )
        )
        force[ended], moment[ended] = np.nan, np.nan
    hung = frozen(measured.T, force[:, 2], 1.0 / step_s)
    notes += frozen_in_words(name, np.asarray(np.arange(len(hung)) * step_s + start_s, dtype=float), hung)
    force[hung], moment[hung] = np.nan, np.nan
    force_L = force @ R_LP.T
    moment_L = moment @ R_LP.T + np.cross(centre, force_L)
    labels = parameters.texts("ANALOG", "LABELS")
    listed = [f"channel {c + 1}{''.join(f' of the file, {label!r}' for label in labels[c : c + 1])}" for c in channels]
    recorded = as_recorded(
        name, kind, signals, force[:, 2], listed, origin=origin, calibration=calibration, units=factors
    )
    return _Raw(name, force_L, moment_L, Surface(centre, normal), corners, units.strange, recorded), notes


def _channels(parameters: Parameters, k: int, wanted: int, count: int) -> list[int]:
    """Indices of the ``wanted`` channels of plate k, of ``count`` in the file."""
    listed = parameters.array("FORCE_PLATFORM", "CHANNEL")
    per_plate = listed.reshape(listed.shape[0], -1) if listed.size else listed.reshape(0, 0)
    numbers = per_plate[:wanted, k] if k < per_plate.shape[1] else np.empty(0)
    if len(numbers) < wanted or any(number not in range(1, count + 1) for number in numbers):
        said = ", ".join(f"{number:g}" for number in numbers)
        raise RecordingError(f"lists channels [{said}], expected {wanted} of 1 to {count}")
    return [int(number) - 1 for number in numbers]


def _bridged(name: str, signals: Array, per_frame: int) -> tuple[Array, list[Message]]:
    """Channels (C, N) with straight lines over gaps of less than half a marker's frame, and a note of these."""
    found, count = bridged(signals.T, (per_frame - 1) // 2)
    if not count:
        return signals, []
    text = f"{name}: gaps shorter than half a frame are bridged by straight lines (samples without a number: {count})."
    return found.T, [note("plates", text)]


def shared_channels(parameters: Parameters, plates: Sequence[int]) -> dict[str, tuple[list[str], Message]]:
    """Plate -> those of these plates (from 0) before it whose channels it lists too, and a warning: such a channel is
    not both plates'."""
    listed = parameters.array("FORCE_PLATFORM", "CHANNEL")
    types = parameters.array("FORCE_PLATFORM", "TYPE").ravel()
    found, owners = dict[str, tuple[list[str], Message]](), dict[float, str]()
    for k in plates:
        name = f"plate {k + 1}"
        own = listed.reshape(listed.shape[0], -1)[: TYPES[int(types[k])].channels, k].tolist()
        if shared := [channel for channel in own if channel in owners]:
            numbers = ", ".join(f"{channel:g}" for channel in shared)
            others = list(dict.fromkeys(owners[channel] for channel in shared))
            text = (
                f"{name} lists the analog channels of {' and '.join(others)} (numbers {numbers} in "
                "FORCE_PLATFORM:CHANNEL): at most one of these plates is measured, and none is used. Correct the list "
                "in the file."
            )
            found[name] = others, warning("plates", text)
        for channel in own:
            owners.setdefault(channel, name)
    return found


def _without_shared(raws: list[_Raw], shared: dict[str, tuple[list[str], Message]]) -> tuple[list[_Raw], list[Message]]:
    """The plates, not measured (NaN) where they share channels and are loaded, and warnings. One that is another from
    the first channel to the last is left to `without_doubles`, which knows where they lie."""
    by_name, lost, notes = {raw.name: raw for raw in raws}, set[str](), list[Message]()
    for name, (others, said) in shared.items():
        own = np.linalg.norm(by_name[name].force, axis=1)
        if not np.nanmax(own, initial=0.0) > JUDGED_N:
            continue
        if not any(_same(own, np.linalg.norm(by_name[other].force, axis=1)) for other in others):
            lost |= {name, *others}
            notes.append(said)
    return [raw.without(np.full(len(raw.force), raw.name in lost)) for raw in raws], notes


def _same(sizes: Array, others: Array) -> bool:
    return bool(np.allclose(sizes, others, rtol=1e-9, atol=0.0, equal_nan=True))


def _slice(values: Array, k: int, size: int, key: str) -> Array:
    """The ``size`` numbers of plate k in file order (first index fastest)."""
    flat = values.ravel(order="F")
    if not len(flat):
        raise RecordingError(f"the file has no FORCE_PLATFORM:{key}")
    if len(flat) < size * (k + 1):
        raise RecordingError(f"FORCE_PLATFORM:{key} has {len(flat)} numbers, it needs {size * (k + 1)}")
    return flat[size * k : size * (k + 1)]


def _calibration(parameters: Parameters, k: int, kind: int) -> Array | None:
    """Matrix (outputs, channels) of plate k, None where the file has none. A file whose plates are of several types has
    one size for all, that of the largest."""
    rows, columns = len(TYPES[kind].outputs), TYPES[kind].channels
    values = parameters.array("FORCE_PLATFORM", "CAL_MATRIX")
    by_row = parameters.text("FORCE_PLATFORM", "MATRIX_STORE").upper().replace(" ", "") == "BYROW"
    if values.ndim != 3:  # a list of numbers, or one plate's matrix
        if not values.any():
            return None
        values = _slice(values, k, rows * columns, "CAL_MATRIX").reshape((rows, columns, 1), order="F")
        k = 0
    if k >= values.shape[2] or not values[:, :, k].any():
        return None
    matrix = values[:, :, k]
    if rows != columns and matrix.shape == (columns, rows):  # type 5, the channels first
        return np.asarray(matrix.T)
    if matrix.shape[0] < rows or matrix.shape[1] < columns:
        found = " by ".join(map(str, matrix.shape))
        raise RecordingError(f"FORCE_PLATFORM:CAL_MATRIX is {found}, type {kind} needs {rows} by {columns}")
    if by_row and matrix.shape[0] != matrix.shape[1]:
        matrix = matrix.ravel(order="F").reshape(matrix.shape)
    elif by_row:
        matrix = matrix.T
    return np.asarray(matrix[:rows, :columns])


def _at_marker_times(raw: _Raw, time_in: Array, time: Array, options: ReadOptions, *, zero_unloaded: bool) -> Plate:
    wrench = np.hstack([raw.force, raw.moment])
    missing = np.asarray(np.isnan(wrench).any(axis=1))
    wrench = filled(wrench, missing)
    rate = 1 / (time_in[1] - time_in[0]) if len(time_in) > 1 else np.inf
    if options.plate_filter_hz is not None and len(time_in) > 1:
        wrench = low_pass(wrench, rate, options.plate_filter_hz, causal=options.causal)
    wrench = resample(wrench, time_in, time, causal=options.causal).copy()
    rate_out = 1 / (time[1] - time[0]) if len(time) > 1 else np.inf
    wrench[touched(missing, time_in, time, reach_s(rate, rate_out, options.plate_filter_hz))] = np.nan
    threshold = UNLOADED_N if options.force_threshold_n is None else options.force_threshold_n
    return plate_from_wrench(
        raw.name,
        wrench[:, :3],
        wrench[:, 3:],
        raw.surface,
        corners=raw.corners,
        threshold_n=threshold,
        zero_unloaded=zero_unloaded or options.force_threshold_n is not None,
    )
