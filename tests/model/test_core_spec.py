"""The conversion to the compiled core: names, sizes, and the start as the core sees it."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from dynakin.model.calibration.how import Calibration
from dynakin.model.definition import load_model
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject
from support.made_person import make, stand

_core = pytest.importorskip("dynakin.bindings._core", reason="the compiled core is not built")
PERSON = Subject(mass_kg=70.0, height_m=1.75, sex="male")


def test_sagittal7_has_89_states_that_are_all_set(standing_person: Recording) -> None:
    initial = load_model("sagittal7", PERSON).calibrate(standing_person)
    n = 7 * 3 + 6 + 17 * 2 + 7 * 4
    assert n == 89
    for vector in (initial.x0, initial.sd0, initial.lower, initial.upper, initial.table):
        assert vector.shape == (n,)
    assert len(initial.names) == n
    assert np.isfinite(initial.x0).all()
    assert np.isfinite(initial.sd0).all()
    assert (initial.sd0 > 0).all()
    assert (initial.lower <= initial.x0).all()
    assert (initial.x0 <= initial.upper).all()
    bounded = np.isfinite(initial.lower)
    assert [name for name, b in zip(initial.names, bounded, strict=True) if not b] == [
        f"{name}/{kind}"
        for kind in ("speed", "acceleration")
        for name in ("toe", "ankle", "knee", "hip", "lumbar", "shoulder", "elbow")
    ]
    inertia = np.array([name.startswith("inertia/") for name in initial.names])
    np.testing.assert_allclose(initial.table[inertia], initial.x0[inertia])
    assert np.isnan(initial.table[~inertia]).all()
    assert initial.marker_variance.shape == (17,)
    assert initial.marker_variance[0] == 1e-3


@pytest.mark.parametrize("name", ["sagittal7", "squat7"])
def test_the_core_puts_the_markers_where_they_were_measured(name: str, standing_person: Recording) -> None:
    initial = load_model(name, PERSON).calibrate(standing_person, how=Calibration(side="right"))
    model = _core.Model(initial.spec)
    places = np.asarray(_core.marker_positions(model, initial.x0))
    measured = np.array([standing_person.marker(marker)[0] for marker in initial.recorded_markers])
    np.testing.assert_allclose(places[:, :2], initial.ground.points_to_ground(measured)[:, :2], atol=1e-9)
    assert list(model.marker_names) == [site.name for site in initial.plan.sites]


def test_a_squat_start_is_met_too() -> None:
    deep = make([stand(ankle=25.0, knee=80.0, hip=70.0)] * 20)
    initial = load_model("sagittal7", PERSON).calibrate(deep, static=make([stand()] * 100, "static"))
    places = np.asarray(_core.marker_positions(_core.Model(initial.spec), initial.x0))
    measured = np.array([deep.marker(marker)[0] for marker in initial.recorded_markers])
    np.testing.assert_allclose(places[:, :2], initial.ground.points_to_ground(measured)[:, :2], atol=1e-8)


def test_the_weight_is_the_persons_and_acts_at_the_centre_of_mass(standing_person: Recording) -> None:
    initial = load_model("sagittal7", PERSON).calibrate(standing_person)
    wrench = np.asarray(_core.wrench(_core.Model(initial.spec), initial.x0))
    assert wrench[1] == pytest.approx(70.0 * 9.80665, rel=1e-12)
    np.testing.assert_allclose(wrench[[0, 2]], 0.0, atol=1e-9)
    assert -0.25 < wrench[5] / wrench[1] < 0.0  # over the feet, which reach from the toe backwards


def test_a_locked_arm_is_not_in_the_state(standing_person: Recording) -> None:
    arms = [n for n in standing_person.marker_names if "elbow" in n or "wrist" in n]
    keep = [k for k, n in enumerate(standing_person.marker_names) if n not in arms]
    lacking = Recording(
        "noarm", None, standing_person.time, tuple(standing_person.marker_names[k] for k in keep),
        standing_person.markers[:, keep],
    )  # fmt: skip
    initial = load_model("sagittal7", PERSON, "opencap").calibrate(lacking)
    assert "shoulder" not in initial.names
    assert "length/upper_arm" not in initial.names
    assert "inertia/forearm/mass" in initial.names


def test_a_start_beyond_a_joint_limit_is_put_on_it_and_said() -> None:
    recording = make([stand(ankle=60.0, knee=60.0, hip=40.0)] * 20)
    initial = load_model("sagittal7", PERSON).calibrate(recording)
    k = initial.names.index("ankle")
    assert initial.x0[k] == initial.upper[k] == pytest.approx(np.deg2rad(50.0))
    assert any("Start of ankle" in message and "put on the bound" in message for message in map(str, initial.messages))


def test_the_specification_can_be_pickled(standing_person: Recording) -> None:
    initial = load_model("sagittal7", PERSON).calibrate(standing_person)
    again = pickle.loads(pickle.dumps(initial.spec))
    np.testing.assert_array_equal(_core.Model(again).initial_state(), _core.Model(initial.spec).initial_state())
