"""The feet's wrenches in figures: how far they were changed, and what no foot accounts for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Codes, rms, wrench_about
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, UNMEASURED
from dynakin.recordings.times import at_the_ends
from dynakin.results.estimate import Estimate, values_of
from dynakin.results.measures import sources
from dynakin.results.naming import plural
from dynakin.units import COMPONENTS, GRAVITY_M_S2

if TYPE_CHECKING:
    import xarray as xr

ROUNDING = 1.0
"""N or N m at the root up to which nothing is left there."""
FLIGHT = 0.05
"""Part of the weight up to which what is left in flight is an error of the motion; more carries the person."""


def foot_sources(data: xr.Dataset) -> Codes:
    """(T, F) codes of `results.measures.sources` of the feet's wrenches; in the air they are known to be zero."""
    known = np.isfinite(values_of(data, "foot_wrench")).all(axis=2)
    return np.where(known, values_of(data, "foot_source"), sources.ABSENT).astype(np.uint8)


def foot_figures(estimate: Estimate, window: npt.NDArray[np.bool_]) -> dict[str, Any] | None:
    """Over the frames ``window``; None where the moments were made without the feet's wrenches.

    Returns:
        ``adjustment_rms``: by foot and component, N and N m about the joint by which the foot hangs, over the frames
        in which all contacts are measured and this one alone is; ``remainder_rms``, about the ground's origin, over the
        ``flight_frames``, in which nothing touches the ground; ``derived_frames``, ``prior_frames`` and
        ``unknown_frames``: those in which a foot's wrench is derived, a prior, or not known; ``left_at_root``: the
        largest force (N) and moment about the root (N m) that no contact gives, ``grounded`` where all contacts are
        measured (each, or the sum of two; not where the plates were refused; there with its largest ``share`` of what
        they give, or of the weight where that is more; not `at_the_ends`, where accelerations are a guess) and in
        ``flight``; ``verdict``.
    """
    if not estimate.foot_names or "foot_wrench" not in estimate.data:
        return None
    contact = estimate.values("foot_contact")[window]
    adjusted = estimate.values("foot_adjustment")[window]
    adjusted = wrench_about(adjusted, _joints(estimate)[window])
    remainder = estimate.values("wrench_remainder")[window]
    codes = foot_sources(estimate.data)[window]
    given = np.isfinite(remainder).all(axis=1)
    flight = (contact == NO_CONTACT).all(axis=1) & given
    grounded = (contact != UNMEASURED).all(axis=1) & (contact != NO_CONTACT).any(axis=1) & given
    grounded &= _nothing_else_bears(estimate)[window] & ~sources.plates_refused(estimate.data)[window]
    inner = ~at_the_ends(estimate.time)[window]
    known = (contact == ON_PLATE) & grounded[:, None] & np.isfinite(adjusted).all(axis=2)  # not where it is lost
    adjustment = {
        name: _rms(COMPONENTS, adjusted[known[:, k], k]) if known[:, k].any() else None
        for k, name in enumerate(estimate.foot_names)
    }
    about_root = wrench_about(remainder, _root(estimate)[window])
    weight = GRAVITY_M_S2 * (estimate.mass_kg or 0.0)
    borne = np.linalg.norm(estimate.values("foot_wrench")[window, :, :3].sum(axis=1), axis=1)
    least = np.fmax(borne, weight or np.nan)
    judged = grounded & inner
    left = {"grounded": _largest(about_root[judged], least[judged]), "flight": _largest(about_root[flight])}
    figures = {
        "adjustment_rms": adjustment,
        "remainder_rms": _rms(COMPONENTS, remainder[flight]) if flight.any() else None,
        "flight_frames": int(flight.sum()),
        "derived_frames": int((codes == sources.DERIVED).any(axis=1).sum()),
        "prior_frames": int((codes == sources.PRIOR).any(axis=1).sum()),
        "unknown_frames": int((codes == sources.ABSENT).any(axis=1).sum()),
        "left_at_root": left,
    }
    frames = (int(judged.sum()), int(grounded.sum()), len(contact))
    return figures | {"verdict": _words(figures, frames, FLIGHT * weight)}


def contact_figures(estimate: Estimate) -> dict[str, Any]:
    """Of each declared contact, over all frames, as `moment_figures`; empty where none was declared.

    Returns:
        by name: ``frames`` in which it bears, and of these those that are ``measured``, ``derived``, ``prior`` and
        ``absent``; the mean force ``force_n{fx, fy, fz}`` in them, the ``largest_n`` of its size, and ``sd_n{fx, fy,
        fz}``, the RMS of the standard deviations; None where it never bears.
    """
    found: dict[str, Any] = {}
    for name in estimate.contact_names[len(estimate.foot_names) :]:
        own = estimate.data.sel(foot=name)
        bears = own["foot_contact"].values != NO_CONTACT
        codes = foot_sources(estimate.data)[bears, estimate.contact_names.index(name)]
        force, sd = (values_of(own, key)[bears, :3] for key in ("foot_wrench", "foot_wrench_sd"))
        known = np.isfinite(force).all(axis=1)
        counts = {what: int(np.sum(codes == code)) for code, what in enumerate(sources.MEANINGS)}
        axes, some = COMPONENTS[:3], bool(known.any())
        found[name] = {
            "frames": int(bears.sum()),
            **counts,
            "force_n": dict(zip(axes, force[known].mean(axis=0).tolist(), strict=True)) if some else None,
            "largest_n": float(np.linalg.norm(force[known], axis=1).max()) if some else None,
            "sd_n": _rms(axes, sd[known]) if some else None,
        }
    return found


def _joints(estimate: Estimate) -> np.ndarray:
    """(T, F, 3) m: where each foot's segment hangs."""
    segments = [str(name) for name in estimate.data["joint_segment"].values]
    own = [segments.index(str(name)) for name in estimate.data["foot_segment"].values]
    return estimate.values("joint_centres")[:, own]


def _root(estimate: Estimate) -> np.ndarray:
    """(T, 3) m: the joint by which the body hangs on the ground."""
    root = int(np.flatnonzero(estimate.data["joint_parent"].values < 0)[0])
    return estimate.values("joint_centres")[:, root]


def _nothing_else_bears(estimate: Estimate) -> npt.NDArray[np.bool_]:
    """(T,) frames in which no undeclared contact is noticed: feet may stand on plates while a seat bears the rest."""
    data = estimate.data
    if "coordinate_segment" not in data.coords:
        return np.ones(len(estimate.time), dtype=bool)
    roots = data["joint_segment"].values[data["joint_parent"].values < 0]
    own = np.isin(data["coordinate_segment"].values, roots)
    return np.asarray((sources.moment_sources(data)[:, own] != sources.ABSENT).all(axis=1))


def _rms(names: Sequence[str], values: np.ndarray) -> dict[str, float]:
    return dict(zip(names, rms(values, axis=0).tolist(), strict=True))


def _largest(wrench: np.ndarray, least_n: np.ndarray | None = None) -> dict[str, float] | None:
    """Of wrenches (N, 6); None where none is known. With what their forces are compared with (N,) the largest share of
    that, too: a landing of three times the weight is no worse modelled for three times the error."""
    known = np.isfinite(wrench).all(axis=1)
    if not known.any():
        return None
    force, moment = (np.linalg.norm(part, axis=1) for part in (wrench[known, :3], wrench[known, 3:]))
    found = {"force_n": float(force.max()), "moment_nm": float(moment.max())}
    return found if least_n is None else found | {"share": float(np.nanmax(force / least_n[known], initial=0.0))}


def _words(figures: dict[str, Any], counts: tuple[int, int, int], weight_n: float) -> str:
    """What is said goes by the numbers: nothing is left only where nothing is.

    Args:
        counts: frames that are judged, those in which all contacts are measured (at the ends too), and all.
    """
    left, text = figures["left_at_root"], []
    judged, grounded, frames = counts
    if left["grounded"] is None:
        where = "In no frame" if not grounded else "In no frame but those at the recording's ends"
        text.append(f"{where} are all contacts with the ground measured: the residual at the root is not known.")
    else:
        ends = ", those at the ends left out" if judged < grounded else ""
        where = f"in the {judged} of {frames} frames in which every contact with the ground is measured{ends}"
        if max(left["grounded"].values()) <= ROUNDING:
            changed = [
                f"{name} foot {max(own['fx'], own['fy'], own['fz']):.1f} N and "
                f"{max(own['mx'], own['my'], own['mz']):.1f} N m (about its joint)"
                for name, own in figures["adjustment_rms"].items()
                if own is not None
            ]
            most = f", RMS of the component that was changed most: {', '.join(changed)}" if changed else ""
            text.append(f"No residual is left at the root {where}: the plates' wrenches were changed instead{most}.")
        else:
            text.append(
                f"{_up_to(left['grounded'])} of residual are left at the root {where}: no contact accounts for them."
            )
    if left["flight"] is not None:
        flight = plural(figures["flight_frames"], "frame")
        large = left["flight"]["force_n"] > weight_n > 0.0
        text.append(
            f"{_up_to(left['flight'])} of residual are left in flight ({flight} in which no foot touches the ground)"
            + (": the model's error, or a contact that is not measured." if large else ".")
        )
    if count := figures["derived_frames"]:
        text.append(
            f"In {count} of {frames} frames one contact was not measured, or the plates were refused: what depends on "
            "it is derived."
        )
    if count := figures["prior_frames"]:
        text.append(
            f"In {count} of {frames} frames several contacts were not measured each on its own: how they divide the "
            "load is assumed, and what depends on that is a prior."
        )
    if count := figures["unknown_frames"]:
        text.append(f"In {count} of {frames} frames the force on a foot is not known: what depends on it is absent.")
    return " ".join(text)


def _up_to(left: dict[str, float]) -> str:
    return f"Up to {left['force_n']:.0f} N and {left['moment_nm']:.0f} N m"
