"""Markers of the ``opencap`` recordings, right and left, on the parts of the body."""

from __future__ import annotations

from dynakin.simulation.sensors.markers import MarkerList, Row

_LOWER = {"foot", "shank", "thigh"}  # the right side's names of these begin with r_, of the others with R_


def _name(row: Row, side: str) -> str:
    if row.stem.startswith("."):  # r.ASIS, L.ASIS
        return f"{'r' if side == 'right' else 'L'}{row.stem}"
    if side == "left":
        return f"L_{row.stem}"
    return f"{'r' if row.part in _LOWER else 'R'}_{row.stem}"


# Stem of the name, part, region, x, y over the body height, distance from the midline over it, whether landmark.
OPENCAP = MarkerList(
    _name,
    (
        Row("toe", "foot", "toe", 0.000, 0.000, 0.120, True),
        Row("5meta", "foot", "forefoot", -0.026, -0.014, 0.150),
        Row("calc", "foot", "heel", -0.128, -0.006, 0.098, True),
        Row("ankle", "shank", "ankle", 0.000, 0.000, 0.125, True),
        Row("sh2", "shank", "shank", -0.020, 0.190, 0.128),
        Row("sh3", "shank", "shank", -0.012, 0.110, 0.130),
        Row("shank_antsup", "shank", "shank", 0.026, 0.200, 0.112),
        Row("knee", "thigh", "knee", 0.000, 0.000, 0.108, True),
        Row("thigh1", "thigh", "thigh", 0.045, 0.165, 0.106),
        Row("thigh2", "thigh", "thigh", 0.042, 0.085, 0.104),
        Row("thigh3", "thigh", "thigh", -0.025, 0.155, 0.125),
        Row("thigh4", "thigh", "thigh", -0.020, 0.080, 0.116),
        Row(".ASIS", "pelvis", "pelvis", 0.036, 0.053, 0.076, True),
        Row(".PSIS", "pelvis", "pelvis", -0.086, 0.053, 0.028, True),
        Row("Sternum", "trunk", "trunk", 0.055, 0.215, 0.014),
        Row("Shoulder", "trunk", "shoulder", 0.000, 0.248, 0.095),
        Row("humerus", "upper_arm", "arm", 0.012, -0.080, 0.125),
        Row("elbow_lat", "upper_arm", "arm", 0.000, -0.186, 0.138, True),
        Row("elbow_med", "upper_arm", "arm", 0.000, -0.186, 0.094, True),
        Row("forearm", "forearm", "forearm", 0.014, -0.045, 0.128),
        Row("wrist_radius", "forearm", "forearm", 0.017, -0.146, 0.112, True),
        Row("wrist_ulna", "forearm", "forearm", -0.017, -0.146, 0.118, True),
        Row("C7", "trunk", "trunk", -0.050, 0.262, 0.0),
    ),
)
