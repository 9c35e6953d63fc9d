"""Plates that lag behind the markers: brought into step between two passes over a recording."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from dynakin.arrays import Array
from dynakin.filter.ground.closure import plates_misfit
from dynakin.filter.ground.delay import Delay, clock_in_words
from dynakin.filter.ground.needed import Needed
from dynakin.filter.measurements import Measurements
from dynakin.filter.tracker import Tracker
from dynakin.messages import Message, note
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.progress import Progress
from dynakin.results.naming import sentence

LEAST_S = 0.003
"""A lesser delay is left to the state: a third of a frame at 100 Hz moves no moment by much."""
SIGMAS = 3.0
PASSES = 3
"""The state extrapolates motion back over the delay and finds a long one a sixth too long; further passes mend that."""


class InStep(NamedTuple):
    """A run over a recording whose plates are in step.

    Attributes:
        tracker: as the last run left it. arrays: of that run.
        shift_s: by which it took the plates earlier. notes: what there is to say of the plates' clock.
    """

    tracker: Tracker
    arrays: dict[str, Array]
    shift_s: float
    notes: list[Message]


def run_in_step(
    tracker: Tracker,
    measured: Measurements,
    progress: Progress | None = None,
    passes: int = PASSES,
    run: Callable[[Tracker, Measurements, Progress | None], dict[str, Array]] = Tracker.run_arrays,
) -> InStep:
    """A run, again (``passes`` times at most) with the plates brought into step where they turn out to lag.

    Args:
        tracker: at its start. run: as `Tracker.run_arrays`.
    """
    calibrated = tracker.calibrated
    needed = Needed(calibrated, measured.time, measured.markers)
    arrays, shift = run(tracker, measured, progress), 0.0
    misfit = None
    for done in range(passes):
        delay = delay_of(calibrated, arrays["state"][-1], arrays["state_sd"][-1])
        if delay is None or not delay.beyond(LEAST_S, SIGMAS):
            break
        if not done:  # of nearly every run nobody asks
            misfit = plates_misfit(needed, measured.wrench)
        taken = measured.in_step(shift + delay.delay_s)
        fits = plates_misfit(needed, taken.wrench)
        if misfit is not None and fits is not None and fits > misfit:
            return InStep(tracker, arrays, shift, [contradicted(shift + delay.delay_s, misfit, fits)])
        shift, misfit = shift + delay.delay_s, fits
        tracker = tracker.fresh()
        arrays = run(tracker, taken, progress)
    delay = delay_of(calibrated, arrays["state"][-1], arrays["state_sd"][-1])
    return InStep(tracker, arrays, shift, in_words(shift, delay))


def delay_of(initial: CalibratedModel, state: Array, sd: Array) -> Delay | None:
    """The plates' delay after the last frame (state, sd: (n,)); None where none is estimated."""
    if "plates/delay" not in initial.names:
        return None
    k = initial.names.index("plates/delay")
    return Delay(float(state[k]), float(sd[k]))


def in_words(shift_s: float, delay: Delay | None) -> list[Message]:
    """What was found about the plates' clock; empty where nothing was asked."""
    if delay is None:
        return []
    text = sentence(clock_in_words(shift_s + delay.delay_s, delay.sd_s))
    if shift_s:
        return [note("in step", f"{text}; they were brought into step.")]
    return [note("sum of the plates", f"{text}.")]


def contradicted(delay_s: float, misfit_n: float, misfit_then_n: float) -> Message:
    """That a delay which the fit asks for is not taken off, because the motion of the centre of mass is against it."""
    where = "behind" if delay_s >= 0.0 else "ahead of"
    return note(
        "plates",
        f"By the fit the plates are {1000.0 * abs(delay_s):.0f} ms {where} the markers, by the motion of the centre of "
        f"mass they are not (their sum would be {misfit_then_n:.0f} N off it, not {misfit_n:.0f} N): no more was taken "
        "off.",
    )
