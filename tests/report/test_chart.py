"""The small panels of a page."""

import re

import numpy as np
import pytest
from matplotlib.ticker import MaxNLocator

from dynakin.report.chart import Line, chart, round_levels

MOMENTS = (1.0, 2.0, 2.5, 5.0)


@pytest.mark.parametrize(("most", "steps"), [(5, None), (6, MOMENTS)])
def test_levels_are_those_of_matplotlib(most: int, steps: tuple[float, ...] | None) -> None:
    rng = np.random.default_rng(3)
    locator = MaxNLocator(most, steps=None if steps is None else [*steps, 10])
    for _ in range(2000):
        low, size = 10.0 ** rng.uniform(-4.0, 4.0, 2) * [rng.choice([-1.0, 1.0]), 1.0]
        high = low + max(size, 0.02 * abs(low))  # nearer to each other Matplotlib counts from an offset
        expected = np.asarray(locator.tick_values(low, high))
        inside = expected[(expected >= low) & (expected <= high)]
        found = round_levels(low, high, most) if steps is None else round_levels(low, high, most, steps)
        np.testing.assert_allclose(found, inside, rtol=1e-9, atol=1e-9 * size)


def test_levels_at_both_ends_count() -> None:
    np.testing.assert_allclose(round_levels(-0.5, 0.15, 5), [-0.45, -0.3, -0.15, 0.0, 0.15], atol=1e-15)
    np.testing.assert_allclose(round_levels(0.0, 10.0, 6, MOMENTS), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0])


@pytest.mark.parametrize("move", [0.0, 1e-8, 1e-3, 0.5, 40.0])
@pytest.mark.parametrize("value", [0.02, 18.0, 246.0, -700.0])
def test_no_two_levels_have_one_label(value: float, move: float) -> None:
    time = np.linspace(0.0, 2.0, 50)
    panel = chart("Mass", "kg", time, [Line(value + move * time, "#000")])
    left = re.findall(r'text-anchor="end">([^<]+)<', panel.svg)
    assert len(left) > 1
    assert len(set(left)) == len(left)


def test_a_band_of_measured_values_ends_within_the_panel() -> None:
    time = np.linspace(0.0, 2.0, 50)
    sd = np.where(time > 1.5, 0.35, 0.1)  # of a range of 1
    svg = chart("Elbow", "deg", time, [Line(0.5 * time, "#000", sd=sd)]).svg
    assert 0.5 * time[-1] + 2.0 * sd[-1] < _top(svg)


def _top(svg: str) -> float:
    """Value at a panel's upper end, from the levels beside it."""
    levels = re.findall(r'y="(\d+)" text-anchor="end">([^<]+)<', svg)
    (low_y, low), (high_y, high) = ((int(y) - 28, float(text.replace("−", "-"))) for y, text in (levels[0], levels[-1]))
    return high + (high - low) * (high_y - 70) / (low_y - high_y)
