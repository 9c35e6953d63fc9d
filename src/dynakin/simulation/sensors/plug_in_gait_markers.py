"""Vicon's Plug-in Gait markers, right and left, on the parts of the body."""

from __future__ import annotations

from dynakin.simulation.sensors.markers import MarkerList, Row


def _name(row: Row, side: str) -> str:
    return f"{side[0].upper()}{row.stem}"


# Stem of the name, part, region, x, y over the body height, distance from the midline over it, whether landmark.
PLUG_IN_GAIT = MarkerList(
    _name,
    (
        Row("TOE", "foot", "toe", 0.000, 0.000, 0.120, True),
        Row("MT5", "foot", "forefoot", -0.026, -0.014, 0.150),
        Row("HEE", "foot", "heel", -0.128, -0.006, 0.098, True),
        Row("ANK", "shank", "ankle", 0.000, 0.000, 0.125, True),
        Row("TIB", "shank", "shank", -0.008, 0.130, 0.130),
        Row("KNE", "thigh", "knee", 0.000, 0.000, 0.108, True),
        Row("THI", "thigh", "thigh", 0.005, 0.115, 0.122),
        Row("ASI", "pelvis", "pelvis", 0.036, 0.053, 0.076, True),
        Row("PSI", "pelvis", "pelvis", -0.086, 0.053, 0.028, True),
        Row("SHO", "trunk", "shoulder", 0.000, 0.248, 0.095),
        Row("ELB", "upper_arm", "arm", 0.000, -0.186, 0.138, True),
        Row("WRA", "forearm", "forearm", 0.017, -0.146, 0.112, True),
        Row("WRB", "forearm", "forearm", -0.017, -0.146, 0.118, True),
        Row("T10", "abdomen", "trunk", -0.055, 0.107, 0.0, True),
        Row("STRN", "trunk", "trunk", 0.060, 0.170, 0.0),
        Row("CLAV", "trunk", "trunk", 0.055, 0.232, 0.0),
        Row("C7", "trunk", "trunk", -0.050, 0.262, 0.0),
    ),
)
