"""Plates of a C3D at the end of their range: seen at the analog rate, where what was cut off is flat."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.messages import warnings_of
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.formats.c3d_channels import at_end_of_range
from dynakin.recordings.recording import Recording
from support.made_recordings import write_c3d

FRAMES, PER_FRAME = 200, 10
T = np.arange(FRAMES * PER_FRAME) / (100.0 * PER_FRAME)
STEP = np.clip(np.sin(np.pi * (T - 0.5) / 0.8), 0.0, None) * ((T > 0.5) & (T < 1.3))
"""A foot on the plate from 0.5 to 1.3 s, 1 in the middle."""
PUSH = np.stack([60.0 * STEP, 10.0 * STEP, -800.0 * STEP, 40.0 * STEP, 20.0 * STEP, 0.0 * T])


def recording(path: Path, channels: np.ndarray, kind: int = 2, calibration: np.ndarray | None = None) -> Recording:
    corners = np.array([[200.0, 300, 0], [-200, 300, 0], [-200, -300, 0], [200, -300, 0]])
    write_c3d(
        path,
        {"LASI": np.full((FRAMES, 3), 500.0)},
        kinds=[kind],
        channels=channels,
        corners=[corners],
        origins=[[0.0, 0.0, -40.0]],
        per_frame=PER_FRAME,
        calibration=None if calibration is None else calibration[:, :, None],
    )
    return read_c3d(path)


@pytest.mark.parametrize("mixed", [False, True])
def test_a_channel_that_is_cut_off_is_not_measured_there(tmp_path: Path, mixed: bool) -> None:
    """With a calibration that mixes them it is a channel that is flat, and not the force."""
    matrix = np.eye(6) + (0.1 * np.random.default_rng(1).normal(size=(6, 6)) if mixed else 0.0)
    channels = np.linalg.solve(matrix, PUSH)
    limit = 0.75 * np.abs(channels[2]).max()
    cut = np.abs(channels[2]) > limit
    channels[2] = np.clip(channels[2], -limit, limit)
    found = recording(tmp_path / "a.c3d", channels, 4 if mixed else 2, matrix if mixed else None)
    unknown = np.isnan(found.plates[0].force[:, 2])
    assert unknown[cut[::PER_FRAME]].all() and not unknown[:30].any() and not unknown[-30:].any()
    (said,) = warnings_of(found.notes)
    assert said.text.startswith(f"plate 1 rests at the end of its range for {cut.sum() / 1000.0:.2g} s in all")


def held(values: np.ndarray) -> np.ndarray:
    """Of every tenth sample, until the next one."""
    return np.repeat(values[:, ::10], 10, axis=1)


@pytest.mark.parametrize(
    "channels",
    [
        PUSH,
        np.round(PUSH / 2.0) * 2.0,  # in steps: flat for 36 ms at the peak
        np.round(PUSH / 10.0) * 10.0,
        held(PUSH),
        np.sign(PUSH) * 500.0,  # made up
        0.05 * PUSH,  # nobody
    ],
)
def test_a_peak_is_none(channels: np.ndarray) -> None:
    assert not at_end_of_range(channels, channels[2]).any()


def test_a_signal_that_is_slow_and_without_noise_is_no_rest() -> None:
    """No step of it is larger than the difference within which its values are one."""
    push = 800.0 * np.sin(np.linspace(0.0, np.pi, 1_000_000))
    assert np.abs(np.diff(push)).max() < 1e-5 * np.ptp(push)
    assert not at_end_of_range(push[None], push).any()
