"""Figures of agreement against signals whose figures are known."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.results.measures.fit import signal_fit, truth_error

TIME = np.arange(1000) / 100.0
SINE = np.sin(2.0 * np.pi * TIME)


def test_a_constant_error_is_normalised_by_rms_and_by_range() -> None:
    fit = signal_fit(4.0 * SINE, 4.0 * SINE + 1.0)
    assert fit.rms == pytest.approx(1.0)
    assert fit.nrms_rms_percent == pytest.approx(100.0 / np.sqrt(8.0), rel=1e-6)
    assert fit.nrms_range_percent == pytest.approx(100.0 / 8.0, rel=1e-3)
    assert fit.correlation == pytest.approx(1.0)


def test_frames_that_either_lacks_do_not_count() -> None:
    measured, estimated = SINE.copy(), SINE + 1.0
    measured[:100], estimated[100:200] = np.nan, np.nan
    estimated[:100] = 1e6
    assert signal_fit(measured, estimated).rms == pytest.approx(1.0)
    assert truth_error(measured, estimated).rms == pytest.approx(1.0)


def test_figures_that_are_not_defined_are_none() -> None:
    constant = np.full(1000, 2.0)
    fit = signal_fit(constant, constant + 1.0)
    assert (fit.rms, fit.nrms_range_percent, fit.correlation) == (1.0, None, None)
    assert fit.nrms_rms_percent == pytest.approx(50.0)
    assert signal_fit(SINE, np.full(1000, np.nan)) == (None, None, None, None)
    assert truth_error(SINE, np.full(1000, np.nan)) == (None, None, None)


def test_an_offset_counts_as_it_is_and_not_about_the_mean() -> None:
    error = truth_error(SINE, SINE + 3.0 + 0.1 * np.cos(2.0 * np.pi * TIME))
    assert error.mean == pytest.approx(3.0, abs=1e-9)
    assert error.rms_about_mean == pytest.approx(0.1 / np.sqrt(2.0), rel=1e-6)
    assert error.rms == pytest.approx(np.sqrt(9.0 + 0.005), rel=1e-6)
