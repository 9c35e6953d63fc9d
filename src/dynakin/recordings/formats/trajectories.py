"""What every reader does with marker trajectories before they become a Recording."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, by_neighbours
from dynakin.errors import RecordingError
from dynakin.messages import Message, note, warning
from dynakin.recordings.formats.filled import MOVES_M_S, held, repeated, straight
from dynakin.recordings.formats.jumps import without_jumps
from dynakin.recordings.times import rate_of, step_of
from dynakin.units import length_factor

_METRES_BELOW, _CENTIMETRES_BELOW = 5.0, 300.0
"""Extent of the markers in a frame up to which it is one in m, and in cm: of a person 0.3 to 2.6 m, of a foot alone
0.3 m. Only a foot in mm (300) and a person with arms raised in cm (260) come near each other."""
_SAME_M = 3e-3
"""Distance up to which two trajectories are one marker's, rounded or filtered otherwise: balls of 6 mm touch there."""
_MOST_REPEATED = 0.2
"""Part of the frames that may repeat others: more is another rate, written as this one."""
_EVEN = 0.2
"""Part of a step by which times may scatter for a jump of all markers to be one of frames."""
_TWICE, _ALL_ALIKE = 1.6, 0.3
"""Times as far as expected from which frames are missing between two, and part of that by which markers may differ: no
recording of ours has more than 1.13 where somebody moves, and a frame that is taken out gives 1.97 to 2.06."""
_ENOUGH = 5  # markers
_FAR, _FAR_M = 10.0, 2.0
"""Median deviations of all markers' coordinates, and metres, from their median beyond which nobody is."""
_MOSTLY = 2.0
"""How many times as often as any other of its name a marker is seen to be the one that is meant."""


def length_unit(word: str, raw: Array) -> tuple[float, Literal["mm", "m"], list[Message]]:
    """Metres per unit, the unit to write back in, and notes.

    Args:
        word: the file's; where it is none that is known, the size of a person decides.
        raw: (T, M, 3) in that unit, NaN where missing.
    """
    factor = length_factor(word)
    notes = []
    if factor is None:
        points = np.where((raw == 0.0).all(axis=2, keepdims=True), np.nan, raw)
        low = np.where(np.isnan(points), np.inf, points).min(axis=1, initial=np.inf)
        high = np.where(np.isnan(points), -np.inf, points).max(axis=1, initial=-np.inf)
        with np.errstate(invalid="ignore", over="ignore"):
            extent = (high - low).max(axis=1, initial=-np.inf)
        span = float(np.median(extent[np.isfinite(extent)])) if np.isfinite(extent).any() else 0.0
        factor = 1.0 if span < _METRES_BELOW else 1e-2 if span < _CENTIMETRES_BELOW else 1e-3
        found = f"The length unit {word!r} is not known" if word else "The file names no length unit"
        word = {1.0: "m", 1e-2: "cm", 1e-3: "mm"}[factor]
        notes.append(note("recording", f"{found}: {word} taken, as the markers span {span:.4g} of them."))
    if factor not in (1.0, 1e-3):
        notes.append(note("recording", f"The file's unit of length is {word}; markers are written back in metres."))
    return factor, ("mm" if factor == 1e-3 else "m"), notes


def distinct_names(names: tuple[str, ...], markers: Array) -> tuple[tuple[str, ...], Array, list[Message]]:
    """Names that are each used once, their markers (T, K, 3) m, and notes on those that were used more often.

    Of markers of one name, those that are never seen, or where the other is, go; those that are never seen together
    are one. Two that are left are two markers, and only one is what the name says: the one that is seen most of the
    time if the others are not seen half as often, else none. Who is not meant is called ``NAME (2)``, which no marker
    set knows, so that nothing is matched to the wrong one.
    """
    counts = Counter(names)
    spots: dict[str, list[int]] = {name: [k for k, n in enumerate(names) if n == name] for name in counts}
    new_names, columns, notes = [], [], []
    for name, doubled in spots.items():
        if len(doubled) == 1:
            new_names.append(name)
            columns.append(markers[:, doubled[0]])
            continue
        places = markers[:, doubled]
        places = np.where(
            (places == 0.0).all(axis=2, keepdims=True) | np.isnan(places).any(2, keepdims=True), np.nan, places
        )
        kept = _distinct(list(places.transpose(1, 0, 2)))
        if len(kept) == 1:
            labels = [name]
            notes.append(
                note(
                    "recording",
                    f"Marker {name!r} is in the file {len(doubled)} times, never at different places: taken as one.",
                )
            )
        else:
            labels = _labels(name, kept, set(counts))
            who = " and ".join(repr(label) for label in sorted(labels))
            notes.append(
                warning(
                    "recording", f"marker {name!r} is in the file {len(doubled)} times, at different places: {who}."
                )
            )
        new_names += labels
        columns += kept
    return tuple(new_names), np.stack(columns, axis=1) if columns else markers, notes


def _distinct(places: list[Array]) -> list[Array]:
    """Of trajectories (T, 3) of one name: those at different places at one time, fragments joined."""
    kept: list[Array] = []
    for place in places:
        for k, other in enumerate(kept):
            both = np.isfinite(place[:, 0]) & np.isfinite(other[:, 0])
            if (np.linalg.norm(place[both] - other[both], axis=1) <= _SAME_M).all():
                kept[k] = np.where(np.isnan(other), place, other)
                break
        else:
            kept.append(place)
    return kept


def _labels(name: str, places: list[Array], taken: set[str]) -> list[str]:
    seen = [int(np.isfinite(place[:, 0]).sum()) for place in places]
    most = int(np.argmax(seen))
    sure = all(seen[most] >= _MOSTLY * n for k, n in enumerate(seen) if k != most)
    labels, number = [], 1
    for k in range(len(places)):
        if sure and k == most:
            labels.append(name)
            continue
        number += sure
        while f"{name} ({number})" in taken:
            number += 1
        labels.append(f"{name} ({number})")
        number += not sure
    return labels


def clean_markers(names: tuple[str, ...], markers: Array, time: Array, path: Path) -> tuple[Array, list[Message]]:
    """Markers (T, M, 3) without what was never measured: a point that has any coordinate missing, or is exactly 0, 0,
    0, is NaN as a whole, and so are frames that repeat the one before, gaps that were filled and markers that jumped
    off their place.

    Several systems export an occluded marker as the laboratory's origin; no marker is ever there to the last
    bit.

    Raises:
        RecordingError: so many frames repeat others that the rate is another.
    """
    markers = markers.copy()  # infinite stays: `Recording` refuses it
    notes: list[Message] = []
    origin = (markers == 0.0).all(axis=2)
    if origin.any():
        who = f"{np.count_nonzero(origin)} samples: {_whose(names, origin)}"
        notes.append(note("recording", f"Markers at exactly 0, 0, 0 taken as missing ({who})."))
    markers, said = _without_placeholders(names, markers)
    notes += said
    markers[origin | np.isnan(markers).any(axis=2)] = np.nan
    rate = rate_of(time)
    markers, said = _without_filled(names, markers, time, rate, path)
    notes += said
    notes += _left_out(markers, time)
    markers, said = without_jumps(names, markers, time, rate)
    notes += said
    missing: npt.NDArray[np.bool_] = (
        np.isnan(markers[:, :, 0]) if markers.size else np.zeros(markers.shape[:2], dtype=bool)
    )
    if missing.any():
        share = ", ".join(
            f"{name} {100 * part:.3g} %" for name, part in zip(names, missing.mean(axis=0), strict=True) if part
        )
        notes.append(note("routine", f"Missing for part of the recording: {share}."))
    if len(names) and missing.all(axis=1).any():
        empty = np.flatnonzero(missing.all(axis=1))
        notes.append(
            note("recording", f"{len(empty)} frames have no marker at all, the first is frame {empty[0] + 1}.")
        )
    return markers, notes


def _whose(names: tuple[str, ...], samples: npt.NDArray[np.bool_]) -> str:
    """Markers of which there are some of these samples (T, M)."""
    return ", ".join(names[m] for m in np.flatnonzero(samples.any(axis=0)))


def _without_filled(
    names: tuple[str, ...], markers: Array, time: Array, rate: float, path: Path
) -> tuple[Array, list[Message]]:
    """Without what a system filled in instead of measuring it.

    Raises:
        RecordingError: so many frames repeat others that the rate is another.
    """
    again, lines, stays = repeated(markers, rate), straight(markers, rate), held(markers, rate)
    notes: list[Message] = []
    if again.any():
        first = int(np.argmax(again))
        text = (
            f"frames repeat the one before to the last digit while the person moves: {np.count_nonzero(again)} of "
            f"{len(markers)}, the first is frame {first + 1} ({time[first]:.3f} s)"
        )
        if again.mean() > _MOST_REPEATED:
            raise RecordingError(
                f"{path}: {text}; expected each frame once, at the rate of the cameras "
                f"({rate * (1 - again.mean()):.0f} Hz?): export it so"
            )
        text += ". They are taken as missing; export the recording without filled frames."
        notes.append(warning("recording", text))
    stays &= ~again[:, None]
    for filled, how in ((lines, "by straight lines"), (stays, "by the last place before them, to the last digit")):
        if filled.any():
            first = int(np.argmax(filled.any(axis=1)))
            text = (
                f"gaps were filled {how}: {_whose(names, filled)}, first at {time[first]:.3f} s. They are taken as "
                f"missing ({np.count_nonzero(filled)} samples); export the recording without filled gaps."
            )
            notes.append(warning("recording", text))
    return np.where((again[:, None] | lines | stays)[:, :, None], np.nan, markers), notes


def _without_placeholders(names: tuple[str, ...], markers: Array) -> tuple[Array, list[Message]]:
    """Without what a program wrote for a missing marker (-9999.99 thrice, say): a place far outside the volume, the
    same to the last digit in several samples of markers that are elsewhere else, or in all three coordinates."""
    flat = markers.reshape(-1, 3)
    known = np.isfinite(flat).all(axis=1)
    if np.count_nonzero(known) < 2:
        return markers, []
    middle = np.median(flat[known], axis=0)
    spread = np.median(np.abs(flat[known] - middle), axis=0)
    far: npt.NDArray[np.bool_] = np.array(known, dtype=bool)
    far[known] = (np.abs(flat[known] - middle) > _FAR * spread + _FAR_M).any(axis=1)
    if not far.any():
        return markers, []
    places, which, counts = np.unique(flat[far], axis=0, return_inverse=True, return_counts=True)
    mostly = far.reshape(markers.shape[:2]).mean(axis=0) < 1.0
    alike = (places == places[:, :1]).all(axis=1)
    held = (counts > 1)[which.ravel()] & np.broadcast_to(mostly, markers.shape[:2]).ravel()[far]
    hit = np.zeros(len(flat), dtype=bool)
    hit[far] = held | alike[which.ravel()]
    if not hit.any():
        return markers, []
    found = hit.reshape(markers.shape[:2])
    where = ", ".join(f"{value:.6g}" for value in flat[np.argmax(hit)])
    text = (
        f"Markers at exactly {where} m, far outside the volume, taken as missing ({int(hit.sum())} samples: "
        f"{_whose(names, found)})."
    )
    return np.where(found[:, :, None], np.nan, markers), [note("recording", text)]


def _left_out(markers: Array, time: Array) -> list[Message]:
    """A warning of frames that were dropped and the times numbered on: all markers move between two frames as far as in
    several, by a cubic through their steps before and after. Where the times are uneven, or scatter, these are not
    numbered on."""
    if len(time) < 6:
        return []
    dt = np.diff(time)
    usual = step_of(time)
    even = np.lib.stride_tricks.sliding_window_view(np.abs(dt - usual) < _EVEN * usual, 5).all(axis=1)
    step = np.diff(markers, axis=0) / usual
    expected, found = by_neighbours(step), step[2:-2]
    both = np.isfinite(found) & np.isfinite(expected)
    found, expected = np.where(both, found, 0.0), np.where(both, expected, 0.0)
    seen = np.maximum(both.any(axis=2).sum(axis=1), 1)
    size = np.square(expected).sum(axis=(1, 2))
    times = (found * expected).sum(axis=(1, 2)) / np.maximum(size, 1e-12)
    apart = np.sqrt(np.square(found - times[:, None, None] * expected).sum(axis=(1, 2)) / np.maximum(size, 1e-12))
    moves = np.sqrt(size / seen) > MOVES_M_S
    jumps = np.flatnonzero(even & moves & (seen >= _ENOUGH) & (times > _TWICE) & (apart < _ALL_ALIKE * times))
    if not len(jumps):
        return []
    listed = [f"{k + 3} and {k + 4} ({time[k + 2]:.3f} s, as in {times[k]:.0f})" for k in jumps[:4]]
    more = f", and at {len(jumps) - 4} more places" if len(jumps) > 4 else ""
    return [
        warning(
            "recording",
            "frames were left out and the times numbered on, because all markers move as far as in several frames "
            f"between frames {', '.join(listed)}{more}. Later times are wrong against the forces; export the recording "
            "with every frame.",
        )
    ]


def timing_notes(time: Array, rate_in_header: float | None = None) -> list[Message]:
    """Sentences on a rate that contradicts the header and on uneven time steps."""
    if len(time) < 3:
        return []
    notes: list[Message] = []
    step = np.diff(time)
    median, rate = step_of(time), rate_of(time)
    if rate_in_header and abs(rate_in_header / rate - 1) > 0.01:
        notes.append(
            note(
                "recording",
                f"The header says {rate_in_header:g} Hz, the time column {rate:.4g} Hz: the latter is used.",
            )
        )
    if np.abs(step / median - 1).max() > 0.5:
        k = int(np.argmax(np.abs(step / median - 1)))
        notes.append(
            note(
                "recording", f"Time steps are uneven: {step[k]:.4g} s after {time[k]:.6g} s, {median:.4g} s elsewhere."
            )
        )
    return notes
