"""Which foot stands on which plate: the wrench on each foot, and where the total wrench is known at all.

Stances are found from the foot's markers (`foot_contact`). A plate belongs to a stance when its centre of pressure lies
within or near the foot's outline for most of its load. A stance that no plate belongs to is off the plates: as long as
it may bear load, the total external wrench is not known. Floors that are not level (stairs) are not handled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import runs
from dynakin.errors import ConfigError
from dynakin.recordings.feet.contact import DEFAULT_FOOT_MARKERS, FootContact, distance_to_hull, foot_contact
from dynakin.recordings.feet.soles import Soles
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Array, Plate, Recording

Flags = npt.NDArray[np.bool_]

LOADED_N = 20.0
"""Vertical force from which a plate is loaded: its centre of pressure is known to a few cm."""
EMPTY_N = 5.0
"""A plate that carries less is empty: a few times the noise of the usual plates (1 to 3 N)."""
FOREIGN_N = 50.0
"""Load where nobody stands from which it is said, and the total left out."""
NEAR_M = 0.10
"""How far a centre of pressure may lie from the outline of a foot's markers: a shoe is some cm wider than these."""
BETWEEN_M = 0.03
"""How far from both feet a centre of pressure lies that neither bears alone, where a plate's edges are not known."""
BEYOND_M = 0.04
"""How far a touching marker may lie beyond the plates' edges: it sits on the shoe, not on its sole."""
MOST = 0.8
"""Part of a press for which a moving foot must be low and near the centre of pressure to be what presses."""
FLAT_FRAMES = 5
"""A loaded plate that stays at its own extreme to 1e-6 for so many frames is at the end of its range."""

SWING, MEASURED, SHARED, OFF_PLATE, UNKNOWN = range(5)
REASONS = ("swing", "measured", "shared plate", "off the plates", "plate not measured")
"""Words for the numbers in `FootLoads.reason`."""


@dataclass(frozen=True, eq=False)
class FootLoads:
    """The plates' wrenches by foot.

    Attributes:
        feet: names of the F feet, ("right", "left") unless other foot markers were given.
        wrench: (T, F, 6) N and N m, ground on foot, ground frame, about the ground's origin; 0 in swing, NaN where it
            is not known. On a shared plate an estimate: see `reason`.
        reason: (T, F) index into `REASONS`. "shared plate": both feet stand on one plate; its wrench is divided by
            where the centre of pressure lies between them, and the sum is what was measured.
        total_known: (T,) frames in which all that the ground does to the person is measured: the sum over the plates
            is then the total external wrench (in flight: about 0).
        all_measured: (T,) frames in which that holds and no plate is shared: each foot's wrench is a measurement.
        elsewhere: (T,) frames in which something else may bear the person: no plate measures at all, a plate carries
            what no foot puts on it, or (`with_undeclared`) the motion needs what the plates do not have.
        aloft: (T, F) feet that are surely in the air, by their markers alone.
        sole: (T, F, 3) m, middle of each foot's sole at the height of what it stands on, ground frame; NaN where the
            foot is not seen.
        sole_half_m: (F, 2) half the sole's length and half its width.
        bears: (T, F) the foot may bear load, by its markers and what supports it alone.
        stance: (T, F) from 0 at touch-down to 1 and back to 0 at toe-off, smooth.
        messages: sentences with times. reasons: those of them that say why something is not measured.
    """

    feet: tuple[str, ...]
    wrench: Array
    reason: npt.NDArray[np.int8]
    total_known: Flags
    all_measured: Flags
    elsewhere: Flags
    aloft: Flags
    sole: Array
    sole_half_m: Array
    bears: Flags
    stance: Array
    messages: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()

    def with_undeclared(self, frames: Flags) -> FootLoads:
        """The same where something bears the person in these frames (T,) that no plate measures: the total is not
        known there, and a foot that is on no plate, or on one that reads nothing, may be what it bears, unless it is
        surely in the air."""
        reason = self.reason.copy()
        light = (reason == SWING) | (np.nan_to_num(self.wrench[..., 1]) < LOADED_N)
        reason[frames[:, None] & light & (reason <= SHARED) & ~self.aloft] = UNKNOWN
        wrench = np.where((reason == UNKNOWN)[..., None], np.nan, self.wrench)
        return replace(
            self,
            wrench=wrench,
            reason=reason,
            total_known=self.total_known & ~frames,
            all_measured=self.all_measured & ~frames,
            elsewhere=self.elsewhere | frames,
        )

    def without(self, feet: Flags) -> FootLoads:
        """The same where these feet (T, F) may reach beyond their plates: what these measure is not all of them."""
        reason = np.where(feet, np.int8(UNKNOWN), self.reason)
        wrench = np.where(feet[..., None], np.nan, self.wrench)
        known = ~feet.any(axis=1)
        return replace(
            self,
            wrench=wrench,
            reason=reason,
            total_known=self.total_known & known,
            all_measured=self.all_measured & known,
        )


def foot_loads(
    recording: Recording,
    ground: GroundFrame,
    *,
    foot_markers: Mapping[str, Sequence[str]] | None = None,
    assigned: Mapping[str, str] | None = None,
) -> FootLoads:
    """Give each plate's load to the foot that stands on it.

    Args:
        ground: the frame and origin of the wrenches.
        foot_markers: foot -> names of its markers; Plug-in Gait's and OpenCap's where not given.
        assigned: plate -> foot, where the user knows better (the whole recording).

    Raises:
        ConfigError: `assigned` names a plate or foot that there is not.
    """
    # ankles are on the shank: they do not touch the floor
    markers = foot_markers or {
        foot: [name for name in DEFAULT_FOOT_MARKERS[foot] if "an" not in name.casefold()] for foot in ("right", "left")
    }
    feet = tuple(markers)
    fixed = dict(assigned or {})
    _check_assigned(fixed, recording, feet)
    contacts = {
        foot: found
        for foot, names in markers.items()
        if (found := foot_contact(recording, ground, list(names))) is not None
    }
    plates = [PlateLoad.of(plate, ground) for plate in recording.plates]
    work = _Assignment(recording, ground, feet, contacts, plates, fixed)
    return work.loads()


def _check_assigned(fixed: dict[str, str], recording: Recording, feet: tuple[str, ...]) -> None:
    names = [plate.name for plate in recording.plates]
    for plate, foot in fixed.items():
        if plate not in names:
            raise ConfigError(f"plates: {plate!r} is not in {recording.name}; expected one of {', '.join(names)}")
        if foot not in feet:
            raise ConfigError(f"plates: {plate!r} is given to {foot!r}, expected one of {', '.join(feet)}")


@dataclass(frozen=True, eq=False)
class PlateLoad:
    """One plate in the ground frame."""

    name: str
    wrench: Array  # (T, 6)
    cop: Array  # (T, 2) [X, Z]
    loaded: Flags
    known: Flags
    corners: Array | None  # (4, 2)

    @classmethod
    def of(cls, plate: Plate, ground: GroundFrame) -> PlateLoad:
        """The plate, turned to the ground frame."""
        wrench = ground.wrench_to_ground(np.hstack([plate.force, plate.moment]))
        known = np.asarray(np.isfinite(wrench).all(axis=1)) & ~saturated(wrench[:, 1])
        loaded = np.nan_to_num(wrench[:, 1]) > LOADED_N
        corners = None if plate.corners is None else ground.points_to_ground(plate.corners)[:, [0, 2]]
        return cls(plate.name, wrench, ground.points_to_ground(plate.cop)[:, [0, 2]], loaded, known, corners)


def saturated(push: Array) -> Flags:
    """(T,) where a vertical force (T,) N rests at its largest value, as an amplifier at the end of its range does.

    It gets there on a slope and is cut off; a force that is the same all the time (made up) is not.
    """
    found = np.zeros(len(push), dtype=bool)
    if not np.isfinite(push).any() or np.nanmax(push) < FOREIGN_N:
        return found
    top = float(np.nanmax(push))
    with np.errstate(invalid="ignore"):
        at_top: Flags = push > top * (1.0 - 1e-6)
    for first, end in runs(at_top):
        before = push[first - 1] if first > 0 else top
        after = push[end] if end < len(push) else top
        found[first:end] = end - first >= FLAT_FRAMES and min(before, after) < 0.99 * top
    return found


def to_the_end(owners: Flags, pressed: Flags) -> Flags:
    """Owners (T, F) of a plate, each kept from the first to the last frame of a press (T,) that has owners at all.

    A centre of pressure is far off while a foot sets down or leaves; what the plate carries there is still that foot's.
    """
    owners = owners.copy()
    owned: Flags = np.asarray(owners.any(axis=1))
    for first, end in runs(pressed):
        inside = np.flatnonzero(owned[first:end]) + first
        if len(inside):
            owners[first : inside[0]] = owners[inside[0]]
            owners[inside[-1] + 1 : end] = owners[inside[-1]]
    return owners


def divided(
    feet: tuple[str, ...],
    plates: Sequence[PlateLoad],
    outlines: Sequence[Array | None],
    on: Flags,
    off: Flags,
    aloft: Flags,
    soles: Soles,
) -> FootLoads:
    """The plates' wrenches given to the feet that stand on them.

    Args:
        outlines: (T, K, 2) m of each foot's markers; None: the foot has none.
        on: (T, F, P) this foot stands on this plate. off: (T, F) it may stand off the plates. aloft: (T, F) it is
            surely in the air.
    """
    n, F = off.shape
    seen = np.array([outline is not None for outline in outlines], dtype=bool)
    elsewhere = np.full(n, not plates)
    wrench, reason = np.zeros((n, F, 6)), np.full((n, F), SWING, dtype=np.int8)
    total_known = np.full(n, bool(plates))
    for p, plate in enumerate(plates):
        owners = on[:, :, p]
        count = owners.sum(axis=1)
        for k in range(F):
            alone = owners[:, k] & (count == 1)
            wrench[alone, k] += plate.wrench[alone]
            reason[alone, k] = np.maximum(reason[alone, k], MEASURED)
        both = np.flatnonzero(count > 1)
        share = _shares(plate, both, owners, outlines)
        for k in range(F):
            wrench[both, k] += share[:, k]
            of = both[owners[both, k]]
            reason[of, k] = np.maximum(reason[of, k], SHARED)
        total_known &= plate.known
        reason[~plate.known[:, None] & owners] = UNKNOWN
        nobodys = (count == 0) & (np.nan_to_num(plate.wrench[:, 1]) > FOREIGN_N)
        elsewhere |= nobodys & seen.all()
        reason[nobodys[:, None] & ~seen & (reason == SWING)] = UNKNOWN  # a foot that nobody sees may be on it
    total_known &= ~elsewhere
    reason[off] = OFF_PLATE
    total_known &= ~off.any(axis=1)
    wrench[(reason == OFF_PLATE) | (reason == UNKNOWN)] = np.nan
    all_measured = total_known & (reason != SHARED).all(axis=1)
    loads = FootLoads(
        feet,
        wrench,
        reason,
        total_known,
        all_measured,
        np.zeros(n, dtype=bool),
        aloft,
        soles.middle,
        soles.half_m,
        soles.bears,
        soles.stance,
    )
    return loads.with_undeclared(elsewhere)


def _shares(plate: PlateLoad, frames: npt.NDArray[np.intp], owners: Flags, outlines: Sequence[Array | None]) -> Array:
    """(K, F, 6) of a plate under two feet: force by the lever between the feet, each at its own middle."""
    found = np.zeros((len(frames), len(outlines), 6))
    for row, t in enumerate(frames):
        own = np.flatnonzero(owners[t])[:2]
        centres = [np.nanmean(outline[t], axis=0) for k in own if (outline := outlines[k]) is not None]
        along = centres[1] - centres[0]
        lever = (plate.cop[t] - centres[0]) @ along / max(float(along @ along), 1e-9)
        part = 0.5 if not np.isfinite(lever) else float(np.clip(lever, 0.0, 1.0))
        F, M = plate.wrench[t, :3], plate.wrench[t, 3:]
        parts: tuple[float, float] = (1.0 - part, part)
        points = [np.array([c[0], 0.0, c[1]]) if np.isfinite(c).all() else np.zeros(3) for c in centres]
        rest = M - np.sum([s * np.cross(c, F) for s, c in zip(parts, points, strict=True)], axis=0)
        for k, s, c in zip(own, parts, points, strict=True):
            found[row, k] = s * np.concatenate([F, np.cross(c, F) + rest])
    return found


class _Assignment:
    def __init__(
        self,
        recording: Recording,
        ground: GroundFrame,
        feet: tuple[str, ...],
        contacts: dict[str, FootContact],
        plates: list[PlateLoad],
        fixed: dict[str, str],
    ) -> None:
        self.ground = ground
        self.recording, self.feet, self.contacts, self.plates, self.fixed = recording, feet, contacts, plates, fixed
        n, F, P = recording.n_frames, len(feet), len(plates)
        self.on = np.zeros((n, F, P), dtype=bool)  # this foot stands on this plate
        self.off = np.zeros((n, F), dtype=bool)  # it may stand off the plates
        self.messages: list[str] = []
        self.reasons: list[str] = []
        for k, foot in enumerate(feet):
            if foot in contacts:
                self.stances(k, contacts[foot])
        for p, plate in enumerate(plates):
            self.presses(p, plate)
            self.on[:, :, p] = to_the_end(self.on[:, :, p], np.nan_to_num(plate.wrench[:, 1]) > EMPTY_N)
            if plate.name in fixed:
                self.on[:, :, p] = False
                self.on[:, feet.index(fixed[plate.name]), p] = np.nan_to_num(plate.wrench[:, 1]) > EMPTY_N
        missing = [foot for foot in feet if foot not in contacts]
        if missing:
            self.messages.append(
                f"No markers of the {' and '.join(missing)} foot: it is taken to stand on the plates alone."
            )

    def stances(self, k: int, foot: FootContact) -> None:
        """Which plates carry each stance of one foot."""
        rate, time = self.recording.rate, self.recording.time
        near = [distance_to_hull(plate.cop, foot.outline) < NEAR_M for plate in self.plates]
        for stance in foot.stances:
            inside, reach = slice(*stance), foot.padded(stance, rate)
            mine = []
            for p, plate in enumerate(self.plates):
                if self.fixed.get(plate.name, self.feet[k]) != self.feet[k]:
                    continue
                loaded = plate.loaded[inside]
                enough = 0.5 * max(int(np.count_nonzero(loaded)), 1)
                close = near[p][inside] | self.between(k, p)[inside] | self.upon(plate, foot, inside)
                if np.count_nonzero(close & loaded) > enough:
                    mine.append(p)
                    self.on[reach, k, p] |= plate.loaded[reach] & (near[p][reach] | foot.stands[reach])
                    self.on[inside, k, p] = True
            beside = self.beyond_edges(foot, inside)
            if not mine:
                self.off[reach, k] = True
            elif beside.any():
                self.off[inside, k] |= beside
        for first, end in runs(self.off[:, k]):
            self.reasons.append(
                f"The {self.feet[k]} foot stands off the plates from {time[first]:.2f} to {time[end - 1]:.2f} s: "
                "the total wrench is left out there."
            )

    def presses(self, p: int, plate: PlateLoad) -> None:
        """Presses of a plate on which no foot stands still: a belt carries the feet along. They are the foot's that is
        low and near for most of the press."""
        pressed = np.nan_to_num(plate.wrench[:, 1]) > EMPTY_N
        for first, end in runs(pressed):
            press = slice(first, end)
            loaded = plate.loaded[press]
            if plate.name in self.fixed or self.on[press, :, p].any() or not loaded.any():
                continue
            for k, name in enumerate(self.feet):
                foot = self.contacts.get(name)
                if foot is None:
                    continue
                under = (distance_to_hull(plate.cop[press], foot.outline[press]) < NEAR_M) & foot.low[press]
                if np.count_nonzero(under & loaded) > MOST * np.count_nonzero(loaded):
                    self.on[press, k, p] = True

    def between(self, k: int, p: int) -> Flags:
        """Frames in which a plate's centre of pressure lies between two standing feet, and under neither."""
        others = [c for name, c in self.contacts.items() if name != self.feet[k]]
        own = self.contacts.get(self.feet[k])
        if own is None or len(others) != 1 or len(self.plates) == 0:
            return np.zeros(self.recording.n_frames, dtype=bool)
        cop, other = self.plates[p].cop, others[0]
        both = np.concatenate([own.outline, other.outline], axis=1)
        apart = np.fmin(distance_to_hull(cop, own.outline), distance_to_hull(cop, other.outline)) > BETWEEN_M
        return np.asarray((distance_to_hull(cop, both) < BETWEEN_M) & apart & own.stands & other.stands)

    def upon(self, plate: PlateLoad, foot: FootContact, frames: slice) -> Flags:
        """Frames in which all touching markers of a foot lie within a plate's edges; none where these are not known."""
        outline, touching = foot.outline[frames], foot.touching[frames]
        if plate.corners is None:
            return np.zeros(len(outline), dtype=bool)
        corners = np.broadcast_to(plate.corners, (len(outline), 4, 2))
        inside = np.stack([distance_to_hull(outline[:, m], corners) == 0.0 for m in range(outline.shape[1])], axis=1)
        return np.asarray(touching.any(axis=1) & (inside | ~touching).all(axis=1))

    def beyond_edges(self, foot: FootContact, frames: slice) -> Flags:
        """Frames in which a touching marker lies beyond the edges of all plates; none where edges are not known."""
        outline, touching = foot.outline[frames], foot.touching[frames]
        if not self.plates or any(plate.corners is None for plate in self.plates):
            return np.zeros(len(outline), dtype=bool)
        away = np.full(touching.shape, np.inf)
        for plate in self.plates:
            corners = np.broadcast_to(np.asarray(plate.corners), (len(outline), 4, 2))
            for m in range(outline.shape[1]):
                away[:, m] = np.fmin(away[:, m], distance_to_hull(outline[:, m], corners))
        return np.asarray(((away > BEYOND_M) & np.isfinite(away) & touching).any(axis=1))

    def loads(self) -> FootLoads:
        for p, plate in enumerate(self.plates):
            self.say(plate, ~plate.known, np.flatnonzero(self.on[:, :, p].sum(axis=1) > 1), self.on[:, :, p])
        outlines = [self.contacts[foot].outline if foot in self.contacts else None for foot in self.feet]
        forward = self.ground.vectors_to_ground(self.ground.forward)[[0, 2]]
        contacts = [self.contacts.get(foot) for foot in self.feet]
        soles = Soles.of(contacts, forward, self.recording.rate, self.recording.n_frames)
        loads = divided(self.feet, self.plates, outlines, self.on, self.off, self.aloft(), soles)
        return replace(loads, messages=(*self.messages, *self.reasons), reasons=tuple(self.reasons))

    def aloft(self) -> Flags:
        """(T, F) feet that are surely in the air: high and moving between two stances of their own, or moving while
        another one stands still. A pedal moves with the foot that presses it, and lets it stand nowhere."""
        found = np.zeros(self.off.shape, dtype=bool)
        for k, name in enumerate(self.feet):
            foot = self.contacts.get(name)
            if foot is None:
                continue
            others = [other.stands for at, other in self.contacts.items() if at != name]
            bears, between = np.zeros(len(found), dtype=bool), np.zeros(len(found), dtype=bool)
            for stance in foot.stances:
                bears[foot.padded(stance, self.recording.rate)] = True
            if len(foot.stances) > 1:
                between[foot.stances[0][1] : foot.stances[-1][0]] = True
            found[:, k] = (foot.aloft & between) | (np.any(others, axis=0) & foot.moves & ~bears)
        return found

    def say(self, plate: PlateLoad, lost: Flags, both: npt.NDArray[np.intp], owners: Flags) -> None:
        time = self.recording.time
        for k, foot in enumerate(self.feet):
            if owners[:, k].any():
                spans = ", ".join(f"{time[a]:.2f} to {time[b - 1]:.2f} s" for a, b in runs(owners[:, k]))
                how = "given" if plate.name in self.fixed else "by its centre of pressure"
                self.messages.append(f"{plate.name} carries the {foot} foot ({how}): {spans}.")
        if len(both):
            self.messages.append(
                f"Both feet stand on {plate.name} in {len(both)} frames from {time[both[0]]:.2f} to "
                f"{time[both[-1]]:.2f} s: its wrench is divided between them by its centre of pressure."
            )
        for a, b in runs(lost):
            self.reasons.append(
                f"{plate.name} is not measured or at the end of its range from {time[a]:.2f} to {time[b - 1]:.2f} s: "
                "the total wrench is left out there."
            )
        if len(self.contacts) == len(self.feet):
            alone = ~owners.any(axis=1) & (np.nan_to_num(plate.wrench[:, 1]) > FOREIGN_N)
            for a, b in runs(alone):
                self.reasons.append(
                    f"Warning: {plate.name} carries up to {np.nanmax(plate.wrench[a:b, 1]):.0f} N where no foot "
                    f"stands, from {time[a]:.2f} to {time[b - 1]:.2f} s: the total wrench is left out there."
                )
