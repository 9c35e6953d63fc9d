"""MOT and STO tables, ground forces in them, and bringing these to the markers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.formats.grf_columns import parse_column
from dynakin.recordings.formats.ground_forces import attach_forces, plates_from_table
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.read import read
from dynakin.recordings.recording import Plate
from dynakin.recordings.resampling import ReadOptions
from support.made_recordings import TRC_TOP, grf_text, plain, write

QUANTITIES = {"vx": 10.0, "vy": 700.0, "vz": -20.0, "px": 0.2, "py": 0.01, "pz": 0.3}
WRENCH_MOMENT = np.cross([0.2, 0.01, 0.3], [10.0, 700.0, -20.0]) + np.array([0.0, 5.0, 0.0])


def trc(folder: Path, n_frames: int, start_s: float = 0.0) -> Path:
    rows = "".join(f"{k + 1}\t{start_s + k / 100:.4f}\t1\t2\t3\t4\t5\t6\n" for k in range(n_frames))
    return write(folder, "trial.trc", TRC_TOP + rows)


def single(time: np.ndarray) -> str:
    columns = {f"ground_force_{key}": value for key, value in QUANTITIES.items()}
    return grf_text(time, {**columns, "ground_torque_x": 0.0, "ground_torque_y": 5.0, "ground_torque_z": 0.0})


OLD = "name trial\ndatacolumns 3\ndatarows 2\nrange 0 0.01\nendheader\ntime knee tx\n0 90 1\n0.01 180 2\n"
NEW = (
    "Coordinates\nversion=1\nnRows=2\nnColumns=3\ninDegrees=yes\n\nUnits are S.I.\nendheader\n"
    "time\tknee\ttx\n0\t90\t1\n0.01\t180\t2\n"
)
MIXED = (
    "squat.mot\nnRows = 2\nnColumns = 3\nINDEGREES = no\nEndHeader\n\nTime\tknee\ttx\t\n0\t90\t1\t\n0.01\t180\t2\t\n"
)


@pytest.mark.parametrize(("text", "degrees"), [(OLD, None), (NEW, True), (MIXED.replace("\n", "\r\n"), False)])
def test_all_headers(tmp_path: Path, text: str, degrees: bool | None) -> None:
    table = read_table(write(tmp_path, "a.mot", text))
    assert table.names == ("knee", "tx")
    assert table.in_degrees is degrees
    np.testing.assert_array_equal(table.time, [0, 0.01])
    np.testing.assert_array_equal(table.column("knee"), [90, 180])
    assert table.notes == ()


def test_degrees_become_radians_but_translations_stay(tmp_path: Path) -> None:
    table = read_table(write(tmp_path, "a.mot", NEW)).radians(["knee"])
    np.testing.assert_allclose(table.column("knee"), [np.pi / 2, np.pi])
    np.testing.assert_array_equal(table.column("tx"), [1, 2])
    already = read_table(write(tmp_path, "b.mot", MIXED)).radians(["knee"])
    np.testing.assert_array_equal(already.column("knee"), [90, 180])
    with pytest.raises(RecordingError, match="inDegrees"):
        read_table(write(tmp_path, "c.mot", OLD)).radians(["knee"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (NEW.replace("0.01\t180\t2", "0.01\t180"), ["line 11", "found 2 columns", "expected 3"]),
        (NEW.replace("\ttx", "\tknee"), ["'knee'", "more than once"]),
        (NEW.replace("0.01\t180", "0\t180"), ["line 11", "increasing"]),
        (NEW.replace("time\tknee", "knee\ttime"), ["line 9", "found column 'knee' first"]),
        (NEW.replace("inDegrees=yes", "inDegrees=maybe"), ["inDegrees=maybe", "yes or no"]),
        ("nothing here\n", ["not a MOT or STO"]),
    ],
)
def test_bad_tables(tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(RecordingError) as caught:
        read_table(write(tmp_path, "a.mot", text))
    for word in [*words, "a.mot"]:
        assert word in str(caught.value)


def test_more_rows_than_the_header_says_are_used_and_said(tmp_path: Path) -> None:
    table = read_table(write(tmp_path, "a.mot", NEW.replace("nRows=2", "nRows=1")))
    assert len(table.time) == 2
    assert "holds 2" in table.notes[0].text


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("ground_force_vx", ("", "force", "x")),
        ("1_ground_force_vy", ("1", "force", "y")),
        ("ground_force_1_vz", ("1", "force", "z")),
        ("ground_force2_px", ("2", "point", "x")),
        ("l_ground_force_py", ("l", "point", "y")),
        ("R_ground_force_pz", ("r", "point", "z")),
        ("ground_force_vx_r", ("r", "force", "x")),
        ("ground_force_calcn_r_vx", ("calcn_r", "force", "x")),
        ("FP1_vx", ("1", "force", "x")),
        ("ground_force_1_vx (N)", ("1", "force", "x")),
        ("ground_force_1_px [m]", ("1", "point", "x")),
        ("ground_force_1_mx (N m)", ("1", "torque", "x")),
        ("FP2.Fy", ("2", "force", "y")),
        ("FP2_mz", ("2", "torque", "z")),
        ("ground_torque_x", ("", "torque", "x")),
        ("1_ground_torque_y", ("1", "torque", "y")),
        ("ground_torque_1_z", ("1", "torque", "z")),
        ("ground_torque2_x", ("2", "torque", "x")),
        ("ground_force_1_mx", ("1", "torque", "x")),
        ("ground_moment_l_my", ("l", "torque", "y")),
        ("l_ground_moment_z", ("l", "torque", "z")),
        ("pelvis_tx", None),
        ("RKNE_x", None),
        ("ground_force_x", None),
        ("knee_angle_r", None),
    ],
)
def test_spellings(name: str, expected: tuple[str, str, str] | None) -> None:
    assert parse_column(name) == expected


@pytest.mark.parametrize("style", [
    ("{p}_ground_force_{q}", "{p}_ground_torque_{a}"),
    ("ground_force_{p}_{q}", "ground_force_{p}_m{a}"),
    ("ground_force{p}_{q}", "ground_torque{p}_{a}"),
    ("FP{p}_{q}", "FP{p}_t{a}"),
])  # fmt: skip
def test_plates_of_every_spelling(tmp_path: Path, style: tuple[str, str]) -> None:
    columns: dict[str, float] = {}
    for p, gain in (("1", 1.0), ("2", 2.0)):
        for q, value in QUANTITIES.items():
            columns[style[0].format(p=p, q=q)] = value * (gain if q[0] == "v" else 1)
        for a, value in zip("xyz", (0.0, 5.0, 0.0), strict=True):
            columns[style[1].format(p=p, a=a)] = value * gain
    path = write(tmp_path, "a.mot", grf_text(np.arange(3) / 100, columns))
    plates, notes = plates_from_table(read_table(path))
    assert [plate.name for plate in plates] == ["plate 1", "plate 2"]
    assert notes == ()
    for plate, gain in zip(plates, (1.0, 2.0), strict=True):
        np.testing.assert_allclose(plate.force[0], gain * np.array([10, 700, -20]))
        np.testing.assert_allclose(plate.moment[0], gain * WRENCH_MOMENT)
        np.testing.assert_allclose(plate.cop[0], [0.2, 0.01, 0.3])
        np.testing.assert_allclose(plate.free_moment[0], [0, gain * 5, 0])


def test_one_plate_of_the_opposite_sign_is_turned_and_named(tmp_path: Path) -> None:
    """All of them the same way is left to the check, which knows what is up."""

    def forces(*signs: float) -> tuple[tuple[Plate, ...], tuple[str, ...]]:
        columns: dict[str, float] = {}
        for p, sign in enumerate(signs, start=1):
            columns |= {f"FP{p}_{q}": value * (sign if q[0] == "v" else 1.0) for q, value in QUANTITIES.items()}
            columns |= {f"FP{p}_m{a}": value for a, value in zip("xyz", (0.0, 5.0 * sign, 0.0), strict=True)}
        return plates_from_table(read_table(write(tmp_path, "a.mot", grf_text(np.arange(9) / 100, columns))))

    plates, notes = forces(1.0, -0.9)
    np.testing.assert_allclose(plates[1].force[0], 0.9 * plates[0].force[0])
    np.testing.assert_allclose(plates[1].moment[0], 0.9 * plates[0].moment[0])
    np.testing.assert_allclose(plates[1].free_moment[0], 0.9 * plates[0].free_moment[0])
    assert [str(note) for note in notes] == [
        "The file stores the person's action on plate 2, unlike its other plates; turned into the ground's reaction."
    ]
    for signs in ((-1.0, -0.9), (1.0, -0.1)):
        plates, notes = forces(*signs)
        assert [np.sign(plate.force[0, 1]) for plate in plates] == [np.sign(sign) for sign in signs]
        assert not notes


def test_same_rate_passes_through_untouched(tmp_path: Path) -> None:
    text = single(np.arange(5) / 100).replace("700", "3.25")  # less than the threshold
    recording = read(trc(tmp_path, 5), write(tmp_path, "a.mot", text))
    (plate,) = recording.plates
    np.testing.assert_array_equal(plate.force, np.tile([10.0, 3.25, -20.0], (5, 1)))
    assert not [note for note in map(str, recording.notes) if "brought to" in note]
    assert recording.path is not None
    zeroed = read(recording.path, tmp_path / "a.mot", force_threshold_n=25.0)
    np.testing.assert_array_equal(zeroed.plates[0].force, 0.0)
    assert np.isnan(zeroed.plates[0].cop).all()


@pytest.mark.parametrize("rate", [1000.0, 1200.0, 333.0])
def test_higher_rates_are_resampled(tmp_path: Path, rate: float) -> None:
    time = np.arange(-0.2, 1.3, 1 / rate)
    slow = 700 + 50 * np.sin(2 * np.pi * 3 * time)
    columns = {f"FP1_{key}": value for key, value in QUANTITIES.items()} | {"FP1_vy": slow}
    columns |= {"FP1_mx": 0.0, "FP1_my": 5.0, "FP1_mz": 0.0}
    recording = read(trc(tmp_path, 101), write(tmp_path, "a.mot", grf_text(time, columns)))
    (plate,) = recording.plates
    expected = 700 + 50 * np.sin(2 * np.pi * 3 * recording.time)
    np.testing.assert_allclose(plate.force[:, 1], expected, atol=0.15)
    np.testing.assert_allclose(plate.force[:, 0], 10, atol=1e-2)
    np.testing.assert_allclose(plate.cop, np.tile([0.2, 0.01, 0.3], (101, 1)), atol=1e-3)
    np.testing.assert_allclose(plate.free_moment[:, 1], 5, atol=5e-2)
    assert any("brought to" in note for note in map(str, recording.notes))


@pytest.mark.parametrize("rate", [1000.0, 100.0])
@pytest.mark.parametrize(
    ("offset_n", "empty_n", "loaded_n"),
    [(-25.0, 0.0, 700.0), (-6.0, 0.0, 700.0), (8.0, 8.0, 708.0), (-2.0, 0.0, 698.0)],
)
@pytest.mark.parametrize("blanked", [False, True])
def test_what_a_plate_reads_while_empty_is_taken_off_or_left_to_the_markers(
    tmp_path: Path, rate: float, offset_n: float, empty_n: float, loaded_n: float, blanked: bool
) -> None:
    """Steadily below nothing is no load, as of a C3D's plate; above, markers know whose it is; noise is none."""
    time = np.arange(round(-0.2 * rate), round(1.3 * rate)) / rate
    noise = np.random.default_rng(1).normal(0.0, 0.5, len(time))
    stands = (time > 0.3) & (time < 0.8)
    push = np.where(stands, 700.0, 0.0) + offset_n + noise
    points = {"px": 2.2 + 1e-3 * noise, "py": 0.0, "pz": 3.3 + 0.01 * time}
    if blanked:  # 0 where nobody stands, far from the plate
        points = {axis: np.where(stands, values, 0.0) for axis, values in points.items()}
    of_one = {"vx": 0.0, "vy": push, "vz": 0.0, "mx": 0.0, "my": 0.0, "mz": 0.0} | points
    columns = {f"FP1_{key}": value for key, value in of_one.items()}
    recording = read(trc(tmp_path, 101), write(tmp_path, "a.mot", grf_text(time, columns)))
    (plate,) = recording.plates
    empty, loaded = recording.time < 0.2, np.abs(recording.time - 0.55) < 0.1
    if not (rate == 100.0 and offset_n == -2.0):  # at the markers' times as it is
        assert np.median(plate.force[empty, 1]) == pytest.approx(empty_n, abs=0.5)
    assert np.median(plate.force[loaded, 1]) == pytest.approx(loaded_n, abs=0.5)
    np.testing.assert_allclose(np.median(plate.cop[loaded], axis=0), [2.2, 0.0, 3.3], atol=0.01)
    said = [str(said) for said in recording.notes if "nobody stands on it" in str(said)]
    words = {-25.0: "Warning: plate 1 reads -2", -6.0: "plate 1 reads -", 8.0: "plate 1 reads "}
    assert len(said) == (offset_n in words) and all(text.startswith(words[offset_n]) for text in said)
    assert all(("taken off over the whole trial" in text) == (offset_n < 0.0) for text in said)


def test_longer_table_at_the_same_rate_is_cut_exactly(tmp_path: Path) -> None:
    text = single(np.arange(40) / 100)
    recording = read(trc(tmp_path, 11, start_s=0.1), write(tmp_path, "a.mot", text))
    np.testing.assert_allclose(recording.plates[0].force, np.tile([10.0, 700.0, -20.0], (11, 1)))
    np.testing.assert_allclose(recording.plates[0].moment[4], WRENCH_MOMENT)


@pytest.mark.parametrize(
    ("time", "what"),
    [
        (np.arange(50) / 100, "do not cover"),
        (np.arange(50) / 1000, "do not cover"),
        (0.55 + np.arange(200) / 100, "do not cover"),
        (10.0 + np.arange(200) / 100, "do not cover"),
        (np.arange(51) / 50, "sampled more slowly"),
    ],
)
def test_forces_that_do_not_fit_name_both_lengths_and_ranges(tmp_path: Path, time: np.ndarray, what: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read(trc(tmp_path, 101), write(tmp_path, "a.mot", single(time)))
    message = str(caught.value)
    assert what in message
    assert f"{len(time)} rows from {time[0]:g} s to {time[-1]:g} s" in message
    assert "101 frames from 0 s to 1 s" in message


@pytest.mark.parametrize(
    ("time", "missing", "level"),
    [
        (np.arange(100) / 100, slice(100, 101), "note"),  # a row short
        (np.arange(1001) / 1000 + 0.05, slice(0, 5), "note"),
        (np.arange(70) / 100, slice(70, 101), "warning"),
        (np.arange(95) / 100 + 0.03, [0, 1, 2, 98, 99, 100], "note"),
    ],
)
def test_frames_beyond_the_rows_of_the_forces_are_not_measured(
    tmp_path: Path, time: np.ndarray, missing: slice | list[int], level: str
) -> None:
    recording = read(trc(tmp_path, 101), write(tmp_path, "a.mot", single(time)))
    unknown = np.zeros(101, dtype=bool)
    unknown[missing] = True
    (plate,) = recording.plates
    for values in (plate.force, plate.moment, plate.cop, plate.free_moment):
        np.testing.assert_array_equal(np.isnan(values).all(axis=1), unknown)
    np.testing.assert_allclose(plate.force[~unknown], np.tile([10.0, 700.0, -20.0], (np.sum(~unknown), 1)), atol=1e-6)
    (said,) = [note for note in recording.notes if "has forces from" in note.text]
    assert said.level == level and f"in {unknown.sum()} of 101 frames the plates are not measured" in said.text


def test_table_without_forces_and_plate_without_point(tmp_path: Path) -> None:
    path = trc(tmp_path, 2)
    with pytest.raises(RecordingError, match="no ground force columns, expected names such as ground_force_vx"):
        read(path, write(tmp_path, "a.mot", NEW))
    text = single(np.arange(2) / 100).replace("ground_force_py", "height")
    with pytest.raises(RecordingError, match="has no point y, expected columns px, py, pz"):
        read(path, write(tmp_path, "b.mot", text))
    with pytest.raises(RecordingError, match=r"found extension '\.txt'"):
        read(path, write(tmp_path, "c.txt", text))


def test_plates_without_free_moment_are_said(tmp_path: Path) -> None:
    columns = {f"ground_force_{key}": value for key, value in QUANTITIES.items()}
    table = read_table(write(tmp_path, "a.mot", grf_text(np.arange(3) / 100, columns)))
    recording = attach_forces(plain(3), table, ReadOptions())
    np.testing.assert_allclose(recording.plates[0].moment[0], WRENCH_MOMENT - [0, 5, 0])
    assert any("no free moment" in note for note in map(str, recording.notes))


@pytest.mark.parametrize(("separator", "named"), [(",", "commas"), (";", "semicolons")])
def test_columns_parted_otherwise_are_named_with_what_parts_them(tmp_path: Path, separator: str, named: str) -> None:
    text = single(np.arange(5) / 100.0).replace("\t", separator)
    with pytest.raises(RecordingError, match=f"found columns parted by {named}, expected tabs or blanks") as error:
        read_table(write(tmp_path, "grf.mot", text))
    assert "ground_force_vx" not in error.value.message


def test_a_unit_in_brackets_is_read_or_named(tmp_path: Path) -> None:
    time = np.arange(11) / 100.0
    units = {"v": " (N)", "p": " (m)", "m": " (Nm)"}
    columns = {f"FP1_{key}{units[key[0]]}": value for key, value in QUANTITIES.items()}
    (plate,) = read(trc(tmp_path, 11), write(tmp_path, "a.mot", grf_text(time, columns))).plates
    assert plate.name == "plate 1"
    wrong = {name.replace("(m)", "(mm)"): value for name, value in columns.items()}
    with pytest.raises(RecordingError, match=r"column 'FP1_px \(mm\)' is in 'mm', expected"):
        read(trc(tmp_path, 11), write(tmp_path, "b.mot", grf_text(time, wrong)))


def lacking(time: np.ndarray, *rows: int) -> np.ndarray:
    return np.delete(time, rows)


@pytest.mark.parametrize("rows", [(50,), (20, 70, 71), tuple(range(30, 45)), (0, 1, 40, 99)])
def test_rows_that_a_table_at_the_markers_rate_lacks_are_missing(tmp_path: Path, rows: tuple[int, ...]) -> None:
    """A lone one was taken for rounding of the times, which shifted all forces; more were refused without a file."""
    recording = read(trc(tmp_path, 100))
    table = read_table(write(tmp_path, "grf.mot", single(lacking(np.arange(100) / 100, *rows))))
    found = attach_forces(recording, table, ReadOptions())
    (plate,) = found.plates
    missing = np.isnan(plate.force).any(axis=1)
    assert np.flatnonzero(missing).tolist() == list(rows)
    np.testing.assert_allclose(plate.force[~missing], [[10.0, 700.0, -20.0]] * (100 - len(rows)))
    (said,) = [m for m in found.notes if "has no row for" in m.text]
    assert f"{len(rows)} of 100 frames" in said.text and said.level == ("warning" if len(rows) > 10 else "note")
    assert not any("rounded" in m.text for m in found.notes)
    with pytest.raises(RecordingError, match=r"grf\.mot: plate has no force at 0.* s, cannot be resampled or filtered"):
        attach_forces(recording, table, ReadOptions(plate_filter_hz=20.0))


def test_a_gap_in_a_table_that_is_resampled_is_refused_by_file_and_time(tmp_path: Path) -> None:
    table = read_table(write(tmp_path, "grf.mot", single(lacking(np.arange(1000) / 1000, 500, 501))))
    with pytest.raises(RecordingError, match=r"grf\.mot: no row between 0\.499 s and 0\.502 s, expected one every"):
        attach_forces(read(trc(tmp_path, 100)), table, ReadOptions())


@pytest.mark.parametrize("rate", [1000.0, 100.0])
def test_that_a_plate_pulls_throughout_is_said_at_any_rate(tmp_path: Path, rate: float) -> None:
    """Nothing was of a table at the markers' rate, which is left as it is."""
    time = np.arange(round(rate) + 1) / rate
    push = np.where((time > 0.3) & (time < 0.8), 700.0, -60.0)
    of_one = QUANTITIES | {"vx": 0.0, "vy": push, "vz": 0.0, "mx": 0.0, "my": 0.0, "mz": 0.0}
    text = grf_text(time, {f"FP1_{key}": value for key, value in of_one.items()})
    recording = read(trc(tmp_path, 101), write(tmp_path, "a.mot", text))
    (said,) = [m for m in recording.notes if "which no plate can" in m.text]
    assert said.level == "warning" and "plate 1 pulls by up to 60 N" in said.text and "Zero it" in said.text
    empty = np.abs(recording.plates[0].force[5, 1]) < 1.0
    assert ("taken as empty there" in said.text) == empty == (rate > 100.0)
