"""Where each moment comes from: the plates, the motion, or nowhere; and nowhere means no number."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import numpy.typing as npt
import xarray as xr

from dynakin.filter.contacts import ContactLoads
from dynakin.recordings.feet.contact import SHARED_PLATE, UNMEASURED
from dynakin.results.measures.sources import ABSENT, DERIVED, MEASURED, PRIOR

Flags = npt.NDArray[np.bool_]
Codes = npt.NDArray[np.uint8]


def with_sources(
    data: xr.Dataset, feet: ContactLoads | None, undeclared: Flags, soles: Collection[str] = ()
) -> xr.Dataset:
    """The dataset of an estimate with ``moment_source`` and ``joint_source``, and NaN where a source is unknown.

    A load that depends on one unmeasured contact is derived from the motion, on several it is not known. Where
    something undeclared bears the person, it may touch any segment but those between the plates and the thighs. A model
    that stands on its root has the plates' sum behind every joint: without it all is derived, or unknown where
    undeclared.

    Args:
        data: with the joints' tree and, of floating models, the core's ``moment_source``.
        feet: contacts (T, F) and the segments on which they act; None of a model that stands on its root.
        undeclared: (T,) frames in which something bears the person that no plate measures.
        soles: segments on which the ground acts.
    """
    segments = [str(name) for name in data["joint_segment"].values]
    parents = data["joint_parent"].values
    moved = [segments.index(str(name)) for name in data["coordinate_segment"].values]
    if feet is None:
        blind = np.isnan(data["wrench_measured"].transpose("time", "component").values).all(axis=1)
        joints = np.tile(np.where(blind, DERIVED, MEASURED)[:, None], (1, len(segments)))
        moments = np.tile(np.where(blind, DERIVED, MEASURED)[:, None], (1, len(moved)))
        legs = np.zeros(len(segments), dtype=bool)
    else:
        at = [segments.index(name) for name in feet.segments]
        joints = _behind(feet.contact, at, parents)
        moments = data["moment_source"].transpose("time", "coordinate").values.copy()
        legs = _below_the_thighs([segments.index(name) for name in soles], parents)
    joints[np.ix_(undeclared, ~legs)] = ABSENT
    if feet is not None:  # a foot on no plate may be what it bears
        joints[undeclared[:, None] & (joints != MEASURED)] = ABSENT
    moments[undeclared[:, None] & (joints[:, moved] == ABSENT)] = ABSENT
    known, held = moments != ABSENT, joints != ABSENT
    found = data.assign(
        moment_source=(("time", "coordinate"), moments.astype(np.uint8)),
        joint_source=(("time", "joint"), joints.astype(np.uint8)),
    )
    for name in ("moments", "moments_sd"):
        found[name] = found[name].where(xr.DataArray(known, dims=("time", "coordinate")))
    found["joint_loads"] = found["joint_loads"].where(xr.DataArray(held, dims=("time", "joint")))
    return found


def _behind(contact: Codes, at: list[int], parents: npt.NDArray[np.int_]) -> Codes:
    """(T, J) codes of the joints' loads by the unmeasured contacts (T, F) that lie behind each."""
    lacks = contact == UNMEASURED
    code = np.where(lacks, np.where(lacks.sum(axis=1) > 1, PRIOR, DERIVED)[:, None], MEASURED)
    code = np.where(contact == SHARED_PLATE, PRIOR, code)
    joints = np.zeros((len(contact), len(parents)), dtype=np.uint8)
    for k, segment in enumerate(at):
        while segment >= 0:
            joints[:, segment] = np.maximum(joints[:, segment], code[:, k])
            segment = int(parents[segment])
    return joints


def _below_the_thighs(at: list[int], parents: npt.NDArray[np.int_]) -> Flags:
    """(J,) segments between a foot (included, with what hangs on it) and the thigh, which hangs on the root."""
    found = np.zeros(len(parents), dtype=bool)
    for segment in at:
        while segment >= 0 and parents[segment] >= 0:
            found[segment] = parents[parents[segment]] >= 0
            segment = int(parents[segment])
    for k, parent in enumerate(parents):  # parents stand before their children
        found[k] |= parent in at and found[parent]
    return found
