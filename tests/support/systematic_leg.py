"""A pelvis, thigh and shank of which everything is known, right or misplaced, and systematic errors of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from dynakin.bindings import _core
from dynakin.filter.uncertainty.frames import Frame, Frames
from dynakin.filter.uncertainty.geometry import BLOCKS, Blocks, Parts
from dynakin.filter.uncertainty.sizes import Sizes
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.model.calibration.calibrated import Provenance
from dynakin.results.measures.sources import MEASURED
from dynakin.settings.noise import Noise
from dynakin.tree import Tree

Array = npt.NDArray[np.float64]

X, Y, Z = np.eye(3)
NOT, AS_IT_IS = np.zeros(3), np.eye(3)
REFERENCE = np.zeros(10)
Q = np.array([0.1, 0.9, -0.2, 0.2, 0.1, 0.3, 0.6, -0.2, 0.25, -0.9])
QD = np.array([0.4, -0.1, 0.2, 0.5, -0.3, 0.6, 1.2, 0.4, -0.7, -1.5])
QDD = np.array([1.0, 0.5, -1.0, 2.0, 1.0, -2.0, 5.0, -3.0, 2.0, 6.0])
CONTACT = np.array([40.0, 500.0, -60.0, 30.0, -20.0, 90.0])
"""N, N m about the ground's origin, on the shank."""
RATE = np.array([-900.0, 4000.0, 300.0, 200.0, 100.0, 700.0])
"""By how much the contact changes, N and N m a second."""
SIZES = (
    0.01,
    0.013,
    0.011,
    0.02,
    0.025,
    0.03,
    0.05,
    0.04,
    0.06,
    0.065,
    0.07,
    0.09,
    0.012,
    0.008,
    0.3,
    0.015,
    0.5,
    0.004,
    2.0,
    0.7,
)
MOVING, MOMENTS_MOVING, OFF_PLATES = 0.1, 0.05, 0.2
NONE = Sizes(
    *np.zeros(len(SIZES) - 2),
    skin_found=1.0,
    placed=np.inf,
    own_speeds=MOVING,
    own_moments=MOMENTS_MOVING,
    vigorous=np.inf,
    own_off_plates=OFF_PLATES,
)
DECLARED = np.repeat([0.014, 0.018, 0.010], 4)


def by_rate() -> Array:
    """(C,) what moments change by a second, where the motion stays and the contact goes on changing."""
    now, then = np.zeros((2, 3, 6))
    now[2], then[2] = CONTACT, CONTACT + RATE
    x = np.r_[Q, QD, QDD]
    return np.asarray(_core.joint_moments(_core.Model(spec()), x, then)) - _core.joint_moments(
        _core.Model(spec()), x, now
    )


def spec(
    hip: Array = NOT, knee: Array = NOT, turned: Array = AS_IT_IS, roll: float | None = None, power: int = 1
) -> _core.ModelSpec:
    """Pelvis, thigh and shank; the hip and the knee misplaced on all their bones, the knee's axis turned on both; the
    knee's centre moves forward by ``roll`` m a radian to this ``power``, where it does."""
    names = ["tx", "ty", "tz", "tilt", "list", "rotation", "flexion", "adduction", "turn", "knee"]
    root = [_core.AxisSpec(n, "translation", e) for n, e in zip(names[:3], (X, Y, Z), strict=True)]
    root += [_core.AxisSpec(n, "rotation", e) for n, e in zip(names[3:6], (Z, X, Y), strict=True)]
    ball = [_core.AxisSpec(n, "rotation", e) for n, e in zip(names[6:9], (Z, X, Y), strict=True)]
    inertia = {
        "pelvis": np.array([10.0, 0.1, 0.2, 0.0, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0]),
        "thigh": np.array([8.0, 0.1, -1.6, 0.1, 0.5, 0.05, 0.5, 0.0, 0.0, 0.0]),
        "shank": np.array([4.0, 0.0, -0.8, 0.0, 0.3, 0.02, 0.3, 0.0, 0.0, 0.0]),
    }
    rolls = [] if roll is None else [_core.AxisSpec("knee", "translation", X, [0.0] * power + [1.0], "roll")]
    segments = [
        _core.SegmentSpec("pelvis", axes=root, inertia=inertia["pelvis"]),
        _core.SegmentSpec(
            "thigh", "pelvis", translation=np.array([-0.05, -0.08, 0.08]) + hip, axes=ball, inertia=inertia["thigh"]
        ),
        _core.SegmentSpec(
            "shank",
            "thigh",
            translation=np.array([0.0, -0.4, 0.0]) - hip + knee,
            axes=[*rolls, _core.AxisSpec("knee", "rotation", turned @ Z)],
            inertia=inertia["shank"],
        ),
    ]
    rng = np.random.default_rng(1)
    markers = [
        _core.MarkerSpec(f"{s}{k}", s, rng.normal(0.0, 0.1, 3) + centre, estimated=[False] * 3)
        for s, centre in (("pelvis", np.zeros(3)), ("thigh", -0.2 * Y), ("shank", -0.2 * Y))
        for k in range(4)
    ]
    lengths = [] if roll is None else [_core.ParameterSpec("roll", roll, False)]
    return _core.ModelSpec("leg", [_core.CoordinateSpec(n) for n in names], lengths, segments, markers)


def changed(**errors: Array) -> _core.Model:
    """A misplaced model whose markers lie on its bones where the reference posture shows them."""
    right, wrong = _core.Model(spec()), spec(**errors)
    places = _core.marker_positions(right, np.zeros(30))
    R, p = _core.segment_poses(_core.Model(wrong), np.zeros(30))
    markers = wrong.markers
    for marker, place in zip(markers, places, strict=True):
        k = ["pelvis", "thigh", "shank"].index(marker.segment)
        marker.position = R[k].T @ (place - p[k])
    wrong.markers = markers
    return _core.Model(wrong)


def calibrated() -> Any:
    model = spec()
    return SimpleNamespace(
        provenance=Provenance(),
        heavy=False,
        own_inertia=False,
        spec=model,
        tree=Tree.of(model.segments),
        names=tuple(_core.Model(model).layout.names),
        x0=_core.Model(model).initial_state(),
        sd0=np.zeros(_core.Model(model).layout.size),
        prior_sd={},
        unshown_sd={},
        plan=None,
        feet={"right": "shank"},
        soft_tissue_m=DECLARED,
        marker_variance=np.zeros(12),
        unmodelled_m=0.0,
        recorded_markers=tuple(m.name for m in model.markers),
        lower=np.full(30, -np.inf),
        upper=np.full(30, np.inf),
        held={},
    )


def systematic() -> Systematic:
    return Systematic(calibrated(), Noise())


def parts_of(
    subject: Systematic, q: Array, qd: Array, qdd: Array, external: Array | None = None, used: Any = None
) -> Parts:
    """Of one frame in which nothing else is unsure."""
    x = np.concatenate([q, qd, qdd, subject.geometry.x0[3 * len(q) :]])
    loads = np.zeros((len(subject.geometry.model.segment_names), 6)) if external is None else external
    known = np.zeros(len(x)), np.zeros((len(x),) * 2)
    return subject.parts_at(Frame(subject.geometry, x, loads, np.zeros_like(loads), used, known))


def one_frame(own: Blocks, x: Array, P: Array, *, late: bool, rate: Array | None = None, scale: float = 1.0) -> Frames:
    """A session's frame of covariance P by noise of this scale, with the contact on the shank."""
    return Frames(
        time=np.zeros(1),
        step_s=np.nan,
        states=x[None],
        sd={block: sd[None] for block, sd in own.items()},
        known_sd=np.ones((1, len(x))),
        known=P / scale,
        wrench=CONTACT[None, None],
        wrench_rate=np.zeros((1, 1, 6)) if rate is None else rate[None, None],
        segments=["shank"],
        used=np.ones((1, 12), dtype=bool),
        sources=np.full((1, len(Q)), MEASURED, dtype=np.uint8),
        ends=np.zeros(1, dtype=bool),
        off_plates=False,
        late=late,
        variance_scale=scale,
    )


def with_errors(subject: Systematic, *given: Any, **how: Any) -> Blocks:
    """With the errors of `one_frame`."""
    frames = one_frame(*given, scale=subject._variance_scale, **how)
    return {block: sd[0] for block, sd in subject.added(frames).items()}


def over_time(data: xr.Dataset) -> Frames:
    """Of a recording with or without estimates and deviations."""
    shape = (len(data["time"]), len(Q))
    blocks = {f"{block}{end}": (("time", "coordinate"), np.zeros(shape)) for block in BLOCKS for end in ("", "_sd")}
    return Frames.of(data.assign(blocks), 1, 1.0, late=False)


def with_motion(x: Array) -> Array:
    """The state in the movement of Q, QD and QDD."""
    moving = x.copy()
    moving[: 3 * len(Q)] = np.concatenate([Q, QD, QDD])
    return moving
