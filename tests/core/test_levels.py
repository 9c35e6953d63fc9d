"""The core's vector levels: one is chosen at import, each by name, and all give the same numbers within rounding."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dynakin import bindings
from dynakin.bindings import _cpu
from dynakin.errors import ConfigError

LEVELS = ("v4", "v3", "baseline")
RUN = """
import sys
import numpy as np
import dynakin
from dynakin import bindings
from dynakin.simulation.trial import simulate

kind, out = sys.argv[1:]
recording = simulate(kind, "squat", 1, 5.0).recording.window(1.0, 2.0)
subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
markers = {"markers": "opencap"} if kind == "sagittal7" else {}
ready = dynakin.Estimator(dynakin.load_model(kind, subject=subject, **markers)).prepare(recording, lag_s=0.0)
for how in ("run_arrays", "run_smoothed_arrays"):
    run = getattr(ready.tracker.fresh(), how)
    arrays = run(ready.measured)
    found = {name: arrays[name] for name in ("state", "state_sd", "moments", "moments_sd")}
    np.savez(f"{out}/{how}.npz", level=bindings.level, **found)
"""


def run(kind: str, level: str, out: Path) -> dict[str, Mapping[str, np.ndarray]]:
    """What a level finds, in a process of its own: forwards and smoothed."""
    subprocess.run([sys.executable, "-c", RUN, kind, str(out)], env=os.environ | {"DYNAKIN_VECTOR": level}, check=True)
    found = {how: np.load(out / f"{how}.npz") for how in ("run_arrays", "run_smoothed_arrays")}
    assert {str(arrays["level"]) for arrays in found.values()} == {level}
    return found


@pytest.fixture(scope="module", params=["sagittal7", "fullbody"])
def ours(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    """A model, and what the level that is loaded finds."""
    return request.param, run(request.param, bindings.level, tmp_path_factory.mktemp("ours"))


@pytest.mark.parametrize("level", LEVELS)
def test_levels_agree_within_rounding(ours, level: str, tmp_path: Path) -> None:
    if level == bindings.level:
        pytest.skip(f"{level} is what the others are compared with")
    if level not in _cpu.built() or not _cpu.has(level):
        pytest.skip(f"{level} is {'more than this processor has' if level in _cpu.built() else 'not built'}")
    kind, found = ours
    others = run(kind, level, tmp_path)
    for how, a in found.items():
        b = others[how]
        for name, zero in (("state", 0.0), ("moments", 1e-9)):  # a root that nothing pushes has none, but for rounding
            sd = a[f"{name}_sd"]
            # 3e-8 of a deviation and 6e-11 of its own were measured
            assert (np.abs(a[name] - b[name]) <= 1e-6 * sd + zero).all()
            np.testing.assert_allclose(b[f"{name}_sd"], sd, rtol=1e-8, atol=zero)


def cpu(monkeypatch: pytest.MonkeyPatch, built: list[str], has: list[str]) -> None:
    monkeypatch.setattr(bindings, "_cpu", SimpleNamespace(built=lambda: built, has=lambda level: level in has))


@pytest.mark.parametrize(
    ("built", "has", "asked", "expected"),
    [
        (["v4", "v3", "baseline"], ["v4", "v3", "baseline"], None, "v4"),
        (["v4", "v3", "baseline"], ["v3", "baseline"], None, "v3"),
        (["v4", "v3", "baseline"], ["baseline"], "", "baseline"),
        (["v4", "v3", "baseline"], ["v4", "v3", "baseline"], "v3", "v3"),
        (["v3"], ["v4", "v3", "baseline"], None, "v3"),
    ],
)
def test_the_widest_that_runs_is_taken_or_that_asked_for(monkeypatch, built, has, asked, expected):
    cpu(monkeypatch, built, has)
    assert bindings._chosen(asked) == expected


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ("avx2", "DYNAKIN_VECTOR is 'avx2', expected v4, v3 or baseline"),
        ("baseline", "'baseline', for which this dynakin was not built .it was for v4 or v3.; build it with: pip"),
        ("v4", "DYNAKIN_VECTOR is 'v4', which this processor lacks, expected v3$"),
    ],
)
def test_a_level_that_cannot_be_had_is_told(monkeypatch, asked, message):
    cpu(monkeypatch, ["v4", "v3"], ["v3", "baseline"])
    with pytest.raises(ConfigError, match=message):
        bindings._chosen(asked)


def test_a_processor_without_any_level_is_told_what_to_build(monkeypatch):
    cpu(monkeypatch, ["v4", "v3"], ["baseline"])
    with pytest.raises(ImportError, match="compiled for v4 or v3, which this processor lacks; build it with: pip"):
        bindings._chosen(None)


def test_the_command_line_ends_with_one_line_where_the_level_is_unknown(tmp_path: Path) -> None:
    program = "import sys; from dynakin.cli import main; sys.exit(main(['model', 'sagittal7']))"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"DYNAKIN_VECTOR": "avx2"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert "DYNAKIN_VECTOR is 'avx2', expected v4, v3 or baseline" in done.stderr
    assert "Traceback" not in done.stderr
