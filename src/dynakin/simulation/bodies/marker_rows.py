"""Marker lists of the simulated persons: the ``opencap`` and the Plug-in Gait set, both sides.

OPENCAP and PLUG_IN_GAIT are for planar persons, SETS for the whole body in space. Rows of the latter are places in the
segment's own frame over the body height, from the joint by which the segment hangs (the pelvis: from the middle of the
ASIS); lateral is outward. Markers over a joint lie off its centre by half a joint's width (Ross & Wilson 1974, as in
the marker sets) and a marker's radius of 7 mm.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dynakin.simulation.bodies.markers import SCATTER_M, MarkerList, Row, Site
from dynakin.simulation.bodies.subject import SimulatedSubject

_LOWER = {"foot", "shank", "thigh"}  # the right side's names of these begin with r_, of the others with R_


def _opencap_name(row: Row, side: str) -> str:
    if row.stem.startswith("."):  # r.ASIS, L.ASIS
        return f"{'r' if side == 'right' else 'L'}{row.stem}"
    if side == "left":
        return f"L_{row.stem}"
    return f"{'r' if row.part in _LOWER else 'R'}_{row.stem}"


# Stem of the name, part, region, x, y over the body height, distance from the midline over it, whether landmark.
OPENCAP = MarkerList(
    _opencap_name,
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


def _plug_in_gait_name(row: Row, side: str) -> str:
    return f"{side[0].upper()}{row.stem}"


PLUG_IN_GAIT = MarkerList(
    _plug_in_gait_name,
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

PAIRED = ("thigh", "shank", "foot", "upper_arm", "forearm", "hand")
ON_KNEE, ON_ANKLE, ON_ELBOW = 0.0320, 0.0236, 0.0230  # sideways of the joint centre, over the height
MALLEOLI = -0.246 / 1.027  # below the knee; the ankle lies 2.7 % of that further down (Bruening et al. 2008)
# The length along which a segment's markers are spread, and its part of the height on which the rows rest.
_SPREAD = {"shank": 0.246, "thigh": 0.245, "torso": 0.260, "upper_arm": 0.186, "forearm": 0.146}
# Coordinate that moves a region's skin; those of limbs on the marker's own side, on the midline the right one.
_DRIVERS = {
    "toe": "ankle_angle", "forefoot": "ankle_angle", "heel": "ankle_angle", "ankle": "ankle_angle",
    "shank": "ankle_angle", "knee": "knee_angle", "thigh": "knee_angle", "pelvis": "hip_flexion",
    "shoulder": "arm_flex", "arm": "arm_flex", "forearm": "elbow_flex",
}  # fmt: skip
_MIDDLE_DRIVERS = {"trunk": "lumbar_extension", "head": "neck_extension"}

_FEET = (
    ("foot", "toe", 0.0909, -0.014, 0.000, True),
    ("foot", "forefoot", 0.065, -0.028, 0.030, False),
    ("foot", "heel", -0.037, -0.020, 0.000, True),
)

SETS: Mapping[str, MarkerList] = {
    "opencap": MarkerList(
        OPENCAP.name,
        (
            *(Row(stem, *rest) for stem, rest in zip(("toe", "5meta", "calc"), _FEET, strict=True)),
            Row("ankle", "shank", "ankle", 0.000, MALLEOLI, ON_ANKLE, True),
            Row("mankle", "shank", "ankle", 0.000, MALLEOLI, -ON_ANKLE, True),
            Row("sh2", "shank", "shank", -0.020, -0.056, 0.020),
            Row("sh3", "shank", "shank", -0.012, -0.136, 0.022),
            Row("shank_antsup", "shank", "shank", 0.026, -0.046, 0.004),
            Row("knee", "thigh", "knee", 0.000, -0.245, ON_KNEE, True),
            Row("mknee", "thigh", "knee", 0.000, -0.245, -ON_KNEE, True),
            Row("thigh1", "thigh", "thigh", 0.045, -0.080, 0.020),
            Row("thigh2", "thigh", "thigh", 0.042, -0.160, 0.020),
            Row("thigh3", "thigh", "thigh", -0.025, -0.090, 0.060),
            Row("thigh4", "thigh", "thigh", -0.020, -0.165, 0.045),
            Row(".ASIS", "pelvis", "pelvis", 0.000, 0.000, 0.076, True),
            Row(".PSIS", "pelvis", "pelvis", -0.122, 0.000, 0.028, True),
            Row("Sternum", "torso", "trunk", 0.055, 0.215, 0.014),
            Row("Shoulder", "torso", "shoulder", 0.000, 0.249, 0.110),
            Row("humerus", "upper_arm", "arm", 0.012, -0.080, 0.028),
            Row("elbow_lat", "upper_arm", "arm", 0.000, -0.186, ON_ELBOW, True),
            Row("elbow_med", "upper_arm", "arm", 0.000, -0.186, -ON_ELBOW, True),
            Row("forearm", "forearm", "forearm", 0.014, -0.045, 0.010),
            Row("wrist_radius", "forearm", "forearm", 0.000, -0.146, 0.017, True),
            Row("wrist_ulna", "forearm", "forearm", 0.000, -0.146, -0.017, True),
            Row("C7", "torso", "trunk", -0.055, 0.266, 0.0),
        ),
    ),
    "plug-in-gait": MarkerList(
        PLUG_IN_GAIT.name,
        (
            *(Row(stem, *rest) for stem, rest in zip(("TOE", "MT5", "HEE"), _FEET, strict=True)),
            Row("ANK", "shank", "ankle", 0.000, MALLEOLI, ON_ANKLE, True),
            Row("TIB", "shank", "shank", -0.008, -0.116, 0.024),
            Row("KNE", "thigh", "knee", 0.000, -0.245, ON_KNEE, True),
            Row("THI", "thigh", "thigh", 0.005, -0.130, 0.060),
            Row("ASI", "pelvis", "pelvis", 0.000, 0.000, 0.076, True),
            Row("PSI", "pelvis", "pelvis", -0.122, 0.000, 0.028, True),
            Row("SHO", "torso", "shoulder", 0.000, 0.249, 0.110),
            Row("UPA", "upper_arm", "arm", 0.012, -0.080, 0.028),
            Row("ELB", "upper_arm", "arm", 0.000, -0.186, ON_ELBOW, True),
            Row("WRA", "forearm", "forearm", 0.000, -0.146, 0.017, True),
            Row("WRB", "forearm", "forearm", 0.000, -0.146, -0.017, True),
            Row("FHD", "head", "head", 0.055, 0.100, 0.040),
            Row("BHD", "head", "head", -0.050, 0.100, 0.040),
            Row("T10", "torso", "trunk", -0.055, 0.107, 0.0, True),
            Row("STRN", "torso", "trunk", 0.060, 0.170, 0.0),
            Row("CLAV", "torso", "trunk", 0.055, 0.232, 0.0),
            Row("C7", "torso", "trunk", -0.055, 0.266, 0.0),
        ),
    ),
}
"""Marker lists by the name of the marker set."""


def draw_sites(rng: np.random.Generator, subject: SimulatedSubject, markers: MarkerList) -> tuple[Site, ...]:
    """Marker sites of the subject, as `dynakin.simulation.bodies.markers.draw_sites`: each is put down off its
    usual place (`SCATTER_M`), paired landmarks where they belong."""
    sites = []
    for row in markers.rows:
        y = row.y
        if row.part in _SPREAD:  # along the segment, so that a marker at its end stays at its end
            y = y / _SPREAD[row.part] * subject.lengths[row.part] / subject.height_m
        place = subject.height_m * np.array([row.x, y, row.lateral])
        if row.lateral == 0.0 and row.part not in PAIRED:
            off = SCATTER_M * rng.standard_normal(3)
            sites.append(Site(row.stem, row.part, row.region, place + off, row.landmark, _driver(row, "_r")))
            continue
        for side, sign in (("right", 1.0), ("left", -1.0)):
            off = np.zeros(3) if row.landmark else SCATTER_M * rng.standard_normal(3)
            name, suffix = markers.name(row, side), f"_{side[0]}"
            segment = row.part + suffix if row.part in PAIRED else row.part
            place_of = place * [1.0, 1.0, sign] + off
            sites.append(Site(name, segment, row.region, place_of, row.landmark, _driver(row, suffix)))
    return tuple(sites)


def _driver(row: Row, suffix: str) -> str:
    return _MIDDLE_DRIVERS[row.region] if row.region in _MIDDLE_DRIVERS else _DRIVERS[row.region] + suffix
