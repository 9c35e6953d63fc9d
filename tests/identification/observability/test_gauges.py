"""Gauges: along each of them nothing that is measured changes; across them something does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin import load_model
from dynakin.bindings import _core
from dynakin.identification.observability.element_words import gauge_in_words, gauges_in_words
from dynakin.identification.observability.gauges import (
    ZERO,
    Gauge,
    _echelon,
    _least,
    _parts,
    _programmes,
    gauges_of,
    sparse_basis,
)
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.simulated import tracker_of
from support.identifiability import changed_model


def measured_change(measured: MeasuredModel, direction: dict[str, float], size: float) -> float:
    """Largest change of any measurement, in its standard deviations, when a direction is gone for a finite step."""
    largest = 0.0
    for x in measured.random_states(8, seed=11):
        moved, error = x.copy(), np.zeros(6)
        for name, change in direction.items():
            if name.startswith("plates/"):
                error[("fx", "fy", "fz", "mx", "my", "mz").index(name.removeprefix("plates/"))] += size * change
            else:
                moved[measured.names.index(name.removeprefix(ZERO))] += size * change
        markers = _core.marker_positions(measured.core, moved) - _core.marker_positions(measured.core, x)
        wrench = _core.wrench(measured.core, moved) + error - _core.wrench(measured.core, x)
        seen = np.array(measured.initial.spec.wrench_measured)
        largest = max(
            largest,
            float(np.abs(markers[:, :2] / measured.marker_sd[:, None]).max()),
            float(np.abs(wrench / measured.wrench_sd)[seen].max()),
        )
    return largest


def test_a_finite_step_along_a_gauge_changes_measurements_to_second_order_only(measured: MeasuredModel) -> None:
    found = gauges_of(measured).found
    assert len(found) == 6 + 1 + 1 + 30  # masses at hinges, the foot's against the plates, a turn, skin
    for gauge in found:
        whole, half = (measured_change(measured, gauge.direction, size) for size in (1.0, 0.5))
        assert whole < 1e-6 or whole / half == pytest.approx(4.0, rel=0.1)


def test_a_step_across_the_gauges_changes_measurements_to_first_order(measured: MeasuredModel) -> None:
    found = gauges_of(measured)
    sd = np.array([np.sqrt(measured.prior[k, k]) for k in map(measured.names.index, _plain(found.names))])
    null = np.array([[gauge.direction.get(name, 0.0) for name in found.names] / sd for gauge in found.found])
    basis = np.linalg.qr(null.T)[0]
    rng = np.random.default_rng(4)
    for _ in range(5):
        across = rng.standard_normal(len(sd))
        across -= basis @ (basis.T @ across)
        direction = dict(zip(found.names, sd * across / np.abs(across).max(), strict=True))
        small, half = (measured_change(measured, direction, size) for size in (1e-3, 5e-4))
        assert small > 1e-3
        assert small / half == pytest.approx(2.0, rel=0.05)


def test_gauges_are_named(measured: MeasuredModel) -> None:
    said = gauges_in_words(gauges_of(measured).found, measured.initial.spec)
    last = measured.initial.spec.segments[-1]
    turn = f"{last.name}: a turn about the {last.axes[0].coordinate}: the angle's zero against its markers' places"
    assert f"{turn} and its first moments" in said
    assert "knee: a mass at it may belong to the shank or to the thigh" in said
    assert "foot mass against a constant error of the plates (fy)" in said
    assert any("mean displacement of the skin under each" in text for text in said)
    assert len(said) == 9


def test_a_slide_along_a_segment_hides_its_length(tmp_path: Path) -> None:
    """A known unobservable parameter: the thigh can grow if the joint that slides along it starts lower."""
    slide = (
        '[[coordinates]]\nname = "hip_slide"\ndescription = "along the thigh"\nminimum_m = -0.05\nmaximum_m = 0.05\n'
    )
    path = changed_model(
        tmp_path,
        ("[[segments]]\nname = \"foot\"", slide + "[[segments]]\nname = \"foot\""),
        (
            'axes = [{ coordinate = "hip", coefficients = [0.0, -1.0] }]',
            'axes = [{ coordinate = "hip_slide", kind = "translation", direction = [0.0, 1.0, 0.0] }, '
            '{ coordinate = "hip", coefficients = [0.0, -1.0] }]',
        ),
    )  # fmt: skip
    measured = MeasuredModel.of(tracker_of(load_model(path)))
    found = gauges_of(measured).found
    lengths = [gauge for gauge in found if "length/thigh" in gauge.direction]
    assert [set(gauge.direction) for gauge in lengths] == [{"length/thigh", "zero/hip_slide"}]
    assert gauge_in_words(lengths[0], measured.initial.spec) == "thigh length against the zero of the hip slide"
    assert measured_change(measured, lengths[0].direction, 1.0) < 1e-9


def test_words_of_what_has_no_name_list_it(measured: MeasuredModel) -> None:
    gauge = Gauge({"length/shank": 0.01, "zero/ankle": 0.1, "zero/knee": -0.1, "inertia/shank/my": 0.2})
    said = gauge_in_words(gauge, measured.initial.spec)
    assert said == "shank length against the zero of the ankle, the zero of the knee and the shank's inertia"


def test_sparse_directions_are_found_in_a_mixed_null_space() -> None:
    rng = np.random.default_rng(0)
    sparse = np.zeros((4, 30))
    for k, row in enumerate(sparse):
        row[[3 * k, 3 * k + 2, 20 + k]] = rng.uniform(0.5, 2.0, 3)
    mixed = np.linalg.qr((rng.standard_normal((4, 4)) @ sparse).T)[0].T
    found = sparse_basis(mixed)
    assert sorted(tuple(np.flatnonzero(np.abs(v) > 1e-9)) for v in found) == [
        (3 * k, 3 * k + 2, 20 + k) for k in range(4)
    ]


def test_entries_that_are_seen_alike_are_cancelled_as_by_a_programme_of_all() -> None:
    """By their own like where that is cheap, by others where its weight is small; some of both in these."""
    rng = np.random.default_rng(1)
    ways = {"own": 0, "others": 0}
    for _ in range(40):
        seen = rng.standard_normal((int(rng.integers(1, 4)), 5)) * (rng.random(5) < 0.8)
        again = rng.integers(0, 5, 3)
        seen = np.hstack([seen, seen[:, again] * rng.choice([1.0, -0.5, 2.0, 0.01, 30.0], 3)])
        null = np.linalg.svd(seen)[2][np.linalg.matrix_rank(seen) :]
        for part in _parts(null):
            B = _echelon(null, part)
            found, expected = _least(B), _programmes(B)
            np.testing.assert_allclose(np.abs(found).sum(axis=1), np.abs(expected).sum(axis=1), rtol=1e-5)
            np.testing.assert_allclose(found @ (np.eye(len(B)) - B @ np.linalg.pinv(B)), 0.0, atol=1e-6)
            np.testing.assert_allclose(np.diag(found), 1.0)
            few = (np.abs(found) > 1e-9).sum(axis=1)
            ways["own"] += int((few == 2).sum())
            ways["others"] += int((few > 2).sum())
    assert min(ways.values()) > 20


def _plain(names: tuple[str, ...]) -> list[str]:
    return [name.removeprefix(ZERO) for name in names]
