"""Noise that calibrates itself: the scales of the declared noise that a recording's own innovations ask for.

Two things are found. The jerk's density by group of joints, from how much accelerations change between frames
compared with what the filter expects of that (covariance matching). Then one factor on all variances but those of
plates and residual, so that the normalised innovation squared is one a row: it leaves the movement as it is weighed,
because the gain depends on the ratio of the variances only, and makes deviations and innovations agree (the variance of
unit weight of adjustment theory). Priors are in it as well: what is wrong with a place, a length or a mass does not
average out, and data that count for more would only bend them further.
"""

from __future__ import annotations

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.errors import DivergenceError
from dynakin.filter.augment import continuous_noise
from dynakin.filter.measurements import Measurements
from dynakin.filter.noise import LATE_SHARE, MOVED_S, SETTLING_S, joint_groups
from dynakin.filter.tracker import Tracker
from dynakin.progress import Progress
from dynakin.results.measures.tracking import ANY_ASTRAY
from dynakin.results.records import FOLLOWING, REFUSED
from dynakin.settings.noise import JointGroup, Noise

CALIBRATED_S = 4.0
"""How long somebody is followed of what is filtered again with other jerk densities, from the recording's start: 3 and
10 s give factors within 2 % of each other."""
SHOWN_S = 10.0
"""The first run, which shows how large innovations are, goes over so much of the recording at least,"""
MOVES = 0.8
"""and over as much more as it takes until markers have moved by so much of what they do in all of it (mean square of
their way in `MOVED_S`): who stands for a while shows little."""
LEAST_FRAMES = 25
"""Fewer say nothing: a quarter of a second."""
LEAST_SHARE = 0.5
"""Part of the frames with markers that must be followed: of a motion that is lost for longer, innovations say how wrong
it is, not how large the noise is."""
JERK_SHARE: dict[JointGroup, float] = {"feet": 1.0, "trunk_rotation": 1.0}
OTHER_JERK_SHARE = 0.5
"""Part of a jerk scale's logarithm that is believed: jerk is not white, and what fits the next frame best is too little
for a step. Of feet all of it: what is kept back there turns up as ankles that are off by a constant (`truth3d`); and of
what turns the trunk about its length, which was cut at 5 to 8 Hz (`truth3d`'s walks 3, 31, two of other persons)."""


def frames_that_show(time: Array, markers: Array) -> int:
    """How many first frames a run has to see for its noise to be that of the recording: (T,) s, (T, M, 3) m."""
    least = int(np.searchsorted(time, time[0] + SHOWN_S, side="right"))
    if least >= len(time):
        return len(time)
    step = max(int(np.searchsorted(time, time[0] + MOVED_S)), 1)
    way = np.square(markers[step:] - markers[:-step]).sum(axis=2)
    seen = np.isfinite(way)
    moved, count = (np.cumsum(each.sum(axis=1)) for each in (np.where(seen, way, 0.0), seen))
    enough = moved * count[-1] >= MOVES * moved[-1] * count
    enough[: least - step] = False
    return int(np.argmax(enough)) + step + 1  # of all frames it is so


def calibrated_noise(
    tracker: Tracker,
    arrays: dict[str, Array],
    trial: Measurements,
    frames: Flags | None = None,
    *,
    late: bool = False,
    progress: Progress | None = None,
) -> Noise | None:
    """The noise with the scales that a recording asks for; None where too few of its frames are followed.

    One more pass, until somebody was followed for `CALIBRATED_S`, for a floating model, none for one that is fixed in
    the ground.

    Args:
        tracker: of the run. arrays: of that run, as `Tracker.run_arrays` gives them. frames: (T,) to look at; all
            where not given. late: for estimates without any lag. progress: called with (frames done, frames in all).
    """
    chosen: Flags = trial.time >= trial.time[0] + SETTLING_S
    if frames is not None:
        chosen &= frames
    noise = tracker.noise
    ratio = nis_per_row(arrays, chosen)
    if ratio is None or not _mostly_followed(arrays, chosen):
        return None
    first = int(np.argmax(followed(arrays, len(trial.time))))
    end = int(np.searchsorted(trial.time, trial.time[first] + CALIBRATED_S, side="right"))
    groups, before = joint_groups(tracker.calibrated), nis_per_row(arrays, chosen[:end])
    if not groups or before is None or not _mostly_followed(arrays, chosen[:end]):
        return _believed(_scaled(noise, ratio), noise, late)
    scaled = _scaled(noise, ratio, jerk_ratios(tracker, arrays, trial.time, chosen, groups))
    try:
        again = tracker.changed(scaled).run_arrays(trial.first(end), progress, state_only=True)
    except DivergenceError:  # with other jerk: the factor alone leaves the movement as it is
        return _believed(_scaled(noise, ratio), noise, late)
    after = nis_per_row(again, chosen[:end])
    found = _scaled(noise, ratio) if after is None else _scaled(scaled, after * ratio / before)
    return _believed(found, noise, late)


def nis_per_row(arrays: dict[str, Array], chosen: Flags) -> float | None:
    """Normalised innovation squared over the measured rows of the chosen frames (K,), the first of those of the run;
    None where they are too few."""
    end = len(chosen)
    nis, rows = arrays["nis"][:end], arrays["n_rows"][:end]
    used = chosen & np.isfinite(nis) & (rows > 0) & followed(arrays, end)
    total = float(nis[used].sum() / rows[used].sum()) if used.sum() >= LEAST_FRAMES else 0.0
    return total if total > 0.0 else None


def followed(arrays: dict[str, Array], end: int) -> Flags:
    """(end,) of the first frames those that the filter followed, without refusing so many markers that the frame counts
    as lost (`results.measures.tracking`): of limbs that are astray it says nothing."""
    verdicts = arrays["verdicts"][:end, :-1]
    refused, measured = (verdicts == REFUSED).sum(axis=1), (verdicts > 0).sum(axis=1)
    return np.asarray((arrays["tracking"][:end] == FOLLOWING) & (refused <= ANY_ASTRAY * measured))


def _mostly_followed(arrays: dict[str, Array], chosen: Flags) -> bool:
    """Of the chosen frames with markers."""
    seen = chosen & (arrays["verdicts"][: len(chosen), :-1] > 0).any(axis=1)
    return bool(followed(arrays, len(chosen))[seen].sum() >= LEAST_SHARE * seen.sum())


def jerk_ratios(
    tracker: Tracker, arrays: dict[str, Array], time: Array, chosen: Flags, groups: dict[str, JointGroup]
) -> dict[JointGroup, float]:
    """By group: how much accelerations change from frame to frame, squared, over what the filter expects of it.

    A prediction keeps accelerations, so their change is what an update moved them by; its variance is what the update
    took off theirs. Where the noise is right the ratio is one.
    """
    layout = tracker.core_model.layout
    density, _ = continuous_noise(tracker.calibrated, tracker.noise, layout)
    offset, size = layout.blocks["accelerations"]
    block = slice(offset, offset + size)
    names = [groups.get(name.removesuffix("/acceleration")) for name in layout.names[block]]
    value, variance = arrays["state"][: len(time), block], arrays["state_sd"][: len(time), block] ** 2
    change = np.diff(value, axis=0) ** 2
    expected = variance[:-1] + density[block] * np.diff(time)[:, None] - variance[1:]
    following = followed(arrays, len(time))
    used = chosen[1:] & following[1:] & following[:-1]
    change, expected = change[used].sum(axis=0), expected[used].sum(axis=0)
    found: dict[JointGroup, float] = {}
    for group in sorted({name for name in names if name is not None}):
        own = [k for k, name in enumerate(names) if name == group and expected[k] > 0.0 and change[k] > 0.0]
        if own:
            found[group] = float(np.mean(change[own] / expected[own]))
    return found


def _scaled(noise: Noise, ratio: float, jerk: dict[JointGroup, float] | None = None) -> Noise:
    """The noise with this factor on all of it, and the jerk's scales moved towards what groups ask for in addition."""
    scales = dict(noise.jerk_scale)
    for group, wanted in (jerk or {}).items():
        scales[group] = scales.get(group, 1.0) * (wanted / ratio) ** JERK_SHARE.get(group, OTHER_JERK_SHARE)
    return noise.changed(variance_scale=ratio * noise.variance_scale, jerk_scale=scales)


def _believed(found: Noise, declared: Noise, late: bool) -> Noise:
    """What is believed of the factor that was found."""
    if not late:
        return found
    factor = (found.variance_scale / declared.variance_scale) ** LATE_SHARE
    return found.changed(variance_scale=factor * declared.variance_scale)
