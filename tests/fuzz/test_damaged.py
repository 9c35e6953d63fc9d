"""What fuzzing found in 0.1, row by row: each ends in one clear error of dynakin's own, in time."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynakin.errors import ConfigError, DynakinError, ModelError, OutputError, RecordingError
from dynakin.filter.build import definition_of
from dynakin.filter.estimator import Estimator
from dynakin.filter.samples import Sample
from dynakin.filter.tracker import Tracker
from dynakin.model.definition import load_model
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.model.table import load_table
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.formats.trc import read_trc
from dynakin.recordings.read import read
from dynakin.recordings.recording import Plate, Recording
from dynakin.results.files.folder import check_output_writable
from dynakin.settings import presets
from dynakin.settings.settings import Settings, read_keys
from dynakin.settings.strict import read_toml
from dynakin.settings.subject import Subject
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.sinks.record_format import packet_record, text_record
from dynakin.stream.sinks.recorder import FILE, recorded
from dynakin.stream.sources.packets import MarkerPacket, PlatePacket
from support.fuzz.corpus import OSIM_3, OSIM_4, make


def refused(call: Callable[[], object], kind: type[DynakinError], expected: str) -> None:
    with pytest.raises(kind) as error:
        call()
    text = str(error.value)
    assert expected in text
    assert text.isprintable() and len(text) <= 1100


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    make(folder)
    return folder


# --- models and configurations


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a = " + "[" * 5000 + "]" * 5000, "lie too deep in one another"),
        ("a = " + "{a=" * 3000 + "1" + "}" * 3000, "lie too deep in one another"),
        ("a = " + "9" * 4301, "not a TOML file"),
        ("a." * 20_000 + "a = 1", "line 1: found a key of 64 parts or more"),
        ("\n[" + "a . " * 20_000 + "a]", "line 2: found a key of 64 parts or more"),
        ("a = {" + '"b c".' * 20_000 + "a = 1}", "line 1: found a key of 64 parts or more"),
    ],
)
def test_toml_that_nests_too_deep(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(text)
    refused(lambda: read_toml(path), ModelError, expected)


def test_dots_in_texts_numbers_and_remarks_are_no_long_key(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(
        f"# {'.' * 200}\nlist = [{', '.join(['0.1'] * 200)}]\ntext = '{'a sentence. ' * 100}'\n'a.b'.c.d = 1\n"
        f"line = '{'-.' * 30}'\n"
    )
    assert read_toml(path)["a.b"] == {"c": {"d": 1}}


@pytest.mark.parametrize(
    ("sound", "odd", "expected"),
    [("UTF-8", encoding, "a.osim") for encoding in ("nonsense", "utf-7", "utf-32", "shift_jis", "idna")]
    + [("40000", version, "expected 20000 or more") for version in ("²", "4" * 5000, "٣0000", "-1", "")],
)
def test_encodings_that_the_parser_lacks_and_versions_that_are_no_numbers(
    tmp_path: Path, sound: str, odd: str, expected: str
) -> None:
    path = tmp_path / "a.osim"
    path.write_text(OSIM_4.replace(sound, odd))
    refused(lambda: load_model(path), ModelError, expected)


@pytest.mark.parametrize("name", ["x\0.osim", "y" * 5000 + ".osim", "x\0.toml", "y" * 5000 + ".toml"])
def test_file_names_that_no_file_can_have(tmp_path: Path, name: str) -> None:
    refused(lambda: load_model(name), ModelError, "x\\x00" if "\0" in name else "yyy")
    refused(lambda: load_table(name, None), ModelError, "no such table")
    refused(lambda: load_marker_set(name), ModelError, "unknown")
    refused(lambda: read(name.replace(".osim", ".trc").replace(".toml", ".trc")), RecordingError, "cannot be read")
    config = tmp_path / "a.toml"
    keys = 'trial = "a.trc"\nmodel = "squat7"\noutput = "o"\nmarkers = "x\\u0000"\n'
    config.write_text(f'{keys}table = "{"y" * 5000}"\n')
    assert Settings.of(read_keys(config), str(config)).table == "y" * 5000
    refused(lambda: definition_of(Settings.of(read_keys(config), str(config))), ModelError, "no such table")


def test_elements_that_nest_too_deep(tmp_path: Path) -> None:
    path = tmp_path / "a.osim"
    nest = "<components>" * 5000 + "</components>" * 5000
    path.write_text(OSIM_4.replace("<gravity>", f"{nest}<gravity>"))
    refused(lambda: load_model(path), ModelError, "found more than 100 elements in one another")


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("rxx", "1e200"),
        ("rxx", "-1e160"),
        ("mass_percent", "1e300"),
        ("origin", "c7>hip:1.5.2"),
        ("origin", f"c7>hip:{'9' * 400}"),
    ],
)
def test_tables_whose_numbers_overflow(whole: Path, tmp_path: Path, column: str, cell: str) -> None:
    lines = (whole / "table_dumas.csv").read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("part"))
    names, cells = lines[head].split(","), lines[head + 1].split(",")
    cells[names.index(column)] = cell
    lines[head + 1] = ",".join(cells)
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    refused(lambda: load_table(path, None), ModelError, f"line {head + 2}: {column} is '{cell}'")


@pytest.mark.parametrize("ending", [".toml", ".osim", ".trc", ".csv", ".c3d"])
def test_a_pipe_is_not_waited_for(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"pipe{ending}"
    os.mkfifo(path)
    if ending in (".toml", ".osim"):
        refused(lambda: load_model(path), ModelError, "expected a" if ending == ".osim" else "unknown")
        refused(lambda: read_toml(path), ModelError, "is a pipe or device, expected a file")
    else:
        refused(lambda: read(path), RecordingError, "is a pipe or device, expected a file")


@pytest.mark.parametrize("text", [OSIM_3, OSIM_4])
def test_more_bodies_than_anybody_has(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.osim"
    path.write_text(text.replace("<BodySet><objects>", "<BodySet><objects>" + '<Body name="b"/>' * 300_000))
    refused(lambda: load_model(path), ModelError, "entries in BodySet, expected at most 1000")


def test_a_preset_that_starts_from_itself(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(f'base = "{path}"\n')
    refused(lambda: presets.preset(str(path)), ConfigError, "base: preset")


def test_a_slash_in_the_name_of_a_coordinate(whole: Path, tmp_path: Path) -> None:
    osim, toml = tmp_path / "a.osim", tmp_path / "a.toml"
    osim.write_text(OSIM_4.replace("flexion", "marker/x"))
    refused(lambda: load_model(osim), ModelError, "a coordinate's name has no /")
    toml.write_text((whole / "model_sagittal7.toml").read_text().replace('"knee"', '"marker/x"'))
    refused(lambda: load_model(toml), ModelError, "found 'marker/x', expected a name without /")


@pytest.mark.parametrize("name", ["a\0b", "a\udcff", "y" * 5000])
def test_an_output_that_no_folder_can_be_called(tmp_path: Path, name: str) -> None:
    refused(lambda: check_output_writable(tmp_path / name), OutputError, "cannot write results there")


# --- recordings


@pytest.mark.parametrize(("rows", "said"), [("9" * 5000, "cut off"), ("²", ""), ("9" * 30, "cut off")])
def test_counts_of_rows_that_are_no_numbers(whole: Path, tmp_path: Path, rows: str, said: str) -> None:
    path = tmp_path / "a.mot"
    path.write_text((whole / "forces_squat.mot").read_text().replace("nRows=24", f"nRows={rows}"))
    table = read_table(path)
    assert len(table.time) == 24
    assert len(" ".join(map(str, table.notes))) < 200 and said in " ".join(map(str, table.notes))


def timed(whole: Path, folder: Path, name: str, factor: float) -> Path:
    """A file with its times multiplied."""
    separator = "," if name.endswith(".csv") else "\t"
    column = 1 if name.endswith(".trc") else 0
    lines = []
    for line in (whole / name).read_text().splitlines():
        cells = line.split(separator)
        if len(cells) > 5 and cells[column].replace(".", "").isdigit():
            cells[column] = f"{factor * float(cells[column]):.12g}"
        lines.append(separator.join(cells))
    path = folder / name
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("name", ["markers_squat.trc", "markers_squat.csv", "forces_squat.mot"])
@pytest.mark.parametrize(
    ("factor", "expected"),
    [
        (1e3, "20 s apart (0.05 Hz), expected 5 to 100000 Hz; they seem to be in milliseconds, expected seconds"),
        (1e6, "2e+04 s apart (5e-05 Hz), expected 5 to 100000 Hz; they seem to be in microseconds, expected seconds"),
        (1e-4, "2e-06 s apart (5e+05 Hz), expected 5 to 100000 Hz"),
        (2e-7, "4e-09 s apart (2.5e+08 Hz), expected 5 to 100000 Hz"),
    ],
)
def test_rates_that_no_camera_has(whole: Path, tmp_path: Path, name: str, factor: float, expected: str) -> None:
    path = timed(whole, tmp_path, name, factor)
    refused(lambda: read_table(path) if path.suffix == ".mot" else read(path), RecordingError, expected)


def test_a_time_that_jumps_by_more_than_an_hour(whole: Path, tmp_path: Path) -> None:
    lines = (whole / "markers_squat.trc").read_text().splitlines()
    cells = lines[-1].split("\t")
    lines[-1] = "\t".join([cells[0], "1e9", *cells[2:]])
    path = tmp_path / "a.trc"
    path.write_text("\n".join(lines) + "\n")
    refused(lambda: read_trc(path), RecordingError, f"line {len(lines)}: time 1e+09 s comes after 2.44 s")


def changed(whole: Path, folder: Path, name: str, column: str, value: str) -> Path:
    """A file with one cell of its fifth row of numbers changed."""
    separator = "," if name.endswith(".csv") else "\t"
    lines = (whole / name).read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.split(separator)[0].casefold() in ("time", "frame#"))
    names = lines[head].split(separator)
    row = head + 5 + (2 if name.endswith(".trc") else 0)
    cells = lines[row].split(separator)
    cells[names.index(column)] = value
    lines[row] = separator.join(cells)
    path = folder / name
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("value", ["inf", "1e200", "-2e7"])
def test_markers_that_are_infinite_or_beyond_the_horizon(whole: Path, tmp_path: Path, value: str) -> None:
    trc = changed(whole, tmp_path, "markers_squat.trc", "r_5meta", value)  # mm
    csv = changed(whole, tmp_path, "markers_squat.csv", "r_5meta_x", value)
    for path in (trc, csv):
        refused(
            lambda path=path: read(path), RecordingError, "'inf'" if value == "inf" else "marker 'r_5meta' at frame 5"
        )


@pytest.mark.parametrize(
    ("value", "expected"), [("inf", "'inf'"), ("1e200", "1e+200"), ("-2e5", "has a force of -2e+05")]
)
def test_forces_that_are_infinite_or_beyond_every_plate(whole: Path, tmp_path: Path, value: str, expected: str) -> None:
    for name in ("forces_squat.mot", "markers_squat.csv"):
        path = changed(whole, tmp_path, name, "ground_force_1_vx", value)
        given: Any = (whole / "markers_squat.trc", path) if path.suffix == ".mot" else (path,)
        refused(lambda given=given: read(*given), RecordingError, expected)
    point = changed(whole, tmp_path, "forces_squat.mot", "ground_force_1_px", "1e306")
    refused(lambda: read(whole / "markers_squat.trc", point), RecordingError, "has a moment of")


def test_a_missing_marker_and_a_missing_plate_stay_missing(whole: Path, tmp_path: Path) -> None:
    markers = read(changed(whole, tmp_path, "markers_squat.csv", "r_5meta_x", ""))
    assert np.isnan(markers.marker("r_5meta")[4]).all() and np.isfinite(markers.marker("r_5meta")[5]).all()
    forces = changed(whole, tmp_path, "forces_squat.mot", "ground_force_1_vx", "nan")
    plate = read(whole / "markers_squat.trc", forces).plates[0]
    assert np.isnan(plate.force[4, 0]) and np.isfinite(plate.force[5]).all()


def test_a_recording_in_memory_holds_nothing_impossible() -> None:
    time, still = np.arange(3) / 100.0, np.ones((3, 1, 3))
    zero = np.zeros((3, 3))

    def made(time: np.ndarray = time, markers: np.ndarray = still, force: np.ndarray = zero) -> Recording:
        return Recording("a", None, time, ("M",), markers, (Plate("plate 1", force, zero, zero, zero),))

    assert made().n_frames == 3
    bad = still.copy()
    bad[1, 0, 2] = np.inf
    refused(lambda: made(markers=bad), RecordingError, "a: marker 'M' at frame 2 is at 1, 1, inf m")
    refused(lambda: made(force=zero + np.inf), RecordingError, "a: plate 1 at frame 1 (0 s) has a force of")
    refused(lambda: made(time=np.array([0.0, 0.02, 0.01])), RecordingError, "of frame 3 does not come after 0.02 s")
    refused(lambda: made(time=np.array([0.0, np.nan, 0.01])), RecordingError, "time of frame 2 is nan")


# --- live


@pytest.fixture(scope="module")
def trial() -> SimulatedTrial:
    return simulate_squat(seed=3, duration_s=5.0, rate_hz=50.0)


@pytest.fixture(scope="module")
def started(trial: SimulatedTrial) -> Tracker:
    estimator = Estimator(load_model("sagittal7", Subject(mass_kg=70.0), markers="opencap"))
    return estimator.start(trial.recording, lag_s=0.04)


@pytest.mark.parametrize(
    ("time", "marker", "plate", "expected"),
    [
        (np.nan, np.ones(3), np.zeros(6), "sample: time is nan s"),
        (np.inf, np.ones(3), np.zeros(6), "sample: time is inf"),
        ("now", np.ones(3), np.zeros(6), "sample: time is 'now', expected 1 number"),
        (0.0, np.ones(4), np.zeros(6), "marker 'r_knee' has shape (4,), expected (3,)"),
        (0.0, np.ones((1, 3)), np.zeros(6), "marker 'r_knee' has shape (1, 3), expected (3,)"),
        (0.0, "knee", np.zeros(6), "marker 'r_knee' is 'knee', expected 3 numbers"),
        (0.0, np.full(3, np.inf), np.zeros(6), "marker 'r_knee' is [inf inf inf], expected numbers up to 10000"),
        (0.0, np.ones(3), np.zeros(3), "plate 1 has shape (3,), expected (6,)"),
        (0.0, np.ones(3), np.full(6, 1e200), "plate 1 is [1.e+200"),
    ],
)
def test_samples_of_another_shape(started: Tracker, time: Any, marker: Any, plate: Any, expected: str) -> None:
    sample = Sample(time, {"r_knee": marker}, {"plate 1": plate})
    refused(lambda: started.step(sample), RecordingError, expected)


def session(trial: SimulatedTrial, *, markers: list[str] | None = None) -> list[bytes]:
    recording = trial.recording
    stream = {"names": markers or list(recording.marker_names), "rate_hz": 50.0, "clock": "a"}
    plates = {"names": ["plate 1"], "rate_hz": 50.0, "clock": "a"}
    records = [text_record({"streams": {"markers": stream, "plates": plates}, "settings": {}})]
    for t, frame, wrench in zip(recording.time, recording.markers, recording.total_wrench(), strict=True):
        records.append(packet_record(PlatePacket(np.array([t]), wrench[None, None], 100.0 + t)))
        records.append(packet_record(MarkerPacket(float(t), frame, 100.0 + t)))
    return records


def test_a_damaged_record_of_a_session_is_passed_over(trial: SimulatedTrial, tmp_path: Path) -> None:
    records = session(trial)
    nonsense = [text_record([]), packet_record(MarkerPacket(0.5, np.ones(4), 100.5))]  # type: ignore[arg-type]
    nonsense.append(packet_record(PlatePacket(np.array([0.5]), np.ones(5), 100.5)))
    (tmp_path / FILE).write_bytes(b"".join([*records[:100], *nonsense, *records[20:60], *records[100:]]))
    found = recorded(tmp_path)
    assert found.n_frames == trial.recording.n_frames and (np.diff(found.time) > 0).all()


@pytest.mark.parametrize(
    ("streams", "expected"),
    [
        ({"markers": {"names": ["a"]}}, "its streams are not described as expected"),
        ({"markers": {"names": ["a"], "rate_hz": 0.0, "clock": "a"}, "plates": None}, "0 Hz"),
        ({"markers": {"names": 3, "rate_hz": 50.0, "clock": "a"}, "plates": None}, "its streams are not described"),
        ([], "its streams are not described"),
    ],
)
def test_a_session_whose_streams_are_not_described(tmp_path: Path, streams: Any, expected: str) -> None:
    (tmp_path / FILE).write_bytes(text_record({"streams": streams, "settings": {}}))
    refused(lambda: recorded(tmp_path), RecordingError, expected)


def test_two_sessions_in_one_file(trial: SimulatedTrial, tmp_path: Path) -> None:
    other = session(trial, markers=["a", "b"])
    (tmp_path / FILE).write_bytes(b"".join(session(trial) + other))
    refused(lambda: recorded(tmp_path), RecordingError, "holds two sessions")
    (tmp_path / FILE).write_bytes(b"".join(session(trial) * 2))
    assert (np.diff(recorded(tmp_path).time) > 0).all()
