"""Names of ground-force columns in all the usual spellings, understood as plate, quantity and axis.

Distinguished are the force (``v`` or ``f``), its point of application (``p``) and the free moment (``m``, ``t``
or the words torque, moment). What else the name holds, a number or a side anywhere in it, is the plate.
Understood are thus ``ground_force_vx``, ``1_ground_force_vx``, ``ground_force_1_vx``, ``ground_force1_vx``,
``l_ground_force_vx``, ``R_ground_force_vx``, ``ground_force_vx_r``, ``ground_force_calcn_r_vx``, ``FP1_vx``,
``ground_torque_x``, ``1_ground_torque_x``, ``ground_torque_1_x``, ``ground_force_1_mx``,
``ground_moment_l_mx``, ``FP1.tx``, ... A unit behind a name, in brackets, is passed over where it is the one that is
taken (N, m, N m).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

_FORCE_WORDS = {
    "force",
    "forces",
    "torque",
    "torques",
    "moment",
    "moments",
    "grf",
    "grm",
    "plate",
    "forceplate",
}
_MOMENT_WORDS = {"torque", "torques", "moment", "moments", "grm"}
_FILLER = _FORCE_WORDS | {"ground", "reaction", "free", "external"}
_UNIT = re.compile(r"\s*[\[(]\s*(n|m|n[\s.*·]?m)\s*[\])]\s*$")
_LAST = re.compile(r"^([vfpmt]?)([xyz])$")
_WORD_NUMBER = re.compile(r"^([a-z]+)(\d+)$")
_QUANTITY = {"v": "force", "f": "force", "p": "point", "m": "torque", "t": "torque"}


@dataclass
class PlateColumns:
    """Column names of one plate: quantity "force", "point" or "torque" -> axis "x", "y" or "z" -> column."""

    plate: str
    columns: dict[str, dict[str, str]] = field(default_factory=dict)


def parse_column(name: str) -> tuple[str, str, str] | None:
    """(plate, quantity, axis) of a ground-force column, None for any other column (``pelvis_tx``, say)."""
    tokens: list[str] = []
    for token in re.split(r"[_.\-\s]+", _UNIT.sub("", name.strip().casefold())):
        number = _WORD_NUMBER.match(token)
        if number and number[1] in _FILLER:
            tokens += [number[1], number[2]]
        elif token:
            tokens.append(token)
    spot = next((k for k in range(len(tokens) - 1, -1, -1) if _LAST.match(tokens[k])), None)
    if spot is None or len(tokens) - spot > 2:
        return None
    letter, axis = _LAST.match(tokens[spot]).groups()  # type: ignore[union-attr]
    rest = tokens[:spot] + tokens[spot + 1 :]
    plate_word = any(re.fullmatch(r"fp\d*|plate\d*|forceplate\d*", token) for token in rest)
    if not plate_word and not _FORCE_WORDS & set(rest):
        return None
    if letter:
        quantity = _QUANTITY[letter]
    elif _MOMENT_WORDS & set(rest):
        quantity = "torque"
    else:
        return None
    plate = "_".join(re.sub(r"^fp(?=\d)", "", token) for token in rest if token not in _FILLER and token != "fp")
    return plate, quantity, axis


_UNITS = {"n", "kn", "lb", "lbf", "kgf", "kg", "bw", "%bw", "m", "cm", "mm", "in", "nm", "nmm", "knm", "ncm", "v", "mv"}
"""What stands in brackets and is a unit, small and without points and blanks; "(left)" is none."""


def other_unit(name: str) -> str | None:
    """The unit in brackets behind a ground-force column's name that is not the one that is taken, None without one."""
    behind = re.search(r"[\[(]([^\[()\]]*)[\])]\s*$", name)
    parsed = parse_column(name)
    if behind is None or parsed is None:
        return None
    unit = re.sub(r"[\s.*\u00b7]", "", behind[1].casefold())
    taken = {"force": "n", "point": "m", "torque": "nm"}[parsed[1]]
    return behind[1] if unit in _UNITS and unit != taken else None


def group_columns(names: tuple[str, ...]) -> tuple[list[PlateColumns], list[str]]:
    """The plates among the columns, in the order in which they first appear, and the columns that are none of
    theirs."""
    plates: dict[str, PlateColumns] = {}
    others: list[str] = []
    for name in names:
        parsed = parse_column(name)
        if parsed is None:
            others.append(name)
            continue
        plate, quantity, axis = parsed
        axes = plates.setdefault(plate, PlateColumns(plate)).columns.setdefault(quantity, {})
        if axis in axes:
            others.append(name)
        else:
            axes[axis] = name
    return list(plates.values()), others
