"""The passes over a recording that end with its estimate: plates in step, noise that calibrates itself, skin that
follows the joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from dynakin.arrays import Array
from dynakin.filter.adapt import CALIBRATED_S, calibrated_noise, frames_that_show
from dynakin.filter.alignment import PASSES, run_in_step
from dynakin.filter.augment import with_hips_shown
from dynakin.filter.following_skin import following_skin, may_follow
from dynakin.filter.measurements import Measurements
from dynakin.filter.prepared import Prepared
from dynakin.filter.tracker import Tracker
from dynakin.messages import Message, note
from dynakin.progress import Progress
from dynakin.results.records import FOLLOWING
from dynakin.settings.lag import frames_later


class Passed(NamedTuple):
    """What `passes` gives.

    Attributes:
        tracker: as the last pass left it, with the noise of that. arrays: of that pass.
        measured: what it ran over, the plates in step.
        notes: on the noise. clock: what there is to say of the plates' clock.
    """

    tracker: Tracker
    arrays: dict[str, Array]
    measured: Measurements
    notes: list[Message]
    clock: list[Message]


def passes(ready: Prepared, progress: Progress | None = None) -> Passed:
    """All passes over what is prepared: one, where nothing of the noise is asked of the recording, else a first that
    shows it, a part of it again, and the last with what was found.

    Raises:
        ValueError: a frame that the core refuses. DivergenceError: the filter lost its estimate.
    """
    calibrated, time, noise = ready.calibrated, ready.measured.time, ready.tracker.noise
    late, adapt = frames_later(ready.lag_s, ready.recording.rate), noise.calibrates(bool(calibrated.feet))
    # joints found from markers are off by what follows angles as skin does
    scaled = late is None and calibrated.plan is None and may_follow(calibrated, noise)
    once = not (adapt or scaled)  # a first run shows nothing that the next is to know
    frames, ways = len(time), 2 if late is None else 1
    # of a body that is fixed nowhere it shows the noise alone: a part of the recording is enough
    part = adapt and calibrated.feet and not scaled
    shown = frames_that_show(time, ready.measured.markers) if part else frames
    again = min(frames, round(CALIBRATED_S * ready.recording.rate)) if adapt else 0
    there, calibrating, back = _shares(progress, (ways * frames, 0, 0) if once else (shown, again, ways * frames))

    def first(own: Tracker, measured: Measurements, progress: Progress | None) -> dict[str, Array]:
        return own.run_late_arrays(late, measured, progress) if once else own.run_arrays(
            measured, progress, state_only=True
        )  # fmt: skip

    rounds = 0 if ready.ground.doubt else PASSES
    tracker, arrays, shift, clock = run_in_step(
        ready.tracker.fresh(), ready.measured.first(shown), there, rounds, first
    )
    measured, notes = ready.measured.in_step(shift), list[Message]()
    if once:
        return Passed(tracker, arrays, measured, notes, clock)
    found = None
    if adapt:
        found = calibrated_noise(tracker, arrays, measured.first(shown), late=late == 0, progress=calibrating)
    if adapt and found is None:
        text = "Too few frames are followed to calibrate the noise on them: it is as declared."
        notes.append(note("noise", text))
    skin = following_skin(tracker, arrays, time) if scaled else None
    seen = measured if skin is None else measured._replace(markers=measured.markers - skin.shift_m)
    if tracker.systematic is not None:  # which gives back to deviations what is kept from the filter
        calibrated = with_hips_shown(calibrated, arrays["state"][arrays["tracking"] == FOLLOWING])
    tracker = tracker.changed(found or tracker.noise, calibrated)
    arrays = tracker.run_late_arrays(late, seen, back)
    return Passed(tracker, arrays if skin is None else skin.put_back(arrays), measured, notes, clock)


def _shares(progress: Progress | None, frames: Sequence[int]) -> list[Progress | None]:
    """One progress for passes that follow each other, each over so many frames."""
    if progress is None:
        return [None] * len(frames)
    before, total = [sum(frames[:k]) for k in range(len(frames))], sum(frames)
    return [lambda done, _, first=first: progress(first + done, total) for first in before]  # type: ignore[misc]
