"""`dynakin check` says what `dynakin run` does, and ends as it would."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from dynakin.cli.app import main
from dynakin.cli.check_rows import _time, recording_rows
from dynakin.cli.prepared import changed, short
from dynakin.filter.prepared import Prepared
from dynakin.messages import note, warning
from dynakin.results.files.markers import write_trc
from dynakin.results.files.storage import write_storage
from dynakin.simulation.trial import simulate
from support.made_recordings import standing

Said = pytest.CaptureFixture[str]


def printed(capsys: Said) -> tuple[str, str]:
    """What stands on stdout and stderr, without line breaks."""
    said = capsys.readouterr()
    return " ".join(said.out.split()), " ".join(said.err.split())


def ran(arguments: list[str], out: Path) -> int:
    return main(["run", *arguments, "-o", str(out)])


def test_what_is_there_and_what_run_would_do(data_dir: Path, capsys: Said) -> None:
    trial = str(data_dir / "plugin_gait" / "S1_FlywheelSquat.c3d")
    assert main(["check", trial, "--model", "squat7", "--mass", "78.6"]) == 0
    found, _ = printed(capsys)
    for words in ("317 frames at 100 Hz", "2 force plates", "Vertical +Z", "RSHO seen in 78.5 %", "abdomen"):
        assert words in found
    assert "Marker set plug-in-gait" in found and "markers by name; next best" in found
    assert "--static S1_StandingRef.c3d (found next to the recording)" in found
    assert "Moments: absent in all 317 frames." in found  # the cable


def test_a_file_of_the_model_that_is_wrong_is_wrong_input(tmp_path: Path, capsys: Said) -> None:
    simulate("sagittal7", "squat", 1, 5.0).save(tmp_path / "squat")
    trial = [str(tmp_path / "squat" / "markers.trc"), "--forces", str(tmp_path / "squat" / "forces.mot")]
    (tmp_path / "set.toml").write_text("schema_version = 1\nunknown = 1\n")
    text = files("dynakin.model.builtin").joinpath("sagittal7.toml").read_text()
    (tmp_path / "model.toml").write_text(text.replace('name = "sagittal7"', 'name = "mine"\nunknown = 1'))
    for option, file in (("--markers", "set.toml"), ("--model", "model.toml")):
        assert main(["check", *trial, "--mass", "70", option, str(tmp_path / file)]) == 2
        assert f"{file}: unknown key 'unknown'" in printed(capsys)[1]
    own = (Path(__file__).parents[2] / "examples" / "03_own_model.toml").read_text()
    (tmp_path / "model.toml").write_text(own.replace('between = ["knee", "hip"]', 'between = ["knee", "hipp"]'))
    assert main(["check", *trial, "--mass", "70", "--model", str(tmp_path / "model.toml")]) == 1
    assert "model.toml: length 'thigh': its landmarks knee and hipp are not measured" in printed(capsys)[1]


@pytest.mark.parametrize(
    ("options", "refusal"),
    [
        (["--model", "squat7", "--mass", "66"], "RTOE moves"),
        (["--model", "sagittal7", "--mass", "66"], "RTOE moves"),
        (["--model", "fullbody", "--markers", "opencap"], "marker"),
    ],
)
def test_check_refuses_as_run_does(
    data_dir: Path, tmp_path: Path, options: list[str], refusal: str, capsys: Said
) -> None:
    trial = str(data_dir / "plugin_gait" / "GaitNormal_1.c3d")
    assert main(["check", trial, *options]) == 1
    _, checked = printed(capsys)
    assert ran([trial, *options], tmp_path / "out") == 2
    assert printed(capsys)[1] == checked
    assert refusal in checked


def test_a_zero_that_nobody_stands_for_is_refused_before_the_estimate(
    data_dir: Path, tmp_path: Path, capsys: Said, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was once the estimate was there, which took the most of the time."""
    monkeypatch.setattr("dynakin.filter.estimator.Estimator.follow", None)
    arguments = [str(data_dir / "plugin_gait" / "GaitNormal_1.c3d"), "--zero", "standing"]
    assert main(["check", *arguments]) == 1
    found, checked = printed(capsys)
    assert "nobody stands still for 0.5 s" in checked and "(--static)" in checked
    assert "Nobody stands still for it (zero = 'standing')." in found
    for row in ("Model", "Markers", "plug-in-gait", "Subject", "Ground", "Contacts", "Results"):  # what else there is
        assert row in found
    assert "mass is missing" not in found
    assert ran(arguments, tmp_path / "out") == 2
    assert printed(capsys)[1] == checked


def test_where_only_the_mass_is_missing_all_else_is_said(data_dir: Path, capsys: Said) -> None:
    """A chair bears part of the person, so that the plates weigh nobody."""
    folder = data_dir / "opencap_subject4"
    assert main(["check", str(folder / "STS1.trc"), "--forces", str(folder / "STS1_grf.mot")]) == 1
    found, refusal = printed(capsys)
    assert "mass_kg is not given and cannot be found" in refusal
    for words in ("The mass is missing.", "--mass KG", "--static static1.trc", "under the right foot", "Contacts"):
        assert words in found
    assert "Results" not in found


def test_check_promises_what_run_keeps(data_dir: Path, tmp_path: Path, capsys: Said) -> None:
    """Without an option: the same moments for the same reasons, what is assumed said first."""
    trial = str(data_dir / "pycgm" / "Movement_trial.c3d")
    assert main(["check", trial]) == 0
    found, _ = printed(capsys)
    assert ran([trial], tmp_path / "out") == 0
    said, _ = printed(capsys)
    moments = json.loads((tmp_path / "out" / "metrics.json").read_text())["moments"]
    assert moments["verdict"] in found and all(reason in found for reason in moments["reasons"])
    first = said[: said.index(moments["verdict"])]
    for words in ("fullbody (the default", "plug-in-gait", "Mass 85.00 kg: from the file", "plate 2 and plate 4 under"):
        assert words in first and words in found
    assert "right: plate 4 0.33 to 1.03 s; plate 2 1.35 to 2.12 s; off the plates 2.42 to 2.68 s." in found
    assert "--static Static_trial.c3d (found next to the recording)" in found


def test_a_standing_trial_of_another_person_is_among_the_doubts(data_dir: Path, capsys: Said) -> None:
    trial, static = data_dir / "plugin_gait" / "GaitNormal_1.c3d", data_dir / "pycgm" / "Static_trial.c3d"
    assert main(["check", str(trial), "--static", str(static)]) == 0
    found, _ = printed(capsys)
    assert found.count("another person, or markers put on anew") == 1
    assert found.index("Doubts") < found.index("another person, or markers put on anew")


def test_what_pulls_is_no_load() -> None:
    made = standing(70.0)
    plate = made.plates[0]
    pulls = replace(plate, name="plate 9", force=np.tile([0.0, -40.0, 0.0], (made.n_frames, 1)))
    said = recording_rows(made.with_plates((plate, pulls)))
    rows = dict(str(text).split(": ", 1) for topic, text in said if topic == "Plates")
    assert rows["plate 9"] == "up to -40 N, mean -40.0 N, loaded 0 %."
    assert rows[plate.name].endswith("loaded 100 %.")


def test_a_handle_that_is_pulled_is_loaded() -> None:
    made = standing(70.0)
    force = np.zeros((made.n_frames, 3))
    force[made.n_frames // 2 :] = [60.0, -5.0, 0.0]
    handle = replace(made.plates[0], name="plate 9", force=force)
    said = recording_rows(made.with_plates((*made.plates, handle)))
    rows = dict(str(text).split(": ", 1) for topic, text in said if topic == "Plates")
    assert rows["plate 9"].startswith("up to 60 N") and rows["plate 9"].endswith("loaded 50 %.")


def test_forces_next_to_a_recording_are_named_and_do_what_is_said(tmp_path: Path, capsys: Said) -> None:
    made = simulate("fullbody", "squat", 1, 5.0).recording
    trial = tmp_path / "squat1.trc"
    write_trc(trial, made.time, list(made.marker_names), made.markers, unit="mm")
    columns, values = [], []
    for number, plate in enumerate(made.plates, 1):
        for stem, part in (("v", plate.force), ("p", np.nan_to_num(plate.cop)), ("m", plate.free_moment)):
            columns += [f"ground_force_{number}_{stem}{axis}" for axis in "xyz"]
            values.append(part)
    forces = tmp_path / "squat1_grf.mot"
    write_storage(forces, "forces", made.time, columns, np.hstack(values), in_degrees=False)
    main(["check", str(trial), "--mass", "70"])
    assert "--forces squat1_grf.mot (found next to the recording)" in printed(capsys)[0]
    assert main(["check", str(trial), "--mass", "70", "--forces", str(forces)]) == 0
    found, _ = printed(capsys)
    assert "Leg moments: measured in all" in found and "--forces" not in found
    assert "1 under the right foot" in found or "2 under the right foot" in found
    assert "Held: knee adduction (both sides)" in found


def test_a_planar_model_is_checked_as_it_runs(tmp_path: Path, capsys: Said) -> None:
    """Without plates it is refused, as `run` refuses it; a file that nobody can read too."""
    made = simulate("sagittal7", "squat", 1, 5.0).recording
    trial = tmp_path / "squat.trc"
    write_trc(trial, made.time, list(made.marker_names), made.markers, unit="mm")
    options = [str(trial), "--model", "sagittal7", "--mass", "70"]
    assert main(["check", *options]) == 1
    _, checked = printed(capsys)
    assert "no force plates" in checked
    assert ran(options, tmp_path / "out") == 2
    assert printed(capsys)[1] == checked
    trial.write_text("nothing")
    assert main(["check", *options]) == 1
    assert main(["check", *options, "--side", "middle"]) == 2
    for missing in ("--forces", "--static"):
        assert main(["check", options[0], missing, str(tmp_path / "none.trc")]) == 2


def test_run_names_what_lies_next_to_a_recording(data_dir: Path, tmp_path: Path, capsys: Said) -> None:
    assert main(["run", str(data_dir / "rajagopal" / "motion_capture_run.trc"), "-o", str(tmp_path / "out")]) == 2
    _, refusal = printed(capsys)
    assert refusal.endswith("Give --static static_run.trc?")
    walk = str(data_dir / "opencap_subject4" / "walking1.trc")
    assert main(["check", walk]) == 0
    found, _ = printed(capsys)
    assert "--forces walking1_grf.mot lies next to the recording" in found


def test_what_is_no_recording_or_no_option_is_wrong_input(tmp_path: Path, capsys: Said) -> None:
    """As README has it: 1 is a refusal of a recording that is there."""
    there = tmp_path / "x.trc"
    there.write_text("no recording\n")
    assert [main(["check", str(tmp_path / "nowhere.trc")]), main(["check", str(there), "--mass", "-3"])] == [2, 2]
    assert main(["check", str(there)]) == 1


def test_run_says_what_was_cut_or_turned_and_nothing_of_every_file() -> None:
    made = standing()
    markers = made.markers.copy()
    markers[-3:] = np.nan
    turned = "plate 1 stores the person's action, unlike the others: it is turned."
    notes = (note("routine", "Plates resampled."), warning("recording", "labels."), note("plates", turned))
    blank = replace(made, markers=markers, notes=notes).without_empty_ends()
    said = changed(SimpleNamespace(recording=blank))  # type: ignore[arg-type]
    assert [topic for topic, _ in said] == ["Note", "Note"]
    assert str(said[0][1]) == turned and "the last 3 frames: they are left out" in str(said[1][1])


def test_how_long_a_run_takes_is_said_where_it_is_more_than_a_minute() -> None:
    def ready(n_frames: int, n_markers: int, measured: tuple[bool, ...]) -> Prepared:
        spec = SimpleNamespace(markers=[SimpleNamespace(measured=measured)] * n_markers)
        calibrated = SimpleNamespace(spec=spec)
        return cast(Prepared, SimpleNamespace(calibrated=calibrated, recording=SimpleNamespace(n_frames=n_frames)))

    assert _time(ready(30_000, 72, (True, True, True))) == [
        "A run takes about 9 min (30000 frames), on a busy machine more."
    ]
    assert not _time(ready(1346, 47, (True, True, True))) and not _time(ready(30_000, 20, (True, True, False)))


def test_only_a_list_at_the_end_of_a_sentence_is_cut() -> None:
    names = ", ".join(f"M{k}" for k in range(12))
    assert short(note("markers", f"Left out: {names}.")).text == "Left out: M0, M1, M2, M3, M4 and 7 more."
    said = f"{names} left out: a and b have been exchanged. Exchange them, or correct the corners."
    assert short(note("plates", said)).text == said
