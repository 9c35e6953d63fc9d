"""What a C3D file says of the person: mass, height, leg lengths, widths of knees and ankles."""

from __future__ import annotations

import re
from collections.abc import Iterator

from dynakin.recordings.formats.c3d_parameters import Parameters
from dynakin.units import PERSON_HEIGHT_M, PERSON_MASS_KG

_GROUPS = ("PROCESSING", "SUBJECTS", "SUBJECT", "SUBJECT_PARAMETERS", "ANTHROPOMETRY", "ANALYSIS")
_MASS = ("bodymass", "mass", "bodyweight", "weight")
_HEIGHT = ("height", "bodyheight", "stature")
# Of each leg, with what it can measure in m: ranges that no other unit of length brings a person into, too
_OF_A_LEG = {
    "leg_length": (("leglength",), (0.2, 1.4)),
    "knee_width": (("kneewidth",), (0.04, 0.25)),
    "ankle_width": (("anklewidth",), (0.025, 0.15)),
}
_LENGTH_UNITS = (1.0, 1e-2, 1e-3)
_SIDES = {"r": ("right", "r"), "l": ("left", "l")}


def read_subject(parameters: Parameters) -> dict[str, float]:
    """``Recording.subject``: the first plausible value of each; lengths from m, cm or mm by their size."""
    found: dict[str, float] = {}
    for word, value in _entries(parameters):
        if word in _MASS and PERSON_MASS_KG[0] < value < PERSON_MASS_KG[1]:
            found.setdefault("mass_kg", value)
        elif word in _HEIGHT:
            _put(found, "height_m", value, PERSON_HEIGHT_M)
        else:
            for key, (stems, limits) in _OF_A_LEG.items():
                for side, spelled in _SIDES.items():
                    if any(word in (f"{s}{stem}", f"{stem}{s}") for s in spelled for stem in stems):
                        _put(found, f"{key}_m_{side}", value, limits)
    return found


def _put(found: dict[str, float], key: str, value: float, limits: tuple[float, float]) -> None:
    metres = next((value * f for f in _LENGTH_UNITS if limits[0] < value * f < limits[1]), None)
    if metres is not None:
        found.setdefault(key, round(metres, 9))


def _entries(parameters: Parameters) -> Iterator[tuple[str, float]]:
    """Names without case, separators, unit and the subject's name, and their numbers."""
    people = [_letters(name) for name in parameters.texts("SUBJECTS", "NAMES")]
    for group in _GROUPS:
        for name in parameters.names(group):
            value = parameters.number(group, name)
            if value is not None:
                yield _word(name, people), value
        values = parameters.array(group, "VALUES").ravel()
        for name, value in zip(parameters.texts(group, "NAMES"), values, strict=False):
            yield _word(name, people), float(value)


def _word(name: str, people: list[str]) -> str:
    word = _letters(name.rpartition(":")[2])
    for person in filter(None, people):
        if len(word) > len(person):
            word = word.removeprefix(person).removesuffix(person)
    return re.sub(r"(mass|weight)kg$|(length|width|height)(mm|cm|m)$", lambda m: m[1] or m[2], word)


def _letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.casefold())
