"""A person in space is found from markers, in any pose and heading."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.model.calibration.pose_start import start_posture

Array = npt.NDArray[np.float64]
LIMITS_DEG = {"flexion": (-30.0, 120.0), "adduction": (-40.0, 30.0), "rotation": (-40.0, 40.0), "knee": (0.0, 140.0)}


def person(locked: tuple[str, ...] = ()) -> _core.Model:
    """Pelvis (free), trunk, and on both sides thigh, shank with foot and arm; four markers a segment."""
    axes = {"X": [1.0, 0.0, 0.0], "Y": [0.0, 1.0, 0.0], "Z": [0.0, 0.0, 1.0]}
    coordinates: list[str] = []

    def joint(chain: str, names: str, kind: str = "rotation") -> list[_core.AxisSpec]:
        own = names.split()
        coordinates.extend(own)
        return [_core.AxisSpec(n, kind, np.array(axes[a])) for a, n in zip(chain, own, strict=True)]

    root = joint("XYZ", "tx ty tz", "translation") + joint("ZXY", "tilt list turn")
    segments = [_core.SegmentSpec("pelvis", axes=root)]
    segments.append(
        _core.SegmentSpec(
            "trunk", "pelvis", translation=np.array([-0.1, 0.1, 0.0]), axes=joint("ZXY", "ext bend twist")
        )
    )
    for side, sign in (("r", 1.0), ("l", -1.0)):
        hip = joint("ZXY", f"flexion_{side} adduction_{side} rotation_{side}")
        segments.append(
            _core.SegmentSpec(f"thigh_{side}", "pelvis", translation=np.array([-0.05, -0.08, 0.09 * sign]), axes=hip)
        )
        knee = joint("Z", f"knee_{side}")
        down = np.array([0.0, -0.42, 0.0])
        segments.append(_core.SegmentSpec(f"shank_{side}", f"thigh_{side}", translation=down, axes=knee))
        arm = joint("ZXY", f"raise_{side} spread_{side} spin_{side}")
        segments.append(
            _core.SegmentSpec(f"arm_{side}", "trunk", translation=np.array([0.0, 0.4, 0.18 * sign]), axes=arm)
        )
    places = {
        "pelvis": [[0.0, 0.0, 0.12], [0.0, 0.0, -0.12], [-0.17, 0.02, 0.05], [-0.17, 0.02, -0.05]],
        "trunk": [[0.12, 0.3, 0.0], [-0.1, 0.35, 0.0], [0.0, 0.42, 0.2], [0.0, 0.42, -0.2]],
        "thigh": [[0.0, -0.4, 0.06], [0.06, -0.2, 0.05], [0.0, -0.3, 0.08]],
        "shank": [[0.0, -0.4, 0.04], [0.05, -0.2, 0.02], [0.14, -0.45, 0.01], [-0.05, -0.45, 0.0]],
        "arm": [[0.0, -0.28, 0.04], [0.03, -0.3, -0.02], [0.05, -0.5, 0.0]],
    }
    markers = [
        _core.MarkerSpec(f"{s.name}{k}", s.name, np.array(p) * [1.0, 1.0, -1.0 if s.name.endswith("_l") else 1.0])
        for s in segments
        for k, p in enumerate(places[s.name.split("_")[0]])
    ]
    named = [_core.CoordinateSpec(name, 0.0, name in locked) for name in coordinates]
    return _core.Model(_core.ModelSpec("person", named, [], segments, markers))


def limits(model: _core.Model) -> dict[str, tuple[float, float]]:
    found = {name: LIMITS_DEG.get(name.split("_")[0]) for name in model.coordinate_names}
    return {name: tuple(np.deg2rad(pair)) for name, pair in found.items() if pair is not None}


def posed(model: _core.Model, rng: np.random.Generator) -> tuple[Array, Array]:
    """A random pose within the limits at any heading, leaning by up to 60 deg: state and markers."""
    x = model.initial_state()
    for k, name in enumerate(c.name for c in model.spec.coordinates if not c.locked):
        low, high = limits(model).get(name, (-0.8, 0.8))
        x[k] = rng.uniform(low, high)
        if name == "turn":
            x[k] = rng.uniform(-np.pi, np.pi)
        if name in ("tilt", "list"):
            x[k] = rng.uniform(-1.0, 1.0)
        if name in ("tx", "ty", "tz"):
            x[k] = rng.uniform(-4.0, 4.0)
    return x, _core.marker_positions(model, x)


@pytest.mark.parametrize("seed", range(12))
def test_finds_any_pose_at_any_heading(seed: int) -> None:
    model, rng = person(), np.random.default_rng(seed)
    _, markers = posed(model, rng)
    noisy = markers + 0.002 * rng.normal(size=markers.shape)
    noisy[rng.choice(len(noisy), 5, replace=False)] = np.nan
    fit = start_posture(model, noisy, limits=limits(model))
    assert fit.rms_m < 0.006
    away = np.linalg.norm(_core.marker_positions(model, fit.x) - markers, axis=1)
    assert np.median(away) < 0.005
    np.testing.assert_array_equal(np.isnan(fit.distance_m), np.isnan(noisy[:, 0]))
    for name, (low, high) in limits(model).items():
        assert low <= fit.coordinates[name] <= high
    n = len(model.coordinate_names)
    assert not fit.x[n : 3 * n].any()  # at rest


@pytest.mark.parametrize("facing", [0.1, 2.0, -3.0])
def test_an_upright_person_has_no_list_beyond_a_quarter_turn(facing: float) -> None:
    """A fit that begins with the other reading of the same pose said 180 deg of list of somebody in a squat."""
    model = person()
    x, _ = posed(model, np.random.default_rng(2))
    tilt, list_, turn = (model.coordinate_names.index(name) for name in ("tilt", "list", "turn"))
    x[tilt], x[list_], x[turn] = -0.7, 0.05, facing
    other = x.copy()
    other[tilt], other[list_], other[turn] = x[tilt] + np.pi, np.pi - x[list_], x[turn] + np.pi
    markers = _core.marker_positions(model, x)
    np.testing.assert_allclose(_core.marker_positions(model, other), markers, atol=1e-9)
    fit = start_posture(model, markers, guess=other, limits=limits(model))
    assert [fit.coordinates[name] for name in ("tilt", "list", "turn")] == pytest.approx([-0.7, 0.05, facing], abs=0.02)


def test_a_locked_coordinate_stays_and_frames_are_averaged() -> None:
    model = person(locked=("twist",))
    x, markers = posed(model, np.random.default_rng(3))
    frames = np.repeat(markers[None], 5, axis=0)
    frames[2] += 0.5  # one frame that a median passes over
    fit = start_posture(model, frames, limits=limits(model))
    assert fit.coordinates["twist"] == 0.0
    assert fit.rms_m < 1e-3
    free = [c.name for c in model.spec.coordinates if not c.locked]
    turned = [k for k, name in enumerate(free) if name not in ("tx", "ty", "tz")]
    wrapped = (fit.x[turned] - x[turned] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(wrapped).max() < 0.02


def swapped(model: _core.Model, markers: Array) -> Array:
    """Right markers under left names; those in the middle in their mirrored order."""
    names = [m.name for m in model.spec.markers]
    other = {"pelvis0": "pelvis1", "pelvis2": "pelvis3", "trunk2": "trunk3"}
    other |= {b: a for a, b in other.items()}
    return markers[[names.index(_other_side(other.get(n, n))) for n in names]]


def _other_side(name: str) -> str:
    return name.replace("_r", "_?").replace("_l", "_r").replace("_?", "_l")


def test_says_what_is_wrong() -> None:
    model = person()
    x = model.initial_state()
    x[model.coordinate_names.index("knee_r")] = 0.6
    markers = _core.marker_positions(model, x)
    with pytest.raises(ModelError, match="times as far apart as the model's, expected metres"):
        start_posture(model, 1000.0 * markers, limits=limits(model))
    with pytest.raises(ModelError, match="left and right are swapped"):
        start_posture(model, swapped(model, markers), limits=limits(model))
    with pytest.raises(ModelError, match="2 markers are seen, expected at least 3"):
        few = np.full_like(markers, np.nan)
        few[:2] = markers[:2]
        start_posture(model, few)
    lost = markers.copy()
    lost[5] += 3.0
    with pytest.raises(ModelError, match="furthest off are trunk1"):
        start_posture(model, lost, limits=limits(model))
