"""Ground forces from an OpenSim table, brought to the times of the markers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, Flags, runs
from dynakin.errors import RecordingError
from dynakin.messages import Message, note, warning
from dynakin.recordings.formats.grf_columns import PlateColumns, group_columns, other_unit, parse_column
from dynakin.recordings.formats.mot import Table
from dynakin.recordings.limits import check_wrench
from dynakin.recordings.plates.axes import pulling, turned_in_words
from dynakin.recordings.plates.loads import without_wrench
from dynakin.recordings.plates.pressure import Surface, main_axis, main_push, plate_from_wrench
from dynakin.recordings.plates.stuck import frozen, frozen_in_words, without_frames
from dynakin.recordings.plates.zero import Zero, zero_of
from dynakin.recordings.pushes import JUDGED_N, UNLOADED_N
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.resampling import UNEVEN, ReadOptions, low_pass, reach_s, resample, same_times, touched
from dynakin.recordings.times import rate_of, settled_times, spans, step_of

_MIN_RATE_RATIO = 0.99
_LEAST_COVER, _END_S = 0.5, 0.1
"""A table of less than this part of the frames is another trial's. An export that ends some rows before the markers do
needs nothing done; more is warned of."""
_GAP, _NAMED = 1.5, 3  # steps between rows from which on some are missing; gaps that are named


def plates_from_table(table: Table) -> tuple[tuple[Plate, ...], tuple[Message, ...]]:
    """The plates of a ground-force table (N, m, N m; ground-on-person, laboratory frame) at the table's own
    times.

    The table gives force F, point of application p and free moment tau; the wrench about the laboratory
    origin is (F, p x F + tau). Force and moment are as in the file; the centre of pressure is NaN where the
    force stays below 10 N, as the file's point means nothing there.

    Returns:
        the plates, and notes (columns that were not understood, plates without free moment).

    Raises:
        RecordingError: no ground-force columns, or some of a plate's are missing.
    """
    groups, others = group_columns(table.names)
    for name in table.names:
        if (unit := other_unit(name)) is not None:
            raise RecordingError(
                f"{table.path}: column {name!r} is in {unit!r}, expected forces in N, points in m and moments in N m"
            )
    if not groups:
        raise RecordingError(
            f"{table.path}: no ground force columns, expected names such as ground_force_vx, "
            "1_ground_force_vx or "
            f"FP1_vx; it has {', '.join(table.names[:6])}{', ...' if len(table.names) > 6 else ''}"
        )
    notes = list(table.notes)
    if others:
        notes.append(note("recording", f"{table.path.name}: columns not used: {', '.join(others)}."))
    plates = []
    for group in groups:
        plate, said = _plate(group, table)
        plates.append(plate)
        notes += said
    plates, turned = _one_sign(plates)
    return tuple(plates), (*notes, *turned)


def _one_sign(plates: list[Plate]) -> tuple[list[Plate], list[Message]]:
    """The plates with those turned that pull while others push, along the axis that carries the most; all of them the
    same way is left to the check, which knows what is up."""
    along = main_axis(plates)
    turned = pulling([plate.force[:, along] for plate in plates])
    if turned.all():
        return plates, []
    found = [
        replace(plate, force=-plate.force, moment=-plate.moment, free_moment=-plate.free_moment) if turn else plate
        for plate, turn in zip(plates, turned, strict=True)
    ]
    return found, turned_in_words([plate.name for plate in plates], turned)


def _plate(group: PlateColumns, table: Table) -> tuple[Plate, list[Message]]:
    name = f"plate {group.plate}".strip()
    notes = []
    for quantity in ("force", "point"):
        missing = [axis for axis in "xyz" if axis not in group.columns.get(quantity, {})]
        if missing:
            word = {"force": "vx, vy, vz", "point": "px, py, pz"}[quantity]
            raise RecordingError(
                f"{table.path}: {name} has no {quantity} {', '.join(missing)}, expected columns {word}"
            )
    torque = group.columns.get("torque", {})
    if not torque:
        notes.append(note("recording", f"{name} has no free moment columns: 0 taken."))
    force, point = (_three(table, group.columns[quantity]) for quantity in ("force", "point"))
    free = _three(table, torque) if torque else np.zeros_like(force)
    point = _without_blanks(point, force)
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused
        moment = np.cross(point, force) + free
    lost = np.isnan(moment).any(axis=1) & ~np.isnan(np.hstack([point, force, free])).any(axis=1)
    moment[lost] = np.inf
    check_wrench(name, table.time, force, moment, str(table.path))
    unloaded = np.linalg.norm(force, axis=1) < UNLOADED_N
    cop = np.where(unloaded[:, None], np.nan, point)
    return Plate(name, force, moment, cop, free), notes


def _without_blanks(point: Array, force: Array) -> Array:
    """Points of application (T, 3), where a plate that is hardly loaded has none: where it was pressed last or is next,
    as programs blank the point of a force that is too small to show it, or write 0 (a plate's zero would then act at
    the laboratory's origin); anywhere of no force."""
    blank = np.isnan(point).any(axis=1) | (point == 0.0).all(axis=1)
    known = np.flatnonzero(~blank & (np.linalg.norm(force, axis=1) > UNLOADED_N))
    faint = np.flatnonzero(blank & (np.linalg.norm(force, axis=1) < JUDGED_N))
    found = point.copy()
    if len(known):
        after = np.clip(np.searchsorted(known, faint), 1, len(known) - 1) if len(known) > 1 else np.zeros_like(faint)
        before = np.maximum(after - 1, 0)
        nearer = np.where(faint - known[before] <= known[after] - faint, known[before], known[after])
        found[faint] = point[nearer]
    else:
        found[faint[(force[faint] == 0.0).all(axis=1)]] = 0.0
    return found


def _three(table: Table, axes: dict[str, str]) -> Array:
    # A free moment acts about the vertical only, and some files leave its two zero columns out.
    zero = np.zeros(len(table.time))
    return np.column_stack([table.column(axes[axis]) if axis in axes else zero for axis in "xyz"])


def attach_forces(recording: Recording, table: Table, options: ReadOptions) -> Recording:
    """The recording with the plates of a ground-force table, at the times of its markers.

    What a plate reads steadily below 0 while nobody is on it is taken off, as of a C3D's. Else a table at the markers'
    times passes through untouched (unless options ask for a filter or threshold); one at a higher rate that covers the
    markers is resampled: the wrench about the laboratory origin, not the centre of pressure, which jumps at each
    contact.

    Frames beyond its rows are not measured (NaN).

    Raises:
        RecordingError: the table has rows for less than half of the markers' frames, or is sampled more slowly; the
            message names both lengths and ranges.
    """
    columns = [k for k, name in enumerate(table.names) if parse_column(name)]
    time, stamps = settled_times(table.time, table.values[:, columns])
    table, lacking = _at_frames(replace(table, time=time), recording)
    plates, notes = plates_from_table(table)
    notes += tuple(said.of(table.path.name) for said in stamps) + lacking
    if recording.plates:
        text = f"{table.path.name} replaces the {len(recording.plates)} plates of {recording.name}."
        notes += (note("recording", text),)
    untouched = same_times(table.time, recording.time)
    as_it_is = untouched and options.plate_filter_hz is None and options.force_threshold_n is None
    hung = [_frozen(plate, table.time) for plate in plates]
    up, rate = main_push(plates), rate_of(table.time)
    zeros = [
        zero_of(plate.name, np.where(lost[:, None], np.nan, plate.wrench), up, rate, emptied=not as_it_is)
        for plate, lost in zip(plates, hung, strict=True)
    ]
    plates = tuple(
        without_wrench(plate, zero.wrench, up) if zero.wrench.any() else plate
        for plate, zero in zip(plates, zeros, strict=True)
    )
    for plate, lost in zip(plates, hung, strict=True):
        notes += tuple(frozen_in_words(plate.name, table.time, lost))
    covered: Flags = np.ones(recording.n_frames, dtype=bool)
    if not untouched:
        _refuse_gaps(table)
        covered = _covered(recording, table)
        notes += _uncovered_in_words(recording, table, covered)
        first, last = table.time[0], table.time[-1]
        text = (
            f"{table.path.name}: {len(table.time)} rows from {first:g} s to {last:g} s brought to the "
            f"{recording.n_frames} marker frames ({'causal' if options.causal else 'zero-phase'} filter)."
        )
        notes += (note("routine", text),)
    notes += tuple(said for zero in zeros for said in zero.said)
    if as_it_is:
        return recording.with_plates(tuple(map(without_frames, plates, hung)), notes)
    time = recording.time[covered]
    reach = reach_s(rate_of(table.time), recording.rate, options.plate_filter_hz)
    found = [
        _beyond_rows(
            without_frames(_resampled(plate, zero, table, time, options), touched(lost, table.time, time, reach)),
            covered,
        )
        for plate, zero, lost in zip(plates, zeros, hung, strict=True)
    ]
    return recording.with_plates(tuple(found), notes)


def _at_frames(table: Table, recording: Recording) -> tuple[Table, tuple[Message, ...]]:
    """A table at the markers' own rate that lacks rows with these blank (NaN), at the markers' times, and what there is
    to say of it; any other as it is."""
    t, m = table.time, recording.time
    step = step_of(m)
    if len(m) < 2 or not len(_gaps(t)) or abs(step_of(t) / step - 1.0) > UNEVEN or same_times(t, m):
        return table, ()
    after = np.clip(np.searchsorted(t, m), 1, len(t) - 1)
    row = np.where(m - t[after - 1] < t[after] - m, after - 1, after)
    there: Flags = np.asarray(np.abs(t[row] - m) < UNEVEN * step)
    if there.mean() < _LEAST_COVER:
        return table, ()
    values = np.where(there[:, None], table.values[row], np.nan)
    if there.all():
        return replace(table, time=m, values=values), ()
    count = np.count_nonzero(~there)
    text = (
        f"the table {table.path.name} has no row for {count} of {len(m)} frames ({spans(m, runs(~there), _NAMED)}): "
        "the plates are not measured there."
    )
    few = count <= _END_S * recording.rate
    said = note("recording", text) if few else warning("plates", f"{text} Export the forces of every frame.")
    return replace(table, time=m, values=values), (said,)


def _gaps(time: Array) -> npt.NDArray[np.intp]:
    """Rows after which others are missing."""
    return np.flatnonzero(np.diff(time) > _GAP * step_of(time)) if len(time) > 2 else np.zeros(0, dtype=np.intp)


def _refuse_gaps(table: Table) -> None:
    """A filter would take what lies about a gap for one movement."""
    for k in _gaps(table.time)[:1]:
        first, last, rate = table.time[k], table.time[k + 1], rate_of(table.time)
        raise RecordingError(
            f"{table.path}: no row between {first:g} s and {last:g} s, expected one every {1.0 / rate:.4g} s: forces "
            "that are to be brought to the markers' times must have no gap; export them anew"
        )


def _frozen(plate: Plate, time: Array) -> Flags:
    """(N,) rows of a plate that repeat the one before, while it is loaded along the axis that carries the most."""
    rows = plate.wrench
    return frozen(rows, plate.force[:, main_axis([plate])], rate_of(time) if len(time) > 1 else 1.0)


def _covered(recording: Recording, table: Table) -> Flags:
    """(T,) frames of the recording for which the table has rows."""
    t, m = table.time, recording.time
    step = step_of(m) if len(m) > 1 else 0.0
    rate = rate_of(t) if len(t) > 1 else 0.0
    slow = len(m) > 1 and rate < _MIN_RATE_RATIO * recording.rate
    covered: Flags = np.asarray((m >= t[0] - 0.5 * step) & (m <= t[-1] + 0.5 * step))
    if slow or covered.mean() < _LEAST_COVER:
        what = "are sampled more slowly than" if slow else "do not cover"
        raise RecordingError(
            f"{table.path}: forces {what} the markers: "
            f"{len(t)} rows from {t[0]:g} s to {t[-1]:g} s at {rate:.4g} Hz, "
            f"expected to cover {len(m)} frames from {m[0]:g} s to {m[-1]:g} s at {recording.rate:.4g} Hz"
        )
    return covered


def _uncovered_in_words(recording: Recording, table: Table, covered: Flags) -> tuple[Message, ...]:
    """What there is to say of frames without rows: a warning where they are many."""
    if covered.all():
        return ()
    text = (
        f"the table {table.path.name} has forces from {table.time[0]:g} s to {table.time[-1]:g} s, markers go from "
        f"{recording.time[0]:g} s to {recording.time[-1]:g} s: in {np.count_nonzero(~covered)} of {len(covered)} "
        "frames the plates are not measured."
    )
    if np.count_nonzero(~covered) <= _END_S * recording.rate:
        return (note("recording", text),)
    return (warning("plates", f"{text} Export the forces of the whole trial."),)


def _beyond_rows(plate: Plate, covered: Flags) -> Plate:
    """A plate of the covered frames, for all (T,): NaN in the others."""
    if covered.all():
        return plate

    def of(values: Array) -> Array:
        every = np.full((len(covered), 3), np.nan)
        every[covered] = values
        return every

    values = (plate.force, plate.moment, plate.cop, plate.free_moment)
    force, moment, cop, free = map(of, values)
    return replace(plate, force=force, moment=moment, cop=cop, free_moment=free)


def _resampled(plate: Plate, zero: Zero, table: Table, time: Array, options: ReadOptions) -> Plate:
    wrench = plate.wrench
    for row in np.flatnonzero(np.isnan(wrench).any(axis=1))[:1]:
        raise RecordingError(
            f"{table.path}: {plate.name} has no force at {table.time[row]:g} s, cannot be resampled or filtered"
        )
    if options.plate_filter_hz is not None:
        rate = rate_of(table.time)
        wrench = low_pass(wrench, rate, options.plate_filter_hz, causal=options.causal)
    try:
        wrench = resample(wrench, table.time, time, causal=options.causal)
    except RecordingError as error:
        raise error.reworded(f"{table.path}: {error.message}") from None
    threshold = UNLOADED_N if options.force_threshold_n is None else options.force_threshold_n
    surface = _surface(plate)
    if surface is None:  # never loaded
        wrench[np.linalg.norm(wrench[:, :3], axis=1) < threshold] = 0.0
        idle = plate.frames(np.zeros(len(time), dtype=int))
        return replace(idle, force=wrench[:, :3], moment=wrench[:, 3:])
    return plate_from_wrench(
        plate.name,
        wrench[:, :3],
        wrench[:, 3:],
        surface,
        corners=None,
        threshold_n=threshold,
        zero_unloaded=options.force_threshold_n is not None or not zero.reads_n or zero.pulls,
    )


def _surface(plate: Plate) -> Surface | None:
    """The plane of the points of application: across the axis that carries most of the force, at their
    height."""
    loaded = ~np.isnan(plate.cop).any(axis=1)
    if not loaded.any():
        return None
    mean = plate.force[loaded].mean(axis=0)
    axis = int(np.argmax(np.abs(mean)))
    normal = np.zeros(3)
    # Towards the force as the file signs it: a file with person-on-ground forces is found by the check, not
    # hidden here.
    normal[axis] = np.sign(mean[axis])
    return Surface(np.median(plate.cop[loaded], axis=0), normal)
