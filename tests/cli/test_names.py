"""Names that files, tables and paths could trip over: a run keeps its results whatever things are called."""

from __future__ import annotations

import json
import tomllib
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from dynakin.cli.app import main
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.read import read
from dynakin.results.files.markers import write_trc
from dynakin.results.files.storage import write_storage
from dynakin.simulation.trial import simulate_squat

Said = pytest.CaptureFixture[str]
NAMES = ("marker/r_A/B/x", "inertia/thigh/leg/mass")


def _segments_renamed(text: str, old: str, new: str) -> str:
    """The model file with a segment called otherwise; the length and the part of its old name stay."""
    lines = text.splitlines()
    for k, line in enumerate(lines):
        if (line == f'name = "{old}"' and lines[k - 1] == "[[segments]]") or line == f'parent = "{old}"':
            lines[k] = line.replace(old, new)
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A squat with the knees' markers called `r_A/B`, `L_A/B`, their place in the set `A/B`, the thigh `thigh/leg`."""
    folder = tmp_path_factory.mktemp("names")
    recording = simulate_squat(seed=3, duration_s=5.0, rate_hz=50.0).recording
    names = [name.replace("_knee", "_A/B") for name in recording.marker_names]
    assert names.count("r_A/B") == 1
    write_trc(folder / "squat.trc", recording.time, names, recording.markers, unit="mm")
    columns, values = [], []
    for number, plate in enumerate(recording.plates, 1):
        for stem, part in (("v", plate.force), ("p", np.nan_to_num(plate.cop)), ("m", plate.free_moment)):
            columns += [f"ground_force_{number}_{stem}{axis}" for axis in "xyz"]
            values.append(part)
    write_storage(folder / "forces.mot", "forces", recording.time, columns, np.hstack(values), in_degrees=False)
    package = resources.files("dynakin.model")
    model = _segments_renamed((package / "builtin" / "sagittal7.toml").read_text(), "thigh", "thigh/leg")
    assert model.count("thigh/leg") == 2
    (folder / "model.toml").write_text(model)
    markers = (package / "markers" / "sets" / "opencap.toml").read_text()
    (folder / "markers.toml").write_text(markers.replace('_knee"', '_A/B"'))
    return folder


def run(study: Path, trial: str, output: Path) -> int:
    options = ["--forces", "forces.mot", "--model", "model.toml", "--markers", "markers.toml"]
    paths = [str(study / option) if "." in option else option for option in options]
    return main(["run", str(study / trial), *paths, "--mass", "70", "-o", str(output)])


OTHERS = [pytest.param(name, marks=pytest.mark.nightly) for name in ("squat", "..squat", "[a]*?")]


@pytest.mark.parametrize("name", ["a b\nc=d;'\"<script>", "x" * 240, *OTHERS])
def test_a_run_keeps_its_results(study: Path, tmp_path: Path, name: str, capsys: Said) -> None:
    trial = study / f"{name}.trc"
    if not trial.exists():
        trial.write_bytes((study / "squat.trc").read_bytes())
    output = tmp_path / "out"
    assert run(study, trial.name, output) == 0, capsys.readouterr().err
    written = {p["name"]: p for p in json.loads((output / "parameters.json").read_text())["parameters"]}
    assert [written[name]["segment"] for name in NAMES] == ["thigh/leg", "thigh/leg"]
    assert [written[name]["unit"] for name in NAMES] == ["m", "kg"]
    with xr.open_dataset(output / "estimate.nc") as data:
        assert set(NAMES) <= set(data["element"].values)
    assert "r_A/B" in read(output / "markers.trc").marker_names
    for path in (*output.glob("*.mot"), *output.glob("*.sto")):
        assert np.isfinite(read_table(path).time).all()
    assert tomllib.loads((output / "config.toml").read_text())["trial"] == str(trial)
    page = (output / "report.html").read_text()
    assert "A/B" in page and "<script>." not in page


def test_a_file_name_that_outputs_cannot_tell_is_refused_before_the_run(
    study: Path, tmp_path: Path, capsys: Said
) -> None:
    trial = study / "x\udcff.trc"
    trial.write_bytes((study / "squat.trc").read_bytes())
    assert run(study, trial.name, tmp_path / "out") == 2
    assert "its name is no UTF-8 text" in " ".join(capsys.readouterr().err.split())
    trial.unlink()


@pytest.mark.parametrize("output", ["a\udcff", "y" * 5000])
def test_an_output_that_no_folder_can_be_called_is_refused_before_the_run(
    study: Path, tmp_path: Path, output: str, capsys: Said
) -> None:
    assert run(study, "squat.trc", tmp_path / output) == 2
    assert "cannot write results there" in " ".join(capsys.readouterr().err.split())


@pytest.mark.nightly
def test_an_output_of_as_long_a_name_as_there_can_be(study: Path, tmp_path: Path) -> None:
    output = tmp_path / ("o" * 255)
    assert run(study, "squat.trc", output) == 0
    assert (output / "metrics.json").is_file()


@pytest.mark.parametrize("name", ["thigh\\n", "thigh\\t", "thigh\\u0000"])
def test_a_name_that_would_break_a_line_is_refused(study: Path, tmp_path: Path, name: str, capsys: Said) -> None:
    text = (study / "model.toml").read_text().replace("thigh/leg", f"a{name}b")
    (study / "broken.toml").write_text(text)
    command = ["run", str(study / "squat.trc"), "--model", str(study / "broken.toml"), "-o", str(tmp_path / "o")]
    assert main(command) == 2
    assert "expected a name without control characters" in " ".join(capsys.readouterr().err.split())
