"""Samples of a plate that are missing in a C3D stay missing, as far as the filter reaches, and cost nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import DynakinError
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.read import read
from support.made_recordings import TRC, write, write_c3d

FRAMES, PER_FRAME, REACH = 100, 10, 10  # frames that the kernel reaches to each side, rounded up


def plates(path: Path, lost: slice) -> np.ndarray:
    """Force (T, 3) N of a plate that reads -500 N and a sine, without the samples ``lost``."""
    t = np.arange(FRAMES * PER_FRAME) / (100.0 * PER_FRAME)
    channels = 1.0 + np.outer([30.0, 20.0, -100.0, 9.0, 8.0, 2.0], np.sin(2 * np.pi * 2.0 * t))
    channels[2] -= 501.0
    channels[:, lost] = np.nan
    corners = np.array([[200.0, 300, 0], [-200, 300, 0], [-200, -300, 0], [200, -300, 0]])
    write_c3d(
        path,
        {"LASI": np.full((FRAMES, 3), 500.0)},
        kinds=[2],
        channels=channels,
        corners=[corners],
        origins=[[0.0, 0.0, -40.0]],
        per_frame=PER_FRAME,
    )
    (plate,) = read_c3d(path).plates
    return plate.force


@pytest.mark.parametrize("lost", [slice(970, 1000), slice(500, 505), slice(0, 25), slice(0, 1)])
def test_missing_samples_stay_missing_and_others_as_they_were(tmp_path: Path, lost: slice) -> None:
    whole, found = plates(tmp_path / "a.c3d", slice(0)), plates(tmp_path / "b.c3d", lost)
    assert np.isfinite(whole).all()
    missing = np.isnan(found).any(axis=1)
    inside = np.arange(lost.start, lost.stop)
    assert missing[np.unique(inside // PER_FRAME)].all()
    away = np.abs(np.arange(FRAMES)[:, None] - inside / PER_FRAME).min(axis=1) > REACH
    assert not missing[away].any() and away.sum() > 50
    np.testing.assert_allclose(found[~missing], whole[~missing], atol=0.05)


@pytest.mark.parametrize("lost", [slice(500, 501), slice(503, 507)])
def test_gaps_of_less_than_half_a_frame_cost_nothing(tmp_path: Path, lost: slice) -> None:
    whole, found = plates(tmp_path / "a.c3d", slice(0)), plates(tmp_path / "b.c3d", lost)
    np.testing.assert_allclose(found, whole, atol=0.02)


def test_a_plate_without_any_sample_is_missing(tmp_path: Path) -> None:
    assert np.isnan(plates(tmp_path / "a.c3d", slice(None))).all()


def test_header_cells_parted_by_two_tabs(tmp_path: Path) -> None:
    doubled = TRC.replace("100\t100\t2\t2\tmm\t100\t1\t2", "100\t\t100\t\t2\t\t2\t\tmm\t100\t1\t2")
    assert doubled != TRC
    np.testing.assert_array_equal(
        read(write(tmp_path, "b.trc", doubled)).markers, read(write(tmp_path, "a.trc", TRC)).markers
    )


def test_every_real_recording_is_read(data_dir: Path) -> None:
    """What no file of 0.1 says: a limit that refuses a good recording is wrong, whatever damage it was made for."""
    refused, kinds = {}, (".c3d", ".trc")
    files = [path for path in sorted(data_dir.rglob("*")) if path.suffix in kinds]
    for path in files:
        try:
            read(path)
        except DynakinError as error:
            refused[path.name] = error.message
    assert not refused and len(files) > 20
