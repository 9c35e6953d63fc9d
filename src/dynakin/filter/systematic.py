"""What the filter's covariance cannot know: joints off where they are, skin that follows them, segments' centres of
mass, inertia that a recording leaves open, and how intense the movement is.

A consider covariance (Schmidt 1966): these errors are not estimated; their effect on what is reported is worked out
afterwards and added to the filter's own variances ([derivations](derivations.md), section 17).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from dynakin.bindings import _core
from dynakin.filter.contacts import any_off_plates, late_by, rates, wrenches_of
from dynakin.filter.error_sizes import CENTRES, KINDS, OF_JOINTS, Sizes, hips_unshown, less_sure_joints, usual_sizes
from dynakin.filter.in_hands import Hands
from dynakin.filter.joint_errors import OF_ROOT, JointErrors, drives, floats, neutral, rolls, trunks_of
from dynakin.filter.limbs import Arms, unseen_limbs, unsure_moments
from dynakin.filter.noise import marker_variance, soft_tissue_sd
from dynakin.filter.reported_sd import BLOCKS, Parts, as_believed, movement_intensity, reported
from dynakin.messages import Message, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.joint_motion import SKIN_ANGLE_RAD
from dynakin.model.spec import free_coordinates
from dynakin.model.state_priors import COMMON_SKIN
from dynakin.recordings.times import frames_apart, step_of
from dynakin.results.estimate import values_of
from dynakin.results.measures.sources import in_use, moment_sources, plates_refused
from dynakin.results.naming import listed, words
from dynakin.settings.noise import Noise

if TYPE_CHECKING:
    import xarray as xr

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

MISFIT = 1.6
"""Times `Sizes.placed` from which a run says that a model was not scaled well: by truth 0.4 to 1.1 with the person's
own skeleton, 2.3 to 3.2 with one scaled by hand."""
ROOT_SKIN = 4.0
"""Times as much skin as elsewhere counts on the segment that floats (the pelvis): what its markers do together no other
segment contradicts. By `truth3d` its rotation was said to a third of its error (0.18 of 0.53 deg in walks)."""
SAMPLE_S = 0.1
"""Frames of a recording further apart than this are worked out, variances of those between by straight lines."""
_STEP_S = 0.005
"""Step along the motion over which effects are differentiated."""
_UNSEEN_SD = 0.5
"""Standard deviation, rad or m, of a coordinate before any marker is seen: keeps what no marker shows finite."""


class Systematic:
    """Effects of systematic errors on what is estimated of one person.

    Args:
        calibrated: with the states that the filter has. noise: how surely the markers are known, for their weights.
        sizes: of the errors; by where the joints come from where not given.
    """

    def __init__(self, calibrated: CalibratedModel, noise: Noise, sizes: Sizes | None = None) -> None:
        spec = calibrated.spec
        self.sizes = sizes or usual_sizes(calibrated).scaled(noise.systematic_scale)
        self._free = np.array(free_coordinates(spec))
        self._count = len(spec.coordinates)
        self._locked = [c.name for c in spec.coordinates if c.locked and c.name not in calibrated.held]
        self._feet = len(calibrated.feet)
        reference = neutral(calibrated)
        self._errors = JointErrors.of(spec, reference, calibrated.held, trunks_of(calibrated))
        self._limbs = unsure_moments(unseen_limbs(calibrated), self._errors.massive)
        self._arms = Arms.of(calibrated)
        self._reference = reference[self._free]
        first = {name: k for k, name in enumerate(calibrated.names)}
        axes = [[f"marker/{marker.name}/{axis}" for axis in "xyz"] for marker in spec.markers]
        self._places = np.array([[first[n] for n in own] for own in axes if first.keys() >= set(own)], dtype=np.intp)
        self._place0 = calibrated.x0[self._places]
        self._measured = np.array([marker.measured for marker in spec.markers]).ravel()
        sd = np.hypot(np.sqrt(marker_variance(calibrated, noise)), soft_tissue_sd(noise, calibrated.soft_tissue_m))
        self._root_weight = np.repeat(1.0 / sd, 3) * self._measured
        segments = [segment.name for segment in spec.segments]
        self._segment = np.array([segments.index(marker.segment) for marker in spec.markers])
        on_root = np.array([floats(spec.segments[k]) for k in self._segment], dtype=bool)
        self._declared = np.repeat(np.where(on_root, ROOT_SKIN, 1.0) * calibrated.soft_tissue_m, 3)
        members = np.equal.outer(self._segment, np.arange(len(segments))).astype(float)
        self._members = np.kron(members, np.eye(3))
        self._drives = drives(spec, self._free)
        still = np.zeros_like(self._reference)
        x = self._errors.state(self._reference, still, still)
        self._R0 = _core.segment_poses(self._errors.model, x)[0]
        self._D0 = self._displacements(_core.marker_jacobian(self._errors.model, x))
        self._D0[:, [kind in OF_ROOT for kind in self._errors.kinds]] = 0.0
        self._model = _core.Model(spec)
        self._hands = Hands(spec, self._model)
        self._constants = np.array(calibrated.x0)
        self._rolls = [first[name] for name in rolls(spec) if name in first]
        gain, N = self._gain(x)
        self._B0 = gain @ np.hstack([N, self._rolled(self._reference)])
        kinds = np.array([*self._errors.kinds, *("roll" for _ in self._rolls)])
        self._columns = {kind: np.flatnonzero(kinds == kind) for kind in (*OF_JOINTS, "roll")}
        unsure, of_rolls = less_sure_joints(calibrated), len(self._rolls)
        sources = zip(self._errors.kinds, self._errors.joints, strict=True)
        times = [unsure.get(joint, 1.0) if kind in CENTRES else 1.0 for kind, joint in sources]
        self._times = np.append(times, np.ones(of_rolls))
        self._hips_open_m = noise.systematic_scale * np.append(self._errors.hips_open_m(calibrated), np.zeros(of_rolls))
        self._segments = {name: k for k, name in enumerate(segments)}
        self._variance_scale = noise.variance_scale
        self._inertia = [
            k for k, name in enumerate(calibrated.names) if self.sizes.inertia and name.startswith("inertia/")
        ]

    def with_found(
        self, clock_sd_s: float, in_hands_kg: float = 0.0, skin: float = 0.0, hips_turned: float = np.inf
    ) -> Systematic:
        """The same, where the plates' clock is less sure than in a walk whose segments are all marked, hands may hold
        what the model does not have, more of skin's displacement was found than usual, or hips turn (rad) so little
        that their centres stay where standing markers have them."""
        sizes, other = self.sizes, copy(self)
        clock, hips = max(clock_sd_s, sizes.clock), hips_unshown(hips_turned)
        other.sizes = replace(sizes, clock=clock, hands=in_hands_kg, hips=hips).with_skin(skin)
        return other

    def _displacements(self, jacobian: Array) -> Array:
        """(3 M, S): what each source does to the markers of the model as it is posed."""
        return np.asarray(jacobian[:, self._errors.placed] @ self._errors.sources)

    def _gain(self, x: Array, used: Flags | None = None) -> tuple[Array, Array]:
        """Minus the least squares gain (K, 3 M) of the markers ``used`` (M,), all where not given, and the net
        displacements N (3 M, S) of the geometry: markers sit where the reference posture showed them, regardless of
        what is wrong with the joints."""
        jacobian = _core.marker_jacobian(self._errors.model, x)
        turned = (_core.segment_poses(self._errors.model, x)[0] @ self._R0.swapaxes(-1, -2))[self._segment]
        carried = turned @ self._D0.reshape(len(self._segment), 3, -1)
        N = self._displacements(jacobian) - carried.reshape(self._D0.shape)
        weight = self._root_weight if used is None else np.where(np.repeat(used, 3), self._root_weight, 0.0)
        A = jacobian[:, self._errors.free] * weight[:, None]
        normal = A.T @ A
        normal.flat[:: len(normal) + 1] += _UNSEEN_SD**-2
        return -cho_solve(cho_factor(normal), (A * weight[:, None]).T), N

    def parts(self, q: Array, qd: Array, qdd: Array, external: Array | None = None, used: Flags | None = None) -> Parts:
        """Variances by kind of error, of errors of size 1 (m, rad, declared size): block -> (C,).

        Args:
            q, qd, qdd: (K,) of the free coordinates. external: (S, 6) wrenches on the segments, about the ground's
                origin. used: (M,) markers that show the posture (`in_use`); not given: all.
        """
        errors = self._errors
        gains, effects = [], []
        for h in (-_STEP_S, 0.0, _STEP_S):
            moved = q + h * qd + 0.5 * h * h * qdd
            gain, N = self._gain(errors.state(moved, qd, qdd), used)
            gains.append(gain)
            effects.append(gain @ np.hstack([N, self._rolled(moved)]))
        G, Gd, Gdd = _differences(gains)
        B, Bd, Bdd = _differences(effects)
        x = errors.state(q, qd, qdd)
        T = _core.moment_jacobian(errors.model, x, external)[: self._count]
        size = len(errors.free) + len(errors.placed)
        Tq, Tv, Ta = (T[:, k * size + errors.free] for k in range(3))
        direct = np.hstack([T[:, errors.placed] @ errors.sources, self._rolled_moments(q, qd, qdd, external)])
        moved = Tq @ B + Tv @ Bd + Ta @ Bdd + direct
        found: Parts = {}
        # of angles what changes with the posture: a zero is a definition
        squares = [np.square(values) for values in (B - self._B0, Bd, Bdd, moved)]
        for kind, chosen in self._columns.items():
            found[kind] = self._labelled(*(values[:, chosen] @ self._times[chosen] ** 2 for values in squares))
        found["hips"] = self._labelled(*(values @ self._hips_open_m**2 for values in squares))
        found["skin"] = self._labelled(*self._skin(q, qd, qdd, (G, Gd, Gdd), (Tq, Tv, Ta)))
        still = np.zeros_like(q)
        by_moment = T[:, errors.first_moments]
        for kind, displaced in (("mass_centre", by_moment * errors.masses), ("limbs", by_moment @ self._limbs)):
            found[kind] = self._labelled(still, still, still, np.square(displaced).sum(axis=1))
        if self._arms:
            swing = self._arms.variances(self._model, np.r_[q, self._constants[len(q) :]], qd, qdd)
            found["limbs"]["moments"] = found["limbs"]["moments"] + swing
        return found

    def _rolled(self, q: Array) -> Array:
        """(3 M, L): what joints' centres that move with their angle do to the markers, a m/rad (`rolls`)."""
        if not self._rolls:
            return np.zeros((len(self._root_weight), 0))
        x = self._constants.copy()
        x[: len(q)] = q
        return np.asarray(_core.marker_jacobian(self._model, x)[:, self._rolls])

    def _rolled_moments(self, q: Array, qd: Array, qdd: Array, external: Array | None) -> Array:
        """(C, L): what they do to moments."""
        if not self._rolls:
            return np.zeros((self._count, 0))
        x = self._constants.copy()
        x[: 3 * len(q)] = np.concatenate([q, qd, qdd])
        return np.asarray(_core.moment_jacobian(self._model, x, external)[: self._count, self._rolls])

    def _skin(
        self, q: Array, qd: Array, qdd: Array, gains: tuple[Array, Array, Array], T: tuple[Array, Array, Array]
    ) -> list[Array]:
        """Variances of angles, speeds, accelerations, moments by skin that follows the joints of its segment."""
        Tq, Tv, Ta = T
        s = np.tanh((q - self._reference) / SKIN_ANGLE_RAD)
        slope = (1.0 - s * s) / SKIN_ANGLE_RAD
        rates = np.array([s, slope * qd, slope * qdd - 2.0 * s * slope / SKIN_ANGLE_RAD * qd * qd])  # (3, K)
        products = (rates[:, None] * rates[None]) @ self._drives.T  # (3, 3, segments)
        weights = np.repeat(np.concatenate([products[:, :, self._segment], products], axis=-1), 3, axis=-1)
        G, Gd, Gdd = (self._displaced(values) for values in gains)
        T0, T1, T2 = Tq @ G + Tv @ Gd + Ta @ Gdd, Tv @ G + 2.0 * Ta @ Gd, Ta @ G
        found = []
        for by_rate in ((G,), (Gd, G), (Gdd, 2.0 * Gd, G), (T0, T1, T2)):  # what goes with skin, its speed, ...
            pairs = [(a, b) for a in range(len(by_rate)) for b in range(len(by_rate))]
            found.append(sum((by_rate[a] * by_rate[b] @ weights[a, b] for a, b in pairs), np.zeros(1)))
        return found

    def _displaced(self, values: Array) -> Array:
        """(., 3 M + 3 S): effects of each marker's own share of the displacement and of each segment's common one."""
        own = values * self._declared
        return np.hstack([np.sqrt(1.0 - COMMON_SKIN) * own, np.sqrt(COMMON_SKIN) * own @ self._members])

    def _by_inertia(self, x: Array, covariance: Array, external: Array) -> Array:
        """(C,) variances of moments by inertia of this covariance (I, I)."""
        if not self._inertia:
            return np.zeros(self._count)
        T = _core.moment_jacobian(self._model, x, external)[: self._count, self._inertia]
        return np.asarray(((T @ covariance) * T).sum(axis=1))

    def _by_clock(self, x: Array, wrench_rate: Array, segments: Sequence[str]) -> Array:
        """(C,) variances of moments by loads that act a second later than they did; of wrenches that change by (F, 6) a
        second. Moments are linear in them."""
        load = self.external(wrench_rate, segments)
        return np.square(
            _core.joint_moments(self._model, x, load) - _core.joint_moments(self._model, x, np.zeros_like(load))
        )

    def _labelled(self, q: Array, qd: Array, qdd: Array, moments: Array) -> dict[str, Array]:
        found = {}
        for name, values in zip(BLOCKS, (q, qd, qdd), strict=False):
            found[name] = np.zeros(self._count)
            found[name][self._free] = values
        return found | {"moments": moments}

    def over_time(self, data: xr.Dataset) -> Parts:
        """`parts` of a recording, and "inertia" by the declared noise: kind -> block -> (T, C). NaN around frames whose
        state or contacts are not numbers.

        Args:
            data: as of `Estimate`, with ``state``, ``state_sd``, ``final_covariance``, and ``foot_wrench`` of a model
                whose contacts have been used.
        """
        time = np.asarray(data["time"].values)
        states = values_of(data, "state")
        # how inertia hangs together is known at the end alone, how well it is known in each frame
        sd = values_of(data, "state_sd")[:, self._inertia]
        together = _correlation(data["final_covariance"].values[np.ix_(self._inertia, self._inertia)])
        wrench, segments = wrenches_of(data)
        chosen = frames_apart(time, SAMPLE_S)
        used = in_use(np.isfinite(values_of(data, "markers_measured")).any(axis=2), time)
        each = [self._at(states[k], sd[k, :, None] * together * sd[k], wrench[k], segments, used[k]) for k in chosen]
        found = {
            kind: {block: _between(time, time[chosen], np.array([p[kind][block] for p in each])) for block in BLOCKS}
            for kind in (*KINDS, "inertia")
        }
        rate = rates(wrench, time)
        for k in np.flatnonzero(np.isfinite(states).all(axis=1)):
            found["clock"]["moments"][k] = self._by_clock(states[k], rate[k], segments)
        return found

    def moments_moved(self, data: xr.Dataset, moved: Sequence[Array]) -> Array:
        """(T, C): what moments change by where coordinates, speeds and accelerations (T, C) are others by ``moved`` and
        the contacts' wrenches stay; NaN where the state is not a number."""
        states, (wrench, segments) = values_of(data, "state"), wrenches_of(data)
        change = np.hstack([values[:, self._free] for values in moved])
        K = change.shape[1]
        found = np.full((len(states), self._count), np.nan)
        for k in np.flatnonzero(np.isfinite(states[:, :K]).all(axis=1)):
            T = _core.moment_jacobian(self._model, states[k], self.external(wrench[k], segments))
            found[k] = T[: self._count, :K] @ change[k]
        return found

    def external(self, wrench: Array, segments: Sequence[str]) -> Array:
        """(S, 6) by segment of the model: wrenches (F, 6) of contacts on these."""
        external = np.zeros((len(self._segments), 6))
        for name, values in zip(segments, wrench, strict=True):
            external[self._segments[name]] += values
        return external

    def _at(
        self,
        x: Array,
        inertia: Array,
        wrench: Array,
        segments: Sequence[str],
        used: Flags | None = None,
        wrench_rate: Array | None = None,
    ) -> Parts:
        """`parts` of a state (n,), "inertia" of this covariance (I, I), and "clock", with wrenches (F, 6) of contacts
        on these segments and by how much these change a second (F, 6)."""
        K = len(self._free)
        if not np.isfinite(x[: 3 * K]).all():
            return {kind: {b: np.full(self._count, np.nan) for b in BLOCKS} for kind in (*KINDS, "inertia")}
        external = self.external(wrench, segments)
        still = np.zeros(K)
        by_inertia = self._by_inertia(x, inertia, external)
        by_hands = self._hands.variances(x, self._count) if self.sizes.hands else np.zeros(self._count)
        by_clock = np.zeros(self._count) if wrench_rate is None else self._by_clock(x, wrench_rate, segments)
        return self.parts(x[:K], x[K : 2 * K], x[2 * K : 3 * K], external, used) | {
            "inertia": self._labelled(still, still, still, by_inertia),
            "clock": self._labelled(still, still, still, by_clock),
            "hands": self._labelled(still, still, still, by_hands),
        }

    def added(
        self,
        found: Mapping[str, Array],
        x: Array,
        covariance: Array,
        wrench: Array,
        segments: Sequence[str],
        *,
        sources: npt.NDArray[np.uint8] | None = None,
        off_plates: bool = False,
        late: bool,
        used: Flags | None = None,
        wrench_rate: Array | None = None,
        step_s: float = np.nan,
    ) -> dict[str, Array]:
        """The filter's standard deviations of one frame (block -> (C,)) with these errors.

        Args:
            x: (n,) state, of covariance (n, n). wrench: (F, 6) of the contacts on these segments. sources, off_plates,
                late, step_s: as of `reported`. used: as of `parts`. wrench_rate: (F, 6) by how much the wrenches change
                a second; not given: not at all.
        """
        inertia = covariance[np.ix_(self._inertia, self._inertia)] / self._variance_scale
        own = {block: found[block] for block in BLOCKS}
        K = len(self._free)
        intense = movement_intensity(x[2 * K : 3 * K], own["accelerations"][self._free])
        parts = self._at(x, inertia, wrench, segments, used, wrench_rate)
        moved = self.moved_m(x)
        return reported(
            self.sizes, self._variance_scale, own, parts, intense, moved, sources,
            off_plates=off_plates, late=late, step_s=step_s,
        )  # fmt: skip

    def added_over_time(self, data: xr.Dataset, *, late: bool) -> xr.Dataset:
        """The same of a recording: ``data`` with other ``coordinates_sd`` ... ``moments_sd``, and the plates' clock in
        those of contacts' wrenches."""
        own = {block: values_of(data, f"{block}_sd") for block in BLOCKS}
        moved = self.moved_m(values_of(data, "state"))
        sources = moment_sources(data)
        sources = np.where(plates_refused(data)[:, None], as_believed(sources), sources)
        found = self.over_time(data), self.intensity(data), moved, sources
        off_plates = any_off_plates(data, self._feet)
        step_s = step_of(data["time"].values)
        sd = reported(self.sizes, self._variance_scale, own, *found, off_plates=off_plates, late=late, step_s=step_s)
        blocks = {f"{block}_sd": (("time", "coordinate"), sd[block]) for block in BLOCKS}
        return data.assign(blocks | late_by(data, self.sizes.clock))

    def moved_m(self, x: Array) -> Array:
        """(...,) how far markers are found from where the model has them by states (..., n), mean; 0 where none is
        looked for."""
        if not len(self._places):
            return np.zeros(x.shape[:-1])
        return np.asarray(np.linalg.norm(x[..., self._places] - self._place0, axis=-1).mean(axis=-1))

    def misfit(self, x: Array) -> list[Message]:
        """What there is to say of how well the model was scaled to the person, by the last state (n,)."""
        moved_m = float(self.moved_m(x))
        if not moved_m > self.sizes.placed * MISFIT:
            return []
        locked = f"; held still are {listed([words(name) for name in self._locked])}" if self._locked else ""
        return [
            warning(
                "scaling",
                f"markers lie {1000.0 * moved_m:.0f} mm (mean) from where the model has them, of a model that "
                f"fits the person at most {1000.0 * self.sizes.placed:.0f} mm: the centres of its joints count as "
                f"{moved_m / self.sizes.placed:.1f} times less sure, and axes that are turned as well do not{locked}.",
            )
        ]

    def intensity(self, data: xr.Dataset) -> Array:
        """(T,) `movement_intensity` of a recording, by its states and the filter's own ``accelerations_sd``."""
        K = len(self._free)
        states = values_of(data, "state")
        sd = values_of(data, "accelerations_sd")[:, self._free]
        return movement_intensity(states[:, 2 * K : 3 * K], sd)


def _differences(values: list[Array]) -> tuple[Array, Array, Array]:
    before, now, after = values
    return now, (after - before) / (2.0 * _STEP_S), (after - 2.0 * now + before) / _STEP_S**2


def _correlation(covariance: Array) -> Array:
    """Of what is known for sure none with anything else."""
    sd = np.sqrt(np.diag(covariance))
    scale = np.divide(1.0, sd, out=np.zeros_like(sd), where=sd > 0.0)
    found: Array = scale[:, None] * covariance * scale
    np.fill_diagonal(found, 1.0)
    return found


def _between(time: Array, known: Array, values: Array) -> Array:
    return np.array([np.interp(time, known, column) for column in values.T]).T
