"""On data drawn from its own model the filter's uncertainties are true: NIS, NEES, coverage, refusals."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from support.core.bridge import filter_of
from support.core.own_model import chain, draw, settings
from support.core.random_models import PLANE
from support.oracle import gate
from support.oracle.state import Layout

SEEDS, FRAMES = 80, 200
LOOKED_AT = (0, 20, 60, 120, 199)  # frames, for NEES


@cache
def trials():
    spec = chain()
    return spec, Layout(spec), draw(spec, SEEDS, FRAMES)


def run(trial, until=FRAMES, **changes):
    spec, layout, data = trials()
    f = filter_of(spec, settings(layout, **changes), data.x0, data.P0)
    out = f.run(data.time[:until], data.markers[trial, :until], data.wrench[trial, :until])
    return out, f.covariance


@cache
def outcome():
    """state, state_sd (seeds, T, n), nis, rows (seeds, T)."""
    runs = [run(trial)[0] for trial in range(SEEDS)]
    return {key: np.array([out[key] for out in runs]) for key in ("state", "state_sd", "nis", "n_rows")}


def test_angles_are_small_enough_that_linearisation_is_not_the_question():
    _, layout, data = trials()
    angles = data.truth[:, :, layout.block("coordinates")]
    assert 0.05 < np.abs(angles).max() < 0.6
    assert np.sqrt((angles**2).mean()) < 0.1


def test_the_innovations_are_as_large_as_they_were_said_to_be():
    """Mean NIS within 5 % of one a degree of freedom; and not only on average over a trial."""
    out = outcome()
    assert out["nis"].sum() / out["n_rows"].sum() == pytest.approx(1.0, abs=0.05)
    for part in np.array_split(np.arange(FRAMES), 4):
        assert out["nis"][:, part].sum() / out["n_rows"][:, part].sum() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("frame", LOOKED_AT)
def test_the_errors_are_as_large_as_they_were_said_to_be(frame):
    """NEES summed over seeds lies within the chi-square bounds that one honest filter in a thousand leaves."""
    _, layout, data = trials()
    nees = 0.0
    for trial in range(SEEDS):
        out, P = run(trial, frame + 1)
        error = out["state"][-1] - data.truth[trial, frame]
        sd = np.sqrt(np.diag(P))
        nees += (error / sd) @ np.linalg.solve(P / np.outer(sd, sd), error / sd)
    freedom = SEEDS * layout.size
    assert chi2.ppf(0.0005, freedom) < nees < chi2.ppf(0.9995, freedom), nees / freedom


def test_the_truth_lies_in_the_95_percent_interval_in_93_to_97_percent_of_cases():
    _, layout, data = trials()
    out = outcome()
    inside = np.abs(out["state"] - data.truth) < 1.959964 * out["state_sd"]
    assert 0.93 < inside.mean() < 0.97
    for block in layout.blocks:
        if layout.blocks[block][1] == 0:  # nobody touches anything here
            continue
        share = inside[:, :, layout.block(block)].mean()
        assert 0.92 < share < 0.98, (block, share)  # fewer cases each


def test_a_gate_refuses_as_many_good_sensors_as_it_was_told_to():
    probability = 0.01
    _, _, data = trials()
    limits = gate.limits(probability)
    verdicts = np.array([run(trial, marker_gate=limits, wrench_gate=limits)[0]["verdicts"] for trial in range(SEEDS)])
    for sensors in (verdicts[:, :, :-1], verdicts[:, :, -1:]):
        refused = (sensors == 2).sum() / (sensors > 0).sum()
        assert refused == pytest.approx(probability, rel=0.3)
    seen = ~np.isnan(data.markers[..., PLANE]).any(axis=-1)
    np.testing.assert_array_equal(verdicts[:, :, :-1] > 0, seen)


def test_a_filter_that_thinks_too_well_of_itself_would_not_pass():
    """The same data and a third of the noise: NIS, NEES and coverage all leave their bounds."""
    _, layout, data = trials()
    nis = rows = inside = 0.0
    for trial in range(10):
        out, _ = run(trial, marker_variance=settings(layout)["marker_variance"] / 9)
        nis, rows = nis + out["nis"].sum(), rows + out["n_rows"].sum()
        inside += (np.abs(out["state"] - data.truth[trial]) < 1.959964 * out["state_sd"]).mean() / 10
    assert nis / rows > 1.3
    assert inside < 0.93
