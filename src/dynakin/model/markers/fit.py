"""Which marker sets fit a recording's names, and how well."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from dynakin.errors import ModelError
from dynakin.model.markers.draft.by_name import said_together, worn
from dynakin.model.markers.marker_set import available_marker_sets, load_marker_set
from dynakin.model.markers.match import (
    SIDES,
    MarkerKey,
    MarkerMatch,
    Spellings,
    found_markers,
)
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.recordings.recording import Recording

LISTED = 8  # names in a sentence
LEG = ("thigh", "shank", "foot")
_ON_LEG_AT_LEAST = 2  # segments of one leg
ROOT = "pelvis"
_FAR_FEWER = 0.5  # than another set knows: `plug-in-gait` of OpenCap's markers has 6 of 27


@dataclass(frozen=True)
class Fit:
    """A built-in set compared with a recording's names.

    Attributes:
        names: of the markers that are there. doubled: aliases that several names fit.
        expected_n: markers that the whole set has, each side counted.
        worn: it has joint centres for names that, beside markers on the pelvis, are those of markers on the skin.
    """

    marker_set: MarkerSetFile
    names: dict[MarkerKey, str]
    doubled: dict[str, list[str]]
    expected_n: int
    worn: bool = False

    @property
    def explained_n(self) -> int:
        """How many of the recording's markers the set knows."""
        return len(self.names)

    @property
    def lacking(self) -> list[str]:
        """What a model needs at least and the recording lacks."""
        return lacking(self.marker_set, self.names)

    @property
    def usable(self) -> bool:
        """Whether a model can be measured by these names as the set reads them."""
        return not self.lacking and not self.worn


def lacking(marker_set: MarkerSetFile, names: Mapping[MarkerKey, str]) -> list[str]:
    """What a model needs at least and is not among these markers: the pelvis, two segments of a leg; in words."""
    parts = {
        side: {_segment(marker_set, name) for name, own in names if own in (side, "centre")}
        for side in ("right", "left")
    }
    best = max(("right", "left"), key=lambda side: len(parts[side] & set(LEG)))
    lacks = [] if any(ROOT in found for found in parts.values()) else [_names_on(marker_set, ROOT, best)]
    here = parts[best] & set(LEG)
    if len(here) < _ON_LEG_AT_LEAST:
        lacks += [_names_on(marker_set, segment, best) for segment in LEG if segment not in here]
    return lacks


def _names_on(marker_set: MarkerSetFile, segment: str, side: str) -> str:
    markers = [m for m in marker_set.markers if _segment(marker_set, m.name) == segment]
    names = [m.aliases(own)[0] for m in markers for own in (side, "centre") if m.aliases(own)]
    return f"on the {segment} ({', '.join(names[:3]) or 'none in the set'})"


_CENTRES = {"HJC": "pelvis", "KJC": "thigh", "AJC": "shank"}


def _segment(marker_set: MarkerSetFile, name: str) -> str:
    return marker_set.marker(name).segment or _CENTRES.get(name, "")


def fits(recorded: Iterable[str]) -> list[Fit]:
    """The built-in sets compared with names, the one that explains most of them first, of equals the one with fewest
    markers that are not there; ``-all`` variants, which are for who asks for them, are left away."""
    own = tuple(recorded)
    spelt, on_skin = Spellings.of(own), worn(told.place for told in said_together(own).values())
    found = []
    for name in available_marker_sets():
        if name.endswith("-all"):
            continue
        set_ = load_marker_set(name)
        names, doubled = found_markers(set_, spelt)
        expected_n = sum(len(m.aliases(s)) > 0 for m in set_.markers for s in SIDES)
        centres = on_skin and any(place == "KJ" for place, _ in names)
        found.append(Fit(set_, names, doubled, expected_n, centres))
    return sorted(found, key=lambda fit: (-fit.explained_n, fit.expected_n - fit.explained_n, fit.marker_set.name))


def choose_marker_set(recorded: Iterable[str], where: str = "the recording") -> MarkerSetFile:
    """The built-in set that explains most of the names.

    Raises:
        ModelError: none of them has the pelvis and two segments of a leg there; says what lacks.
    """
    names = tuple(recorded)
    return usable_of(fits(names), where)[0].marker_set


def usable_of(ranked: Sequence[Fit], where: str) -> list[Fit]:
    """Those by which a model can be measured; errors as of `choose_marker_set`."""
    found = [fit for fit in ranked if fit.usable]
    if not found:
        best = ranked[0]
        if best.worn and not best.lacking:
            knee = next(name for (place, _), name in best.names.items() if place == "KJ")
            raise ModelError(
                f"{where}: {knee} is a joint centre in {best.marker_set.name}, but here are markers on the pelvis' "
                "skin; expected a set of your own that says what is on the skin: dynakin markers new TRIAL -o my.toml"
            )
        why = f"best: {best.marker_set.name} with {best.explained_n} markers; it lacks {'; '.join(best.lacking)}"
        raise ModelError(
            f"{where}: no marker set fits ({why if best.explained_n else 'none knows any of the names'}), expected "
            "names of a set of `dynakin markers list`, or a set of your own: dynakin markers new TRIAL -o my.toml"
        )
    return found


def refuse_unfit(asked: MarkerSetFile, recording: Recording) -> None:
    """Refuse a built-in set that knows far fewer markers of pelvis and legs than another, as one named by mistake.

    Raises:
        ModelError: names both, and how many markers each knows.
    """
    if asked.name not in available_marker_sets() or asked != load_marker_set(asked.name):
        return  # one of the user's own knows what it wants
    ranked = fits(recording.seen_names)
    best = next((fit for fit in ranked if fit.usable), None)
    names, _ = found_markers(asked, Spellings.of(recording.seen_names))
    if best is not None and _on_legs(asked, names) < _FAR_FEWER * _on_legs(best.marker_set, best.names):
        raise ModelError(
            f"{recording.path or recording.name}: {asked.name} knows {len(names)} of the {len(recording.seen_names)} "
            f"markers, {best.marker_set.name} knows {best.explained_n}; expected --markers {best.marker_set.name}, or "
            "no --markers"
        )


def _on_legs(marker_set: MarkerSetFile, names: Mapping[MarkerKey, str]) -> int:
    return sum(_segment(marker_set, name) in (ROOT, *LEG) for name, _ in names)


def choice_words(match: MarkerMatch, ranked: Sequence[Fit]) -> str:
    """Which set was chosen and how well it fits, with its runner-up and the names that it does not know."""
    own = next(fit for fit in ranked if fit.marker_set.name == match.marker_set.name)
    said = f"Marker set {own.marker_set.name}: {own.explained_n} of its {own.expected_n} markers by name"
    other = next((fit for fit in ranked if fit is not own and fit.explained_n), None)
    if other is not None:
        said += f"; next best {other.marker_set.name} with {other.explained_n} of {other.expected_n}"
    left = match.unexplained
    if left:
        more = f" and {len(left) - LISTED} more" if len(left) > LISTED else ""
        said += f"; not known to it and left out: {', '.join(left[:LISTED])}{more}"
    return said + "."
