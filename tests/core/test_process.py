"""How state and covariance move between frames: white jerk, decay, and any time step."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from support.core.bridge import filter_of
from support.core.random_models import (
    continuous,
    planar_model,
    prior_sd,
    settings,
    spatial_model,
    with_contacts,
    with_slow_errors,
)
from support.oracle import process
from support.oracle.state import Layout

SPECS = [with_slow_errors(planar_model(50, n_segments=7), 1), with_slow_errors(spatial_model(6), 2)]
SPECS += [with_contacts(SPECS[0])]
each_spec = pytest.mark.parametrize("spec", SPECS, ids=lambda s: s.name)


def start(spec, seed=1):
    """A state in motion and a covariance with correlations everywhere."""
    rng, layout = np.random.default_rng(seed), Layout(spec)
    sd = prior_sd(layout)
    root = rng.normal(size=(layout.size, 2 * layout.size)) / np.sqrt(2 * layout.size)
    return layout.initial_state() + sd * rng.normal(size=layout.size), root @ root.T * np.outer(sd, sd)


def predicted(spec, options, steps):
    f = filter_of(spec, options, *start(spec))
    for dt in steps:
        f.predict(dt)
    return f.state, f.covariance


def noisy_everywhere(spec):
    """Densities on coordinates, speeds, lengths, places and the plates' delay too."""
    options, layout = continuous(spec, 3), Layout(spec)
    density = options["process_density"].copy()
    for block, value in {"coordinates": 1e-4, "speeds": 1e-2, "lengths": 1e-6, "markers": 1e-6}.items():
        density[layout.block(block)] = value
    density[layout.names.index("plates/delay")] = 1e-6
    return options | {"process_density": density}


@each_spec
@pytest.mark.parametrize("dt", [0.0, 1e-4, 0.01, 0.37])
def test_equals_van_loans_matrix_exponential(spec, dt):
    options, layout = noisy_everywhere(spec), Layout(spec)
    x, P = start(spec)
    F, Q = process.transition(layout, options["process_density"], options["decay_rate"], dt)
    actual_x, actual_P = predicted(spec, options, [dt])
    expected = F @ P @ F.T + Q
    sd = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(actual_x, F @ x, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(actual_P / np.outer(sd, sd), expected / np.outer(sd, sd), atol=1e-12)
    np.testing.assert_array_equal(actual_P, actual_P.T)


@each_spec
@pytest.mark.parametrize("parts", [[0.5, 0.5], [0.1, 0.7, 0.2], [0.0, 1.0], [0.01] * 100])
def test_steps_of_any_length_add_up(spec, parts):
    """Two half steps equal one: x and P to rounding, for white jerk, random walks and decay together."""
    options = noisy_everywhere(spec)
    x, P = predicted(spec, options, [0.05])
    in_parts, P_in_parts = predicted(spec, options, [0.05 * part for part in parts])
    sd = np.sqrt(np.diag(P))
    np.testing.assert_allclose(in_parts, x, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(P_in_parts / np.outer(sd, sd), P / np.outer(sd, sd), atol=1e-13)


@each_spec
def test_without_density_and_decay_nothing_but_the_papers_process_is_left(spec):
    """Declaring zeros equals declaring nothing, to the last bit."""
    paper, n = settings(spec, 3), Layout(spec).size
    x, P = predicted(spec, paper, [0.01] * 3)
    zeros = paper | {"process_density": np.zeros(n), "decay_rate": np.zeros(n)}
    same_x, same_P = predicted(spec, zeros, [0.01] * 3)
    np.testing.assert_array_equal(same_x, x)
    np.testing.assert_array_equal(same_P, P)


@each_spec
def test_what_decays_settles_at_its_declared_variance_and_forgets(spec):
    """density / (2 rate); mean 0, no correlation with what it knew at first."""
    options, layout = continuous(spec, 3), Layout(spec)
    decay = options["decay_rate"]
    decays = decay > 0
    assert decays.sum() > 3
    x, P = predicted(spec, options, [0.5] * 120)
    np.testing.assert_allclose(x[decays], 0.0, atol=1e-10)
    stationary = options["process_density"][decays] / (2 * decay[decays])
    np.testing.assert_allclose(np.diag(P)[decays], stationary, rtol=1e-12)
    constant = np.arange(layout.size)[layout.block("lengths")]
    sd = np.sqrt(np.diag(P))
    assert np.abs(P / np.outer(sd, sd))[np.ix_(decays, constant)].max() < 1e-10


@each_spec
def test_a_process_at_its_stationary_variance_stays_there(spec):
    options, layout = continuous(spec, 3), Layout(spec)
    decays = options["decay_rate"] > 0
    f = filter_of(spec, options, layout.initial_state(), np.diag(prior_sd(layout) ** 2))
    for dt in (0.004, 0.01, 1.0, 30.0):
        f.predict(dt)
        np.testing.assert_allclose(np.diag(f.covariance)[decays], prior_sd(layout)[decays] ** 2, rtol=1e-12)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("process_density", -1.0, "process_density"),
        ("process_density", np.nan, "process_density"),
        ("process_density", np.inf, "process_density"),
        ("decay_rate", -1.0, "decay_rate"),
        ("decay_rate", np.nan, "decay_rate"),
        ("decay_rate", np.inf, "decay_rate"),
    ],
)
def test_wrong_densities_and_rates_are_refused_by_name(key, value, text):
    spec = SPECS[0]
    options, layout = continuous(spec, 3), Layout(spec)
    changed = options[key].copy()
    changed[layout.block("soft_tissue").start] = value
    with pytest.raises(ValueError, match=f"{text}: of 'soft_tissue"):
        filter_of(spec, options | {key: changed}, *start(spec))
    with pytest.raises(ValueError, match=f"{key}: expected {layout.size} numbers"):
        filter_of(spec, options | {key: options[key][:-1]}, *start(spec))


@pytest.mark.parametrize("block", ["coordinates", "speeds", "accelerations", "lengths", "markers", "inertia"])
def test_only_soft_tissue_plates_and_contacts_may_decay(block):
    """A length or a mass that decays to 0 is a mistake."""
    spec = SPECS[0]
    options, layout = continuous(spec, 3), Layout(spec)
    decay = options["decay_rate"].copy()
    decay[layout.block(block).start] = 1.0
    with pytest.raises(ValueError, match=r"decay_rate: of '.*' is 1.0*, expected 0"):
        filter_of(spec, options | {"decay_rate": decay}, *start(spec))


def test_settings_show_what_they_were_given():
    options = continuous(SPECS[0], 3)
    kept = _core.FilterSettings(**options)
    for key in ("process_variance", "marker_variance", "lower", "upper"):
        np.testing.assert_array_equal(getattr(kept, key), options[key])


@each_spec
def test_constants_keep_clear_of_rounding(spec):
    """Constants that are known in one sum only: after many frames the correlations' smallest eigenvalue has left
    rounding, and no standard deviation has changed by more than a billionth."""
    layout = Layout(spec)
    first = layout.block("lengths").start
    x, P = start(spec)
    sd = np.sqrt(np.diag(P))
    same = np.outer(sd, sd)
    P[first:, first:] = (1.0 - 1e-13) * same[first:, first:]  # each a multiple of the others
    np.fill_diagonal(P, sd**2)
    P[:first, first:] = 0.0
    P[first:, :first] = 0.0
    still = {key: np.zeros(layout.size) for key in ("process_variance", "process_density")}
    f = filter_of(spec, settings(spec, 1) | still, x, P)
    for _ in range(4096):
        f.predict(1e-3)
    constants = [k for k in range(first, layout.size) if not layout.names[k].startswith(("soft_tissue", "plates"))]
    after = f.covariance[np.ix_(constants, constants)]
    grown = np.sqrt(np.diag(after))
    least = np.linalg.eigvalsh(after / np.outer(grown, grown))[0]
    assert 0.9e-10 < least < 1.3e-10
    np.testing.assert_allclose(grown, sd[constants], rtol=1e-9)
