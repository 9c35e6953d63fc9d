"""Files as laboratories have them: read where that is safe, else told in one line what they are and what to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.read import read

TIME = np.arange(40) / 100.0
PLACES = np.random.default_rng(0).normal(scale=0.4, size=(6, 3)) + 0.3 * np.sin(5 * TIME)[:, None, None]


def trc(path: Path, places: np.ndarray = PLACES, cells: dict[tuple[int, int], str] | None = None, mark: str = "\t",
        times: np.ndarray = TIME) -> Path:  # fmt: skip
    """Six markers in metres; cells: (frame, marker) -> what stands for each of its coordinates."""
    names = [f"M{k}" for k in range(6)]
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", path.name],
        ["DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"],
        ["100", "100", "40", "6", "m"],
        ["Frame#", "Time", *(cell for name in names for cell in (name, "", ""))],
        ["", "", *(f"{axis}{k + 1}" for k in range(6) for axis in "XYZ")],
    ]
    for k, row in enumerate(places):
        numbers = [[f"{value:.6f}" for value in place] for place in row]
        for (frame, marker), text in (cells or {}).items():
            if frame == k:
                numbers[marker] = [text] * 3
        lines.append([str(k + 1), f"{times[k]:.6g}", *(cell for place in numbers for cell in place)])
    path.write_text("\n".join(mark.join(line) for line in lines) + "\n")
    return path


@pytest.mark.parametrize("mark", [";", ","])
def test_a_trc_that_a_spreadsheet_parted_otherwise(tmp_path: Path, mark: str) -> None:
    found = read(trc(tmp_path / "a.trc", mark=mark))
    assert found.marker_names == tuple(f"M{k}" for k in range(6))
    np.testing.assert_allclose(found.markers, PLACES, atol=1e-6)


@pytest.mark.parametrize("text", ["-", "---", "**", "...", "NaN", ""])
def test_what_stands_for_a_missing_value(tmp_path: Path, text: str) -> None:
    found = read(trc(tmp_path / "a.trc", cells={(k, 2): text for k in range(10, 15)}))
    assert np.isnan(found.markers[10:15, 2]).all() and np.isfinite(found.markers).sum() == 40 * 18 - 15


@pytest.mark.parametrize("text", ["-9999.99", "9999999", "99999"])
def test_placeholders_are_missing_with_a_note(tmp_path: Path, text: str) -> None:
    found = read(trc(tmp_path / "a.trc", cells={(k, 2): text for k in range(10, 15)}))
    assert np.isnan(found.markers[10:15, 2]).all() and np.isfinite(found.markers).sum() == 40 * 18 - 15
    assert [
        note for note in map(str, found.notes) if "far outside the volume, taken as missing (5 samples: M2)" in note
    ]


def test_a_marker_that_stands_far_away_is_no_placeholder(tmp_path: Path) -> None:
    places = PLACES.copy()
    places[:, 5] = (7.0, 1.0, 8.0)  # on a wall
    found = read(trc(tmp_path / "a.trc", places))
    assert np.isfinite(found.markers).all()


def test_a_time_column_that_counts_frames(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"1 s apart .* they seem to count frames"):
        read(trc(tmp_path / "a.trc", times=np.arange(1.0, 41.0)))


@pytest.mark.parametrize(
    ("name", "first", "said"),
    [
        ("a.csv", "Format Version,1.23,Take Name,Take 1", "CSV of Motive"),
        ("a.csv", "Trajectories", "CSV of Nexus"),
        ("a.tsv", "NO_OF_FRAMES\t131", "TSV of QTM"),
    ],
)
def test_exports_of_camera_systems(tmp_path: Path, name: str, first: str, said: str) -> None:
    path = tmp_path / name
    path.write_text(f"{first}\n100\n")
    with pytest.raises(RecordingError, match=rf"is a {said}, expected the same trial exported as C3D"):
        read(path)
