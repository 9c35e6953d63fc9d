"""Where each moment comes from: the plates, the motion, a prior, or nowhere; and nowhere means no number."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from dynakin.arrays import Codes, Flags
from dynakin.bindings import _core
from dynakin.filter.contacts import ContactLoads
from dynakin.filter.sight import owners_of
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
from dynakin.tree import Tree

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class ContactSources:
    """Where a model's loads come from by its contacts: one rule, of a live step, of `Prepared` and of an estimate.

    Attributes:
        tree: of the model's J segments.
        moved: (C,) number of the segment of the first joint that each coordinate moves.
        soles: segments on which the ground acts. unmarked: those of them that no marker shows: what they carry is
            absent, with all that lies before it.
        held: (C,) coordinates that no marker shows, of which nothing is known.
        owners: (M,) segments of the markers.
    """

    tree: Tree
    moved: Sequence[int]
    soles: Collection[str]
    unmarked: Collection[str]
    held: Flags
    owners: Sequence[str]

    @staticmethod
    def of(initial: CalibratedModel) -> ContactSources:
        """Those of a calibrated model."""
        spec = initial.spec
        tree = Tree.of(spec.segments)
        segments = list(tree.parents)
        return ContactSources(
            tree,
            [segments.index(name) for name in moved_segments(spec)],
            list(initial.feet.values()),
            list(initial.unmarked_feet.values()),
            np.array([c.name in initial.held for c in spec.coordinates], dtype=bool),
            owners_of(spec),
        )

    @cached_property
    def _legs(self) -> Flags:
        return _below_the_thighs(self.soles, self.tree)

    @cached_property
    def _trunk_and_arms(self) -> Flags:
        return _over_the_legs(self.soles, self.tree)

    def gone(self, hidden: Hidden, frames: int) -> Flags:
        """(T, J) joints of a segment that lies nobody knows how (`hidden_segments`); segments that never have markers
        are passed over."""
        gone = np.zeros((frames, len(self.tree.parents)), dtype=bool)
        if not any(own.any() for own in hidden.values()):
            return gone
        for k, (name, parent) in enumerate(self.tree.parents.items()):
            if ends := [name] if name in hidden else self.tree.next_below(name, hidden):
                gone[:, k] = np.logical_and.reduce([hidden[end] for end in ends])
            if above := self.tree.nearest(parent, hidden):
                gone[:, k] |= hidden[above]
        return gone

    def unseen(self, hidden: Hidden, frames: int) -> Flags:
        """(T, C) coordinates of such joints: nothing is known of them."""
        return self.gone(hidden, frames)[:, self.moved]

    def joints(
        self,
        feet: ContactLoads | None,
        undeclared: Flags,
        refused: Flags,
        *,
        gone: Flags | None = None,
        impossible: Flags | None = None,
        carried: bool = False,
    ) -> tuple[Codes, Codes]:
        """Codes of the contacts' forces (T, F) and of the joints' loads (T, J).

        A load is as good as the worst of the contacts behind its joint (`contact_sources`). Where something undeclared
        bears the person, it may touch any segment but those between the feet and the thighs, and a foot on no plate:
        what lies there, or has such a foot behind it, is absent. Where the plates were refused nothing that stands on
        them is measured: it is derived. A model that stands on its root has the plates' sum behind every joint:
        without it, too, all is derived, or absent where undeclared.

        Args:
            feet: contacts (T, F) and the segments on which they act; None of a model that stands on its root, whose
                only contact the plates' sum is, and where nobody knows what bears one on feet.
            undeclared: (T,) frames in which something bears the person that no plate measures.
            refused: (T,) frames whose plates were refused; without ``feet`` also those without their sum.
            gone: (T, J) joints of which nothing is known, as of `gone`.
            impossible: (T,) frames whose derived forces are none that the ground gives: these are absent.
            carried: whether the hands carry what the model does not have: what bears it (arms and back) is absent.
        """
        if feet is None:
            contacts = np.where(refused, DERIVED, MEASURED).astype(np.uint8)[:, None]
            joints = np.tile(contacts, (1, len(self.tree.parents)))
            joints[undeclared] = ABSENT
            on_feet = _flags(self.tree.up(*self.soles), self.tree) | self._legs
            joints[:, on_feet] = ABSENT  # nobody knows what bears a model on feet
        else:
            contacts = contact_sources(feet.contact, undeclared)
            contacts[refused[:, None] & (feet.contact == ON_PLATE)] = DERIVED
            contacts[:, [segment in self.unmarked for segment in feet.segments]] = ABSENT
            if impossible is not None:
                contacts[impossible[:, None] & (contacts != MEASURED)] = ABSENT
            joints = _behind(contacts, feet.segments, self.tree)
            joints[np.ix_(undeclared, ~self._legs)] = ABSENT
            joints[_beyond(feet, self.soles, self.tree)] = ABSENT
        if gone is not None:
            joints[gone] = ABSENT
        if carried:
            joints[:, self._trunk_and_arms] = ABSENT
        return contacts, joints

    def moments(self, feet: ContactLoads | None, *, refused: bool = False, carried: bool = False) -> Codes:
        """(T, C) codes of the moments by the contacts. Without them one row: of a model that stands on its root
        measured, as far as anybody knows; of one on feet legs and root are absent, since nobody knows what bears them.

        Args:
            refused: what the plates say was. carried: as of `joints`.
        """
        undeclared = np.zeros(1, dtype=bool) if feet is None else feet.undeclared
        _, joints = self.joints(feet, undeclared, np.full(len(undeclared), refused), carried=carried)
        return np.where(self.held, ABSENT, joints[:, self.moved]).astype(np.uint8)


def with_sources(
    data: xr.Dataset,
    known: ContactSources,
    feet: ContactLoads | None,
    undeclared: Flags,
    hidden: Hidden | None = None,
    impossible: Flags | None = None,
    carried: bool = False,
) -> xr.Dataset:
    """The dataset of an estimate with ``foot_source``, ``moment_source`` and ``joint_source``, and NaN where absent.

    Args:
        data: with, of floating models, the core's ``moment_source``.
        known: of the model whose labels the dataset has.
        hidden: as of `hidden_segments`: while nobody knows how a segment lies, moments of its joints are absent and
            nothing is known of their angles, nor of where its markers are.
        feet, undeclared, impossible, carried: as of `ContactSources.joints`.
    """
    import xarray as xr  # as in `assemble`

    found: dict[str, Any] = {}
    blind, refused = np.isnan(values_of(data, "wrench_measured")).all(axis=1), refused_for_long(data)
    gone = known.gone(hidden or {}, len(blind))
    behind = refused if feet is not None else blind | refused
    contacts, joints = known.joints(feet, undeclared, behind, gone=gone, impossible=impossible, carried=carried)
    moments = joints[:, known.moved]
    if feet is not None:
        if impossible is not None:
            believed = xr.DataArray(~(impossible & blind), dims="time")
            found |= {name: data[name].where(believed) for name in ("wrench_estimated", "wrench_sd") if name in data}
        there = xr.DataArray(contacts != ABSENT, dims=("time", "foot"))
        found["foot_source"] = (("time", "foot"), contacts)
        found |= {name: data[name].where(there) for name in ("foot_wrench", "foot_wrench_sd") if name in data}
        worse = refused[:, None] | (moments == ABSENT)  # than the core knows
        moments = np.maximum(values_of(data, "moment_source"), np.where(worse, moments, MEASURED))
    moments[:, known.held] = ABSENT
    found["moment_source"] = (("time", "coordinate"), moments.astype(np.uint8))
    found["joint_source"] = (("time", "joint"), joints)
    seen = xr.DataArray(~known.held & ~gone[:, known.moved], dims=("time", "coordinate"))
    for name in ("coordinates_sd", "speeds_sd", "accelerations_sd"):
        if name in data:
            found[name] = data[name].where(seen)  # held where nobody sees it is not known for sure
    if "markers_sd" in data and hidden:
        lost = np.stack([hidden[name] for name in known.owners], axis=1)
        found["markers_sd"] = data["markers_sd"].where(xr.DataArray(~lost, dims=("time", "marker")))
    for name in ("moments", "moments_sd"):
        found[name] = data[name].where(xr.DataArray(moments != ABSENT, dims=("time", "coordinate")))
    found["joint_loads"] = data["joint_loads"].where(xr.DataArray(joints != ABSENT, dims=("time", "joint")))
    return data.assign(found)  # all at once: each time takes 10 ms


def moved_segments(spec: _core.ModelSpec) -> list[str]:
    """Segment of the first joint that each coordinate moves."""
    first: dict[str, str] = {}
    for segment in spec.segments:
        for axis in segment.axes:
            first.setdefault(axis.coordinate, segment.name)
    return [first[c.name] for c in spec.coordinates]


def _flags(names: Collection[str], tree: Tree) -> Flags:
    return np.array([name in names for name in tree.parents], dtype=bool)


def _behind(contacts: Codes, at: Sequence[str], tree: Tree) -> Codes:
    """(T, J) codes of the joints' loads: the worst of the contacts' (T, C) that lie behind each."""
    joints = np.zeros((len(contacts), len(tree.parents)), dtype=np.uint8)
    for k, segment in enumerate(at):
        on = _flags(tree.up(segment), tree)
        joints[:, on] = np.maximum(joints[:, on], contacts[:, k, None])
    return joints


def _beyond(feet: ContactLoads, soles: Collection[str], tree: Tree) -> Flags:
    """(T, J) joints that hang on a foot (toes) while it bears load: how much of it lies beyond them nobody measures."""
    found = np.zeros((len(feet.contact), len(tree.parents)), dtype=bool)
    bears = {name: feet.contact[:, k] != NO_CONTACT for k, name in enumerate(feet.segments) if name in soles}
    for name, loaded in bears.items():
        found |= np.outer(loaded, _flags(tree.below(name), tree))
    return found


def _over_the_legs(soles: Collection[str], tree: Tree) -> Flags:
    """(J,) segments of the trunk and the arms: all but the root and those of a leg."""
    return ~_flags([*tree.roots, *tree.up(*soles), *tree.below(*soles)], tree)


def _below_the_thighs(soles: Collection[str], tree: Tree) -> Flags:
    """(J,) segments between a foot (included, with what hangs on it) and the thigh, which hangs on the root."""
    legs = [name for name in tree.up(*soles) if len(tree.up(name)) > 2]
    return _flags([*legs, *tree.below(*(name for name in soles if name in legs))], tree)
