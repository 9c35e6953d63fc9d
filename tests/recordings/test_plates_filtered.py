"""A low-pass of the plates that takes their loads away is warned of; one that takes noise is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.messages import warnings_of
from dynakin.recordings.read import cuts_into_loads, read
from dynakin.recordings.recording import Plate, Recording
from dynakin.recordings.resampling import low_pass

T = np.arange(200) / 100.0


@pytest.mark.parametrize(("hz", "cuts"), [(2.0, True), (3.0, True), (6.0, False), (10.0, False)])
def test_a_step_is_smeared_by_a_low_filter_only(hz: float, cuts: bool) -> None:
    s = np.clip((T - 0.5) / 0.7, 0.0, 1.0)
    push = 700.0 * np.sin(np.pi * s) * (1.0 + 0.8 * np.sin(np.pi * s) * np.cos(4 * np.pi * s) * 0.5)
    push += np.random.default_rng(1).normal(0.0, 3.0, len(T)) * (push > 10.0)
    wrench = np.zeros((200, 6))
    wrench[:, 1] = push

    def recorded(values: np.ndarray) -> Recording:
        plate = Plate("plate 1", values[:, :3], values[:, 3:], np.full((200, 3), np.nan), np.zeros((200, 3)))
        return Recording("made", None, T, ("A",), np.zeros((200, 1, 3)), (plate,), "m", ())

    said = cuts_into_loads(recorded(wrench), recorded(low_pass(wrench, 100.0, hz)), hz)
    assert (said is not None) == cuts
    assert said is None or said.text.startswith(f"the low-pass at {hz:g} Hz (plate_filter_hz) takes ")


@pytest.mark.parametrize(("hz", "cuts"), [(3.0, True), (6.0, False)])
def test_a_real_walk(data_dir: Path, hz: float, cuts: bool) -> None:
    folder = data_dir / "opencap_subject4"
    found = read(folder / "walking1.trc", folder / "walking1_grf.mot", plate_filter_hz=hz)
    assert any("plate_filter_hz" in each.text for each in warnings_of(found.notes)) == cuts
