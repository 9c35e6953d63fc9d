"""Tables of body segment inertial parameters: Dumas, de Leva, or a user's CSV of the same shape.

Columns of the CSV (lines that open with # are comments): ``part``, ``sex`` (male, female or any), ``axis``
(x or y) with ``axis_from`` and ``axis_to`` (the landmarks along which that axis of the part's frame runs),
``origin`` (the landmark at the frame's origin), ``length_from``, ``length_to`` (landmarks that define the
length L), ``mass_percent`` (one side), ``com_x..z`` (percent of L), ``rxx, ryy, rzz, rxy, rxz, ryz`` (radii
of gyration about the centre of mass, percent of L; a minus sign turns the sign of the tensor entry) and
``length_per_height`` (L over the height, for parts without markers; may be empty). A landmark may also be a
point on a line, ``c7>hip:0.40``. Frames are those of the right side.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ModelError
from dynakin.files import LARGEST_TEXT, is_file, read_bytes
from dynakin.model.inertia import RigidBody
from dynakin.settings.strict import nearest
from dynakin.settings.subject import Sex

BUILTIN = ("dumas", "deleva")
PAIRED = frozenset({"upper_arm", "forearm", "hand", "thigh", "shank", "foot"})
"""Parts of which the body has two."""

_TEXT = ("part", "sex", "axis", "axis_from", "axis_to", "origin", "length_from", "length_to")
_POINTS = ("axis_from", "axis_to", "origin", "length_from", "length_to")
_RADII = ("rxx", "ryy", "rzz", "rxy", "rxz", "ryz")
_NUMBERS = ("mass_percent", "com_x", "com_y", "com_z", *_RADII)
_COLUMNS = (*_TEXT, *_NUMBERS, "length_per_height")
_ON_LINE = re.compile(r"^(\w+)>(\w+):([0-9]?\.?[0-9]{1,17})$")
_LARGEST = 1e4  # percent: a hundred lengths or body masses; what is larger is damaged


@dataclass(frozen=True)
class Point:
    """A landmark, or the point ``fraction`` of the way from one landmark to another."""

    start: str
    end: str
    fraction: float = 0.0

    @classmethod
    def parse(cls, text: str) -> Point:
        """From "hip" or "c7>hip:0.40"; ValueError where it is neither."""
        match = _ON_LINE.match(text)
        if match is None and (">" in text or ":" in text):
            raise ValueError(f"is {text!r}, expected a landmark, or a point on a line such as c7>hip:0.40")
        return cls(match[1], match[2], float(match[3])) if match else cls(text, text)

    def at(self, landmarks: dict[str, Array]) -> Array | None:
        """Its place (3,) m, or None where a landmark is not known."""
        if self.start not in landmarks or self.end not in landmarks:
            return None
        return landmarks[self.start] + self.fraction * (landmarks[self.end] - landmarks[self.start])


@dataclass(frozen=True, eq=False)
class Part:
    """One part of the body as a fraction of the mass and of its own length L, in its own frame (right
    side)."""

    name: str
    axis: str
    axis_from: Point
    axis_to: Point
    origin: Point
    length_from: Point
    length_to: Point
    mass_fraction: float  # of the whole body, one side
    centre: Array  # (3,) in L
    inertia: Array  # (3, 3) about the centre of mass, in mass L^2; entries of the tensor
    length_per_height: float | None


@dataclass(frozen=True, eq=False)
class BodyTable:
    """All parts of one table for one sex (or the mean), mass fractions normalised so that the whole body is
    1."""

    name: str
    sex: Sex | None
    parts: dict[str, Part]

    def part(self, name: str) -> Part:
        """The part of that name.

        Raises:
            ModelError: the table has none; the message lists those that it has.
        """
        try:
            return self.parts[name]
        except KeyError:
            raise ModelError(
                f"table {self.name}: no part {name!r}{nearest(name, self.parts)}; it has {', '.join(self.parts)}"
            ) from None


def _tensor(radii: list[float]) -> Array:
    """(3, 3) tensor in mass L^2 from radii in percent; the sign of the radius is the sign of the entry."""
    xx, yy, zz, xy, xz, yz = (np.sign(r) * (r / 100.0) ** 2 for r in radii)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _read_rows(path: Path) -> list[tuple[int, dict[str, str]]]:
    try:
        lines = read_bytes(path, ModelError, LARGEST_TEXT).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: table cannot be read ({error})") from None
    kept = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and not line.startswith("#")]
    if not kept:
        raise ModelError(f"{path}: the table is empty; expected a header with {', '.join(_COLUMNS)}")
    try:
        header, *rows = [(k, next(csv.reader([line]))) for k, line in kept]
    except csv.Error as error:  # a cell of more than 131072 characters
        raise ModelError(f"{path}: table cannot be read ({error})") from None
    names = [name.strip() for name in header[1]]
    for name in names:
        if name not in _COLUMNS:
            raise ModelError(f"{path}: line {header[0]}: unknown column {name!r}{nearest(name, _COLUMNS)}")
    lacking = [name for name in _COLUMNS if name not in names]
    if lacking:
        raise ModelError(f"{path}: line {header[0]}: column {lacking[0]!r} is missing")
    for k, row in rows:
        if len(row) != len(names):
            raise ModelError(f"{path}: line {k}: {len(row)} cells, expected {len(names)}")
    return [(k, dict(zip(names, (cell.strip() for cell in row), strict=True))) for k, row in rows]


def _part(row: dict[str, str], where: str) -> Part:
    if row["axis"] not in ("x", "y"):
        raise ModelError(f"{where}: axis is {row['axis']!r}, expected x or y")
    numbers: dict[str, float] = {}
    for key in (*_NUMBERS, "length_per_height"):
        try:
            numbers[key] = float(row[key]) if row[key] or key in _NUMBERS else np.nan
        except ValueError:
            raise ModelError(f"{where}: {key} is {row[key]!r}, expected a number") from None
        if (key in _NUMBERS or row[key]) and not abs(numbers[key]) <= _LARGEST:
            raise ModelError(f"{where}: {key} is {row[key]!r}, expected a number up to {_LARGEST:g}")
    if numbers["mass_percent"] <= 0.0:
        raise ModelError(f"{where}: mass_percent is {row['mass_percent']}, expected more than 0")
    tensor = _tensor([numbers[key] for key in _RADII])
    if not RigidBody(1.0, np.zeros(3), tensor).possible():
        raise ModelError(
            f"{where}: the radii of gyration belong to no real body (expected a tensor whose principal "
            "moments obey the triangle inequality; off-diagonal radii are entries of the tensor, not "
            "products "
            "of inertia)"
        )
    points = {}
    for key in _POINTS:
        try:
            points[key] = Point.parse(row[key])
        except ValueError as error:
            raise ModelError(f"{where}: {key} {error}") from None
    length = numbers["length_per_height"]
    return Part(
        name=row["part"],
        axis=row["axis"],
        **points,
        mass_fraction=numbers["mass_percent"] / 100.0,
        centre=np.array([numbers["com_x"], numbers["com_y"], numbers["com_z"]]) / 100.0,
        inertia=tensor,
        length_per_height=None if np.isnan(length) else length,
    )


def _mean_point(a: Point, b: Point, where: str) -> Point:
    if (a.start, a.end) != (b.start, b.end):
        raise ModelError(f"{where}: male and female rows name different landmarks, so their mean has no sense")
    return Point(a.start, a.end, 0.5 * (a.fraction + b.fraction))


def _mean_part(a: Part, b: Part, where: str) -> Part:
    """Mean of both sexes: of masses, centres and signed tensors, not of radii (anthropometry page)."""
    if a.axis != b.axis:
        raise ModelError(f"{where}: male and female rows have different axes, {a.axis} and {b.axis}")
    points = {name: _mean_point(getattr(a, name), getattr(b, name), where) for name in _POINTS}
    lengths = [value for value in (a.length_per_height, b.length_per_height) if value is not None]
    return Part(
        name=a.name,
        axis=a.axis,
        **points,
        mass_fraction=0.5 * (a.mass_fraction + b.mass_fraction),
        centre=0.5 * (a.centre + b.centre),
        inertia=0.5 * (a.inertia + b.inertia),
        length_per_height=float(np.mean(lengths)) if lengths else None,
    )


def load_table(name_or_path: str | Path, sex: Sex | None) -> BodyTable:
    """The table "dumas" or "deleva", or a CSV file of the same shape, for one sex (None: mean of both).

    Raises:
        ModelError: no such table, or a wrong cell; the message gives file, line, column, what was found and
        expected.
    """
    name = str(name_or_path)
    path = Path(str(resources.files("dynakin.model") / "tables" / f"{name}.csv")) if name in BUILTIN else Path(name)
    if name not in BUILTIN and not is_file(path):
        raise ModelError(f"table {name!r}: no such table{nearest(name, BUILTIN)}; expected dumas, deleva or a CSV file")
    found: dict[tuple[str, str], Part] = {}
    for line, row in _read_rows(path):
        where = f"{path}: line {line}"
        if row["sex"] not in ("male", "female", "any"):
            raise ModelError(f"{where}: sex is {row['sex']!r}, expected male, female or any")
        found[row["part"], row["sex"]] = _part(row, where)
    parts: dict[str, Part] = {}
    for part in dict.fromkeys(key[0] for key in found):
        if (part, "any") in found:
            parts[part] = found[part, "any"]
        elif sex is not None and (part, sex) in found:
            parts[part] = found[part, sex]
        elif sex is None and (part, "male") in found and (part, "female") in found:
            parts[part] = _mean_part(found[part, "male"], found[part, "female"], f"{path}: part {part}")
        else:
            raise ModelError(f"{path}: part {part!r} has no row for sex {sex or 'male and female (sex not given)'}")
    total = sum((2 if part in PAIRED else 1) * entry.mass_fraction for part, entry in parts.items())
    normalised = {part: replace(entry, mass_fraction=entry.mass_fraction / total) for part, entry in parts.items()}
    return BodyTable(path.stem, sex, normalised)
