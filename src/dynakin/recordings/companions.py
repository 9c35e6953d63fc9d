"""What lies in a recording's folder and belongs to it: its ground forces, the same person standing.

By names, then by what is in the files. It is offered, never taken: a name is no proof.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path

import numpy as np
import numpy.typing as npt

from dynakin.errors import DynakinError
from dynakin.recordings.landmarks import plain_name
from dynakin.recordings.read import READERS, read
from dynakin.recordings.recording import Recording
from dynakin.recordings.standing import standing_window

STANDING_WORDS = frozenset({"static", "standing", "stand", "stance", "cal", "calibration", "pose", "anat", "neutral"})
_FORCE_WORDS = frozenset({"grf", "force", "forces", "ground", "reaction", "plates", "fp", "analog"})
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+")
_TABLES = (".mot", ".sto")
_MOST_FILES, _LARGEST_BYTES = 8, 50_000_000
"""Files that are opened to look for somebody who stands, and how large: `dynakin check` is to answer within seconds."""
_STILL = 0.6
"""Part of a recording in which the person stands still, from which it is one of somebody standing."""
_SAME_M = 0.012
"""Median difference of distances between markers that move as one, up to which two recordings show the same person and
markers: 0.7 to 7.5 mm in the 15 pairs that we have of a trial and its standing one, 20 mm and more of other people."""
_RIGID_M = 0.006
"""Standard deviation of a distance over a trial, up to which its two markers move as one."""
_NEAR_M = 0.3
"""How far apart such markers are at most: of those on two segments that hardly move, a posture would be compared."""
_PAIRS = 6
_COMMON = 0.5
"""Part of the markers of the one with fewer that the other has."""
_SAME_PLACE_M = 1e-5
"""How far apart the markers of a trial and of its copy lie at most: files round to 1e-5 m or less."""
_FRAMES = 1000  # spread over a trial, enough for these


def companion_forces(trial: Path) -> Path | None:
    """A table of ground forces in the trial's folder whose name is the trial's but for words such as "grf"."""
    own = _words(trial)
    found = []
    for path in _others(trial, _TABLES):
        theirs = _words(path) - _FORCE_WORDS
        if _words(path) & _FORCE_WORDS and theirs and theirs <= own and not (own - theirs) & STANDING_WORDS:
            found.append((len(theirs), path))
    return max(found, key=lambda pair: (pair[0], pair[1].name))[1] if found else None


def companion_static(trial: Path, recording: Recording) -> Path | None:
    """A recording in the trial's folder of the same person, with the same markers, who stands; None where the trial is
    one itself."""
    if _words(trial) & STANDING_WORDS or _still(recording) > _STILL:
        return None
    others = sorted(_others(trial, tuple(READERS)), key=lambda path: not _words(path) & STANDING_WORDS)
    found, named = [], False
    for path in [path for path in others if path.stat().st_size <= _LARGEST_BYTES][:_MOST_FILES]:
        says = bool(_words(path) & STANDING_WORDS)
        if named and not says:
            break
        try:
            other = read(path)
        except DynakinError:  # somebody else's file
            continue
        apart = _apart_m(recording, other)
        if apart is not None and apart < _SAME_M and (says or _still(other) > _STILL):
            found.append((apart, path))
            named = named or says
    return min(found)[1] if found else None


def _words(path: Path) -> set[str]:
    return {word.casefold() for word in _WORD.findall(path.stem)}


def _others(trial: Path, suffixes: tuple[str, ...]) -> Iterator[Path]:
    try:
        inside = sorted(trial.parent.iterdir())
    except OSError:
        return
    for path in inside:
        if path.suffix.casefold() in suffixes and path.is_file() and path.name != trial.name:
            yield path


def _still(recording: Recording) -> float:
    window = standing_window(recording)
    return 0.0 if window is None else (window.stop - window.start) / recording.n_frames


def another_person(trial: Recording, other: Recording) -> str:
    """What shows that a recording is of somebody else, or of markers put on anew; "" where nothing does."""
    common = _common(trial, other)
    fewer = min(len(trial.marker_names), len(other.marker_names))
    if len(common) < _COMMON * fewer:
        return (
            f"only {len(common)} markers are in both {trial.name} ({len(trial.marker_names)}) and {other.name} "
            f"({len(other.marker_names)}): they share no marker set, and nothing shows that it is the same person"
        )
    apart = _apart_m(trial, other)
    if apart is None or apart < _SAME_M:
        return ""
    return (
        f"distances between markers that move as one differ by {1e3 * apart:.0f} mm from those in {other.name} "
        f"(median; of one person by {1e3 * _SAME_M:.0f} mm at most): another person, or markers put on anew"
    )


def copies_among(recordings: Sequence[Recording]) -> tuple[Recording, Recording] | None:
    """Two recordings whose markers are the same, as no two movements are; None where there are none."""
    for one, other in combinations(recordings, 2):
        alike = one.marker_names == other.marker_names and one.markers.shape == other.markers.shape
        if alike and np.allclose(one.markers, other.markers, rtol=0.0, atol=_SAME_PLACE_M, equal_nan=True):
            return one, other
    return None


def of_most(trials: Sequence[Recording], static: Recording | None = None) -> Recording:
    """The recording whose person and markers most of the trials show, in whatever order they come; of several the
    standing one, then the first."""
    those = [static, *trials] if static is not None else list(trials)
    return max(those, key=lambda one: sum(not another_person(trial, one) for trial in trials))


@contextmanager
def told_of_the_static(recording: Recording, static: Recording | None) -> Iterator[None]:
    """A refusal says, too, that the standing trial is of somebody else, where it looks so.

    Raises:
        DynakinError: as what is done in it does.
    """
    try:
        yield
    except DynakinError as refusal:
        other = "" if static is None else another_person(recording, static)
        if static is None or not other:
            raise
        text = f"{refusal.message}. Of the standing trial {static.path or static.name}: {other}"
        raise refusal.reworded(text) from None


def _common(trial: Recording, other: Recording) -> list[tuple[str, str]]:
    """Names of the markers that are in both."""
    names = {plain_name(name): name for name in other.marker_names}
    return [(name, names[plain_name(name)]) for name in trial.marker_names if plain_name(name) in names]


def _apart_m(trial: Recording, other: Recording) -> float | None:
    """Median difference of the distances between markers that move as one in the trial; None of too few."""
    every = -(-trial.n_frames // _FRAMES)
    common = _common(trial, other)
    places = np.array([trial.marker(name)[::every] for name, _ in common])  # (M, T, 3)
    apart = []
    for k, (_, a) in enumerate(common):
        distances = np.linalg.norm(places[k + 1 :] - places[k], axis=2)
        for j in np.flatnonzero(_move_as_one(distances)):
            here, there = distances[j], np.linalg.norm(other.marker(a) - other.marker(common[k + 1 + j][1]), axis=1)
            if np.isfinite(there).any():
                apart.append(abs(float(np.nanmedian(here) - np.nanmedian(there))))
    return float(np.median(apart)) if len(apart) >= _PAIRS else None


def _move_as_one(distances: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """(K,) whether two markers hardly move against each other and are near, of distances (K, T) m, in most frames."""
    seen = np.isfinite(distances)
    n = np.maximum(seen.sum(axis=1), 1)
    mean = np.where(seen, distances, 0.0).sum(axis=1) / n
    variance = (np.where(seen, distances - mean[:, None], 0.0) ** 2).sum(axis=1) / n
    return np.asarray((n > 0.5 * seen.shape[1]) & (variance < _RIGID_M**2) & (mean < _NEAR_M))
