"""The core filter, given the truth, finds nothing to correct: simulator and filter speak of the same mechanics.

Here, and only here, the simulator meets the core.
"""

from __future__ import annotations

import numpy as np
import pytest

import dynakin
from dynakin.bindings import _core
from dynakin.model.calibration.how import Calibration
from dynakin.simulation.bodies.body import ten_numbers
from dynakin.simulation.bodies.subject import Spread
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate
from support.trees import spatial_body, waving

PERFECT = SensorNoise.none()
INERTIA = ("mass", "mx", "my", "mz", "ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def perfect_trial(name: str) -> SimulatedTrial:
    if name == "spatial":
        body = spatial_body()
        return simulate(body, waving(body.coordinates, {"knee_r": 0.4, "knee_l": 0.4}), duration_s=2.0, noise=PERFECT)
    model, motion = name.split()
    return simulate(model, motion, 6, 11.0 if motion == "sit-to-stand" else 6.0, noise=PERFECT)


def core_model(trial: SimulatedTrial) -> _core.Model:
    """The truth's own tree in the core's classes, marker places and inertia estimated."""
    truth = trial.truth
    segments = [
        _core.SegmentSpec(
            name=s.name,
            parent=s.parent or "ground",
            rotation=np.eye(3),
            translation=s.placement,
            lengths=[],
            axes=[
                _core.AxisSpec(a.coordinate, "translation" if a.translation else "rotation", np.array(a.direction))
                for a in s.axes
            ],
            inertia=np.array([ten_numbers(s)[key] for key in INERTIA]),
            inertia_estimated=[True] * 10,
        )
        for s in truth.tree
    ]
    return _core.Model(
        _core.ModelSpec(
            name="truth",
            coordinates=[_core.CoordinateSpec(str(n)) for n in truth.data["coordinate"].values],
            parameters=[],
            segments=segments,
            markers=[_core.MarkerSpec(s.name, s.segment, s.place) for s in truth.sites],
        )
    )


def states(trial: SimulatedTrial, model: _core.Model) -> np.ndarray:
    """The true state (T, n) in the core's order."""
    data, named = trial.truth.data, dict(trial.truth.parameters)
    rest = np.array(model.initial_state())
    columns = []
    for k, name in enumerate(model.layout.names):
        stem, _, kind = name.partition("/")
        if stem in data["coordinate"].values:
            variable = {"": "coordinates", "speed": "speeds", "acceleration": "accelerations"}[kind]
            columns.append(data[variable].sel(coordinate=stem).values)
        else:
            columns.append(np.full(data.sizes["time"], named[name]))
            assert rest[k] == pytest.approx(named[name], abs=1e-12), name  # state names are the truth's names
    return np.stack(columns, axis=1)


def measured(trial: SimulatedTrial) -> tuple[np.ndarray, np.ndarray]:
    recording, origin = trial.recording, trial.truth.origin_L
    own = [recording.marker(site.name) - origin for site in trial.truth.sites]
    return np.ascontiguousarray(np.stack(own, axis=1)), recording.total_wrench(about=origin)


def settings(n: int, markers: int, process: np.ndarray) -> _core.FilterSettings:
    return _core.FilterSettings(
        process_variance=process,
        marker_variance=np.full(markers, 1e-10),  # (0.01 mm)^2
        wrench_covariance=np.diag(np.full(6, 1e-4)),  # (0.01 N, 0.01 N m)^2
        reference_point=np.zeros(3),
        total_mass=None,
        total_mass_variance=1.0,
        lower=np.full(n, -np.inf),
        upper=np.full(n, np.inf),
        constraint="none",
    )


CASES = ["sagittal7 squat", "squat7 squat", "sagittal7 sit-to-stand", "squat7 sway", "spatial"]


@pytest.mark.parametrize("name", CASES)
def test_at_the_truth_the_residual_is_zero(name: str) -> None:
    """At frames all over the trial: started there with a tiny covariance, an update changes nothing."""
    trial = perfect_trial(name)
    model = core_model(trial)
    x, (markers, wrench) = states(trial, model), measured(trial)
    n = x.shape[1]
    noise = settings(n, markers.shape[1], np.zeros(n))
    for k in range(0, len(x), 40):
        np.testing.assert_allclose(_core.marker_positions(model, x[k]), markers[k], atol=1e-12)
        np.testing.assert_allclose(_core.wrench(model, x[k]), wrench[k], atol=1e-8)
        core = _core.Filter(model, noise, x[k], np.asfortranarray(1e-10 * np.eye(n)))
        report = core.update(markers[k], wrench[k])
        assert report.n_rows == 3 * markers.shape[1] + 6
        assert report.nis < 1e-9
        np.testing.assert_allclose(core.state, x[k], atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_from_the_truth_it_stays_there(name: str) -> None:
    """Over the trial the residual is what one step of constant acceleration misses: jerk dt^3 / 6 and jerk dt."""
    trial = perfect_trial(name)
    model = core_model(trial)
    x, (markers, wrench) = states(trial, model), measured(trial)
    n, moving = x.shape[1], 3 * trial.truth.data.sizes["coordinate"]
    process = np.zeros(n)
    process[:moving] = np.repeat([1e-8, 1e-4, 1.0], moving // 3)
    core = _core.Filter(model, settings(n, markers.shape[1], process), x[0], np.asfortranarray(1e-12 * np.eye(n)))
    result = core.run(np.ascontiguousarray(trial.recording.time), markers, np.ascontiguousarray(wrench))
    count = moving // 3
    assert np.abs(result["markers_estimated"] - markers).max() < 1e-6
    assert np.abs(result["wrench_estimated"] - wrench).max() < 5e-3
    off = np.abs(result["state"] - x)
    assert np.degrees(off[:, :count]).max() < 1e-3
    assert off[:, count : 2 * count].max() < 0.02  # rad/s
    assert off[:, moving:].max() < 1e-9  # marker places and inertia, SI


@pytest.mark.parametrize("side", ["right", "left"])
def test_squat7_initialises_on_its_own_simulation(side: str) -> None:
    """Coordinates and lengths as the model measures them from landmarks: its signs and zeros are the simulator's."""
    trial = simulate("squat7", "squat", 3, 5.0, noise=PERFECT)
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    start = dynakin.load_model("squat7", subject, markers="plug-in-gait").calibrate(
        trial.recording, how=Calibration(side=side)
    )
    truth = trial.truth.data["coordinates"].isel(time=0)
    named = dict(zip(start.names, start.x0, strict=True))
    for name in ("toe", "ankle", "knee", "hip", "lumbar", "thoracic", "shoulder"):
        assert np.degrees(named[name] - float(truth.sel(coordinate=name))) == pytest.approx(0.0, abs=9.0), name
    for name in ("foot", "shank", "thigh"):
        assert named[f"length/{name}"] == pytest.approx(trial.truth.parameters[f"length/{name}"], abs=0.005), name


def test_fullbody_measured_on_exact_markers_is_the_true_body() -> None:
    """Where the marker set tells the joint centres (hips, knees), the built-in model at the true angles carries every
    marker of pelvis, thighs and shanks where it was recorded, in a deep squat too."""
    trial = simulate("fullbody", "squat", 3, 6.0, noise=PERFECT, spread=Spread(joint=0.0, axis=0.0))
    recording, data = trial.recording, trial.truth.data
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("fullbody", subject=subject, markers="opencap"))
    initial = estimator.start(recording).calibrated
    for name in ("pelvis", "thigh", "shank"):
        (length,) = (parameter for parameter in initial.spec.parameters if parameter.name == name)
        assert length.value == pytest.approx(trial.truth.parameters[f"length/{name}"], abs=1e-4)
    model, x = _core.Model(initial.spec), np.array(initial.x0)
    lowest = int(np.argmax(data["coordinates"].sel(coordinate="knee_angle_r").values))
    known = ("pelvis", "hip", "knee")
    for k, name in enumerate(initial.names):
        if name in data["coordinate"].values and name.split("_")[0] in known:
            x[k] = data["coordinates"].sel(coordinate=name).values[lowest]
    found = _core.marker_positions(model, x)
    checked = 0
    for marker, place in zip(initial.spec.markers, found, strict=True):
        if marker.segment.split("_")[0] in ("pelvis", "thigh", "shank"):
            site = next(s.name for s in trial.truth.sites if s.name.casefold() == marker.name.casefold())
            np.testing.assert_allclose(place, recording.marker(site)[lowest], atol=2e-4)
            checked += 1
    assert checked >= 18
