"""The figures of ``metrics.json``: fit, prediction, consistency, events and timing of one estimate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from dynakin.arrays import rms, widened
from dynakin.results.estimate import Estimate
from dynakin.results.failures import Failures
from dynakin.results.measures.adaptation import adaptation
from dynakin.results.measures.bounds import parameter_bounds
from dynakin.results.measures.consistency import (
    AVERAGED_S,
    Consistency,
    consistency,
    mismatch_in_words,
    noise_from,
    speed_mismatch,
)
from dynakin.results.measures.facing import facing
from dynakin.results.measures.feet import contact_figures, foot_figures
from dynakin.results.measures.fit import SignalFit, marker_rms_mm, signal_fit
from dynakin.results.measures.posterior import posterior_figures
from dynakin.results.measures.power import work
from dynakin.results.measures.soft_tissue import soft_tissue
from dynakin.results.measures.sources import moment_figures, needed_wrench
from dynakin.results.measures.stances import counted
from dynakin.results.measures.symmetry import asymmetry
from dynakin.results.measures.tracking import lost_in_words, tracking_figures, why_lost
from dynakin.results.records import REFUSED
from dynakin.units import COMPONENTS

SCHEMA_VERSION = 2
"""Version of ``metrics.json``, ``parameters.json`` and ``estimate.nc``; it grows when a key changes its meaning."""

# The paper lets the filter adapt for 2 s before it counts (section III); a recording that is not at least twice as
# long counts as a whole.
ADAPTATION_S = 2.0


def evaluation_window(time: np.ndarray) -> np.ndarray:
    """Frames (T,) bool that the figures are taken over: after the first 2 s, or all of a trial of 4 s or less."""
    if time[-1] - time[0] > 2.0 * ADAPTATION_S:
        # half a microsecond: file times are rounded, the frame at 2 s belongs to the window
        return np.asarray(time >= time[0] + ADAPTATION_S - 5e-7)
    return np.ones(len(time), dtype=bool)


def compute_metrics(estimate: Estimate, failures: Failures | None = None) -> dict[str, Any]:
    """Everything in ``metrics.json`` as a plain dictionary; a figure that is not defined is None.

    Components of the wrench are along the way the person faces: fx forward, fy up, fz to the right.

    Args:
        failures: takes what fails, whose block is None then; not given: it is raised.
    """
    with nullcontext() if failures is None else failures.stage("figures along the way the person faces"):
        estimate = facing(estimate)
    window = evaluation_window(estimate.time)
    kept = estimate.time[window]
    good = window & ~estimate.lost  # for what is made of `state`, which keeps what the filter held
    blocks: dict[str, Callable[[], Any]] = {
        "markers": lambda: _markers(estimate, "estimated", window),
        "wrench": lambda: _wrench(estimate, "estimated", window),
        "prediction": lambda: _prediction(estimate, window),
        "tracking": lambda: tracking_figures(estimate),
        "consistency": lambda: _consistency(estimate, window),
        "adaptation": lambda: adaptation(estimate),
        "bounds": lambda: parameter_bounds(estimate, good),
        "soft_tissue": lambda: soft_tissue(estimate, good),
        "identifiability": lambda: posterior_figures(estimate),
        "moments": lambda: moment_figures(estimate, lost_in_words(estimate)),
        "peak_moments_per_kg": lambda: _peak_moments(estimate, window),
        "work": lambda: work(estimate, window),
        "angles": lambda: _angles(estimate),
        "asymmetry": lambda: asymmetry(estimate, window),
        "feet": lambda: foot_figures(estimate, window),
        "contacts": lambda: contact_figures(estimate),
        "events": lambda: _events(estimate),
        "timing": lambda: asdict(estimate.timing),
    }
    metrics: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "window": {"start_s": float(kept[0]), "end_s": float(kept[-1])},
        "lag_s": None if estimate.smoothed else estimate.lag_s,
        "marker_places": estimate.marker_places,
        "unmarked_joints": estimate.unmarked_joints,
    }
    for name, block in blocks.items():
        metrics[name] = None
        with nullcontext() if failures is None else failures.stage(f"{name} in metrics.json"):
            metrics[name] = block()
    return metrics


def _prediction(estimate: Estimate, window: np.ndarray) -> dict[str, Any]:
    return {
        "what": "one frame ahead: the model's expectation before the frame is used",
        "markers": _markers(estimate, "predicted", window),
        "wrench": {"rms": _wrench(estimate, "predicted", window)["rms"]},
    }


def _angles(estimate: Estimate) -> dict[str, Any] | None:
    """Where the joint angles of ``angles.sto`` have their zero, by coordinate; None where none were asked for."""
    if "zero_offset" not in estimate.data:
        return None
    degrees = np.degrees(estimate.data["zero_offset"].values)
    turning = zip(estimate.coordinate_names, degrees, estimate.is_rotation(), strict=True)
    return {
        "signs": estimate.data.attrs["angle_signs"],
        "zero_deg": {name: float(value) for name, value, turns in turning if turns},
    }


def _peak_moments(estimate: Estimate, window: np.ndarray) -> dict[str, dict[str, float]]:
    """Largest and smallest moment of each coordinate over the body mass and over how many frames; those that are not
    measured long enough (`counted`) are left out."""
    taken = counted(estimate, window)
    values = np.where(taken, estimate.moments_per_kg(), np.nan)
    return {
        name: {
            "largest": float(np.nanmax(values[:, k])),
            "smallest": float(np.nanmin(values[:, k])),
            "frames": int(taken[:, k].sum()),
        }
        for k, name in enumerate(estimate.coordinate_names)
        if np.isfinite(values[:, k]).any()
    }


def _markers(estimate: Estimate, kind: str, window: np.ndarray) -> dict[str, Any]:
    measured = _array(estimate, "markers_measured")[window]
    compared = _array(estimate, f"markers_{kind}")[window]
    axes = estimate.modelled_axes()
    rms = {
        name: marker_rms_mm(measured[:, index], compared[:, index], axes)
        for index, name in enumerate(estimate.marker_names)
    }
    seen = [value for value in rms.values() if value is not None]
    return {"rms_mm": rms, "mean_rms_mm": float(np.mean(seen)) if seen else None}


def _wrench(estimate: Estimate, kind: str, window: np.ndarray) -> dict[str, dict[str, float | None]]:
    measured = _array(estimate, "wrench_measured")[window]
    compared = (needed_wrench(estimate.data) if kind == "estimated" else _array(estimate, f"wrench_{kind}"))[window]
    fits = {name: signal_fit(measured[:, k], compared[:, k]) for k, name in enumerate(COMPONENTS)}
    fits = {name: fit for name, fit in fits.items() if fit.rms is not None}
    renamed = {"nrms_rms_percent": "nrms_percent"}  # its name in the file from before there were two
    return {renamed.get(key, key): {name: getattr(fit, key) for name, fit in fits.items()} for key in SignalFit._fields}


def window_consistency(estimate: Estimate, window: np.ndarray) -> Consistency:
    """Consistency over the frames ``window`` (T,) bool; markers that were refused are not judged by."""
    axes = estimate.modelled_axes()
    kept = "markers_innovation_sd" in estimate.data  # not of every live run
    pairs = {}
    for name in ("markers", "wrench"):
        sd = _array(estimate, f"{name}_innovation_sd")[window] if kept else None
        off = _array(estimate, f"{name}_measured") - _array(estimate, f"{name}_predicted")
        pairs[name] = (_array(estimate, f"{name}_innovation") if kept else off)[window], sd
    markers, sd = pairs["markers"]
    if sd is not None:
        refused = estimate.values("verdict")[window, :-1] == REFUSED
        sd = np.where(refused[:, :, None], np.nan, sd)[:, :, axes].reshape(len(sd), -1)
    return consistency(
        estimate.time[window],
        estimate.data["nis"].values[window],
        estimate.data["n_rows"].values[window],
        (markers[:, :, axes].reshape(len(markers), -1), sd),
        pairs["wrench"],
        noise_from(estimate.config),
    )


def speed_consistency(estimate: Estimate, window: np.ndarray) -> tuple[dict[str, float], str]:
    """How far each speed is from the derivative of its coordinate, and a sentence, empty where all fit. Frames in which
    nothing is known of a speed do not count, nor do those next to them, whose derivative they are part of."""
    names = estimate.coordinate_names
    sd = estimate.values("speeds_sd")
    unknown = np.isnan(sd)
    beside = np.stack([widened(column, 1) for column in unknown.T], axis=1)
    coordinates, speeds = (estimate.values(name)[window] for name in ("coordinates", "speeds"))
    mismatch, moving = speed_mismatch(estimate.time[window], coordinates, np.where(beside[window], np.nan, speeds))
    finite = {name: float(value) for name, value in zip(names, mismatch, strict=True) if np.isfinite(value)}
    return finite, mismatch_in_words(names, estimate.is_rotation(), mismatch, moving, rms(sd[window], axis=0))


def _consistency(estimate: Estimate, window: np.ndarray) -> dict[str, Any]:
    found = window_consistency(estimate, window)
    mismatch, speeds_verdict = speed_consistency(estimate, window)
    if why_lost(estimate) is not None:
        found = replace(found, judgements={}, verdict="The person was lost, so nothing is said of consistency.")
        speeds_verdict = ""
    elif estimate.lost.any():
        found = replace(found, verdict=f"Of the frames that are not lost: {found.verdict}")
    return {
        "mean_nis_per_dof": found.mean_nis_per_dof,
        "interval_95": list(found.interval_95) if found.interval_95 else None,
        "measured_dof": found.measured_dof,
        "noise": found.noise,
        "judgement": found.judgement,
        "judgements": dict(found.judgements),
        "statistics": {
            "what": "mean squares of normalised innovations, 1 if covariances are right; averaged: of their means over "
            f"{AVERAGED_S:g} s, what lasts longer than noise",
            **found.statistics,
        },
        "whiteness": {
            "what": "lag-1 autocorrelation of the innovations, 0 if white",
            "markers": found.whiteness_markers,
            "wrench": found.whiteness_wrench,
        },
        "speed_mismatch": {
            "what": "RMS of estimated speed less differenced estimated coordinate, rad/s or m/s",
            **mismatch,
        },
        "verdict": " ".join(filter(None, [found.verdict, speeds_verdict])),
    }


def _events(estimate: Estimate) -> dict[str, Any]:
    count = Counter(event.kind for event in estimate.events)
    return {
        "gated": count["gated"],
        "missing": count["missing"],
        "at_bound": count["at_bound"],
        "resets": count["reset"],
        "missing_frames": missing_frames(estimate),
        "parameters_at_bound": [p.name for p in estimate.parameters if p.at_bound],
        "log": [asdict(event) for event in estimate.events],
    }


def missing_frames(estimate: Estimate) -> dict[str, int]:
    """Frames of the whole recording in which a marker in use was not measured; only markers that miss any."""
    measured = _array(estimate, "markers_measured")[:, :, estimate.modelled_axes()]
    gaps = (~np.isfinite(measured).all(axis=2)).sum(axis=0)
    return {name: int(gap) for name, gap in zip(estimate.marker_names, gaps, strict=True) if gap}


def _array(estimate: Estimate, name: str) -> np.ndarray:
    dims = ("time", "marker", "axis") if name.startswith("markers") else ("time", "component")
    return np.asarray(estimate.data[name].transpose(*dims).values, dtype=float)
