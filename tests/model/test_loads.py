"""Known loads: bodies that a person carries, and wrenches on plates that are not the person's."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.bindings import _core
from dynakin.errors import ConfigError, ModelError, RecordingError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.declared import with_loads
from dynakin.model.definition import ModelDefinition
from dynakin.pipeline.stages import configure
from dynakin.recordings.plates.loads import without_plate_loads
from dynakin.results.measures.metrics import compute_metrics
from dynakin.settings.settings import Settings
from dynakin.settings.subject import CarriedLoad, PlateLoad
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate_squat

SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
BARBELL = CarriedLoad(
    segment="trunk", mass_kg=20.0, place_m=(0.05, 0.3, 0.0), inertia_kg_m2=(1.5, 1.5, 0.1), name="bar"
)


@pytest.fixture(scope="module")
def trial() -> SimulatedTrial:
    return simulate_squat(seed=3, duration_s=5.0)


@pytest.fixture(scope="module")
def definition() -> ModelDefinition:
    return dynakin.load_model("sagittal7", subject=SUBJECT, markers="opencap")


@pytest.fixture(scope="module")
def initial(trial: SimulatedTrial, definition: ModelDefinition) -> CalibratedModel:
    return definition.calibrate(trial.recording)


def test_the_loads_of_the_documentation_are_of_the_default_model() -> None:
    page = (Path(__file__).parents[2] / "docs" / "models.md").read_text(encoding="utf-8")
    example = page.split("## Known loads")[1].split("```toml")[1].split("```")[0]
    settings = Settings.of(tomllib.loads(example), "docs/models.md", needed=())
    model = dynakin.load_model(settings.model, subject=SUBJECT).model
    assert settings.loads and {load.segment for load in settings.loads} <= {segment.name for segment in model.segments}


def test_a_load_adds_its_own_wrench_and_nothing_else(initial: CalibratedModel) -> None:
    """Newton and Euler of a body that turns about Z, by differences of its segment's pose."""
    loaded = with_loads(initial, [BARBELL])
    bare, model = _core.Model(initial.spec), _core.Model(loaded.spec)
    assert list(model.layout.names) == list(bare.layout.names)
    rng = np.random.default_rng(1)
    x = initial.x0.copy()
    n = model.layout.blocks["coordinates"][1]
    x[: 3 * n] += rng.uniform(-1.0, 1.0, 3 * n) * np.repeat([0.3, 2.0, 10.0], n)
    trunk = model.segment_names.index("trunk")

    def pose(dt: float) -> tuple[np.ndarray, float]:
        z = x.copy()
        z[:n] += dt * x[n : 2 * n] + dt**2 / 2 * x[2 * n : 3 * n]
        R, p = (array[trunk] for array in _core.segment_poses(model, z))
        return p + R @ np.array(BARBELL.place_m), float(np.arctan2(R[1, 0], R[0, 0]))

    h = 1e-4
    (before, angle_before), (now, angle), (after, angle_after) = pose(-h), pose(0.0), pose(h)
    force = 20.0 * ((after - 2 * now + before) / h**2 + [0.0, 9.80665, 0.0])
    turning = 0.1 * (angle_after - 2 * angle + angle_before) / h**2
    expected = np.concatenate([force, np.cross(now, force) + np.array([0.0, 0.0, turning])])
    added = _core.wrench(model, x) - _core.wrench(bare, x)
    np.testing.assert_allclose(added, expected, atol=1e-4 * np.abs(expected).max())
    assert loaded.weighed_kg == pytest.approx(90.0) and loaded.mass_kg == 70.0
    assert _core.total_mass(model, x) - _core.total_mass(bare, x) == pytest.approx(20.0)
    assert initial.spec.segments[-1].name != "bar"  # what was measured stays as it is


def test_the_filter_finds_the_person_beside_the_load(trial: SimulatedTrial, definition: ModelDefinition) -> None:
    """A part of the trunk declared as a load: the same body, so the same movement and the same plates."""
    part = CarriedLoad(segment="trunk", mass_kg=7.0, place_m=(0.0, 0.2, 0.0), inertia_kg_m2=(0.1, 0.1, 0.1))
    lighter = replace(definition, subject=SUBJECT.changed(mass_kg=63.0))
    whole = dynakin.Estimator(definition).run(trial.recording)
    parts = dynakin.Estimator(lighter, loads=[part]).run(trial.recording)
    assert any("load 7 kg on the trunk" in message for message in map(str, parts.messages))
    assert not any("plates are not used" in message for message in map(str, parts.messages))
    apart = np.abs(parts.data["coordinates"].values - whole.data["coordinates"].values)[200:]
    assert np.degrees(apart).max() < 2.0
    fit = compute_metrics(parts)["wrench"]["rms"]
    assert fit["fy"] < 10.0
    unknown = dynakin.Estimator(lighter).run(trial.recording)
    assert unknown.mass_kg == 63.0 and any(
        "plates carry" in m or "plates read" in m for m in map(str, unknown.messages)
    )


def test_loads_that_do_not_fit_are_told(initial: CalibratedModel, definition: ModelDefinition) -> None:
    with pytest.raises(ModelError, match=r"load 'bar': segment 'trunck' is not .* \(did you mean 'trunk'\?\)"):
        with_loads(initial, [BARBELL.model_copy(update={"segment": "trunck"})])
    with pytest.raises(ModelError, match="load 'trunk': the name is taken"):
        with_loads(initial, [BARBELL.model_copy(update={"name": "trunk"})])
    nobody = replace(definition, subject=dynakin.Subject())
    with pytest.raises(ConfigError, match=r"loads: .* expected the person's own mass"):
        dynakin.Estimator(nobody, loads=[BARBELL])
    keys = {"trial": "a.c3d", "model": "squat7", "output": "out"}
    bar = {"segment": "trunk", "mass_kg": 20.0, "place_m": [0.0, 0.3, 0.0]}
    config = Settings.of(keys | {"loads": [bar], "mass_kg": 70.0}, "run.toml")
    assert config.loads == (CarriedLoad(**bar),) and config.as_used()["loads"][0]["mass_kg"] == 20.0
    for wrong, words in (
        ({"loads": [bar]}, "expected mass_kg"),
        ({"loads": [bar | {"mass": 3.0}], "mass_kg": 70.0}, "unknown key 'mass'"),
        ({"loads": [bar | {"mass_kg": -1.0}], "mass_kg": 70.0}, "mass_kg"),
        ({"loads": [bar | {"place_m": [50, 300, 0.0]}], "mass_kg": 70.0}, r"place_m: .*304 m .*expected metres, 2 at"),
        ({"loads": [bar | {"inertia_kg_m2": [1, 1, 5]}], "mass_kg": 70.0}, "1, 1 and 5 .* others [(]2[)]"),
        ({"loads": [bar | {"inertia_kg_m2": [900, 900, 900]}], "mass_kg": 70.0}, "at most 80 of 20 kg"),
        ({"plate_loads": [{"plate": "plate 1", "force": [0, 1, 0]}]}, "plate_loads"),
        ({"zero": "sitting"}, "zero"),
    ):
        with pytest.raises(ConfigError, match=words):
            Settings.of(keys | wrong, "run.toml")


def test_what_is_not_the_persons_comes_off_its_plate(trial: SimulatedTrial) -> None:
    bare = trial.recording
    first = bare.plates[0]
    force, point, moment = np.array([3.0, 55.0, -2.0]), np.array([0.4, 0.0, 0.3]), np.array([0.0, 1.5, 0.0])
    railed = replace(
        first, force=first.force + force, moment=first.moment + np.cross(point, force) + moment, cop=first.cop + 0.1
    )
    recording = replace(bare, plates=(railed, *bare.plates[1:]))
    load = PlateLoad(first.name, tuple(force), tuple(point), tuple(moment))
    found = without_plate_loads(recording, [load])
    np.testing.assert_allclose(found.plates[0].force, first.force, atol=1e-9)
    np.testing.assert_allclose(found.plates[0].moment, first.moment, atol=1e-9)
    loaded = first.force[:, 1] > 50.0
    np.testing.assert_allclose(found.plates[0].cop[loaded][:, [0, 2]], first.cop[loaded][:, [0, 2]], atol=1e-2)
    moment = np.cross(found.plates[0].cop, found.plates[0].force) + found.plates[0].free_moment
    np.testing.assert_allclose(moment[loaded], first.moment[loaded], atol=1e-9)
    assert all(a is b for a, b in zip(found.plates[1:], bare.plates[1:], strict=True))
    assert "a known load of 55.1 N" in found.notes[-1].text
    assert without_plate_loads(bare, []) is bare
    with pytest.raises(RecordingError, match="plate_loads: no plate 'rail', expected one of"):
        without_plate_loads(bare, [PlateLoad("rail", (0, 1, 0), (0, 0, 0))])


def test_a_configuration_reads_them(tmp_path: Path) -> None:
    file = tmp_path / "run.toml"
    file.write_text(
        'trial = "squat.c3d"\nmodel = "squat7"\noutput = "out"\nmass_kg = 70.0\n'
        '[[loads]]\nsegment = "trunk"\nmass_kg = 20.0\nplace_m = [0.0, 0.3, 0.0]\n'
        '[[plate_loads]]\nplate = "plate 1"\nforce_n = [0.0, 50.0, 0.0]\npoint_m = [0.1, 0.0, 0.0]\n'
    )
    config = configure(file, {})
    assert config.loads[0].segment == "trunk"
    assert config.plate_loads == (PlateLoad("plate 1", (0.0, 50.0, 0.0), (0.1, 0.0, 0.0)),)
