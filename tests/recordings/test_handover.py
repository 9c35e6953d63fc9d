"""When stances take their load and give it up, and how it passes from foot to foot."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from dynakin.recordings.feet.contact import FootContact
from dynakin.recordings.feet.handover import (
    BOTH_S,
    EARLY_S,
    LATE_S,
    PASSING_S,
    Span,
    spans_of,
    stance_weights,
    supported,
)

RATE_HZ, FRAMES = 100.0, 200


def smooth(path: np.ndarray, frames: int = 5) -> np.ndarray:
    """As soft as skin is: a Hann window."""
    window = np.hanning(2 * frames + 3)
    return np.convolve(np.pad(path, len(window), mode="edge"), window / window.sum(), "same")[
        len(window) : -len(window)
    ]


def a_step(down: int, off: int, first: int, end: int, belt_m_s: float = 0.0) -> FootContact:
    """A heel that falls at 0.6 m/s until frame ``down`` and lies still, a toe that lies still until frame ``off`` and
    leaves forward and up; markers are slow and low in frames [first, end). Markers: back, front."""
    at = np.arange(FRAMES) / RATE_HZ
    heel = smooth(0.6 * np.maximum(down / RATE_HZ - at, 0.0))
    gone = np.maximum(at - off / RATE_HZ, 0.0)
    ahead, up = smooth(8.0 * gone**1.5), smooth(2.0 * gone**1.5)
    stands = (np.arange(FRAMES) >= first) & (np.arange(FRAMES) < end)
    outline = np.zeros((FRAMES, 2, 2))
    outline[:, 1, 0] = 0.2 + ahead
    outline[..., 0] += belt_m_s * at[:, None]
    blank: Any = np.zeros(FRAMES, bool)
    return FootContact(
        outline, np.stack([heel, up], axis=1), ~blank, np.zeros((FRAMES, 0), bool), np.zeros(FRAMES),
        np.tile([belt_m_s, 0.0], (FRAMES, 1)), np.tile(stands[:, None], (1, 2)), stands, ((first, end),), blank, blank,
        blank, blank,
    )  # fmt: skip


@pytest.mark.parametrize("belt_m_s", [0.0, -1.3])
@pytest.mark.parametrize("early", [-2, 0, 4])
def test_accelerations_say_when_whatever_the_thresholds_say(early: int, belt_m_s: float) -> None:
    """The same touch-down and toe-off where a marker is slow and low some hundredths earlier or later."""
    (span,) = spans_of(a_step(50, 120, 50 - early, 113 + early, belt_m_s), (0, 1), RATE_HZ)
    assert span.on == pytest.approx(50, abs=2) and span.off == pytest.approx(120, abs=4)


def test_where_nothing_shows_it_fixed_delays_are_taken() -> None:
    step = a_step(50, 120, 52, 113)
    for foot, ends in ((step, None), (replace(step, rise_m=np.full((FRAMES, 2), np.nan)), (0, 1))):
        (span,) = spans_of(foot, ends, RATE_HZ)
        assert span.on == 52 - EARLY_S * RATE_HZ and span.off == 112 + LATE_S * RATE_HZ
    (cut,) = spans_of(a_step(50, 120, 0, FRAMES), (0, 1), RATE_HZ)
    assert cut.on == -np.inf and cut.off == np.inf


def test_a_foot_that_is_not_seen_before_or_after_has_no_touch_down_or_toe_off_there() -> None:
    step, frames = a_step(50, 120, 50, 113), np.arange(FRAMES)
    (span,) = spans_of(replace(step, seen=(frames >= 50) & (frames < 113)), (0, 1), RATE_HZ)
    assert (span.on, span.off) == (-np.inf, np.inf)
    (span,) = spans_of(replace(step, seen=(frames < 113) | (frames > 150)), (0, 1), RATE_HZ)  # a gap: it lifts off
    assert span.on == pytest.approx(50, abs=2) and np.isfinite(span.off)


def test_one_foot_takes_what_the_other_gives() -> None:
    """In a double support of a walk the two weights are one together, and half each in its middle; where the feet stand
    together for longer than a walk does they are not."""
    right, left = Span(0, 60, -np.inf, 62.0), Span(50, 140, 48.0, 130.0)
    weights = stance_weights([[right], [left]], RATE_HZ, FRAMES)
    both = slice(48, 63)
    np.testing.assert_allclose(weights[both].sum(axis=1), 1.0)
    np.testing.assert_allclose(weights[55], 0.5)
    assert (np.diff(weights[both, 1]) > 0.0).all() and weights[47, 1] == 0.0 and weights[62, 1] == 1.0
    shortest = stance_weights([[right], [replaced(left, on=60.0)]], RATE_HZ, FRAMES)
    assert shortest[60 + round(BOTH_S[0] * RATE_HZ), 1] == 1.0 > shortest[63, 1]
    longer = stance_weights([[replaced(right, off=100.0)], [left]], RATE_HZ, FRAMES)
    assert longer[48 + round(PASSING_S * RATE_HZ), 1] == 1.0 and longer[70, 0] == 1.0


@pytest.mark.parametrize(("seconds", "rate"), [(0.2, 100.0), (0.28, 100.0), (0.28, 1000.0)])
def test_feet_that_land_and_leave_together_share_the_load(seconds: float, rate: float) -> None:
    """A hop: the one a frame before the other; none takes what the other gives."""
    frames, long = round(rate), seconds * rate
    on, end = 0.2 * rate, 0.2 * rate + long
    hop = [[Span(round(on), round(end), on, end)], [Span(round(on), round(end), on + 1.0, end + 1.0)]]
    weights = stance_weights(hop, rate, frames)
    inside = slice(round(on + 0.2 * long), round(end - 0.2 * long))
    share = weights[inside, 0] / weights[inside].sum(axis=1)
    np.testing.assert_allclose(share, 0.5, atol=0.2 * 100.0 / rate)
    within = [[Span(0, frames, 0.1 * rate, 0.9 * rate)], hop[0]]  # one stands throughout
    np.testing.assert_allclose(stance_weights(within, rate, frames)[inside, 0], 1.0)


def replaced(span: Span, **changed: float) -> Span:
    return span._replace(**changed)


def test_all_feet_together_stand_from_the_first_load_to_the_last() -> None:
    stood = np.zeros(FRAMES, bool)
    stood[20:120] = True
    spans = [[Span(20, 70, 17.0, 75.0)], [Span(60, 120, 58.0, 127.0)]]
    assert supported(stood, spans, RATE_HZ) == [Span(20, 120, 17.0, 127.0)]
    (unseen,) = supported(stood, [[], []], RATE_HZ)
    assert unseen.on == 20 - EARLY_S * RATE_HZ and unseen.off == 119 + LATE_S * RATE_HZ
