"""What the filter has not seen: plates withheld, one marker left out at a time, a moment ahead. A posterior residual
proves little, since large gains follow anything; these cannot be had by following."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynakin.blas import one_blas_thread
from dynakin.errors import ConfigError, RecordingError
from dynakin.filter.estimator import Estimator
from dynakin.filter.measurements import Measurements
from dynakin.progress import Progress
from dynakin.recordings.recording import Recording
from dynakin.results.measures.metrics import evaluation_window
from dynakin.settings.defaults import HORIZON_S
from dynakin.units import COMPONENTS
from dynakin.validation.case import Setup
from dynakin.validation.held_out import halves, identify_on, judge, predict_blind
from dynakin.validation.table2 import MARKERS, Spread, spread, unit_of
from dynakin.validation.unseen_in_space import figures_in_space
from dynakin.validation.yardsticks import (
    LEFT_OUT,
    LINEAR,
    PERSISTENCE,
    WITHHELD,
    Figures,
    Judged,
    ahead,
    expected_ahead,
    held,
    line,
    span_frames,
    with_mean,
)


@dataclass(frozen=True)
class UnseenRow:
    """RMS error of one quantity by one method, by one yardstick; mean and standard deviation over trials.

    yardstick: "plates withheld", "marker left out", "100 ms ahead". quantity: fx to mz, "markers" (mean over markers)
    or a marker's name. unit: of ``rms``.
    """

    yardstick: str
    quantity: str
    unit: str
    method: str
    rms: Spread


def unseen(trials: Sequence[Figures]) -> list[UnseenRow]:
    """Rows over one or many trials, each of `unseen_figures`: by yardstick, then quantity, then method."""
    keys = dict.fromkeys(key for figures in trials for key in figures)
    yardsticks, quantities, methods = (list(dict.fromkeys(part)) for part in zip(*keys, strict=True))
    first = [name for name in (MARKERS, *COMPONENTS) if name in quantities]
    return [
        UnseenRow(*key[:2], unit_of(key[1]), key[2], spread([figures.get(key) for figures in trials]))
        for yardstick in yardsticks
        for quantity in dict.fromkeys([*first, *quantities])
        for method in methods
        if (key := (yardstick, quantity, method)) in keys
    ]


def check_horizon(recording: Recording, horizon_s: float) -> None:
    """Whether a trial can be predicted so far ahead.

    Raises:
        ConfigError: the horizon is not within it.
    """
    longest = 0.5 * float(recording.time[-1] - recording.time[0])
    if not 0.0 < horizon_s < longest:
        raise ConfigError(
            f"{recording.path or recording.name}: the horizon is {horizon_s:g} s (--horizon-ms), expected more than 0 "
            f"and less than half of the trial ({longest:g} s)"
        )


@one_blas_thread
def unseen_figures(
    recording: Recording,
    setup: Setup,
    *,
    static: Recording | None = None,
    horizon_s: float = HORIZON_S,
    progress: Progress | None = None,
) -> Figures:
    """All yardsticks on one trial, over its window.

    - Plates withheld: lengths and inertia from the first half, frozen; the second half from markers alone.
    - Marker left out: from the end of the adaptation on, one marker is not given to the filter; its error there.
    - Ahead: what is expected from each frame's estimate ``horizon_s`` on (`LookAhead`).

    For each also: the last value held, and the last slope of the raw data carried on. A floating model's are those of
    `figures_in_space`.

    Raises:
        ConfigError: the horizon is not within the trial. DynakinError: as `Estimator.run`.
    """
    check_horizon(recording, horizon_s)
    if setup.definition.floating:
        return figures_in_space(recording, setup, static=static, horizon_s=horizon_s, progress=progress)
    figures = plates_withheld(recording, setup, static=static)
    time = recording.time
    if evaluation_window(time)[0]:
        raise RecordingError(
            f"{recording.path or recording.name}: {time[-1] - time[0]:.1f} s, too short to leave a marker out after "
            "the adaptation; expected more than 4 s"
        )
    for preset in setup.noise:
        estimator = setup.estimator(preset)
        initial = estimator.start(recording, static=static).calibrated
        markers, wrench, _ = estimator.measured(recording, initial)
        trial = Judged(initial, Measurements(time, markers, wrench))
        figures |= _left_out(estimator, preset, trial, progress)
        figures |= _ahead(estimator, preset, trial, horizon_s)
    return figures


def plates_withheld(recording: Recording, setup: Setup, *, static: Recording | None = None) -> Figures:
    """Errors (N, N m) of the second half's wrench from markers alone, parameters frozen at the first half's end."""
    first, second = halves(recording)
    identified = identify_on(first, setup, static=static, same_recording=True)
    blind = predict_blind(identified, second)
    wanted = {f"EKF ({preset}), identified": f"EKF ({preset})" for preset in setup.noise}
    last = len(first.time) - 1
    time = np.concatenate([first.time, second.time])
    shown = np.vstack([identified.wrench, np.full((len(second.time), 6), np.nan)])
    chosen = {wanted[name]: wrench for name, wrench in blind.wrenches.items() if name in wanted}
    chosen |= {PERSISTENCE: held(shown, last)[last + 1 :], LINEAR: line(time, shown, last)[last + 1 :]}
    rows = judge(replace(blind, wrenches=chosen), second)
    return {(WITHHELD, row.quantity, row.method): row.rms.mean for row in rows}


def _left_out(estimator: Estimator, preset: str, trial: Judged, progress: Progress | None) -> Figures:
    time, markers, *_ = trial.measured
    first = int(np.flatnonzero(trial.window)[0])
    single: Figures = {}
    count = markers.shape[1]
    for k in range(count):
        hidden = markers.copy()
        hidden[first:, k] = np.nan
        arrays = estimator.start(trial.calibrated).run_arrays(trial.measured._replace(markers=hidden))
        single |= trial.markers(LEFT_OUT, f"EKF ({preset})", arrays["markers_estimated"], [k])
        if progress is not None:
            progress(k + 1, count)
    for method, guess in (
        (PERSISTENCE, [held(markers[:, k], first - 1) for k in range(count)]),
        (LINEAR, [line(time, markers[:, k], first - 1) for k in range(count)]),
    ):
        single |= trial.markers(LEFT_OUT, method, np.stack(guess, axis=1), range(count))
    return with_mean(LEFT_OUT, single)


def _ahead(estimator: Estimator, preset: str, trial: Judged, horizon_s: float) -> Figures:
    time, tracker = trial.measured.time, estimator.start(trial.calibrated)
    yardstick = ahead(horizon_s)
    states = tracker.run_arrays(trial.measured)["state"]
    expected = expected_ahead(tracker.core_model, time, states, horizon_s)
    figures: Figures = {}
    guesses = {f"EKF ({preset})": expected} | trial.raw_ahead(span_frames(time, horizon_s))
    for method, (places, forces) in guesses.items():
        figures |= trial.markers(yardstick, method, places, range(places.shape[1]))
        figures |= trial.wrench(yardstick, method, forces)
    return with_mean(yardstick, figures)
