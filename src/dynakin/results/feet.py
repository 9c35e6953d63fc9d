"""The feet's wrenches in figures: how far they were changed, and what no foot accounts for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dynakin.results.estimate import COMPONENTS

if TYPE_CHECKING:
    from dynakin.results.estimate import Estimate

IN_THE_AIR, MEASURED, NOT_MEASURED = range(3)
"""Codes of ``foot_contact``: a foot's wrench is zero, is measured, or is not known."""
DERIVED, UNKNOWN = 1, 2
"""Codes of ``moment_source`` beside 0: the only unmeasured contact, or one of several, lies behind that axis."""


def foot_figures(estimate: Estimate, window: npt.NDArray[np.bool_]) -> dict[str, Any] | None:
    """Over the frames ``window``; None where the moments were made without the feet's wrenches.

    Returns:
        ``adjustment_rms``: by foot and component, N and N m about the joint by which the foot hangs, over the frames
        in which all contacts are measured, this one too; ``remainder_rms``, about the ground's origin, over the
        ``flight_frames``, in which nothing touches the ground; ``derived_frames`` and ``unknown_frames``: those in
        which one contact, or more, were not measured; ``verdict``.
    """
    if not estimate.foot_names:
        return None
    contact = estimate.data["foot_contact"].transpose("time", "foot").values[window]
    adjusted = estimate.data["foot_adjustment"].transpose("time", "foot", "component").values[window]
    adjusted = np.concatenate(
        [adjusted[..., :3], adjusted[..., 3:] - np.cross(_joints(estimate)[window], adjusted[..., :3])], axis=-1
    )
    remainder = estimate.data["wrench_remainder"].transpose("time", "component").values[window]
    unmeasured = (contact > MEASURED).sum(axis=1)
    known = (contact == MEASURED) & (unmeasured == 0)[:, None]
    flight = (contact == IN_THE_AIR).all(axis=1)
    rms = {
        name: dict(zip(COMPONENTS, _rms(adjusted[known[:, k], k]), strict=True)) if known[:, k].any() else None
        for k, name in enumerate(estimate.foot_names)
    }
    return {
        "adjustment_rms": rms,
        "remainder_rms": dict(zip(COMPONENTS, _rms(remainder[flight]), strict=True)) if flight.any() else None,
        "flight_frames": int(flight.sum()),
        "derived_frames": int((unmeasured == 1).sum()),
        "unknown_frames": int((unmeasured > 1).sum()),
        "verdict": _words(rms, unmeasured, len(contact)),
    }


def _joints(estimate: Estimate) -> np.ndarray:
    """(T, F, 3) m: where each foot's segment hangs."""
    segments = [str(name) for name in estimate.data["joint_segment"].values]
    own = [segments.index(str(name)) for name in estimate.data["foot_segment"].values]
    return np.asarray(estimate.data["joint_centres"].transpose("time", "joint", "axis").values[:, own])


def _rms(values: np.ndarray) -> list[float]:
    return [float(v) for v in np.sqrt(np.mean(values**2, axis=0))]


def _words(rms: dict[str, dict[str, float] | None], unmeasured: np.ndarray, frames: int) -> str:
    told = [
        f"{name} foot {max(own['fx'], own['fy'], own['fz']):.1f} N and "
        f"{max(own['mx'], own['my'], own['mz']):.1f} N m (about its joint)"
        for name, own in rms.items()
        if own is not None
    ]
    text = "Nothing is left at the root: the plates' wrenches were changed instead"
    text += f", RMS of the component that was changed most: {', '.join(told)}." if told else "."
    if (unmeasured == 1).any():
        text += (
            f" In {int((unmeasured == 1).sum())} of {frames} frames one contact was not measured: what hangs on it "
            "is derived from the motion."
        )
    if (unmeasured > 1).any():
        text += (
            f" In {int((unmeasured > 1).sum())} of {frames} frames several contacts were not measured: the moments "
            "between them are not known."
        )
    return text
