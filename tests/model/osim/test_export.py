"""A model that is written and read again is the same, and OpenSim sees the same in it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from dynakin.bindings import _core
from dynakin.cli.app import app
from dynakin.errors import ModelError, OutputError
from dynakin.filter.build import definition_of
from dynakin.model.identified import read_constants
from dynakin.model.opensim.definition import scale_names
from dynakin.model.opensim.description import OpenSimModel
from dynakin.model.opensim.export import identified
from dynakin.model.opensim.from_core import from_core
from dynakin.model.opensim.functions import constant, is_constant
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.spec import to_spec
from dynakin.model.opensim.write import write_osim
from dynakin.recordings import read
from dynakin.settings.settings import Settings
from support.core.bridge import to_core
from support.core.random_models import planar_model, spatial_model, with_functions
from support.oracle.spec import Spec
from support.osim.files import COUPLER, small_model
from support.osim.states import as_state, coupled, random_motion

SHIPPED = ["optimized_scale_and_markers.osim", "unscaled_generic.osim"]


def same(a: _core.ModelSpec, b: _core.ModelSpec) -> None:
    """Two specifications are equal to 1e-12, name by name."""
    assert [(c.name, c.locked) for c in a.coordinates] == [(c.name, c.locked) for c in b.coordinates]
    assert [p.name for p in a.parameters] == [p.name for p in b.parameters]
    close([c.value for c in a.coordinates], [c.value for c in b.coordinates])
    for s, t in zip(a.segments, b.segments, strict=True):
        assert (s.name, s.parent) == (t.name, t.parent)
        close(s.rotation, t.rotation)
        close(s.translation, t.translation)
        close(s.inertia, t.inertia)
        assert [term.parameter for term in s.lengths] == [term.parameter for term in t.lengths]
        for term, other in zip(s.lengths, t.lengths, strict=True):
            close(term.direction, other.direction)
        for axis, twin in zip(s.axes, t.axes, strict=True):
            assert (axis.coordinate, axis.kind, axis.scale) == (twin.coordinate, twin.kind, twin.scale)
            close(axis.direction, twin.direction)
            close(axis.coefficients, twin.coefficients)
            for f, g in zip(axis.functions, twin.functions, strict=True):
                assert f.kind == g.kind
                close([*f.coefficients, *f.x, *f.y], [*g.coefficients, *g.x, *g.y])
    assert [(m.name, m.segment) for m in a.markers] == [(m.name, m.segment) for m in b.markers]
    close([m.position for m in a.markers], [m.position for m in b.markers])


def close(a: object, b: object) -> None:
    np.testing.assert_allclose(np.asarray(a, float), np.asarray(b, float), rtol=0, atol=1e-12)


def again(model: OpenSimModel, folder: Path) -> OpenSimModel:
    path = folder / "again.osim"
    write_osim(model, path)
    return read_osim(path)


@pytest.mark.parametrize("kind", ["PinJoint", "FreeJoint", "PlanarJoint", "WeldJoint", "BallJoint", "CustomJoint"])
@pytest.mark.parametrize("version", [3, 4])
def test_small_models_come_back(kind: str, version: int, tmp_path: Path) -> None:
    model = read_osim(small_model(tmp_path, kind, version, COUPLER if kind == "CustomJoint" else ""))
    found = again(model, tmp_path)
    scales = scale_names(model)
    same(to_spec(found, scales), to_spec(model, scales))
    assert (found.couplers, found.gravity) == (model.couplers, model.gravity)
    assert [j.coordinates for j in found.joints] == [j.coordinates for j in model.joints]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_models_come_back(name: str, data_dir: Path, tmp_path: Path) -> None:
    model = read_osim(data_dir / "opencap_subject4" / name)
    found = again(model, tmp_path)
    scales = scale_names(model)
    same(to_spec(found, scales), to_spec(model, scales))
    assert [j.kind for j in found.joints] == [j.kind for j in model.joints]
    assert {c.name: c.limits for j in found.joints for c in j.coordinates} == {
        c.name: c.limits for j in model.joints for c in j.coordinates
    }


def found_values(model: OpenSimModel, scales: dict[str, str]) -> tuple[_core.Model, dict[str, float]]:
    """Values away from the file's for everything that is estimated."""
    heavy = [body.name for body in model.bodies if body.mass > 0.0]
    core = _core.Model(to_spec(model, scales, estimate_inertia=heavy))
    rng, x = np.random.default_rng(5), core.initial_state()
    values = dict(zip(core.layout.names, x, strict=True))
    for name in values:
        kind = name.split("/")[0]
        factor = {"length": 0.1, "marker": 0.0, "inertia": 0.02}.get(kind, 0.0)
        values[name] *= 1.0 + factor * rng.uniform(-1.0, 1.0)
        values[name] += 0.01 * rng.normal() if kind == "marker" else 0.0
    return core, {name: value for name, value in values.items() if name.count("/") and not name.endswith("ion")}


@pytest.mark.parametrize("source", ["small", *SHIPPED])
def test_what_a_run_found_is_written(source: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    if source == "small":
        path = small_model(tmp_path, "CustomJoint", 4, COUPLER)
    else:
        path = request.getfixturevalue("data_dir") / "opencap_subject4" / source
    model = read_osim(path)
    scales = scale_names(model)
    core, values = found_values(model, scales)
    estimated = again(identified(model, scales, values), tmp_path)
    exported = _core.Model(to_spec(estimated, {}))
    rng, index = np.random.default_rng(6), {name: k for k, name in enumerate(core.layout.names)}
    for _ in range(5):
        motion = random_motion(model, rng)
        x = as_state(core, motion)
        for name, value in values.items():
            if name in index and name.split("/")[0] in ("length", "marker", "inertia"):
                x[index[name]] = value
        y = as_state(exported, motion)
        close(_core.marker_positions(exported, y), _core.marker_positions(core, x))
        expected = _core.wrench(core, x)
        np.testing.assert_allclose(_core.wrench(exported, y), expected, rtol=0, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("name", SHIPPED)
def test_opensim_loads_what_is_written(name: str, data_dir: Path, tmp_path: Path) -> None:
    pytest.importorskip("opensim", reason="OpenSim is not installed (pip install opensim)")
    from support.osim.peer import Peer

    model = read_osim(data_dir / "opencap_subject4" / name)
    scales = scale_names(model)
    estimated = again(identified(model, scales, found_values(model, scales)[1]), tmp_path)
    core, peer, rng = _core.Model(to_spec(estimated, {})), Peer(tmp_path / "again.osim"), np.random.default_rng(7)
    there = [core.segment_names.index(body) for body in peer.bodies]
    masses = peer.inertia()
    assert len(masses) == len(estimated.bodies)
    for body in estimated.bodies:
        close(masses[body.name], np.array([body.mass, *body.centre, *body.inertia]))
    for _ in range(5):
        motion = random_motion(model, rng)
        q, qd, _ = coupled(model, motion)
        peer.at(q, qd)
        R, origins = _core.segment_poses(core, as_state(core, motion))
        close(R[there], peer.poses()[0])
        close(origins[there], peer.poses()[1])
        close(_core.marker_positions(core, as_state(core, motion)), peer.marker_places())


def test_opensim_loads_a_built_in_model_measured_on_a_person(tmp_path: Path) -> None:
    pytest.importorskip("opensim", reason="OpenSim is not installed (pip install opensim)")
    from dynakin.simulation.output import save_trial
    from dynakin.simulation.trial import simulate
    from support.osim.peer import Peer

    trial = next(save_trial(simulate("fullbody", "squat", 1, 5.0), tmp_path / "person").glob("*.trc"))
    out = tmp_path / "fullbody.osim"
    command = ["model", "fullbody", "--markers", "opencap", "--mass", "70", "--trial", str(trial), "--export", str(out)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    spec, peer, rng = to_spec(read_osim(out), {}), Peer(out), np.random.default_rng(9)
    core = _core.Model(spec)
    there = [core.segment_names.index(body) for body in peer.bodies]
    assert sum(vector[0] for vector in peer.inertia().values()) == pytest.approx(70.0, rel=1e-9)
    assert {"pelvis_tilt", "hip_flexion_r", "knee_angle_l", "subtalar_angle_r"} <= set(peer.names)
    q = {c.name: c.value if c.locked else rng.uniform(-1.0, 1.0) for c in spec.coordinates}
    peer.at(q, dict.fromkeys(q, 0.0))
    x = core.initial_state()
    for k, name in enumerate(core.layout.names):
        x[k] = q.get(name, x[k])
    R, origins = _core.segment_poses(core, x)
    close(R[there], peer.poses()[0])
    close(origins[there], peer.poses()[1])
    close(_core.marker_positions(core, x), peer.marker_places())


def test_an_export_is_measured_on_the_standing_trial(data_dir: Path, tmp_path: Path) -> None:
    trial, static = (str(data_dir / "opencap_subject4" / name) for name in ("walking1.trc", "static1.trc"))
    command = ["model", "fullbody", "--markers", "opencap", "--mass", "60.05", "--trial", trial]
    places = []
    for name, options in (("without", []), ("with", ["--static", static])):
        out = tmp_path / f"{name}.osim"
        result = CliRunner().invoke(app, [*command, *options, "--export", str(out)])
        assert result.exit_code == 0, result.output
        places.append({marker.name: marker.location for marker in read_osim(out).markers})
    definition = definition_of(Settings(model="fullbody", markers="opencap", mass_kg=60.05))
    standing = definition.calibrate(read(trial), static=read(static)).spec.markers
    turns = [axis for joint in read_osim(out).joints for axis in joint.axes if axis.kind == "rotation"]
    assert not [axis for axis in turns if is_constant(axis.functions) and constant(axis.functions) != 0.0]  # knees
    close([places[1][marker.name] for marker in standing], [marker.position for marker in standing])
    assert max(np.abs(np.subtract(places[0][m.name], m.position)).max() for m in standing) > 1e-3


TREES = [planar_model(2), planar_model(50, n_segments=7), *(spatial_model(s, nonlinear=False) for s in range(100, 106))]
TREES += [spatial_model(s) for s in range(4)]


@pytest.mark.parametrize("spec", TREES, ids=lambda s: s.name)
def test_a_specification_becomes_an_opensim_model(spec: Spec, tmp_path: Path) -> None:
    """Any tree: chains split over massless bodies, coordinates that move several joints."""
    before = to_core(spec)
    after = to_spec(again(from_core(before), tmp_path), {})
    a, b = _core.Model(before), _core.Model(after)
    rng = np.random.default_rng(8)
    x, y = a.initial_state(), b.initial_state()
    free = [c.name for c in before.coordinates if not c.locked]
    assert sorted(free) == sorted(c.name for c in after.coordinates if not c.locked)
    values = {
        name: rng.normal() for name in (*free, *(f"{n}/speed" for n in free), *(f"{n}/acceleration" for n in free))
    }
    for model, state in ((a, x), (b, y)):
        for k, name in enumerate(model.layout.names):
            state[k] = values.get(name, state[k])
    close(_core.marker_positions(b, y), _core.marker_positions(a, x))
    np.testing.assert_allclose(_core.wrench(b, y), _core.wrench(a, x), rtol=1e-9, atol=1e-9)


def test_fixed_turns_are_part_of_where_a_joint_lies(data_dir: Path, tmp_path: Path) -> None:
    """OpenSim 4.6 has wrong velocities where a rotation that moves follows one that does not; knees have such turns."""
    folder = data_dir / "opencap_subject4"
    definition = definition_of(Settings(model="fullbody", markers="opencap", mass_kg=60.05))
    before = definition.calibrate(read(folder / "squats1.trc"), static=read(folder / "static1.trc")).spec
    found = {p.name: p.value for p in before.parameters if "knee_axis" in p.name}
    assert found  # turns of the knees' axes, which are lengths to the filter
    values = {f"length/{name}": 0.1 for name in found}
    source = again(from_core(before, values), tmp_path)
    turns = [axis for joint in source.joints for axis in joint.axes if axis.kind == "rotation"]
    assert not [axis for axis in turns if is_constant(axis.functions) and constant(axis.functions) != 0.0]
    a, b = _core.Model(before), _core.Model(to_spec(source, {}))
    rng, x, y = np.random.default_rng(9), a.initial_state(), b.initial_state()
    kept = ("marker/", "inertia/")
    moved = {
        name: rng.normal(scale=0.3) for name in a.layout.names if name in b.layout.names and not name.startswith(kept)
    }
    for model, state in ((a, x), (b, y)):
        for k, name in enumerate(model.layout.names):
            state[k] = moved.get(name, values.get(name, state[k]))
    close(_core.marker_positions(b, y), _core.marker_positions(a, x))
    np.testing.assert_allclose(_core.wrench(b, y), _core.wrench(a, x), rtol=1e-9, atol=1e-9)


def test_a_chain_that_opensim_lacks_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no form in OpenSim"):
        write_osim(from_core(to_core(with_functions(spatial_model(20), 20))), tmp_path / "x.osim")


def test_the_command_line_exports(tmp_path: Path) -> None:
    path, out = small_model(tmp_path, "PinJoint", 4), tmp_path / "out.osim"
    found = {
        "schema_version": 1,
        "parameters": [
            {"name": name, "value": value, "sd": 0.01, "estimated": True}
            for name, value in (("marker/m/x", 0.4), ("length/scale_base", 1.1))
        ],
    }
    parameters = tmp_path / "parameters.json"
    parameters.write_text(json.dumps(found))
    command = ["model", str(path), "--export", str(out), "--parameters", str(parameters), "--mass", "10"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    model = read_osim(out)
    assert model.mass == pytest.approx(10.0)
    assert model.markers[0].location == (0.4, 0.2, 0.3)
    np.testing.assert_allclose(model.joints[1].parent_offset.translation, np.array([0.1, -0.3, 0.05]) * 1.1)


def written(path: Path, values: dict[str, float], **more: object) -> Path:
    """A parameters.json."""
    path.write_text(
        json.dumps(
            {"parameters": [{"name": n, "value": v, "sd": 0.0, "estimated": True} for n, v in values.items()], **more}
        )
    )
    return path


def test_parameters_of_another_model_are_refused(tmp_path: Path) -> None:
    from dynakin.model.opensim.definition import load_opensim
    from dynakin.model.opensim.export import of_definition

    definition, path = load_opensim(small_model(tmp_path, "PinJoint", 4)), tmp_path / "parameters.json"
    for values, reason in (
        ({"length/scale_femur": 1.0}, "has no length/scale_femur"),
        ({"length/scale_base": 9.0}, r"length/scale_base is 9, expected 0\.8 to 1\.2"),
    ):
        with pytest.raises(ModelError, match=reason):
            of_definition(definition, read_constants(written(path, values)), None)
    path.write_text("[]")
    with pytest.raises(ModelError, match=r"no parameters\.json of a run"):
        read_constants(path)
    with pytest.raises(ModelError, match="holds no parameters"):
        read_constants(written(path, {}))


@pytest.fixture(scope="module")
def squat(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, float]]:
    """A trial of somebody of 70 kg, and the parameters of the model that is measured on it."""
    from dynakin.simulation.trial import simulate

    folder = simulate("sagittal7", "sway", 1, 3.0, 50.0).save(tmp_path_factory.mktemp("trial") / "person")
    trial = folder / "markers.trc"
    initial = definition_of(Settings(model="sagittal7", mass_kg=70.0, height_m=1.75)).calibrate(read(trial))
    return str(trial), {n: float(v) for n, v in zip(initial.names, initial.x0, strict=True) if n.count("/") and v}


@pytest.mark.parametrize(
    ("changed", "more", "mass", "reason"),
    [
        ({}, {}, "70", ""),
        ({"length/thigh": 9.0}, {}, "70", "length/thigh is 9, expected"),
        ({"length/tail": 0.4}, {}, "70", "has no length/tail"),
        ({}, {"model": "squat7"}, "70", "parameters of model squat7"),
        ({}, {}, "90", "expected 90.0 kg within 5 %"),
    ],
)
def test_a_built_in_model_takes_its_own_parameters_alone(
    squat: tuple[str, dict[str, float]],
    changed: dict[str, float],
    more: dict[str, str],
    mass: str,
    reason: str,
    tmp_path: Path,
) -> None:
    trial, values = squat
    values = {n: v for n, v in values.items() if n.startswith(("length", "marker", "inertia")) and "soft" not in n}
    parameters = written(tmp_path / "parameters.json", values | changed, **more)
    if mass == "90":  # stated by the run, so that the mass alone speaks
        entries = json.loads(parameters.read_text())["parameters"]
        entries = [e | ({"lower": e["value"], "upper": e["value"]} if "inertia" in e["name"] else {}) for e in entries]
        parameters.write_text(json.dumps({"parameters": entries}))
    out = tmp_path / "out.osim"
    command = ["model", "sagittal7", "--trial", trial, "--mass", mass, "--height", "1.75"]
    result = CliRunner().invoke(app, [*command, "--export", str(out), "--parameters", str(parameters)])
    assert out.exists() is (reason == ""), result.output
    if reason:
        assert reason in str(result.exception)


def test_an_export_is_measured_with_the_height_and_sex_of_the_run(
    squat: tuple[str, dict[str, float]], tmp_path: Path
) -> None:
    from dynakin.errors import ConfigError
    from dynakin.model.opensim.export import settings_of_run

    parameters = written(tmp_path / "parameters.json", squat[1])
    given = Settings(model="sagittal7")
    assert settings_of_run(given, parameters) is given
    (tmp_path / "config.toml").write_text('mass_kg = 70.0\nheight_m = 1.75\nsex = "female"\n')
    found = settings_of_run(given, parameters)
    assert (found.mass_kg, found.height_m, found.sex) == (70.0, 1.75, "female")
    assert settings_of_run(given.changed(height_m=1.754), parameters).height_m == 1.754  # as a run prints it
    for wrong, reason in (({"height_m": 1.6}, "--height is 1.6"), ({"sex": "male"}, "--sex is male")):
        with pytest.raises(ConfigError, match=reason):
            settings_of_run(given.changed(**wrong), parameters)


def test_an_export_overwrites_nothing(tmp_path: Path) -> None:
    path = small_model(tmp_path, "PinJoint", 4)
    before = path.read_bytes()
    result = CliRunner().invoke(app, ["model", str(path), "--export", str(path), "--mass", "10"])
    assert "exists already" in str(result.exception) and path.read_bytes() == before
