"""Where the simulated subject carries its markers, and where they are when it moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dynakin.arrays import Array, cross
from dynakin.simulation.bodies.subject import SimulatedSubject
from dynakin.simulation.mechanics import TreeMotion


@dataclass(frozen=True)
class Site:
    """A marker on a segment.

    name: in the recording; region: of soft_tissue.toml; place: (3,) m in the segment's frame; landmark: it
    stands for a point of the skeleton, so where it is put matters to whoever starts from it; driver:
    coordinate that moves the skin under it, "" for the region's own.
    """

    name: str
    segment: str
    region: str
    place: Array
    landmark: bool = False
    driver: str = ""


@dataclass(frozen=True)
class Row:
    """A line of a marker list: a place on a part of the body, over the body height; lateral 0: on the midline."""

    stem: str
    part: str
    region: str
    x: float
    y: float
    lateral: float
    landmark: bool = False


@dataclass(frozen=True)
class MarkerList:
    """Rows, and how a row of the right or left side is named."""

    name: Callable[[Row, str], str]
    rows: tuple[Row, ...]


# The length along which a part's markers are spread, and its part of the height on which the rows rest.
SCATTER_M = 0.006
"""Standard deviation, an axis, by which a marker is put down off its usual place."""
_LENGTH_OF = {
    "shank": ("shank", 0.246),
    "thigh": ("thigh", 0.245),
    "trunk": ("trunk", 0.236),
    "upper_arm": ("upper_arm", 0.186),
    "forearm": ("forearm", 0.146),
    "abdomen": ("torso", 0.260),
}


def draw_sites(
    rng: np.random.Generator,
    subject: SimulatedSubject,
    markers: MarkerList,
    *,
    attach: Mapping[str, tuple[str, Array]] | None = None,
    drivers: Mapping[str, str] | None = None,
) -> tuple[Site, ...]:
    """Marker sites of the subject; each is put down off its usual place (`SCATTER_M`).

    Paired landmarks stay where they belong: what their misplacement does is a sensor error of its own
    (`misplace`), not part of the subject.

    Args:
        attach: part of the list -> (segment, place of the part's origin in it) where a tree has no segment of
            the part's name.
        drivers: region -> coordinate that moves its skin, where it is not the region's own.
    """
    sites = []
    for row in markers.rows:
        segment, shift = (attach or {}).get(row.part, (row.part, np.zeros(3)))
        driver = (drivers or {}).get(row.region, "")
        y = row.y
        if row.part in _LENGTH_OF:  # along the part, so that a marker at its end stays at its end
            length, fraction = _LENGTH_OF[row.part]
            y = y / fraction * subject.lengths[length] / subject.height_m
        place = subject.height_m * np.array([row.x, y, row.lateral]) + shift
        if row.lateral == 0.0:
            off = SCATTER_M * rng.standard_normal(3)
            sites.append(Site(row.stem, segment, row.region, place + off, row.landmark, driver))
            continue
        for side, sign in (("right", 1.0), ("left", -1.0)):
            off = np.zeros(3) if row.landmark else SCATTER_M * rng.standard_normal(3)
            name = markers.name(row, side)
            sites.append(Site(name, segment, row.region, place * [1.0, 1.0, sign] + off, row.landmark, driver))
    return tuple(sites)


def misplace(rng: np.random.Generator, sites: Sequence[Site], sd_m: float) -> tuple[Site, ...]:
    """The sites as somebody found them: landmarks off by ``sd_m`` (standard deviation an axis)."""
    off = sd_m * rng.standard_normal((len(sites), 3))
    return tuple(replace(s, place=s.place + d) if s.landmark else s for s, d in zip(sites, off, strict=True))


def marker_positions(sites: Sequence[Site], moving: TreeMotion, displacement: Array | None = None) -> Array:
    """Positions (T, M, 3) m in the ground frame; ``displacement`` (T, M, 3) m is added in the segments'
    frames."""
    columns = []
    for k, site in enumerate(sites):
        body = moving.segments[site.segment]
        place = site.place if displacement is None else site.place + displacement[:, k]
        columns.append(body.origin + (body.rotation @ np.broadcast_to(place, body.origin.shape)[:, :, None])[:, :, 0])
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class HipCentres:
    """Virtual hip centres: the pelvis markers that they rest on (right and left ASIS, right and left PSIS), their
    names (right, left), the regression's distance from the midline, m, and the middle between them (3,) m in the
    pelvis' frame. The joint may lie off it."""

    pelvis: tuple[str, str, str, str]
    names: tuple[str, str]
    half_width_m: float
    middle: Array = field(default_factory=lambda: np.zeros(3))


def hip_centres(hips: HipCentres, sites: Sequence[Site], markers: Array, error: Array) -> Array:
    """Virtual markers (T, 2, 3) m, right and left, from the four pelvis markers as they were seen.

    A regression rests on the landmarks alone: a frame is laid on them (X from mid-PSIS to mid-ASIS, Z towards
    the right), and the centre lies at its fixed place in it. For ``sites`` (where the landmarks belong) and no
    ``error`` (2, 3) m the place is exact; when the seen markers were misplaced or move with the skin, so does
    the centre. Missing where a pelvis marker is missing.
    """
    names = [site.name for site in sites]
    rest = {site.name: site.place for site in sites}
    R_PL, o_P = _pelvis_frame(*(rest[n][None] for n in hips.pelvis))
    R_GL, o_G = _pelvis_frame(*(markers[:, names.index(n)] for n in hips.pelvis))
    result = []
    for off, sign in zip(error, (1.0, -1.0), strict=True):
        centre_P = hips.middle + np.array([0.0, 0.0, sign * hips.half_width_m])
        p_L = R_PL[0].T @ (centre_P - o_P[0]) + off
        result.append(o_G + R_GL @ p_L)
    return np.stack(result, axis=1)


def _pelvis_frame(r_asis: Array, l_asis: Array, r_psis: Array, l_psis: Array) -> tuple[Array, Array]:
    """Rotation (T, 3, 3) and origin (T, 3) of the frame on the four landmarks."""
    front, back = 0.5 * (r_asis + l_asis), 0.5 * (r_psis + l_psis)
    x = front - back
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    z = r_asis - l_asis
    z = z - np.sum(z * x, axis=1, keepdims=True) * x
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, cross(z, x), z], axis=2), front
