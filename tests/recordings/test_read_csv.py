"""dynakin's own csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ConfigError, RecordingError
from dynakin.recordings.read import READERS, read, register_reader
from dynakin.recordings.recording import Recording
from dynakin.recordings.resampling import ReadOptions
from support.made_recordings import write

TEXT = """# standing
time,RKNE_x,RKNE_y,RKNE_z,FP1_vx,FP1_vy,FP1_vz,FP1_px,FP1_py,FP1_pz,FP1_mx,FP1_my,FP1_mz
0.00,0.101,0.480,0.093,0,800,0,0.1,0,0.2,0,3,0
0.01,,,,0,800,0,0.1,0,0.2,0,3,0
"""


def test_markers_and_plates(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "a.csv", TEXT))
    assert recording.marker_names == ("RKNE",)
    np.testing.assert_allclose(recording.markers[0, 0], [0.101, 0.480, 0.093])
    assert np.isnan(recording.markers[1, 0]).all()
    # (0.1, 0, 0.2) x (0, 800, 0) = (-160, 0, 80), and 3 N m of free moment
    np.testing.assert_allclose(recording.total_wrench()[0], [0, 800, 0, -160, 3, 80])
    np.testing.assert_allclose(recording.total_wrench(about=(0.1, 0, 0.2))[0], [0, 800, 0, 0, 3, 0], atol=1e-12)


def test_forces_from_a_csv_beside_markers(tmp_path: Path) -> None:
    markers = write(tmp_path, "m.csv", "time,A_x,A_y,A_z\n0,1,2,3\n0.01,1,2,3\n")
    recording = read(markers, write(tmp_path, "f.csv", TEXT))
    np.testing.assert_allclose(recording.plates[0].force[1], [0, 800, 0])
    assert recording.notes == ()


def test_bad_columns(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="found column 'RKNE', expected NAME_x"):
        read(write(tmp_path, "a.csv", TEXT.replace("RKNE_z,", "RKNE,")))
    with pytest.raises(RecordingError, match="first, expected 'time'"):
        read(write(tmp_path, "b.csv", TEXT.replace("time", "t")))
    with pytest.raises(RecordingError, match="line 4: found 14 columns, expected 13"):
        read(write(tmp_path, "c.csv", TEXT.replace("0.01,,", "0.01,,,")))


def test_a_reader_is_a_plug_in(tmp_path: Path) -> None:
    made = Recording("mine", None, np.zeros(1), (), np.zeros((1, 0, 3)))
    register_reader(".MINE", lambda path, options: made)
    try:
        assert read(write(tmp_path, "a.mine", "")) is made
    finally:
        del READERS[".mine"]


def test_options_are_checked() -> None:
    with pytest.raises(ConfigError, match="plate_filter_hz: found 0"):
        ReadOptions(plate_filter_hz=0)
    with pytest.raises(ConfigError, match="force_threshold_n: found -1"):
        ReadOptions(force_threshold_n=-1)
