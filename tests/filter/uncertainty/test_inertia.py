"""Centres of mass off their places, inertia that a recording leaves open, and tables that do not fit the person."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from dynakin.bindings import _core
from dynakin.filter.uncertainty.reported import (
    OWN_AT_ONCE,
    STILL,
)
from dynakin.filter.uncertainty.sizes import LANDMARKS, usual_sizes
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.settings.noise import Noise
from support.made_in_space import measured
from support.systematic_leg import (
    CONTACT,
    NONE,
    QD,
    QDD,
    Q,
    calibrated,
    over_time,
    parts_of,
    spec,
    systematic,
    with_errors,
)

Array = npt.NDArray[np.float64]


def with_inertia() -> tuple[Any, Array]:
    """The model whose shank's mass and first moments are estimated, and its state."""
    model = spec()
    segments = model.segments
    segments[2].inertia_estimated = [True] * 4 + [False] * 6
    model.segments = segments
    subject, core = calibrated(), _core.Model(model)
    subject.spec, subject.names, subject.sd0 = model, tuple(core.layout.names), np.zeros(core.layout.size)
    subject.lower, subject.upper = np.full(34, -np.inf), np.full(34, np.inf)
    return subject, np.r_[Q, QD, QDD, core.initial_state()[30:]]


def by_inertia(subject: Any, x: Array, root: Array) -> Array:
    """(10,) variances of moments of bodies drawn with a covariance root root'."""
    core, external, h = _core.Model(subject.spec), np.zeros((3, 6)), 1e-3
    external[2] = CONTACT
    as_it_is = _core.joint_moments(core, x, external)
    change = [  # moments are linear in inertia
        (_core.joint_moments(core, x + h * np.r_[np.zeros(30), a], external) - as_it_is) / h for a in root.T
    ]
    return np.asarray(np.square(change).sum(axis=0))


def test_a_centre_of_mass_off_its_place_is_that_of_segments_that_are_changed() -> None:
    external = np.zeros((3, 6))
    external[2] = CONTACT
    x = np.r_[Q, QD, QDD]
    as_it_is = _core.joint_moments(_core.Model(spec()), x, external)
    expected = np.zeros(10)
    for k in range(3):
        for axis in range(3):
            model = spec()
            segments = model.segments
            inertia = np.array(segments[k].inertia)
            inertia[1 + axis] += 1e-3 * inertia[0]  # m times m: the first moment of a centre 1 mm off
            segments[k].inertia = inertia
            model.segments = segments
            expected += np.square((_core.joint_moments(_core.Model(model), x, external) - as_it_is) / 1e-3)
    parts = parts_of(systematic(), Q, QD, QDD, external)["mass_centre"]
    np.testing.assert_allclose(np.sqrt(parts["moments"]), np.sqrt(expected), rtol=1e-6)
    assert not any(parts[block].any() for block in ("coordinates", "speeds", "accelerations"))


def test_inertia_that_small_innovations_leave_open_is_known_by_the_declared_noise() -> None:
    """A shank's mass and first moments of some covariance, against moments of bodies drawn from it."""
    subject, x = with_inertia()
    root = 0.1 * np.random.default_rng(4).normal(size=(4, 4))
    P = np.zeros((34, 34))
    P[30:, 30:] = root @ root.T
    variance = by_inertia(subject, x, root)
    own = {block: np.zeros(10) for block in ("coordinates", "speeds", "accelerations")} | {"moments": np.sqrt(variance)}
    found = Systematic(subject, Noise(variance_scale=0.2), NONE)
    for late in (True, False):  # the factor on the filter's own counts nothing twice
        seen = with_errors(found, own, x, P, late=late)
        np.testing.assert_allclose(seen["moments"], np.sqrt(variance / 0.2), rtol=1e-6)
        np.testing.assert_array_equal(seen["speeds"], 0.0)
    for late, factor in ((True, STILL), (False, OWN_AT_ONCE["moments"][0])):
        wide = Systematic(subject, Noise(variance_scale=1.5 / factor), NONE)  # the filter's own part has more of it
        seen = with_errors(wide, own, x, P, late=late)
        np.testing.assert_allclose(seen["moments"], np.sqrt(factor * variance), rtol=1e-6)
        scaled = Systematic(subject, Noise(variance_scale=0.2), replace(NONE, inertia=False))
        seen = with_errors(scaled, own, x, P, late=late)
        np.testing.assert_allclose(seen["moments"], np.sqrt(factor * variance), rtol=1e-6)


def test_the_scale_of_systematic_errors_is_that_of_joints_and_skin() -> None:
    """What is not known of inertia has no usual size: another scale leaves it."""
    subject, x = with_inertia()
    subject.plan = SimpleNamespace(sites=())  # joints found from markers
    P = np.zeros((34, 34))
    P[30:, 30:] = 0.01 * np.eye(4)
    own = {block: np.zeros(10) for block in ("coordinates", "speeds", "accelerations", "moments")}
    said = [
        with_errors(Systematic(subject, Noise(variance_scale=0.2, systematic_scale=scale)), own, x, P, late=False)
        for scale in (1e-9, 1.0, 2.0)
    ]
    expected = (1.0 / 0.2 - OWN_AT_ONCE["moments"][0]) * by_inertia(subject, x, 0.1 * np.eye(4))
    np.testing.assert_allclose(said[0]["moments"], np.sqrt(expected), rtol=1e-6)
    np.testing.assert_allclose(said[2]["speeds"], 2.0 * said[1]["speeds"], rtol=1e-9)
    one, two = (np.square(each["moments"]) - expected for each in said[1:])
    np.testing.assert_allclose(two, 4.0 * one, rtol=1e-6)


def test_over_time_inertia_is_known_as_well_as_in_each_frame() -> None:
    """Deviations that a recording halves from frame to frame: moments' are those of a session at that moment."""
    subject, x = with_inertia()
    A = 0.1 * np.random.default_rng(4).normal(size=(4, 4))
    root = np.eye(34)
    root[30:, 30:] = A
    last, s = root @ root.T, 0.2
    time = 0.2 * np.arange(4)
    wider = 2.0 ** np.arange(4)[::-1]
    sd = np.sqrt(np.diag(last)) * np.array([np.r_[np.ones(30), np.full(4, w / np.sqrt(s))] for w in wider])
    data = xr.Dataset(
        {
            "state": (("time", "element"), np.tile(x, (4, 1))),
            "state_sd": (("time", "element"), sd),  # constants' by the declared noise
            "final_covariance": (("element", "element_"), last),
            "foot_wrench": (("time", "foot", "component"), np.tile(CONTACT, (4, 1, 1))),
            "markers_measured": (("time", "marker", "axis"), np.zeros((4, 12, 3))),
        },
        coords={"time": time, "foot_segment": ("foot", ["shank"])},
    )
    found = Systematic(subject, Noise(variance_scale=s), NONE)
    variance = by_inertia(subject, x, A)
    expected = wider[:, None] ** 2 * variance / s
    np.testing.assert_allclose(found.parts(over_time(data))["inertia"]["moments"], expected, rtol=1e-6)
    blocks = ("coordinates", "speeds", "accelerations", "moments")
    data = data.assign(
        {f"{b}{end}": (("time", "coordinate"), np.zeros((4, 10))) for b in blocks for end in ("", "_sd")}
    )
    recorded = found.added_over_time(data, late=False)["moments_sd"].values
    own = {block: np.zeros(10) for block in blocks}
    for k, w in enumerate(wider):
        scales = np.r_[np.ones(30), np.full(4, w)]
        live = with_errors(found, own, x, np.outer(scales, scales) * last, late=False)
        np.testing.assert_allclose(recorded[k], live["moments"], rtol=1e-9)


def test_of_a_heavy_person_the_tables_are_not_believed_and_that_is_said() -> None:
    """Unless identified parameters take the tables' place; an .osim has bodies of its own."""
    usual, heavy = measured(), replace(measured(), mass_kg=100.0, height_m=1.7, height_stated=True)
    assert usual_sizes(usual) == LANDMARKS and usual.unlike_the_tables() == []
    wide = usual_sizes(heavy)
    assert wide.mass_centre >= 2.0 * LANDMARKS.mass_centre and wide.skin >= 1.5 * LANDMARKS.skin
    (said,) = heavy.unlike_the_tables()
    assert said.level == "warning" and "100 kg at 1.70 m (35 kg/m2)" in said.text
    identified = replace(heavy, own_inertia=True)
    assert identified.unlike_the_tables() == []
    assert usual_sizes(identified) == replace(LANDMARKS, skin=wide.skin, skin_found=wide.skin_found)
    for other in (replace(heavy, height_stated=False), replace(heavy, height_m=None), replace(heavy, plan=None)):
        assert not other.heavy and other.unlike_the_tables() == []
