"""TRC files as they come."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.read import read
from support.made_recordings import TRC, TRC_TOP, write, write_c3d


def test_plain_file_in_millimetres(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "squat.trc", TRC))
    assert recording.name == "squat"
    assert recording.marker_names == ("RKNE", "RANK")
    assert recording.length_unit == "mm"
    assert recording.rate == pytest.approx(100.0)
    np.testing.assert_allclose(recording.marker("RANK"), [[0.004, 0.005, 0.006], [0.0045, 0.0055, 0.0065]])
    assert recording.notes == ()


@pytest.mark.parametrize(
    ("word", "factor", "unit"),
    [("m", 1, "m"), ("Meters", 1, "m"), ("MM", 1e-3, "mm"), ("(millimetres)", 1e-3, "mm"), ("cm", 1e-2, "m")],
)
def test_unit_in_any_spelling(tmp_path: Path, word: str, factor: float, unit: str) -> None:
    recording = read(write(tmp_path, "a.trc", TRC.replace("\tmm\t", f"\t{word}\t")))
    assert recording.length_unit == unit
    np.testing.assert_allclose(recording.marker("RKNE")[0], np.array([1, 2, 3]) * factor)


@pytest.mark.parametrize("change", [
    lambda text: text.replace("\n", "\r\n"),
    lambda text: text.replace("\n", "\r"),
    lambda text: "\ufeff" + text,
    lambda text: text.replace("\n\n", "\n"),  # no blank line
    lambda text: text.replace("Z2\n\n", "Z2\n\n\n\n") + "\n\n",  # more of them
    lambda text: text.replace("3\t4\t5\t6\n", "3\t4\t5\t6\t\t\n"),  # trailing tabs in data
    lambda text: text.replace("RANK\t\t\n", "RANK\n"),  # none after the last name
    lambda text: text.replace("\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n", ""),  # no row of axes
    lambda text: "\n" + text,
])  # fmt: skip
def test_odd_but_valid_files_read_the_same(tmp_path: Path, change) -> None:  # type: ignore[no-untyped-def]
    expected, found = read(write(tmp_path, "a.trc", TRC)), read(write(tmp_path, "b.trc", change(TRC)))
    assert found.marker_names == expected.marker_names
    np.testing.assert_array_equal(found.markers, expected.markers)
    np.testing.assert_array_equal(found.time, expected.time)


def test_blank_cells_and_exact_zeros_are_missing(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "a.trc", TRC_TOP + "1\t0\t\t\t\t4\t5\t6\n2\t0.01\t1\t2\t3\t0\t0\t0\n"))
    assert np.isnan(recording.markers[0, 0]).all()
    assert np.isnan(recording.markers[1, 1]).all()
    np.testing.assert_allclose(recording.markers[1, 0], [0.001, 0.002, 0.003])
    assert any("0, 0, 0" in note and "RANK" in note for note in map(str, recording.notes))
    assert any("RKNE 50 %" in note for note in map(str, recording.notes))


def test_frame_without_any_marker_is_said(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "a.trc", TRC_TOP + "1\t0\t1\t2\t3\t4\t5\t6\n2\t0.01\t\t\t\t\t\t\n"))
    assert np.isnan(recording.markers[1]).all()
    assert any("1 frames have no marker at all, the first is frame 2" in note for note in map(str, recording.notes))


def test_prefix_and_blanks_in_names_stay(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "a.trc", TRC.replace("RKNE", "S1:R knee").replace("RANK", "S1:R.ANK")))
    assert recording.marker_names == ("S1:R knee", "S1:R.ANK")


def test_what_a_model_computed_is_no_marker(tmp_path: Path) -> None:
    """Exporters write every point of a C3D; a moment that changes fast passed for a marker that jumps."""
    recording = read(write(tmp_path, "a.trc", TRC.replace("RKNE", "S1:RKneeMoment")))
    assert recording.marker_names == ("RANK",)
    assert "1 computed points left out: S1:RKneeMoment." in [str(message) for message in recording.notes]
    nothing = TRC.replace("RKNE", "*52").replace("RANK", "LHipAngles")
    with pytest.raises(RecordingError, match="found 2 points and no marker"):
        read(write(tmp_path, "b.trc", nothing))


def test_missing_unit_is_found_and_said(tmp_path: Path) -> None:
    text = TRC.replace("\tUnits", "\t").replace("\tmm\t", "\t\t").replace("4.5\t5.5", "904.5\t5.5")
    recording = read(write(tmp_path, "a.trc", text))
    assert recording.length_unit == "mm"
    assert any("no length unit" in note for note in map(str, recording.notes))


def test_header_counts_that_are_wrong_are_said(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "a.trc", TRC.replace("100\t100\t2\t2", "50\t50\t7\t3")))
    assert recording.n_frames == 2
    said = " ".join(map(str, recording.notes))
    assert "7 frames" in said
    assert "3 markers" in said


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (TRC.replace("2.5\t3.5\t", "2.5\t"), ["line 8", "found 7 columns", "expected 8"]),
        (TRC.replace("6.5\n", "6.5\t7.5\n"), ["line 8", "found 9 columns", "expected 8"]),
        (TRC.replace("2\t0.01", "2\t0.00"), ["line 8", "time 0 s", "increasing"]),
        (TRC.replace("2\t0.01", "2\t"), ["line 8", "no time"]),
        (TRC.replace("2.5", "inf"), ["line 8", "'inf'", "RKNE y"]),
        (TRC.replace("2.5", "2,5"), ["line 8", "'2,5'", "RKNE y", "point"]),
        (TRC_TOP, ["no frames"]),
        ("hello\nworld\n", ["not a TRC"]),
        ("", ["not a TRC"]),
        ("\0\1\2", ["not a text file"]),
    ],
)
def test_bad_files_give_one_clear_line(tmp_path: Path, text: str, words: list[str]) -> None:
    path = write(tmp_path, "bad.trc", text)
    with pytest.raises(RecordingError) as caught:
        read(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    for word in words:
        assert word in message


def test_no_such_file_folder_and_unknown_kind(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file"):
        read(tmp_path / "none.trc")
    with pytest.raises(RecordingError, match="is a folder"):
        read(tmp_path)
    with pytest.raises(
        RecordingError, match=r"found extension '\.xyz', expected a recording as \.c3d, \.csv or \.trc$"
    ):
        read(write(tmp_path, "a.xyz", TRC))
    with pytest.raises(RecordingError, match=r"'\.MOT', expected .* \.trc; a table of ground forces goes with"):
        read(write(tmp_path, "a.MOT", TRC))
    with pytest.raises(
        RecordingError, match=r"found extension '\.trc', expected ground forces as \.csv, \.mot or \.sto"
    ):
        read(write(tmp_path, "a.trc", TRC), tmp_path / "a.trc")


def test_a_file_of_another_kind_than_its_extension_says(tmp_path: Path) -> None:
    c3d = write_c3d(tmp_path / "a.c3d", {"LASI": np.ones((5, 3))}).read_bytes()
    (tmp_path / "b.trc").write_bytes(c3d)
    with pytest.raises(RecordingError, match=r"b\.trc: is not a text file$"):
        read(tmp_path / "b.trc")
    with pytest.raises(RecordingError, match=r"d\.C3D: is not a C3D file"):
        read(write(tmp_path, "d.C3D", TRC))
    (tmp_path / "e.C3D").write_bytes(c3d)
    assert read(tmp_path / "e.C3D").marker_names == ("LASI",)


@pytest.mark.parametrize(("wrong", "words"), [("mm", r"span 0\.00[0-9]+ m"), ("m", r"span [0-9.e+]+ m")])
def test_metres_called_millimetres_and_the_reverse_are_seen(tmp_path: Path, wrong: str, words: str) -> None:
    scale = 1.0 if wrong == "mm" else 1000.0  # what the numbers are: metres, or millimetres
    places = scale * np.random.default_rng(1).uniform([0.0, 0.0, -0.3], [0.4, 1.7, 0.3], (2, 8, 3))
    names = "\t\t\t".join(f"M{k}" for k in range(8))
    axes = "\t".join(f"{a}{k}" for k in range(8) for a in "XYZ")
    rows = "".join(f"{k + 1}\t{0.01 * k}\t" + "\t".join(f"{v:.5f}" for v in places[k].ravel()) + "\n" for k in (0, 1))
    top = TRC_TOP.replace("\t2\t2\tmm\t", f"\t2\t8\t{wrong}\t").splitlines()[:3]
    text = "\n".join([*top, f"Frame#\tTime\t{names}\t\t", f"\t\t{axes}", "", rows])
    with pytest.raises(RecordingError, match=rf"a\.trc.*{words} in a frame, expected 0\.2 to 10 m.*unit is wrong"):
        read(write(tmp_path, "a.trc", text))
