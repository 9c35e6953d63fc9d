"""Where each moment comes from: the plates, the motion, a prior, or nowhere; and nowhere means no number."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.sight import next_marked
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE
from dynakin.results.estimate import values_of
from dynakin.results.measures.sources import (
    ABSENT,
    DERIVED,
    MEASURED,
    Hidden,
    contact_sources,
    refused_for_long,
)

if TYPE_CHECKING:
    import xarray as xr

Flags = npt.NDArray[np.bool_]
Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.uint8]


def with_sources(
    data: xr.Dataset,
    feet: ContactLoads | None,
    undeclared: Flags,
    soles: Collection[str] = (),
    held: Collection[str] = (),
    unmarked: Collection[str] = (),
    hidden: Hidden | None = None,
    owners: Sequence[str] = (),
    impossible: Flags | None = None,
    carried: bool = False,
) -> xr.Dataset:
    """The dataset of an estimate with ``foot_source``, ``moment_source`` and ``joint_source``, and NaN where absent.

    A load is as good as the worst of the contacts behind its joint (`contact_sources`). Where something undeclared
    bears the person, it may touch any segment but those between the feet and the thighs, and a foot on no plate: what
    lies there, or has such a foot behind it, is absent. Where the plates were refused (`refused_for_long`) nothing that
    stands on them is measured: it is derived. A model that stands on its root has the plates' sum behind every joint:
    without it, too, all is derived, or absent where undeclared.

    Args:
        data: with the joints' tree and, of floating models, the core's ``moment_source``.
        feet: contacts (T, F) and the segments on which they act; None of a model that stands on its root.
        undeclared: (T,) frames in which something bears the person that no plate measures.
        soles: segments on which the ground acts. held: coordinates that no marker shows, of which nothing is known.
        unmarked: those of ``soles`` that no marker shows: what they carry is absent, with all that lies before it.
        hidden: as of `hidden_segments`: while nobody knows how a segment lies, moments of its joints (`_gone`) are
            absent and nothing is known of their angles, nor of where its markers are.
        owners: (M,) segments of the markers.
        impossible: (T,) frames whose derived forces are none that the ground gives: these are absent.
        carried: whether the hands carry what the model does not have: what bears it (arms and back) is absent.
    """
    import xarray as xr  # as in `assemble`

    found: dict[str, Any] = {}
    segments = [str(name) for name in data["joint_segment"].values]
    parents = data["joint_parent"].values
    moved = [segments.index(str(name)) for name in data["coordinate_segment"].values]
    blind = np.isnan(values_of(data, "wrench_measured")).all(axis=1)
    refused = refused_for_long(data)
    if feet is None:
        codes = np.where(blind | refused, DERIVED, MEASURED)[:, None]
        joints, moments = np.tile(codes, (1, len(segments))), np.tile(codes, (1, len(moved)))
        legs = np.zeros(len(segments), dtype=bool)
    else:
        contacts = _contacts(feet, undeclared, unmarked, refused)
        if impossible is not None:
            contacts[impossible[:, None] & (contacts != MEASURED)] = ABSENT
            believed = xr.DataArray(~(impossible & blind), dims="time")
            found |= {name: data[name].where(believed) for name in ("wrench_estimated", "wrench_sd") if name in data}
        there = xr.DataArray(contacts != ABSENT, dims=("time", "foot"))
        found["foot_source"] = (("time", "foot"), contacts)
        found |= {name: data[name].where(there) for name in ("foot_wrench", "foot_wrench_sd") if name in data}
        joints = _behind(contacts, [segments.index(name) for name in feet.segments], parents)
        legs = _below_the_thighs([segments.index(name) for name in soles], parents)
        moments = np.maximum(values_of(data, "moment_source"), np.where(refused[:, None], joints[:, moved], MEASURED))
    joints[np.ix_(undeclared, ~legs)] = ABSENT
    if feet is not None:
        joints[_beyond(feet, soles, segments, parents)] = ABSENT
    gone = _gone(hidden or {}, segments, parents, len(joints))
    joints[gone] = ABSENT
    if carried:
        joints[:, _over_the_legs([segments.index(name) for name in soles], parents)] = ABSENT
    moments[joints[:, moved] == ABSENT] = ABSENT
    moments[:, np.isin(data["coordinate"].values, list(held))] = ABSENT
    known, borne = moments != ABSENT, joints != ABSENT
    found["moment_source"] = (("time", "coordinate"), moments.astype(np.uint8))
    found["joint_source"] = (("time", "joint"), joints.astype(np.uint8))
    shown = ~np.isin(data["coordinate"].values, list(held)) & ~gone[:, moved]
    seen = xr.DataArray(shown, dims=("time", "coordinate"))
    for name in ("coordinates_sd", "speeds_sd", "accelerations_sd"):
        if name in data:
            found[name] = data[name].where(seen)  # held where nobody sees it is not known for sure
    if "markers_sd" in data and hidden:
        lost = np.stack([hidden[name] for name in owners], axis=1)
        found["markers_sd"] = data["markers_sd"].where(xr.DataArray(~lost, dims=("time", "marker")))
    for name in ("moments", "moments_sd"):
        found[name] = data[name].where(xr.DataArray(known, dims=("time", "coordinate")))
    found["joint_loads"] = data["joint_loads"].where(xr.DataArray(borne, dims=("time", "joint")))
    return data.assign(found)  # all at once: each time takes 10 ms


def _gone(hidden: Hidden, segments: list[str], parents: npt.NDArray[np.int_], frames: int) -> Flags:
    """(T, J) joints of a segment that lies nobody knows how; segments that never have markers are passed over."""
    gone = np.zeros((frames, len(segments)), dtype=bool)
    if not any(own.any() for own in hidden.values()):
        return gone
    above, beyond = next_marked(parents, [name in hidden for name in segments])
    for k, name in enumerate(segments):
        ends = [k] if name in hidden else beyond[k]
        if ends:
            gone[:, k] = np.logical_and.reduce([hidden[segments[end]] for end in ends])
        if above[k] >= 0:
            gone[:, k] |= hidden[segments[above[k]]]
    return gone


class ContactSources:
    """The same of a model's moments by its contacts alone: what a live step says, and `Prepared` of a recording."""

    def __init__(
        self,
        spec: _core.ModelSpec,
        soles: Collection[str],
        held: Collection[str] = (),
        unmarked: Collection[str] = (),
    ) -> None:
        self._unmarked = unmarked
        self._held = np.array([c.name in held for c in spec.coordinates], dtype=bool)
        self._segments = [segment.name for segment in spec.segments]
        self._parents = np.array([_place(self._segments, segment.parent) for segment in spec.segments])
        self._moved = [self._segments.index(name) for name in moved_segments(spec)]
        self._soles = tuple(soles)
        at = [self._segments.index(name) for name in soles]
        self._feet = at
        self._legs, self._over_the_legs = _below_the_thighs(at, self._parents), _over_the_legs(at, self._parents)

    @classmethod
    def of(cls, initial: CalibratedModel) -> ContactSources:
        """Those of a calibrated model."""
        return cls(initial.spec, initial.feet.values(), initial.held, initial.unmarked_feet.values())

    def unseen(self, hidden: Hidden, frames: int) -> Flags:
        """(T, C) coordinates of joints of which nothing is known, by their segments (`hidden_segments`)."""
        return _gone(hidden, self._segments, self._parents, frames)[:, self._moved]

    def moments(self, feet: ContactLoads | None, *, refused: bool = False, carried: bool = False) -> Codes:
        """(T, C) codes of the moments by the contacts. Without them one row: of a model that stands on its root
        measured, as far as anybody knows; of one on feet legs and root are absent, since nobody knows what bears them.

        Args:
            refused: what the plates say was. carried: as of `with_sources`.
        """
        if feet is None:
            unknown = _behind(np.full((1, len(self._feet)), ABSENT), self._feet, self._parents)
            unknown[:, self._legs] = ABSENT  # toes, too
            return np.where(self._held, ABSENT, unknown[:, self._moved]).astype(np.uint8)
        undeclared = feet.undeclared
        at = [self._segments.index(name) for name in feet.segments]
        contacts = _contacts(feet, undeclared, self._unmarked, np.full(len(undeclared), refused))
        joints = _behind(contacts, at, self._parents)
        joints[np.ix_(undeclared, ~self._legs)] = ABSENT
        joints[_beyond(feet, self._soles, self._segments, self._parents)] = ABSENT
        if carried:
            joints[:, self._over_the_legs] = ABSENT
        return np.where(self._held, ABSENT, joints[:, self._moved]).astype(np.uint8)


def _contacts(feet: ContactLoads, undeclared: Flags, unmarked: Collection[str], refused: Flags) -> Codes:
    """(T, C) codes of the contacts; derived on plates that were refused (T,), absent of a foot that no marker shows."""
    codes = contact_sources(feet.contact, undeclared)
    codes[refused[:, None] & (feet.contact == ON_PLATE)] = DERIVED
    codes[:, [segment in unmarked for segment in feet.segments]] = ABSENT
    return codes


def moved_segments(spec: _core.ModelSpec) -> list[str]:
    """Segment of the first joint that each coordinate moves."""
    first: dict[str, str] = {}
    for segment in spec.segments:
        for axis in segment.axes:
            first.setdefault(axis.coordinate, segment.name)
    return [first[c.name] for c in spec.coordinates]


def _place(names: list[str], name: str) -> int:
    return names.index(name) if name in names else -1


def _behind(contacts: Codes, at: list[int], parents: npt.NDArray[np.int_]) -> Codes:
    """(T, J) codes of the joints' loads: the worst of the contacts' (T, C) that lie behind each."""
    joints = np.zeros((len(contacts), len(parents)), dtype=np.uint8)
    for k, segment in enumerate(at):
        while segment >= 0:
            joints[:, segment] = np.maximum(joints[:, segment], contacts[:, k])
            segment = int(parents[segment])
    return joints


def _beyond(feet: ContactLoads, soles: Collection[str], segments: list[str], parents: npt.NDArray[np.int_]) -> Flags:
    """(T, J) joints that hang on a foot (toes) while it bears load: how much of it lies beyond them nobody measures."""
    found = np.zeros((len(feet.contact), len(parents)), dtype=bool)
    bears = {
        segments.index(name): feet.contact[:, k] != NO_CONTACT for k, name in enumerate(feet.segments) if name in soles
    }
    for k, parent in enumerate(parents):  # parents stand before their children
        if parent >= 0:
            found[:, k] = bears.get(int(parent), found[:, parent])
    return found


def _over_the_legs(at: list[int], parents: npt.NDArray[np.int_]) -> Flags:
    """(J,) segments of the trunk and the arms: all but the root and those of a leg."""
    found = np.asarray(parents >= 0)
    for k, parent in enumerate(parents):  # what hangs on a foot
        found[k] &= not (k in at or parent in at)
    for segment in at:
        while segment >= 0:
            found[segment] = False
            segment = int(parents[segment])
    return found


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
