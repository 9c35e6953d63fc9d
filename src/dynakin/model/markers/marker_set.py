"""Finds the markers of a set in a recording, with any prefix, case, dots or underscores in its names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np

from dynakin.errors import ModelError
from dynakin.files import is_file
from dynakin.model.markers.schema import Marker, MarkerSetFile
from dynakin.recordings.landmarks import FacingPairs, plain_name
from dynakin.recordings.recording import Recording
from dynakin.settings.strict import nearest, read_toml, validate

MarkerKey = tuple[str, str]
"""(name of the marker in its set, "right", "left" or "centre")."""

_FOLDER = resources.files("dynakin.model") / "markers"


def available_marker_sets() -> list[str]:
    """Names of the built-in marker sets."""
    return sorted(entry.name.removesuffix(".toml") for entry in _FOLDER.iterdir() if entry.name.endswith(".toml"))


def load_marker_set(name_or_path: str | Path) -> MarkerSetFile:
    """A built-in marker set by name, or a TOML file of a user's own.

    Raises:
        ModelError: unknown name (the nearest is suggested), or a wrong file (file and key are named).
    """
    name = str(name_or_path)
    known = available_marker_sets()
    path = Path(str(_FOLDER / f"{name}.toml")) if name in known else Path(name)
    if name not in known and (path.suffix != ".toml" or not is_file(path)):
        raise ModelError(
            f"marker set {name!r}: unknown{nearest(name, known)}; expected {', '.join(known)} or a .toml "
            "file that exists"
        )
    return validate(MarkerSetFile, read_toml(path), str(path))


@dataclass(frozen=True)
class MarkerMatch:
    """Which name in the recording each marker of the set has."""

    marker_set: MarkerSetFile
    names: dict[MarkerKey, str]
    recorded: tuple[str, ...]  # all names in the recording
    where: str  # the recording, for messages

    @property
    def facing_pairs(self) -> FacingPairs:
        """The recorded names of the markers that show where the person faces."""
        chosen = (self.marker_set.heel_toe, self.marker_set.pelvis_back_front)
        found = [
            tuple(
                (self.names[pair[0], side], self.names[pair[1], side])
                for side in ("right", "left")
                if (pair[0], side) in self.names and (pair[1], side) in self.names
            )
            for pair in (entry or ("", "") for entry in chosen)
        ]
        return FacingPairs(found[0], found[1])

    @property
    def foot_markers(self) -> dict[str, list[str]]:
        """Side -> the recorded names of the markers on its foot: those on the segment of heel and toe."""
        set_ = self.marker_set
        segments = {set_.marker(name).segment for name in set_.heel_toe or ()} | {"foot", "toes"}
        own = [marker.name for marker in set_.markers if marker.segment in segments]
        return {
            side: [self.names[name, side] for name in own if (name, side) in self.names] for side in ("right", "left")
        }

    def sites(self, side: str, planar: bool = True) -> list[tuple[Marker, MarkerKey, str]]:
        """Markers that become sites of a planar model on "right", "left" or "both" sides, or of one in space; in the
        order of the set."""
        sides = ("centre", "right", "left") if side == "both" else ("centre", side)
        keys = [(m, (m.name, s)) for m in self.marker_set.markers if m.measures(planar) for s in sides if m.aliases(s)]
        return [(marker, key, self.names[key]) for marker, key in keys if key in self.names]

    def absent(self, name: str) -> str:
        """Words for a marker that the recording lacks, with the aliases tried."""
        marker = self.marker_set.marker(name)
        return (
            f"marker {name} is not in the recording (tried {', '.join((*marker.right, *marker.left, *marker.centre))})"
        )


def match_markers(
    marker_set: MarkerSetFile, recorded: Iterable[str], present: Iterable[bool], where: str
) -> MarkerMatch:
    """Finds each marker of the set among the recorded names.

    Args:
        recorded: names of the recording, in its order.
        present: whether that marker is seen at all; one that is blank everywhere counts as absent.

    Raises:
        ModelError: two recorded names fit the same marker (two subjects in one file, say).
    """
    names = tuple(recorded)
    by_plain: dict[str, list[str]] = {}
    for name, seen in zip(names, present, strict=True):
        if seen:
            by_plain.setdefault(plain_name(name), []).append(name)
    found: dict[MarkerKey, str] = {}
    for marker in marker_set.markers:
        for side in ("right", "left", "centre"):
            for alias in marker.aliases(side):
                fits = by_plain.get(plain_name(alias), [])
                if len(fits) > 1:
                    raise ModelError(
                        f"{where}: {' and '.join(fits)} both fit marker {alias} of set {marker_set.name}; "
                        "expected one subject in a recording"
                    )
                if fits and (marker.name, side) not in found:
                    found[marker.name, side] = fits[0]
    return MarkerMatch(marker_set, found, names, where)


def foot_markers_of(recording: Recording) -> dict[str, list[str]]:
    """Side -> markers on its foot by the built-in set that fits a recording best; none where none fits."""
    try:
        chosen = choose_marker_set(recording.marker_names)
        seen = [bool(np.isfinite(recording.marker(name)).all(axis=1).any()) for name in recording.marker_names]
        return match_markers(chosen, recording.marker_names, seen, recording.name).foot_markers
    except ModelError:
        return {"right": [], "left": []}


def choose_marker_set(recorded: Iterable[str]) -> MarkerSetFile:
    """The built-in set with the largest share of its markers in the recording (each side counts).

    Raises:
        ModelError: no set fits at least half.
    """
    names = {plain_name(name) for name in recorded}
    best: tuple[float, int, MarkerSetFile] | None = None
    for name in available_marker_sets():
        candidate = load_marker_set(name)
        if name.endswith("-all"):
            continue  # a larger variant of another set: by name only
        sites = [m.aliases(s) for m in candidate.usual for s in ("right", "left", "centre") if m.aliases(s)]
        hits = sum(any(plain_name(alias) in names for alias in aliases) for aliases in sites)
        score = (hits / len(sites), hits, candidate)
        if best is None or score[:2] > best[:2]:
            best = score
    if best is None or best[0] < 0.5:
        raise ModelError(
            f"no marker set fits the recording (best: {best[2].name if best else 'none'}, "
            f"{100 * (best[0] if best else 0):.0f} % of "
            f"its markers); expected one of {', '.join(available_marker_sets())} or a file of your own"
        )
    return best[2]
