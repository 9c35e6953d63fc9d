"""Live moments of a whole body against those of the offline run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import dynakin
from dynakin.stream import Callback, Live, LiveFrame, Replay


def test_moments_of_a_whole_body_agree_with_the_offline_run(data_dir: Path) -> None:
    trial = (data_dir / "opencap_subject4/squats1.trc", data_dir / "opencap_subject4/squats1_grf.mot")
    recording = dynakin.read(*trial, causal=True).window(0.0, 5.0)
    estimator = dynakin.Estimator(dynakin.load_model("fullbody", dynakin.Subject(mass_kg=60.05, height_m=1.70)))
    frames: list[LiveFrame] = []
    source = Replay(recording, speed=0.0)
    live = Live(estimator, [source], [Callback(frames.append)], say=lambda text: None, standing_wait_s=2.0)
    live.run()
    offline = estimator.again().run(recording)
    names = [str(name) for name in offline.data["coordinate"].values]
    t0 = frames[0].estimate.time_s
    at = [k for k, t in enumerate(recording.time) if t >= t0 - 1e-6][: len(frames)]
    for side in "rl":
        k = names.index(f"knee_angle_{side}")
        now = np.array([f.estimate.moments[k] for f in frames])[100:]
        before = offline.data["moments"].values[at, k][100:]
        assert np.isfinite(now).all() and np.abs(before).max() > 20.0
        assert np.sqrt(np.mean((now - before) ** 2)) < 6.0
