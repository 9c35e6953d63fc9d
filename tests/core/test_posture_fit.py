"""The core's least squares of one frame against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from dynakin.bindings import _core


def arm() -> _core.Model:
    """Three joints in a row, three markers on each segment."""
    names = ["flexion", "spread", "turn", "elbow", "wrist"]
    axes = {"flexion": [0.0, 0.0, 1.0], "spread": [1.0, 0.0, 0.0], "turn": [0.0, 1.0, 0.0]}
    upper = [_core.AxisSpec(name, "rotation", np.array(axis)) for name, axis in axes.items()]
    down = np.array([0.0, -0.3, 0.0])
    segments = [
        _core.SegmentSpec("upper", axes=upper),
        _core.SegmentSpec("fore", "upper", translation=down, axes=[_core.AxisSpec("elbow")]),
        _core.SegmentSpec("hand", "fore", translation=down, axes=[_core.AxisSpec("wrist")]),
    ]
    places = [[0.05, -0.1, 0.0], [0.0, -0.25, 0.04], [-0.03, -0.2, -0.05]]
    markers = [
        _core.MarkerSpec(f"{s.name}{k}", s.name, np.array(place), estimated=[False] * 3)
        for s in segments
        for k, place in enumerate(places)
    ]
    return _core.Model(_core.ModelSpec("arm", [_core.CoordinateSpec(name) for name in names], [], segments, markers))


@pytest.mark.parametrize("seed", range(6))
def test_it_is_a_minimum_of_scipys(seed: int) -> None:
    """Given noisy markers, some not seen, and bounds that the true posture breaks, it ends where SciPy stays."""
    model, rng = arm(), np.random.default_rng(seed)
    x = np.zeros(model.layout.size)
    x[:5] = rng.uniform(-0.9, 0.9, 5)
    targets = _core.marker_positions(model, x) + 0.005 * rng.normal(size=(9, 3))
    targets[rng.choice(9, 2, replace=False)] = np.nan
    targets[0, 1] = np.nan
    lower, upper = np.full(5, -0.6), np.full(5, 0.6)
    pull, rest = np.array([0.0, 0.0, 1e-2, 0.0, 1e-2]), np.full(5, 0.1)
    seen = np.isfinite(targets)

    def residual(q: np.ndarray) -> np.ndarray:
        state = np.zeros(model.layout.size)
        state[:5] = q
        return np.concatenate([(_core.marker_positions(model, state) - targets)[seen], pull * (q - rest)])

    q, cost, found = _core.fit_posture(model, np.zeros(len(x)), targets, lower, upper, np.ones(5), pull, rest)
    assert found
    assert ((q >= lower) & (q <= upper)).all()
    # From close by: beyond the bounds of a joint there may be several minima.
    start = np.clip(q + 0.01 * rng.normal(size=5), lower + 1e-6, upper - 1e-6)
    exact = least_squares(residual, start, bounds=(lower, upper), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    assert cost <= exact.cost * (1.0 + 1e-9)
    np.testing.assert_allclose(q, exact.x, atol=1e-5)  # SciPy stays off its bounds a little


def test_what_does_not_fit_is_named() -> None:
    model = arm()
    x, wide, none = np.zeros(model.layout.size), np.full(5, np.inf), np.zeros(5)
    nothing = np.full((9, 3), np.nan)
    with pytest.raises(ValueError, match="no marker is measured"):
        _core.fit_posture(model, x, nothing, -wide, wide, none + 1.0, none, none)
    with pytest.raises(ValueError, match="expected 5 numbers, a coordinate each, found 2"):
        _core.fit_posture(model, x, nothing + 1.0, -wide[:2], wide, none + 1.0, none, none)
    with pytest.raises(ValueError, match="9 markers, found 15 and 4"):
        _core.fit_posture(model, x, np.zeros((4, 3)), -wide, wide, none + 1.0, none, none)


def test_nothing_to_fit_is_fitted() -> None:
    axis = _core.AxisSpec("elbow")
    marker = _core.MarkerSpec("hand", "arm", np.ones(3), estimated=[False] * 3)
    locked = [_core.CoordinateSpec("elbow", 0.3, True)]
    model = _core.Model(_core.ModelSpec("still", locked, [], [_core.SegmentSpec("arm", axes=[axis])], [marker]))
    none = np.zeros(0)
    x = np.zeros(model.layout.size)
    q, cost, found = _core.fit_posture(model, x, np.zeros((1, 3)), none, none, none, none, none)
    assert len(q) == 0 and found and cost > 0.0
