"""Where the filter lost the person: frames whose numbers are no estimate, and trials that have too many of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from dynakin.arrays import Array, Flags, rms, runs
from dynakin.errors import LostError
from dynakin.messages import about, warning, warnings_of
from dynakin.recordings.times import spans
from dynakin.results.estimate import AXES, Estimate, values_of
from dynakin.results.measures.soft_tissue import marker_sites, state_paths
from dynakin.results.measures.sources import ABSENT
from dynakin.results.naming import listed, sentence
from dynakin.results.records import NO_ESTIMATE_CODES, REFUSED, Tracking

ASTRAY_M = 0.060
"""A marker further than this from its place on the bone is astray: skin moves by 40 mm at most, and a start posture
that fits no better is refused. On good recordings nine markers of ten stay within 24 mm."""
COMMON_M = 0.040
"""All places of a segment may move together by so much: the joints' angles and centres move with them, so the fit stays
as it is (30 mm in sitting down and standing up with `sagittal7`, markers within 5 mm). More is a wrong posture."""
USED_ASTRAY = 0.10
"""Part of the markers that the filter believed although they are astray: then the posture is wrong, not a marker."""
ANY_ASTRAY = 0.34
"""The same with those that it refused: a fault of cameras (two pairs swapped, one flown off) stays below a third."""
LIMB_S = 0.5
"""All of a segment's markers (two at least) refused for so long: that limb is lost. Markers that are swapped or fly off
come back sooner, or do not take a whole segment."""
BRIDGED_S = 0.1
"""Good frames between lost ones for less than this are chance."""
MOST_LOST = 0.10
"""Part of the measured frames from which on the whole trial is lost: lengths and inertia come from them too."""

_KEPT = ("_measured", "_covariance")
_RECORD = {"state", "state_sd", "foot_contact", "verdict", "tracking", "constrained", "lost"}
_RECORD |= {"constraints_met", "step_us"}
_SOURCES = {"moment_source", "joint_source", "foot_source"}


def tracking_of(estimate: Estimate) -> Tracking:
    """Judge each frame of an estimate by all its markers, those that the filter refused too.

    The posterior distance alone does not show it: displaced skin takes up what a wrong posture leaves (an arm that
    hangs where it is raised: 300 mm of skin).
    """
    data, axes = estimate.data, estimate.modelled_axes()
    gaps = (data["markers_measured"] - data["markers_estimated"]).transpose("time", "marker", "axis").values
    distance = np.linalg.norm(gaps[:, :, axes], axis=2) + _skin(estimate)
    seen = np.isfinite(values_of(data, "markers_measured")[:, :, axes]).all(axis=2)
    count = seen.shape[1]
    verdict = values_of(data, "verdict")[:, :count] if "verdict" in data else np.ones_like(seen)
    refused = (verdict == REFUSED) & seen
    astray = seen & ~(distance <= ASTRAY_M)
    n = np.maximum(seen.sum(axis=1), 1)
    lost = ((astray & ~refused).sum(axis=1) > np.maximum(USED_ASTRAY * n, 1.0)) | (astray.sum(axis=1) > ANY_ASTRAY * n)
    lost |= _limb_lost(estimate, seen, refused)
    if "tracking" in data:
        lost |= np.isin(data["tracking"].values, NO_ESTIMATE_CODES)
    return Tracking(_bridged(lost, estimate.time), seen.any(axis=1), np.where(seen, distance, np.nan), refused)


def without_lost(estimate: Estimate) -> Estimate:
    """The estimate with the flag ``lost`` (time,) in its data, NaN for all that was estimated in these frames, and a
    warning that names them. ``state`` keeps what the filter held."""
    found = tracking_of(estimate)
    data = estimate.data.assign(lost=("time", found.lost))
    if found.lost.any():
        for name, variable in data.data_vars.items():
            text = str(name)
            if "time" not in variable.dims or text in _RECORD or text.endswith(_KEPT):
                continue
            empty = ABSENT if text in _SOURCES else 0 if variable.dtype.kind in "iu" else np.nan
            data[name] = variable.where(~data["lost"], empty).astype(variable.dtype)
    messages = list(estimate.messages)
    if found.lost.any():
        whole = " The trial as a whole is no estimate." if lost_share(found) > MOST_LOST else ""
        messages.append(warning("lost", f"{in_words(estimate, found)}{whole}"))
    return replace(estimate, data=data, messages=messages, tracking=found)


def lost_share(found: Tracking) -> float:
    """Part of the frames with markers in which the person was lost."""
    return float(np.sum(found.lost & found.measured) / max(int(found.measured.sum()), 1))


def in_words(estimate: Estimate, found: Tracking) -> str:
    """Which frames are lost, when, by what it shows, and by which markers."""
    time = estimate.time
    astray = found.lost & found.measured
    parts = [
        f"{int(found.lost.sum())} of {len(time)} frames are no estimate and left empty "
        f"({spans(time, runs(found.lost), 4)})"
    ]
    if astray.any():
        far = found.distance_m[astray]
        middle = np.nanmedian(np.nanmax(far, axis=1))
        parts.append(
            f"there markers lie up to {1000.0 * middle:.0f} mm from where the bones carry them, "
            f"{100.0 * np.mean(np.nansum(far > ASTRAY_M, axis=1) / np.isfinite(far).sum(axis=1)):.0f} % of them more "
            f"than {1000.0 * ASTRAY_M:.0f} mm, or are refused{_mostly(estimate, found, astray)}"
        )
    if (found.lost & ~found.measured).any():
        parts.append("or no marker was seen")
    return f"the person was lost: {'; '.join(parts)}."


def _mostly(estimate: Estimate, found: Tracking, frames: Flags) -> str:
    """The markers that are astray or refused in half of these frames and more, the most often first; nothing where
    they are more than a third of all, which names nobody."""
    off = ((found.distance_m > ASTRAY_M) | found.refused)[frames].mean(axis=0)
    names = [estimate.marker_names[k] for k in np.argsort(-off, kind="stable") if off[k] >= 0.5]
    return f", in most of these frames {listed(names, 4)}" if 0 < len(names) <= ANY_ASTRAY * len(off) else ""


def lost_in_words(estimate: Estimate) -> str:
    """`in_words` of an estimate; empty where nobody was lost."""
    found = estimate.tracking
    return in_words(estimate, found) if found is not None and found.lost.any() else ""


def why_lost(estimate: Estimate) -> str | None:
    """Why a trial as a whole is no estimate, in one clause; None where it is one."""
    found = estimate.tracking
    if found is None:
        return None
    share = lost_share(found)
    if share <= MOST_LOST:
        return None
    return (
        f"{in_words(estimate, found)[:-1]}. That is {100.0 * share:.0f} % of the frames with markers, expected "
        f"{100.0 * MOST_LOST:.0f} % at most"
    )


def refuse_lost(estimate: Estimate, keep: str | None = None) -> None:
    """
    Args:
        keep: what the caller is asked with to save the good frames all the same; None: it cannot be asked.

    Raises:
        LostError: the trial as a whole is no estimate.
    """
    reason, found = why_lost(estimate), estimate.tracking
    if reason is not None and found is not None:
        where = estimate.recording.path or estimate.recording.name
        good = bool((found.measured & ~found.lost).any())
        hint = f" ({keep} saves the frames that are good)" if keep and good else ""
        doubted = [message.text for message in warnings_of(about(estimate.messages, "calibration", "labels"))]
        look = "Look whether labels are swapped, or the person bends a joint that this model does not have"
        if doubted:  # often the cause
            look = f"What was doubted before: {' '.join(doubted)}"
        raise LostError(f"{where}: {reason}; {'' if good else 'no frame is good, '}nothing is saved{hint}. {look}")


def tracking_figures(estimate: Estimate) -> dict[str, Any] | None:
    """The block ``tracking`` of ``metrics.json``; None for an estimate that was not judged."""
    found = estimate.tracking
    if found is None:
        return None
    seen = np.isfinite(found.distance_m)
    distance_m = rms(found.distance_m[found.measured], axis=1)
    refused = found.refused.sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    return {
        "what": "distance of all measured markers from where the bones carry them (RMS over markers, skin in it), mm; "
        "part of the markers refused; frames that are no estimate",
        "lost_frames": int(found.lost.sum()),
        "lost_share": lost_share(found),
        "trial_lost": why_lost(estimate) is not None,
        "unmeasured_frames": int(np.sum(~found.measured)),
        "distance_median_mm": float(1000.0 * np.median(distance_m)) if len(distance_m) else None,
        "distance_largest_mm": float(1000.0 * np.max(distance_m)) if len(distance_m) else None,
        "refused_largest_share": float(refused.max()),
        "verdict": sentence(in_words(estimate, found)) if found.lost.any() else "",
    }


def _skin(estimate: Estimate) -> Array:
    """(T, M) m by which each marker lies off the place on its segment that it started with: skin's displacement, and
    what the place itself has moved by against those of its segment, which takes up a wrong posture as well. Of what
    all places of a segment move by together (a gauge with the joints' angles), only what exceeds `COMMON_M` counts.
    """
    skin, places = (state_paths(estimate, block) for block in ("soft_tissue", "marker"))
    start = {p.name: p.initial for p in estimate.parameters if p.kind == "marker"}
    size = (len(estimate.time), len(estimate.marker_names), len(AXES))
    moved, shift = np.zeros(size), np.zeros(size)
    for k, (_, site) in enumerate(marker_sites(estimate)):
        for i, axis in enumerate(AXES):
            moved[:, k, i] = skin.get(site, {}).get(axis, 0.0)
            if axis in places.get(site, {}):
                shift[:, k, i] = places[site][axis] - start.get(f"marker/{site}/{axis}", np.nan)
    for columns in _worn(estimate).values():
        common = shift[:, columns].mean(axis=1, keepdims=True)
        length = np.linalg.norm(common, axis=2, keepdims=True)
        shift[:, columns] -= common * np.minimum(1.0, COMMON_M / np.maximum(length, COMMON_M))
    return np.asarray(np.linalg.norm(moved + shift, axis=2))


def _worn(estimate: Estimate) -> dict[str, list[int]]:
    """Columns of the markers on each segment that wears two at least."""
    segments = estimate.marker_segments
    worn: dict[str, list[int]] = {}
    for k, (_, site) in enumerate(marker_sites(estimate)):
        if site in segments:
            worn.setdefault(segments[site], []).append(k)
    return {segment: columns for segment, columns in worn.items() if len(columns) > 1}


def _limb_lost(estimate: Estimate, seen: Flags, refused: Flags) -> Flags:
    """(T,) frames in which some segment's markers are all refused, for `LIMB_S` on end."""
    found = np.zeros(len(estimate.time), dtype=bool)
    for columns in _worn(estimate).values():
        none_used = (refused[:, columns] == seen[:, columns]).all(axis=1) & (seen[:, columns].sum(axis=1) > 1)
        for first, end in runs(none_used):
            if estimate.time[end - 1] - estimate.time[first] >= LIMB_S:
                found[first:end] = True
    return found


def _bridged(lost: Flags, time: Array) -> Flags:
    bridged = lost.copy()
    for first, end in runs(~lost):
        if first > 0 and end < len(time) and time[end] - time[first - 1] < BRIDGED_S:
            bridged[first:end] = True
    return bridged
