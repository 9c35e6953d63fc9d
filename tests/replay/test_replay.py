"""Change indication: what the filter gives on two fixed trials, compared with a small committed file.

``pytest tests/replay --update`` accepts a change; the diff of the file then shows it.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.simulation.trial import simulate_squat

HERE = Path(__file__).parent
# Frames and how far they may move, in standard deviations. The paper's gains hardly see the speeds, so rounding grows
# with time: the last bit of the input came to 2e-4 at frame 200 of the simulated trial (in another process), and to
# a standard deviation at its end. Late frames can't be compared; the early ones show any change of the equations.
SQUATS1 = {0: 1e-6, 50: 1e-6, 100: 1e-5, 200: 1e-4, 300: 1e-3}
SIMULATED = {0: 1e-6, 50: 1e-6, 100: 1e-4, 150: 1e-3}
# The default's late frames can: its rounding does not grow.
DEFAULT = {0: 1e-6, 100: 1e-6, 300: 1e-5, 600: 1e-5}


def squats1(data_dir: Path, noise: dynakin.Noise) -> dynakin.Estimate:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", forces=folder / "squats1_grf.mot")
    model = dynakin.load_model("sagittal7", subject=dynakin.Subject(mass_kg=60.05), markers="opencap")
    return dynakin.Estimator(model, noise).run(recording, lag_s=0.0)


def simulated(noise: dynakin.Noise) -> dynakin.Estimate:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    model = dynakin.load_model("sagittal7", subject=subject, markers="opencap")
    return dynakin.Estimator(model, noise).run(simulate_squat(seed=1, duration_s=6.0).recording, lag_s=0.0)


def summary(estimate: dynakin.Estimate, frames: dict[int, float]) -> dict:
    data = estimate.data
    return {
        "elements": [str(name) for name in data["element"].values],
        "frames": {
            str(k): {
                "state": [float(f"{v:.12g}") for v in data["state"].values[k]],
                "sd": [float(f"{v:.12g}") for v in data["state_sd"].values[k]],
            }
            for k in frames
        },
    }


def compare(estimate: dynakin.Estimate, frames: dict[int, float], path: Path, update: bool) -> None:
    found = summary(estimate, frames)
    if update:
        path.write_text(json.dumps(found, indent=0) + "\n", encoding="utf-8")
        return
    expected = json.loads(path.read_text(encoding="utf-8"))
    assert found["elements"] == expected["elements"]
    for k, tolerance in frames.items():
        now, then = found["frames"][str(k)], expected["frames"][str(k)]
        sd = np.array(then["sd"])
        moved = np.abs(np.array(now["state"]) - then["state"]) / sd
        wider = np.abs(np.array(now["sd"]) - sd) / sd
        worst = int(np.argmax(np.maximum(moved, wider)))
        assert max(moved[worst], wider[worst]) < tolerance, (
            f"frame {k}: {expected['elements'][worst]} moved by {moved[worst]:.2g} of its standard deviation, "
            f"which changed by {wider[worst]:.2g}; --update accepts this"
        )


@pytest.mark.parametrize("preset", ["paper", "default"])
def test_squats1(data_dir: Path, update: bool, preset: str) -> None:
    frames = SQUATS1 if preset == "paper" else DEFAULT
    estimate = squats1(data_dir, dynakin.presets.preset(preset))
    compare(estimate, frames, HERE / f"squats1_{preset}.json", update)


@pytest.mark.parametrize("preset", ["paper", "default"])
def test_simulated_squat(update: bool, preset: str) -> None:
    frames = SIMULATED if preset == "paper" else DEFAULT
    estimate = simulated(dynakin.presets.preset(preset))
    compare(estimate, frames, HERE / f"simulated_squat_{preset}.json", update)


def test_a_change_is_seen(tmp_path: Path) -> None:
    estimate = simulated(dynakin.presets.paper())
    compare(estimate, SIMULATED, tmp_path / "replay.json", update=True)
    compare(estimate, SIMULATED, tmp_path / "replay.json", update=False)
    changed = json.loads((tmp_path / "replay.json").read_text())
    changed["frames"]["50"]["state"][0] *= 1.0 + 1e-3
    (tmp_path / "replay.json").write_text(json.dumps(changed))
    with pytest.raises(AssertionError, match="frame 50: toe moved"):
        compare(estimate, SIMULATED, tmp_path / "replay.json", update=False)
