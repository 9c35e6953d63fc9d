"""A person who moves on while nothing is seen. `python tests/support/gaps.py` prints the table of docs/live.md."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

import dynakin
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate

GAPS_S = (0.5, 1.0, 2.0, 5.0, 10.0, 60.0, 300.0)
LATER_S = 2.4  # of the movement that pass at most, unseen: it differs from the one before
SUBJECT = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")


@cache
def person(kind: str, length_s: float) -> Recording:
    return simulate(kind, "squat", 1, length_s).recording


def estimator(kind: str) -> dynakin.Estimator:
    options = {"markers": "opencap"} if kind == "sagittal7" else {}
    return dynakin.Estimator(dynakin.load_model(kind, subject=SUBJECT, **options))


def with_gap(recording: Recording, stop_s: float, gap_s: float) -> tuple[Recording, np.ndarray]:
    """The recording without some frames from ``stop_s``, its time going on ``gap_s`` later; and which frames remain."""
    passed = min(gap_s, LATER_S)
    kept = np.flatnonzero((recording.time < stop_s - 1e-6) | (recording.time > stop_s + passed - 1e-6))
    time = recording.time[kept] + np.where(recording.time[kept] < stop_s - 1e-6, 0.0, gap_s - passed)
    plates = tuple(plate.frames(kept) for plate in recording.plates)
    return replace(recording, time=time, markers=recording.markers[kept], plates=plates), kept


@dataclass
class Followed:
    """Of each frame: RMS distance (T,) m of all markers from their estimate, and the filter's word."""

    off: np.ndarray
    tracking: np.ndarray

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.off**2)))


def distance(initial: CalibratedModel, estimated: np.ndarray, measured: dict[str, np.ndarray]) -> float:
    """RMS over the markers, m, on the axes that the model measures."""
    places = initial.ground.points_to_ground(np.stack([measured[name] for name in initial.recorded_markers]))
    axes = np.array([marker.measured for marker in initial.spec.markers])
    return float(np.sqrt(np.mean((np.where(axes, estimated - places, 0.0) ** 2).sum(axis=1))))


def follow(kind: str, recording: Recording, start_s: float = 0.0) -> Followed:
    """By `Tracker.step` from ``start_s`` on, from a model measured on the first two seconds."""
    live = estimator(kind).start(recording.window(0.0, 2.0))
    off, tracking = [], []
    for k, t in enumerate(recording.time):
        if t < start_s - 1e-6:
            continue
        markers = dict(zip(recording.marker_names, recording.markers[k], strict=True))
        plates = {p.name: np.hstack([p.force[k], p.moment[k]]) for p in recording.plates}
        step = live.step(dynakin.Sample(float(t), markers, plates))
        off.append(distance(live.calibrated, step.markers, markers))
        tracking.append(step.report.tracking)
    return Followed(np.array(off), np.array(tracking))


@cache
def without_gap(kind: str, length_s: float, start_s: float) -> Followed:
    return follow(kind, person(kind, length_s), start_s)


@dataclass
class Figures:
    """After a gap."""

    soon: float  # RMS of the markers over that of the run without the gap, from 0.5 s after the first frame to 1 s
    later: float  # and to the end
    following_m: float  # largest distance of a frame that is called following
    words: list[str]  # of the frames after the gap
    rms_m: float


def figures(kind: str, gap_s: float, stop_s: float, after_s: float, start_s: float = 0.0) -> Figures:
    length_s = stop_s + LATER_S + after_s
    gapped, kept = with_gap(person(kind, length_s), stop_s, gap_s)
    found, whole = follow(kind, gapped, start_s), without_gap(kind, length_s, start_s)
    skipped = len(kept) - len(found.off)
    kept = kept[skipped:] - skipped
    return compared(found, Followed(whole.off[kept], whole.tracking[kept]), gapped.time[skipped:], stop_s)


def compared(found: Followed, whole: Followed, time: np.ndarray, stop_s: float) -> Figures:
    first = int(np.searchsorted(time, stop_s - 1e-6))
    soon = (time > time[first] + 0.5) & (time <= time[first] + 1.0)
    later = time > time[first] + 0.5

    def ratio(where: np.ndarray) -> float:
        return Followed(found.off[where], found.tracking).rms / Followed(whole.off[where], whole.tracking).rms

    following = found.off[first:][found.tracking[first:] == "following"]
    return Figures(
        ratio(soon), ratio(later), float(following.max(initial=0.0)), list(found.tracking[first:]),
        Followed(found.off[later], found.tracking).rms,
    )  # fmt: skip


if __name__ == "__main__":
    print("| gap, s | squat in the plane: markers, mm | ratio | worst following, mm | whole body: the same | | |")
    print("|---|---|---|---|---|---|---|")
    for gap in GAPS_S:
        cells = []
        for kind in ("sagittal7", "fullbody"):
            f = figures(kind, gap, 15.0, 5.0)
            cells += [f"{1e3 * f.rms_m:.2f}", f"{max(f.soon, f.later):.2f}", f"{1e3 * f.following_m:.1f}"]
        print(f"| {gap:g} | {' | '.join(cells)} |", flush=True)
