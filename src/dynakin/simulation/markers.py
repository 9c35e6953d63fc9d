"""Where the simulated subject carries its markers: names of the ``opencap`` recordings, right and left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynakin.simulation.mechanics import TreeMotion
from dynakin.simulation.subject import SimulatedSubject

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Site:
    """A marker on a segment: name in the recording, segment, region of soft_tissue.toml, place (3,) m in the
    segment's frame."""

    name: str
    segment: str
    region: str
    place: Array


# Stem of the name, segment, region, (x, y) in the segment's frame as fractions of body height, lateral
# distance from the midline.
_Row = tuple[str, str, str, float, float, float]
_PAIRED: tuple[_Row, ...] = (
    ("toe", "foot", "toe", 0.000, 0.000, 0.120),
    ("5meta", "foot", "forefoot", -0.026, -0.014, 0.150),
    ("calc", "foot", "heel", -0.128, -0.006, 0.098),
    ("ankle", "shank", "ankle", 0.000, 0.000, 0.125),
    ("sh2", "shank", "shank", -0.020, 0.190, 0.128),
    ("sh3", "shank", "shank", -0.012, 0.110, 0.130),
    ("shank_antsup", "shank", "shank", 0.026, 0.200, 0.112),
    ("knee", "thigh", "knee", 0.000, 0.000, 0.108),
    ("thigh1", "thigh", "thigh", 0.045, 0.165, 0.106),
    ("thigh2", "thigh", "thigh", 0.042, 0.085, 0.104),
    ("thigh3", "thigh", "thigh", -0.025, 0.155, 0.125),
    ("thigh4", "thigh", "thigh", -0.020, 0.080, 0.116),
    (".ASIS", "pelvis", "pelvis", 0.036, 0.053, 0.076),
    (".PSIS", "pelvis", "pelvis", -0.086, 0.053, 0.028),
    ("Sternum", "trunk", "trunk", 0.055, 0.215, 0.014),
    ("Shoulder", "trunk", "shoulder", 0.000, 0.248, 0.095),
    ("humerus", "upper_arm", "arm", 0.012, -0.080, 0.125),
    ("elbow_lat", "upper_arm", "arm", 0.000, -0.186, 0.138),
    ("elbow_med", "upper_arm", "arm", 0.000, -0.186, 0.094),
    ("forearm", "forearm", "forearm", 0.014, -0.045, 0.128),
    ("wrist_radius", "forearm", "forearm", 0.017, -0.146, 0.112),
    ("wrist_ulna", "forearm", "forearm", -0.017, -0.146, 0.118),
)
_SINGLE: tuple[_Row, ...] = (("C7", "trunk", "trunk", -0.050, 0.262, 0.0),)
# The length along which a segment's markers are spread, and its part of the height on which the rows rest.
_LENGTH_OF = {
    "shank": ("shank", 0.246),
    "thigh": ("thigh", 0.245),
    "trunk": ("trunk", 0.236),
    "upper_arm": ("upper_arm", 0.186),
    "forearm": ("forearm", 0.146),
}
_LOWER = {"foot", "shank", "thigh"}  # the right side's names of these begin with r_, of the others with R_


def _name(stem: str, segment: str, side: str) -> str:
    if stem.startswith("."):  # r.ASIS, L.ASIS
        return f"{'r' if side == 'right' else 'L'}{stem}"
    if side == "left":
        return f"L_{stem}"
    return f"{'r' if segment in _LOWER else 'R'}_{stem}"


def draw_sites(rng: np.random.Generator, subject: SimulatedSubject, scatter_m: float = 0.006) -> tuple[Site, ...]:
    """Marker sites of the subject; each is put down ``scatter_m`` (standard deviation an axis) off its usual
    place.

    Landmarks stay where they belong (toe, heel, ankle, knee, elbow, wrist, pelvis): what their misplacement
    does is a sensor error of its own, not part of the subject.
    """
    landmark = {
        "toe",
        "calc",
        "ankle",
        "knee",
        ".ASIS",
        ".PSIS",
        "elbow_lat",
        "elbow_med",
        "wrist_radius",
        "wrist_ulna",
    }
    sites = []
    for stem, segment, region, x, y, z in _PAIRED + _SINGLE:
        scale = subject.height_m
        if segment in _LENGTH_OF:  # along the segment, so that a marker at its end stays at its end
            length, fraction = _LENGTH_OF[segment]
            y = y / fraction * subject.lengths[length] / scale
        place = scale * np.array([x, y, z])
        if z == 0.0:
            sites.append(Site(stem, segment, region, place + scatter_m * rng.standard_normal(3)))
            continue
        for side, sign in (("right", 1.0), ("left", -1.0)):
            off = np.zeros(3) if stem in landmark else scatter_m * rng.standard_normal(3)
            sites.append(Site(_name(stem, segment, side), segment, region, place * [1.0, 1.0, sign] + off))
    return tuple(sites)


def marker_positions(sites: Sequence[Site], moving: TreeMotion, displacement: Array | None = None) -> Array:
    """Positions (T, M, 3) m in the ground frame; ``displacement`` (T, M, 3) m is added in the segments'
    frames."""
    columns = []
    for k, site in enumerate(sites):
        body = moving.segments[site.segment]
        place = site.place if displacement is None else site.place + displacement[:, k]
        columns.append(body.origin + (body.rotation @ np.broadcast_to(place, body.origin.shape)[:, :, None])[:, :, 0])
    return np.stack(columns, axis=1)


def hip_centres(subject: SimulatedSubject, sites: Sequence[Site], markers: Array) -> dict[str, Array]:
    """Virtual markers R_HJC_reg and L_HJC_reg (T, 3) m, from the four pelvis markers as they were seen.

    A regression rests on the landmarks alone: a frame is laid on them (X from mid-PSIS to mid-ASIS, Z towards
    the right), and the centre lies at its fixed place in it. The regression is made exact for this subject,
    so that without soft-tissue motion the virtual marker is the true centre; with it, the centre moves with
    the skin.
    """
    names = [site.name for site in sites]
    rest = {site.name: site.place for site in sites}
    R_PL, o_P = _pelvis_frame(*(rest[n][None] for n in PELVIS_MARKERS))
    R_GL, o_G = _pelvis_frame(*(markers[:, names.index(n)] for n in PELVIS_MARKERS))
    result = {}
    for name, sign in (("R_HJC_reg", 1.0), ("L_HJC_reg", -1.0)):
        centre_P = np.array([0.0, 0.0, 0.5 * sign * subject.lengths["hip_width"]])
        p_L = R_PL[0].T @ (centre_P - o_P[0])
        result[name] = o_G + R_GL @ p_L
    return result


PELVIS_MARKERS = ("r.ASIS", "L.ASIS", "r.PSIS", "L.PSIS")


def _pelvis_frame(r_asis: Array, l_asis: Array, r_psis: Array, l_psis: Array) -> tuple[Array, Array]:
    """Rotation (T, 3, 3) and origin (T, 3) of the frame on the four landmarks."""
    front, back = 0.5 * (r_asis + l_asis), 0.5 * (r_psis + l_psis)
    x = front - back
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    z = r_asis - l_asis
    z = z - np.sum(z * x, axis=1, keepdims=True) * x
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2), front


def true_joint_centres(subject: SimulatedSubject, moving: TreeMotion) -> dict[str, Array]:
    """Joint centres (T, 3) m on the midline, ground frame: toe, ankle, knee, hip, lumbar, shoulder, elbow,
    wrist."""
    first = {"toe": "foot", "ankle": "shank", "knee": "thigh", "hip": "pelvis", "lumbar": "trunk"}
    first |= {"shoulder": "upper_arm", "elbow": "forearm"}
    centres = {joint: moving.segments[segment].origin for joint, segment in first.items()}
    centres["wrist"] = moving.segments["forearm"].point(np.array([0.0, -subject.lengths["forearm"], 0.0]))
    return centres
