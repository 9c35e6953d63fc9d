"""Skin that follows the joints: what is found of it in a run, and that results are whole again after it."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.bindings import _core
from dynakin.filter.estimator import Estimator
from dynakin.filter.following_skin import following_skin
from dynakin.filter.tracker import Tracker
from dynakin.filter.uncertainty.skin import skin_found
from dynakin.filter.uncertainty.upright import followed
from dynakin.model.definition import load_model
from dynakin.results.records import FOLLOWING
from dynakin.settings.noise import Noise
from dynakin.settings.subject import Subject
from support.simulated import simulate

Array = np.ndarray
FRAMES = 3000


@pytest.fixture(scope="module")
def start() -> Tracker:
    made = simulate("fullbody", "gait", 5, 3.0)
    subject = made.truth.subject
    model = load_model("fullbody", Subject(mass_kg=subject.mass_kg, height_m=subject.height_m, sex="male"))
    return Estimator(model).prepare(made.recording).tracker


def bending(tracker: Tracker, displacement_m: float) -> tuple[Array, dict[str, Array], int]:
    """Time, arrays of a person whose right knee bends to and fro, and the element of a thigh marker's displacement,
    which follows the knee by that much."""
    names = list(tracker.core_model.layout.names)
    time = 0.01 * np.arange(FRAMES)
    state = np.tile(tracker.state, (FRAMES, 1))
    knee = names.index("knee_angle_r")
    state[:, knee] += 0.7 * (1.0 - np.cos(2.0 * np.pi * 0.3 * time))
    spec = tracker.calibrated.spec
    thigh = next(
        segment.parent for segment in spec.segments if any(a.coordinate == "knee_angle_r" for a in segment.axes)
    )
    element = next(
        names.index(name)
        for marker in spec.markers
        if marker.segment == thigh and (name := f"soft_tissue/{marker.name}/x") in names
    )
    K = tracker.core_model.layout.blocks["coordinates"][1]
    state[:, element] = displacement_m * followed(state[:, :K], tracker.calibrated)[:, knee]
    arrays = {"state": state, "tracking": np.full(FRAMES, FOLLOWING)}
    return time, arrays, element


def test_what_follows_a_joint_is_found_and_the_rest_is_not_touched(start: Tracker) -> None:
    time, arrays, element = bending(start, 0.012)
    skin = following_skin(start, arrays, time)
    assert skin is not None
    found = skin.local_m[:, skin.columns == element][:, 0]
    wanted = arrays["state"][:, element] - arrays["state"][:, element].mean()
    # a Bayesian line: noise of half the declared size, independent every 30 frames (twice 0.15 s), and a prior
    # of the whole size
    q = arrays["state"][:, : start.core_model.layout.blocks["coordinates"][1]]
    knee = followed(q, start.calibrated)[:, list(start.core_model.layout.names).index("knee_angle_r")]
    ridge = 30.0 * 0.5**2 / 1.0**2
    np.testing.assert_allclose(found, wanted / (1.0 + ridge / (FRAMES * knee.var())), atol=1e-9)
    assert not skin.local_m[:, skin.columns != element].any()
    assert np.linalg.norm(skin.shift_m, axis=-1).max() == pytest.approx(np.abs(found).max())


def test_a_short_recording_is_believed_less(start: Tracker) -> None:
    time, arrays, _ = bending(start, 0.012)
    short = {name: values[:400] for name, values in arrays.items()}
    whole, part = following_skin(start, arrays, time), following_skin(start, short, time[:400])
    assert whole is not None and part is not None
    assert np.ptp(part.local_m, axis=0).max() < 0.95 * np.ptp(whole.local_m, axis=0).max()


def test_state_and_markers_agree_after_it(start: Tracker) -> None:
    time, arrays, element = bending(start, 0.012)
    skin = following_skin(start, arrays, time)
    assert skin is not None
    model = start.core_model
    without = arrays["state"].copy()
    without[:, element] = 0.0

    def markers(state: Array) -> Array:
        return np.array([_core.marker_positions(model, x) for x in state])

    run = {"state": without, "markers_estimated": markers(without), "markers_predicted": markers(without)}
    whole = skin.put_back(run)
    np.testing.assert_allclose(whole["markers_estimated"], markers(whole["state"]), atol=1e-12)
    np.testing.assert_allclose(whole["markers_predicted"] - run["markers_predicted"], skin.shift_m, atol=1e-12)


def test_nothing_follows_where_it_is_not_wanted(start: Tracker) -> None:
    time, arrays, _ = bending(start, 0.012)
    none = start.changed(start.noise.changed(following_skin_fraction=0.0))
    assert following_skin(none, arrays, time) is None
    assert Noise().following_skin_fraction > 0.0


def test_twice_the_skin_is_found_as_twice_whatever_the_joints_do(start: Tracker) -> None:
    """Over what is declared for joints that turn so; of who hardly moves little is found, of who is lost nothing."""
    calibrated, names = start.calibrated, list(start.core_model.layout.names)

    def moved(times: float, swing: float) -> dict[str, Array]:
        _, arrays, _ = bending(start, 0.0)
        state, knee = arrays["state"], names.index("knee_angle_r")
        state[:, knee] = state[0, knee] + swing * (state[:, knee] - state[0, knee])
        K = start.core_model.layout.blocks["coordinates"][1]
        follows = followed(state[:, :K], calibrated)[:, knee]
        by_knee = {s.name for s in calibrated.spec.segments if any(a.coordinate == "knee_angle_r" for a in s.axes)}
        by_knee |= {s.parent for s in calibrated.spec.segments if s.name in by_knee}
        for marker, declared in zip(calibrated.spec.markers, calibrated.soft_tissue_m, strict=True):
            for axis in "xyz":
                if marker.segment in by_knee and (name := f"soft_tissue/{marker.name}/{axis}") in names:
                    state[:, names.index(name)] = 0.2 * times * declared * follows
        return arrays

    usual = skin_found(calibrated, moved(1.0, 1.0))
    assert skin_found(calibrated, moved(2.0, 1.0)) == pytest.approx(2.0 * usual)
    assert 0.1 < usual < 0.2
    assert skin_found(calibrated, moved(1.0, 0.1)) < usual
    lost = moved(1.0, 1.0) | {"tracking": np.full(FRAMES, FOLLOWING + 1)}
    assert skin_found(calibrated, lost) == 0.0
