"""Skin that follows the joints, and markers that show a posture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.filter.uncertainty.skin import ROOT_SKIN
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.model.calibration.joint_motion import SKIN_ANGLE_RAD
from dynakin.model.state_priors import COMMON_SKIN
from dynakin.results.measures.sources import in_use
from dynakin.settings.noise import Noise
from support.systematic_leg import (
    DECLARED,
    QD,
    QDD,
    Q,
    calibrated,
    parts_of,
    spec,
    systematic,
)

Array = npt.NDArray[np.float64]


def test_skin_that_follows_the_knee_is_that_of_displaced_markers() -> None:
    """One marker's own displacement and one segment's common one, drawn: the variances are those of the fits."""
    rng = np.random.default_rng(2)
    model, right = _core.Model(spec()), np.r_[Q, np.zeros(20)]
    sd = 0.5 * np.repeat([0.014, 0.018, 0.010], 4)
    weight = 1.0 / np.hypot(0.0007, sd)[:, None]
    J = (_core.marker_jacobian(model, right)[:, :10].reshape(12, 3, 10) * weight[..., None]).reshape(36, 10)
    drives = {"pelvis": [6, 7, 8], "thigh": [6, 7, 8, 9], "shank": [9]}
    s = np.tanh(Q / SKIN_ANGLE_RAD)
    draws = []
    for _ in range(4000):
        d = np.zeros((12, 3))
        for k, (_, coordinates) in enumerate(drives.items()):
            for c in coordinates:
                own, common = rng.standard_normal((4, 3)), rng.standard_normal(3)
                d[4 * k : 4 * k + 4] += s[c] * (np.sqrt(1.0 - COMMON_SKIN) * own + np.sqrt(COMMON_SKIN) * common)
        d[:4] *= ROOT_SKIN
        d *= DECLARED[:, None] * weight
        draws.append(np.linalg.solve(J.T @ J + 4.0 * np.eye(10), J.T @ d.ravel()))
    parts = parts_of(systematic(), Q, QD, QDD)["skin"]
    np.testing.assert_allclose(np.sqrt(parts["coordinates"]), np.std(draws, axis=0), rtol=0.06)


def test_markers_that_nobody_sees_show_nothing() -> None:
    """Two markers of four on the segment that floats: what the skin of the others does counts for more."""
    unsure, used = systematic(), np.ones(12, dtype=bool)
    seen = parts_of(unsure, Q, QD, QDD, used=used)
    np.testing.assert_array_equal(seen["skin"]["moments"], parts_of(unsure, Q, QD, QDD)["skin"]["moments"])
    used[:2] = False
    gone = parts_of(unsure, Q, QD, QDD, used=used)
    assert gone["skin"]["coordinates"][:6].sum() > 1.5 * seen["skin"]["coordinates"][:6].sum()
    gain, _ = unsure.geometry.gain(unsure.geometry.errors.state(Q, QD, QDD), used)
    assert not gain[:, np.repeat(~used, 3)].any() and np.isfinite(gain).all()


def test_a_marker_shows_the_posture_until_a_fifth_of_a_second_after_it_was_seen() -> None:
    time, seen = np.arange(100) / 100.0, np.ones((100, 3), dtype=bool)
    seen[20:35, 0] = seen[50:90, 0] = seen[:, 1] = False
    used = in_use(seen, time)
    assert used[:50, 0].all() and not used[50:90, 0].any() and used[90:, 0].all()
    assert not used[:, 1].any() and used[:, 2].all()


def test_speeds_of_skin_are_the_rates_of_its_angles() -> None:
    """The same random displacement along the motion: its variance of speed, by differences of its effect in time."""
    subject = systematic()
    parts = parts_of(subject, Q, QD, np.zeros(10))["skin"]
    h = 1e-3
    ahead, back = (parts_of(subject, Q + t * QD, QD, np.zeros(10))["skin"]["coordinates"] for t in (h, -h))
    # d/dt sd^2 = 2 cov(angle, speed), at most 2 sd(angle) sd(speed)
    slope = np.abs(ahead - back) / (2.0 * h)
    assert (slope <= 2.0 * np.sqrt(parts["coordinates"] * parts["speeds"]) * 1.001).all()
    still = parts_of(subject, Q, np.zeros(10), np.zeros(10))["skin"]
    np.testing.assert_allclose(still["speeds"], 0.0, atol=1e-12)


def test_more_skin_than_usual_counts_for_more_and_less_for_no_less() -> None:
    subject = Systematic(calibrated(), Noise())
    usual = subject.sizes.skin_found
    assert subject.with_found(0.0, skin=0.5 * usual).sizes == subject.with_found(0.0).sizes == subject.sizes
    assert subject.with_found(0.0, skin=2.0 * usual).sizes == replace(subject.sizes, skin=2.0 * subject.sizes.skin)
