"""Simulated trials with known truth, run and kept: what a run says of itself beside how wrong it is.

Used by `verdicts.py` (thresholds of the verdicts) and `given.py` (accuracy by what is given). A run is kept in
``build/known_truth`` by what was simulated, altered and told, not by the source: ``again`` makes it anew.
"""

from __future__ import annotations

import hashlib
import json
import pickle
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from dynakin.errors import DynakinError
from dynakin.pipeline.stages import configure
from dynakin.recordings.recording import Plate, Recording
from dynakin.report.insights import insights
from dynakin.results.files.netcdf import full_dataset
from dynakin.results.measures.metrics import compute_metrics
from dynakin.settings.effect import without_effect
from dynakin.settings.noise import Noise
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate
from dynakin.validation.case import case_of
from dynakin.validation.methods import estimate_each

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "build" / "known_truth"
Array = NDArray[np.float64]

MASS_KG, HEIGHT_M, SEX = 70.0, 1.75, "male"
STANDING_S = 1.0
SPANS = {"squat": (5.0, 0.5, 3.2), "gait": (2.5, 0.0, 2.5), "sagittal": (9.0, 0.0, 9.0)}
"""Of each kind of trial: s simulated, and the part that is run."""
RATE_HZ = {"squat": 60.0, "gait": 60.0, "sagittal": 100.0}
LEFT_OUT = {"squat": (0.3, 0.1), "gait": (0.3, 0.1), "sagittal": (2.0, 0.1)}
"""Seconds at either end that are not judged."""
NOISE = (
    "marker_sd_m",
    "soft_tissue_sd_fraction",
    "soft_tissue_least_sd_m",
    "plate_force_sd_n",
    "plate_moment_sd_nm",
    "residual_force_sd_n",
    "residual_moment_sd_nm",
)
"""Standard deviations that are scaled where noise settings are made wrong; variances and densities by the square."""
VARIANCES = (
    "force_variance_n2",
    "moment_variance_n2_m2",
    "jerk_density_rad2_s5",
    "translation_jerk_density_m2_s5",
    "floating_jerk_density_rad2_s5",
    "floating_translation_jerk_density_m2_s5",
)
HALF = ("toe", "calc", "ankle", "knee", "ASIS", "PSIS", "Shoulder", "elbow_lat", "wrist_radius", "thigh1", "sh2")
"""Parts of names that are kept of the opencap set where half of it is worn; medial ones are not, C7 is."""


@dataclass(frozen=True)
class Spec:
    """One run. motion: "squat", "gait" (fullbody) or "sagittal" (squats of sagittal7). sensors: changes of
    `SensorNoise`. altered: names of `ALTERATIONS`, with their sizes. told: arguments of `dynakin.run`. noise: factor
    on all standard deviations of the noise settings."""

    motion: str
    seed: int
    sensors: Mapping[str, float] = field(default_factory=dict)
    markers: str = "opencap"
    altered: Mapping[str, float] = field(default_factory=dict)
    static: bool = True
    told: Mapping[str, Any] = field(default_factory=dict)
    noise: float = 1.0
    smooth: bool = True

    def key(self) -> str:
        content = json.dumps({name: _plain(value) for name, value in vars(self).items()}, sort_keys=True)
        return f"{self.motion}_{self.seed}_{hashlib.sha256(content.encode()).hexdigest()[:12]}"


@dataclass(frozen=True, eq=False)
class Run:
    """What came of it. data: `full_dataset` without what is large; None where the trial was refused (``said``).
    insights: (level, title, text) as on the page; truth: coordinates, speeds, moments; window: (T,) frames judged."""

    said: str
    data: xr.Dataset | None
    truth: xr.Dataset | None
    window: NDArray[np.bool_] | None
    messages: tuple[str, ...]
    insights: tuple[tuple[str, str, str], ...]
    seconds: float


def run(spec: Spec, again: bool = False) -> Run:
    """The run, or what was kept of it; one that was refused is not kept."""
    file = KEPT / f"{spec.key()}.pickle"
    if file.exists() and not again:
        kept = pickle.loads(file.read_bytes())
        assert isinstance(kept, Run)
        return kept
    start = time.perf_counter()
    made = replace(_made(spec), seconds=time.perf_counter() - start)
    if made.data is None:
        file.unlink(missing_ok=True)  # else what an older program made of it would stand for this one
        return made
    KEPT.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(".part")
    part.write_bytes(pickle.dumps(made))
    part.replace(file)
    return made


@lru_cache(maxsize=4)
def trial_of(motion: str, seed: int, sensors: tuple[tuple[str, float], ...], markers: str) -> SimulatedTrial:
    """A simulated trial; kept in memory, because several runs differ only in what is made of it."""
    noise = SensorNoise().changed(dict(sensors))
    who = {"mass_kg": MASS_KG, "height_m": HEIGHT_M, "sex": SEX}
    seconds = SPANS[motion][0]
    if motion == "sagittal":
        return simulate("sagittal7", "squat", seed, seconds, RATE_HZ[motion], noise=noise, **who)
    return simulate("fullbody", motion, seed, seconds, RATE_HZ[motion], noise=noise, markers=markers, **who)


def _made(spec: Spec) -> Run:
    sensors = tuple(sorted(spec.sensors.items()))
    trial = trial_of(spec.motion, spec.seed, sensors, spec.markers)
    _, first, last = SPANS[spec.motion]
    recording = trial.recording.window(first, last)
    static = None
    if spec.static and spec.motion != "sagittal":
        stood = trial_of("squat", spec.seed, sensors, spec.markers).recording
        static = stood.window(0.0, STANDING_S)
    recording = replace(recording, subject={})  # the simulator writes the mass into it: only what is told is known
    static = None if static is None else replace(static, subject={})
    for name, size in spec.altered.items():
        recording = ALTERATIONS[name](recording, size)
    told = {"mass_kg": MASS_KG, "height_m": HEIGHT_M, "sex": SEX, "markers": spec.markers} | dict(spec.told)
    told |= {"model": "sagittal7" if spec.motion == "sagittal" else "fullbody", "lag_s": np.inf if spec.smooth else 0.0}
    if spec.noise != 1.0:
        told["noise"] = scaled_noise(spec.noise, floating=spec.motion != "sagittal")
    truth = trial.truth.data[["coordinates", "speeds", "moments"]]
    truth = truth.isel(time=np.searchsorted(truth["time"].values, recording.time - 1e-9))
    if static is not None:
        told["static"] = static.name
    try:
        case = case_of(configure(Path(recording.name), told, {"output": Path()}), recording=recording, static=static)
        estimates, _, _ = estimate_each(case.recording, case.setup, static=case.static, keep_lost=True)
    except DynakinError as error:
        return Run(error.message, None, None, None, (), (), 0.0)
    (estimate,) = (case.with_config(title, made) for title, made in estimates.items())
    found = tuple((each.level, each.title, each.text) for each in insights(estimate, compute_metrics(estimate)))
    data = full_dataset(estimate).drop_vars([*LARGE], errors="ignore").drop_dims("element_", errors="ignore").load()
    before, after = LEFT_OUT[spec.motion]
    window = (estimate.time >= estimate.time[0] + before) & (estimate.time <= estimate.time[-1] - after)
    return Run("", data, truth, window & ~estimate.lost, tuple(map(str, estimate.messages)), found, 0.0)


LARGE = ("joint_orientations", "joint_loads", "initial_covariance", "final_covariance", "joint_centres")


def scaled_noise(factor: float, *, floating: bool) -> dict[str, float | bool]:
    """The default noise settings with their standard deviations times ``factor``, as a preset fixes them, of those that
    such a model has."""
    default = Noise().model_dump()
    scaled = {key: factor * default[key] for key in NOISE} | {key: factor**2 * default[key] for key in VARIANCES}
    idle = without_effect(list(scaled), Noise(), [floating])
    return {"adapt": False} | {key: value for key, value in scaled.items() if key not in idle}


def _half(recording: Recording, _: float) -> Recording:
    kept = [k for k, name in enumerate(recording.marker_names) if name == "C7" or _lateral(name)]
    names = tuple(recording.marker_names[k] for k in kept)
    return replace(recording, marker_names=names, markers=recording.markers[:, kept])


def _lateral(name: str) -> bool:
    return any(name.endswith(part) for part in HALF) and not any(part in name for part in ("mknee", "mankle"))


def _no_plates(recording: Recording, _: float) -> Recording:
    return recording.with_plates(())


def _plates_of_one(recording: Recording, _: float) -> Recording:
    """The first plate alone (of a squat the right foot's, of a walk the first stance's)."""
    return recording.with_plates(recording.plates[:1])


def _plate_gain(recording: Recording, gain: float) -> Recording:
    first, *others = recording.plates
    return recording.with_plates((_times(first, gain), *others))


def _times(plate: Plate, gain: float) -> Plate:
    return replace(plate, force=gain * plate.force, moment=gain * plate.moment, free_moment=gain * plate.free_moment)


def _exchanged(recording: Recording, from_s: float) -> Recording:
    """Two markers of the right leg swap their names from a time on."""
    markers, names = recording.markers.copy(), list(recording.marker_names)
    a, b = (names.index(name) for name in ("r_knee", "r_sh2" if "r_sh2" in names else "r_thigh1"))
    late = recording.time >= recording.time[0] + from_s
    markers[np.ix_(late, [a, b])] = markers[np.ix_(late, [b, a])]
    return replace(recording, markers=markers)


def _off(recording: Recording, size_m: float) -> Recording:
    """One marker sits elsewhere than in the standing trial (it fell off and was put on again)."""
    markers = recording.markers.copy()
    markers[:, list(recording.marker_names).index("r_knee"), :] += size_m * np.array([0.5, 0.75, -0.43])
    return replace(recording, markers=markers)


def _low_passed(recording: Recording, cutoff_hz: float) -> Recording:
    """Trajectories as capture software exports them: low-passed, so that their cameras' noise is gone."""
    b, a = butter(2, cutoff_hz / (0.5 * recording.rate))
    return replace(recording, markers=filtfilt(b, a, recording.markers, axis=0))


ALTERATIONS: dict[str, Callable[[Recording, float], Recording]] = {
    "half": _half,
    "no plates": _no_plates,
    "one plate": _plates_of_one,
    "plate gain": _plate_gain,
    "exchanged": _exchanged,
    "off": _off,
    "low-passed": _low_passed,
}
"""What is done to a recording before it is run, by name, with a size."""


def _plain(value: Any) -> Any:
    return dict(value) if isinstance(value, Mapping) else value
