"""What Qualisys Track Manager says of its markers and plates, and its forces in the laboratory frame.

Source: QTM Real-time Server Protocol (Qualisys), "XML packet" and "Force components"; QTM user manual, "Force data
information": forces are those on the plate, in the plate's frame (z into the floor) or in the laboratory's, as the
project's options say.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array
from dynakin.errors import ConfigError, StreamError
from dynakin.recordings.pushes import LOADED_N
from dynakin.units import length_factor

FRAMES = ("plate", "lab")
"""Frames that QTM can give forces in: its "Local (force plate)" and "Lab"."""


@dataclass(frozen=True, eq=False)
class QtmPlate:
    """A plate by its corners.

    Attributes:
        number: QTM's Plate_ID. rate_hz: of its samples.
        R_LP: (3, 3) axes in the laboratory frame: x from corner 2 to 1, y from corner 4 to 1, z = x cross y, as C3D
            has them.
        centre: (3,) m.
    """

    number: int
    name: str
    rate_hz: float
    R_LP: Array
    centre: Array

    def wrenches(self, rows: Array, frame: str) -> Array:
        """Ground on person, (K, 6) N and N m about the laboratory origin.

        The force is put at its point of application and the moment about the normal there: both stay right whether QTM
        takes moments about the plate's surface or about its sensor below.

        Args:
            rows: (K, 9) force N, moment N m and point of application mm, on the plate. frame: one of `FRAMES`.
        """
        force, moment, point = rows[:, :3], rows[:, 3:6], rows[:, 6:] / 1000.0
        if frame == "plate":
            force, moment = force @ self.R_LP.T, moment @ self.R_LP.T
            reach = point @ self.R_LP.T  # from the centre, about which the moment is
            point = self.centre + reach
        else:
            reach = point
        normal = self.R_LP[:, 2]
        loaded = (np.abs(force @ normal) > LOADED_N) & np.isfinite(point).all(axis=1)
        free = np.where(loaded, (moment - np.cross(reach, force)) @ normal, 0.0)
        point = np.where(loaded[:, None], point, self.centre)
        return -np.hstack([force, np.cross(point, force) + free[:, None] * normal])


@dataclass(frozen=True)
class QtmParameters:
    """Markers' labels in their order, and the plates."""

    labels: tuple[str, ...]
    up: str
    plates: tuple[QtmPlate, ...]


def parse_parameters(text: str | bytes, where: str) -> QtmParameters:
    """The answer to ``GetParameters General 3D Force``.

    Raises:
        StreamError: it is not what the protocol says. ConfigError: no labelled markers, or plates at several rates.
    """
    try:
        root = ElementTree.fromstring(text)
        labels = tuple((label.findtext("Name") or "").strip() for label in root.iterfind(".//The_3D/Label"))
        up = (root.findtext(".//The_3D/AxisUpwards") or "").strip()
        plates = tuple(_plate(found, root) for found in root.iterfind(".//Force/Plate"))
    except (ElementTree.ParseError, ValueError, TypeError) as error:
        raise StreamError(f"{where}: QTM's parameters cannot be read ({error})") from None
    if not labels:
        raise ConfigError(f"{where}: QTM has no labelled markers; expected a project with labels or an AIM model")
    rates = sorted({plate.rate_hz for plate in plates})
    if len(rates) > 1:
        raise ConfigError(f"{where}: plates at {', '.join(f'{r:g}' for r in rates)} Hz, expected one rate for all")
    return QtmParameters(labels, up, plates)


def _plate(found: ElementTree.Element, root: ElementTree.Element) -> QtmPlate:
    unit = root.findtext(".//Force/Unit_Length", "mm")
    metre = length_factor(unit)
    if metre is None:
        raise ValueError(f"plates in the unknown unit {unit!r}, expected mm, cm or m")
    number = int(found.findtext("Plate_ID", "nan"))
    corners = np.array(
        [[float(found.findtext(f"Location/Corner{k}/{axis}", "nan")) for axis in "XYZ"] for k in range(1, 5)]
    )
    corners *= metre
    if not np.isfinite(corners).all():
        raise ValueError(f"plate {number} has no corners")
    x, y = corners[0] - corners[1], corners[0] - corners[3]
    z = np.cross(x, y)
    if np.linalg.norm(z) < 1e-4:
        raise ValueError(f"the corners of plate {number} span no surface")
    axes = np.column_stack([v / np.linalg.norm(v) for v in (x, np.cross(z, x), z)])
    name = (found.findtext("Name") or "").strip()
    return QtmPlate(
        number, f"{name} {number}".strip(), float(found.findtext("Frequency", "nan")), axes, corners.mean(axis=0)
    )
