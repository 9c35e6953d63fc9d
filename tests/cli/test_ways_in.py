"""The same trial from Python, the command line, a batch and a recorded session gives the same folder."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import dynakin
from dynakin.cli.app import main
from dynakin.errors import ConfigError, OutputError
from dynakin.report.insights import in_short, insights
from dynakin.report.paper_figures.figures import FIGURES
from dynakin.results.files.folder import OUTPUT_FILES
from dynakin.settings.settings import Settings
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate_squat

KEYS = {"model": "sagittal7", "markers": "opencap", "mass_kg": 70.0, "height_m": 1.75}
OPTIONS = ["--model", "sagittal7", "--markers", "opencap", "--mass", "70", "--height", "1.75"]
NOT_EQUAL = {"config.toml", "report.html", "metrics.json", "estimate.nc"}  # hold where they lie and how long it took


@pytest.fixture(scope="module")
def squat() -> SimulatedTrial:
    return simulate_squat(seed=4, duration_s=5.0)


@pytest.fixture(scope="module")
def trial(squat: SimulatedTrial, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return squat.save(tmp_path_factory.mktemp("ways") / "trial")


@pytest.fixture(scope="module")
def from_python(trial: Path) -> dynakin.Result:
    return dynakin.run(trial / "markers.trc", forces=trial / "forces.mot", **KEYS)


@pytest.fixture(scope="module")
def saved(from_python: dynakin.Result, trial: Path) -> Path:
    return from_python.save(trial.parent / "python")


def check_same(one: Path, other: Path) -> None:
    assert {file.name for file in one.iterdir()} == {file.name for file in other.iterdir()}
    for file in one.iterdir():
        if file.name not in NOT_EQUAL:
            assert file.read_bytes() == (other / file.name).read_bytes(), file.name
    with xr.open_dataset(one / "estimate.nc") as a, xr.open_dataset(other / "estimate.nc") as b:
        names = [name for name in a.variables if name != "step_us"]
        assert set(a.variables) == set(b.variables)
        assert all(a[name].identical(b[name]) for name in names)
    a, b = (json.loads((folder / "metrics.json").read_text()) for folder in (one, other))
    assert set(a) == set(b)
    for key in set(a) - {"timing", "identifiability"}:
        assert a[key] == b[key], key
    assert a["identifiability"]["parameters"] == b["identifiability"]["parameters"]


def test_command_line_and_python_give_one_folder(trial: Path, saved: Path) -> None:
    out = trial.parent / "command"
    arguments = [str(trial / "markers.trc"), "--forces", str(trial / "forces.mot"), *OPTIONS, "-o", str(out)]
    assert main(["run", *arguments]) == 0
    check_same(saved, out)
    assert {file.name for file in out.iterdir()} >= set(OUTPUT_FILES)
    ours, theirs = ((folder / "config.toml").read_text() for folder in (saved, out))
    assert ours.replace(str(saved), str(out)) == theirs
    blocks = [json.loads((folder / "metrics.json").read_text())["identifiability"] for folder in (saved, out)]
    assert blocks[0] == blocks[1] and "advice" in blocks[0]


def test_a_batch_gives_the_same_folder(trial: Path, saved: Path) -> None:
    keys = "".join(f"{key} = {json.dumps(value)}\n" for key, value in KEYS.items())
    study = f'{keys}output = "out"\n[[subjects]]\nname = "S1"\nfolder = "trial"\n'
    (trial.parent / "study.toml").write_text(f'{study}trials = "markers.trc"\nforces = "forces.mot"\n')
    assert main(["batch", str(trial.parent / "study.toml"), "--jobs", "1"]) == 0
    check_same(saved, trial.parent / "out" / "S1" / "markers")


def test_settings_and_a_recording_that_was_read_give_the_same(
    trial: Path, from_python: dynakin.Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dynakin.identification.observability.trial.identifiability", lambda *_, **__: None)
    recording = dynakin.read(trial / "markers.trc", forces=trial / "forces.mot")
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75)
    read = dynakin.run(recording, model="sagittal7", markers="opencap", subject=subject)
    files = {"trial": trial / "markers.trc", "forces": trial / "forces.mot", "output": tmp_path / "out"}
    settings = Settings.of(KEYS | files, "test")
    set_up = dynakin.run(settings)
    for result in (read, set_up):
        for name in ("coordinates", "moments_sd", "state"):
            np.testing.assert_array_equal(result.estimate.data[name], from_python.estimate.data[name])
        assert result.comparison is not None and len(result.comparison.methods) == 3
    assert read.estimate.config["trial"] == str(trial / "markers.trc")
    assert read.estimate.config["forces"] == str(trial / "forces.mot")  # config.toml can be run again
    assert set_up.save() == tmp_path / "out" and (tmp_path / "out" / "report.html").exists()
    with pytest.raises(OutputError, match=r"no folder was given, expected save\(FOLDER\)"):
        read.save()
    with pytest.raises(ConfigError, match="trial is missing"):
        dynakin.run(Settings.of({"model": "squat7"}, "test", ("model",)))
    with pytest.raises(ConfigError, match="model is given next to settings"):
        dynakin.run(settings, model="squat7")
    with pytest.raises(ConfigError, match="plate_filter_hz takes effect while a file is read"):
        dynakin.run(recording, plate_filter_hz=20.0, **KEYS)
    with pytest.raises(ConfigError, match="mass_kg is given next to subject"):
        dynakin.run(recording, subject=subject, **KEYS)
    with pytest.raises(ConfigError, match=r"subject is \{'mass_kg': 60.0\}, expected a dynakin.Subject"):
        dynakin.run(recording, subject={"mass_kg": 60.0}, model="squat7")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="unknown key 'modle'"):
        dynakin.run(recording, modle="squat7", **KEYS)


def test_a_result_as_a_researcher_takes_it(from_python: dynakin.Result) -> None:
    assert repr(from_python) == "<Result: <Estimate of markers: sagittal7, 501 frames, smoothed>>"
    assert repr(from_python.estimate.recording).startswith("<Recording markers: 501 frames, ")
    table = from_python.to_dataframe("moments")
    estimate = from_python.estimate
    assert list(table.columns) == estimate.coordinate_names and table.index.name == "time"
    np.testing.assert_array_equal(table.to_numpy(), estimate.data["moments"].transpose("time", "coordinate"))
    for quantity, dimensions in (
        ("markers_estimated", "time, marker, axis"),
        ("final_covariance", "element, element_"),
    ):
        with pytest.raises(
            ConfigError, match=f"{quantity} has the dimensions {dimensions}, .* as coordinates, .*speeds"
        ):
            from_python.to_dataframe(quantity)
    for wrong in (None, 3):
        with pytest.raises(ConfigError, match=f"no quantity {wrong}, expected one of coordinates"):
            from_python.to_dataframe(wrong)  # type: ignore[arg-type]
    shown = from_python._repr_html_()
    assert "<b>markers</b>" in shown and in_short(insights(estimate, from_python.metrics())) in shown
    assert from_python.plot("moments").axes
    cycles = from_python.cycles
    assert cycles and all(one.movement == "squat" and one.end_s > one.start_s for one in cycles)
    assert from_python.events == estimate.events and from_python.failures.found == []
    assert from_python.metrics()["identifiability"]["advice"] == list(from_python.observability.advice)
    assert from_python.model.mass_kg == 70.0


def test_figures_that_fail_in_python_are_named_in_the_files(
    from_python: dynakin.Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ValueError("zero-size array")

    result = dynakin.Result(from_python.estimate, settings=from_python.settings)
    monkeypatch.setitem(FIGURES, "figure5_angles", broken)
    with pytest.raises(OutputError, match=r"the results are saved .*Failed: figure figure5_angles"):
        result.save(tmp_path / "out", figures=tmp_path / "figures")
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["failures"] == ["figure figure5_angles"]
    assert (tmp_path / "figures" / "figure4_markers.svg").exists()
