"""Any marker set on the simulated whole body: where the places that sets name lie on it.

Rows as in `marker_rows`: in the segment's own frame over the body height, from the joint by which the segment hangs
(the pelvis: from the middle of the ASIS); lateral is outward. A place is worn under the first of its names. What is not
worn: the knee alignment device, which nobody walks with.

These are the truth of simulated persons, no copy of anatomy.toml by which their recordings are recognised, completed
and drafted: with its numbers here those would be tried on what they expect.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from dynakin.arrays import Array
from dynakin.model.markers.schema import Marker, MarkerSetFile
from dynakin.simulation.bodies.marker_rows import MALLEOLI, ON_ANKLE, ON_ELBOW, ON_KNEE, PAIRED, draw_sites
from dynakin.simulation.bodies.markers import MarkerList, Row, Site
from dynakin.simulation.bodies.subject import SimulatedSubject

# Place -> part, region, x, y, lateral, whether a landmark.
_PLACES: Mapping[str, tuple[str, str, float, float, float, bool]] = {
    "ASI": ("pelvis", "pelvis", 0.000, 0.000, 0.076, True),
    "PSI": ("pelvis", "pelvis", -0.122, 0.000, 0.028, True),
    "SACR": ("pelvis", "pelvis", -0.122, 0.000, 0.000, True),
    "ILC": ("pelvis", "pelvis", -0.040, 0.035, 0.080, False),
    "LV5": ("pelvis", "pelvis", -0.124, 0.022, 0.000, False),
    "GTR": ("thigh", "thigh", -0.005, -0.003, 0.045, False),
    "THI": ("thigh", "thigh", 0.005, -0.130, 0.060, False),
    "KNE": ("thigh", "knee", 0.000, -0.245, ON_KNEE, True),
    "KNM": ("thigh", "knee", 0.000, -0.245, -ON_KNEE, True),
    "PAT": ("thigh", "knee", 0.032, -0.235, 0.000, False),
    "KJ": ("thigh", "knee", 0.000, -0.245, 0.000, True),
    "KJC": ("thigh", "knee", 0.000, -0.245, 0.000, True),
    "HFB": ("shank", "shank", -0.012, -0.030, 0.030, False),
    "TTC": ("shank", "shank", 0.026, -0.036, 0.000, False),
    "TIB": ("shank", "shank", -0.008, -0.116, 0.024, False),
    "ANK": ("shank", "ankle", 0.000, MALLEOLI, ON_ANKLE, True),
    "ANM": ("shank", "ankle", 0.000, MALLEOLI, -ON_ANKLE, True),
    "AJ": ("shank", "ankle", 0.000, -0.246, 0.000, True),
    "AJC": ("shank", "ankle", 0.000, -0.246, 0.000, True),
    "HEE": ("foot", "heel", -0.037, -0.020, 0.000, True),
    "HEL": ("foot", "heel", -0.028, -0.018, 0.018, False),
    "HEM": ("foot", "heel", -0.028, -0.015, -0.018, False),
    "NAV": ("foot", "forefoot", 0.018, -0.010, -0.022, False),
    "MB1": ("foot", "forefoot", 0.035, -0.006, -0.018, False),
    "MB2": ("foot", "forefoot", 0.042, 0.000, -0.004, False),
    "MB5": ("foot", "forefoot", 0.022, -0.026, 0.028, False),
    "TOE": ("foot", "toe", 0.0909, -0.014, 0.000, True),
    "MT1": ("foot", "forefoot", 0.082, -0.022, -0.022, True),
    "MT5": ("foot", "forefoot", 0.065, -0.028, 0.030, True),
    "HAL": ("foot", "toe", 0.112, -0.022, -0.016, True),
    "TO2": ("foot", "toe", 0.114, -0.024, 0.000, True),
    "SMT": ("foot", "toe", 0.086, -0.030, 0.030, True),
    "LV1": ("torso", "trunk", -0.052, 0.060, 0.000, False),
    "T10": ("torso", "trunk", -0.055, 0.107, 0.000, True),
    "T8": ("torso", "trunk", -0.060, 0.160, 0.000, False),
    "T2": ("torso", "trunk", -0.060, 0.236, 0.000, False),
    "C7": ("torso", "trunk", -0.055, 0.266, 0.000, False),
    "CLAV": ("torso", "trunk", 0.055, 0.232, 0.000, False),
    "STRN": ("torso", "trunk", 0.060, 0.170, 0.000, False),
    "CHE": ("torso", "trunk", 0.056, 0.212, 0.035, False),
    "BAK": ("torso", "trunk", -0.070, 0.185, 0.050, False),
    "SHO": ("torso", "shoulder", 0.000, 0.249, 0.110, False),
    "ACB": ("torso", "shoulder", -0.030, 0.236, 0.108, False),
    "NJ": ("torso", "trunk", 0.000, 0.260, 0.000, True),
    "UPA": ("upper_arm", "arm", 0.012, -0.080, 0.028, False),
    "ELB": ("upper_arm", "arm", 0.000, -0.186, ON_ELBOW, True),
    "ELM": ("upper_arm", "arm", 0.000, -0.186, -ON_ELBOW, True),
    "EJ": ("upper_arm", "arm", 0.000, -0.186, 0.000, True),
    "EJC": ("upper_arm", "arm", 0.000, -0.186, 0.000, True),
    "OLE": ("forearm", "forearm", -0.018, 0.004, 0.000, False),
    "FRM": ("forearm", "forearm", 0.014, -0.060, 0.012, False),
    "WRA": ("forearm", "forearm", 0.000, -0.146, 0.017, True),
    "WRB": ("forearm", "forearm", 0.000, -0.146, -0.017, True),
    "WRI": ("forearm", "forearm", -0.008, -0.146, 0.000, True),
    "WJ": ("forearm", "forearm", 0.000, -0.146, 0.000, True),
    "FIN": ("hand", "forearm", -0.008, -0.046, 0.008, False),
    "HM5": ("hand", "forearm", -0.006, -0.043, -0.020, False),
    "HFT": ("hand", "forearm", 0.000, -0.095, 0.008, False),
    "FHD": ("head", "head", 0.055, 0.100, 0.040, False),
    "BHD": ("head", "head", -0.050, 0.100, 0.040, False),
    "TEM": ("head", "head", 0.010, 0.090, 0.045, False),
    "SEL": ("head", "head", 0.060, 0.090, 0.000, False),
    "OCC": ("head", "head", -0.055, 0.090, 0.000, False),
    "HDT": ("head", "head", 0.000, 0.155, 0.000, False),
    "NOS": ("head", "head", 0.065, 0.070, 0.000, True),
    "EYE": ("head", "head", 0.050, 0.085, 0.018, True),
    "EAR": ("head", "head", 0.000, 0.075, 0.042, True),
    "HDK": ("head", "head", 0.000, 0.150, 0.000, True),
}
_UNWORN = ("KAX", "KD1", "KD2")
_JOINTS = {"HJ": ("pelvis", "hip"), "HJC": ("pelvis", "hip"), "HJM": ("pelvis", "hip"), "SJ": ("torso", "shoulder"),
           "SJC": ("torso", "shoulder")}  # fmt: skip
# Where a cluster's markers lie on a segment: part, region, radius round its axis, and y of the first and the last.
_CLUSTERS: Mapping[str, tuple[str, str, float, float, float]] = {
    "pelvis": ("pelvis", "pelvis", 0.070, 0.010, 0.030),
    "thigh": ("thigh", "thigh", 0.050, -0.085, -0.180),
    "shank": ("shank", "shank", 0.028, -0.050, -0.160),
    "foot": ("foot", "forefoot", 0.020, 0.000, -0.010),
    "thorax": ("torso", "trunk", 0.070, 0.150, 0.230),
    "abdomen": ("torso", "trunk", 0.060, 0.030, 0.090),
    "upper_arm": ("upper_arm", "arm", 0.026, -0.060, -0.140),
    "forearm": ("forearm", "forearm", 0.020, -0.040, -0.110),
    "hand": ("hand", "forearm", 0.015, -0.020, -0.040),
    "head": ("head", "head", 0.050, 0.070, 0.110),
}
_OFF_MIDLINE_M = 0.014
_TURN = 2.4  # rad from one marker of a cluster to the next, so that no two lie on a line along the segment


def worn_sites(
    rng: np.random.Generator, subject: SimulatedSubject, marker_set: MarkerSetFile, joints: Mapping[str, Array]
) -> tuple[Site, ...]:
    """Marker sites of the subject who wears all of a set.

    Args:
        joints: places (3,) m of the right "hip" in the pelvis' frame and of the right "shoulder" in the torso's.
    """
    names: dict[tuple[str, str], str] = {}
    rows, exact = [], []
    on: dict[str, list[Marker]] = {}
    for marker in marker_set.markers:
        if marker.name not in _PLACES and marker.name not in _JOINTS:
            on.setdefault(marker.segment, []).append(marker)
    for marker in marker_set.markers:
        if marker.name in _UNWORN:
            continue
        if marker.name in _JOINTS:
            exact += _joint_sites(marker, joints)
            continue
        part, region, x, y, lateral, landmark = _PLACES.get(marker.name) or _in_cluster(marker, on[marker.segment])
        if marker.centre:
            rows.append(Row(marker.centre[0], part, region, x, y, 0.0, landmark))
            continue
        if lateral == 0.0 and part not in PAIRED:
            lateral = _OFF_MIDLINE_M  # of a pair about the midline
        names |= {(marker.name, side): marker.aliases(side)[0] for side in ("right", "left")}
        rows.append(Row(marker.name, part, region, x, y, lateral, landmark))
    drawn = draw_sites(rng, subject, MarkerList(lambda row, side: names[row.stem, side], tuple(rows)))
    return (*drawn, *exact)


def _in_cluster(marker: Marker, others: list[Marker]) -> tuple[str, str, float, float, float, bool]:
    part, region, radius, first, last = _CLUSTERS[marker.segment]
    k = others.index(marker)
    y = first + (last - first) * k / max(len(others) - 1, 1)
    x, lateral = radius * np.cos(1.0 + _TURN * k), radius * np.sin(1.0 + _TURN * k)
    if part not in PAIRED and not marker.centre:
        lateral = abs(lateral) + 0.02  # each side's on its own side
    return part, region, float(x), y, float(lateral), False


def _joint_sites(marker: Marker, joints: Mapping[str, Array]) -> list[Site]:
    """Joint centres on segments of the middle, where the subject has them."""
    part, joint = _JOINTS[marker.name]
    region = {"pelvis": "pelvis", "torso": "shoulder"}[part]
    found = []
    for side, sign in (("right", 1.0), ("left", -1.0), ("centre", 0.0)):
        driver = {"hip": "hip_flexion", "shoulder": "arm_flex"}[joint] + ("_l" if side == "left" else "_r")
        for name in marker.aliases(side)[:1]:
            found.append(Site(name, part, region, joints[joint] * [1.0, 1.0, sign], True, driver))
    return found
