"""Coordinates of a spatial model that fit measured marker places: a start from any pose and heading.

The body is laid on the markers as a whole (Kabsch 1976, Acta Cryst A32:922-923), then all free coordinates are fitted
by the core's bounded least squares; limbs that do not fit are started again elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from dynakin.arrays import Array, rms, wrapped
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.model.calibration.joint_motion import nearest_rotation
from dynakin.model.calibration.posture import joint_coordinates, other_reading, turned
from dynakin.model.schema import Interval, kinds_of
from dynakin.model.spec import free_names

GOOD_M = 0.010
"""Root mean square distance from which on nothing else is tried: less than skin moves."""
BAD_M = 0.060
"""Beyond this a fit is refused: nominal marker places on an unscaled body err by 20 to 40 mm."""
MIRROR_RATIO = 0.6
"""A mirror image that fits this much better, on a fit that is not good, is what was measured."""
_UNITS = 3.0  # the markers' spread against the model's, beyond which the unit is wrong
_REST = 1e-3  # m a radian: draws what no marker observes to where it was, moves what one does by nothing
_RESTARTS = 4
_SAME_M = 1e-6  # markers of one pose
_ARM = 0.3  # m, at which an angle counts as a distance


@dataclass(frozen=True, eq=False)
class PoseFit:
    """Where the fit ended.

    Attributes:
        coordinates: name -> rad or m, of all coordinates, locked ones as they are.
        x: (n,) the model's initial state with these coordinates.
        distance_m: (M,) of each marker from where it was measured, NaN where it was not.
        rms_m: root mean square of these (3-D distances).
    """

    coordinates: dict[str, float]
    x: Array
    distance_m: Array
    rms_m: float


def start_posture(
    model: _core.Model,
    markers: Array,
    *,
    guess: Array | None = None,
    limits: Mapping[str, Interval] | None = None,
    good_m: float = GOOD_M,
    bad_m: float = BAD_M,
    where: str = "start",
) -> PoseFit:
    """Fit the free coordinates of a model to one frame's markers, or to the median of a few frames.

    Args:
        model: lengths, marker places and locked coordinates are taken as its specification has them; its coordinates
            are the first guess of the joints. A root with three translations and three rotations may be anywhere and
            head anywhere.
        markers: (M, 3) or (T, M, 3) m, ground frame, in the order of the model's markers; NaN: not seen.
        guess: (n,) state of this or a like model to begin with; other starts are tried where that ends badly.
        limits: name -> (lower, upper) rad or m of coordinates that have any.
        good_m: root mean square distance from which on nothing else is tried.
        bad_m: root mean square distance from which the fit is refused; infinite: any is taken.
        where: opens the messages (a file's name).

    Raises:
        ModelError: fewer than three markers, or a bad fit; the message names wrong units, swapped sides or the markers
            that are furthest off.
    """
    measured = np.asarray(markers, dtype=float)
    if measured.ndim == 3:
        measured = _median(measured)
    body = _Body(model, measured, dict(limits or {}), where, good_m)
    best = body.fit(None if guess is None else guess[: body.n_free])
    if np.isfinite(bad_m):
        _refuse(body, best, bad_m, where)
    return _pose(model, body, best)


def near(model: _core.Model, x: Array, markers: Array, limits: Mapping[str, Interval]) -> PoseFit:
    """The fit that is reached from a state x (n,): one frame (M, 3) later, say.

    Raises:
        ModelError: fewer than three markers.
    """
    body = _Body(model, np.asarray(markers, dtype=float), dict(limits), "next frame")
    return _pose(model, body, body.solve(x[: body.n_free], wrap=False))


def _pose(model: _core.Model, body: _Body, fit: _Fit) -> PoseFit:
    x = np.array(model.initial_state(), dtype=float)
    x[: body.n_free] = fit.q
    q, _, _ = _core.coordinates(model, x)
    return PoseFit(dict(zip(model.coordinate_names, map(float, q), strict=True)), x, body.distances(fit.q), fit.rms)


def _median(frames: Array) -> Array:
    """Median (M, 3) over frames (T, M, 3), NaN where a marker is in none."""
    found = np.full(frames.shape[1:], np.nan)
    for k in range(frames.shape[1]):
        seen = frames[np.isfinite(frames[:, k]).all(axis=1), k]
        if len(seen):
            found[k] = np.median(seen, axis=0)
    return found


@dataclass(frozen=True, eq=False)
class _Fit:
    q: Array  # (n_free,)
    rms: float


class _Body:
    """The model with everything fixed but its coordinates, and the markers that it is laid on."""

    def __init__(
        self, model: _core.Model, measured: Array, limits: dict[str, Interval], where: str, good_m: float = GOOD_M
    ) -> None:
        self.good_m = good_m
        self.model = _core.Model(bare(model.spec))
        spec = self.model.spec
        if measured.shape != (len(spec.markers), 3):
            raise ModelError(f"{where}: markers have shape {measured.shape}, expected ({len(spec.markers)}, 3)")
        self.measured = measured
        self.seen: npt.NDArray[np.bool_] = np.asarray(np.isfinite(measured).all(axis=1))
        if np.count_nonzero(self.seen) < 3:
            raise ModelError(f"{where}: {np.count_nonzero(self.seen)} markers are seen, expected at least 3")
        self.names = [marker.name for marker in spec.markers]
        self.rows = np.array([marker.measured for marker in spec.markers]) & self.seen[:, None]
        self.free = free_names(spec)
        self.n_free = len(self.free)
        self.x0 = np.array(self.model.initial_state(), dtype=float)
        bounds = np.array([limits.get(name, (-np.inf, np.inf)) for name in self.free]).reshape(-1, 2)
        self.lower, self.upper = bounds.T
        self.rest = np.clip(self.x0[: self.n_free], self.lower, self.upper)
        order = {name: k for k, name in enumerate(self.free)}
        kinds = kinds_of(spec.segments)
        self.turns = np.array([kinds[name] == "rotation" for name in self.free])
        self.paths, self.base = _paths(spec, order)
        self.roots = [k for k, s in enumerate(spec.segments) if s.parent == "ground"]
        self.segment_of = [[s.name for s in spec.segments].index(m.segment) for m in spec.markers]
        self.pull = np.where(self.turns, _REST, 0.0)
        self.pull[self.base] = 0.0
        self.scale = np.where(self.turns, 1.0, _ARM)
        self.targets = np.where(self.rows, measured, np.nan)

    @property
    def floating(self) -> bool:
        turns = int(self.turns[self.base].sum())
        return len(self.roots) == 1 and turns == 3 and len(self.base) == 6

    def state(self, q: Array) -> Array:
        x = self.x0.copy()
        x[: self.n_free] = q
        return x

    def distances(self, q: Array) -> Array:
        gap = _core.marker_positions(self.model, self.state(q)) - self.measured
        return np.where(self.seen, np.sqrt((np.where(self.rows, gap, 0.0) ** 2).sum(axis=1)), np.nan)

    def solve(self, start: Array, wrap: bool = True) -> _Fit:
        """Bounded least squares over all free coordinates."""
        end, _, _ = _core.fit_posture(
            self.model, self.state(start), self.targets, self.lower, self.upper, self.scale, self.pull, self.rest
        )
        endless = self.turns & np.isinf(self.lower) & np.isinf(self.upper) & wrap
        end[endless] = wrapped(end[endless])
        return _Fit(end, float(rms(self.distances(end))))

    def fit(self, guess: Array | None = None) -> _Fit:
        """The best of several starts; the first good one where there is one."""
        return self.read_as_usual(self._best(guess))

    def read_as_usual(self, fit: _Fit) -> _Fit:
        """The same fit with the root's turns by that of their two readings that turns less from rest: an upright
        person, however they face, has no list beyond 90 deg. A fit that begins far off may end in the other one."""
        if not self.floating:
            return fit
        other = fit.q.copy()
        other[self.base] = other_reading(fit.q[self.base], self.turns[self.base])
        other[self.base] = np.where(self.turns[self.base], wrapped(other[self.base]), other[self.base])
        less = _turned(other - self.rest, self.turns) < _turned(fit.q - self.rest, self.turns)
        within = np.all((other >= self.lower) & (other <= self.upper))
        here, there = (_core.marker_positions(self.model, self.state(q)) for q in (fit.q, other))
        return replace(fit, q=other) if less and within and np.allclose(here, there, atol=_SAME_M) else fit

    def _best(self, guess: Array | None) -> _Fit:
        best: _Fit | None = None
        if guess is not None:
            best = self.solve(guess)
            if best.rms < self.good_m:
                return best
        for start in self.starts():
            found = self.mended(self.solve(start))
            best = found if best is None or found.rms < best.rms else best
            if best.rms < self.good_m:
                break
        assert best is not None
        return best

    def starts(self) -> Iterator[Array]:
        """First guesses: the body at rest laid on the markers as a whole, its root alone, then other headings."""
        if not self.floating:
            yield self.rest
            return
        at_rest = _core.marker_positions(self.model, self.state(self.rest))
        root = self.seen & (np.array(self.segment_of) == self.roots[0])
        poses = [
            pose for chosen in (self.seen, root) if (pose := laid(at_rest[chosen], self.measured[chosen])) is not None
        ]
        centre, here = at_rest[self.seen].mean(axis=0), self.measured[self.seen].mean(axis=0)
        up = -np.array(self.model.spec.gravity)
        up = up / np.linalg.norm(up) if np.any(up) else np.array([0.0, 1.0, 0.0])
        for angle in np.deg2rad([0.0, 90.0, 180.0, 270.0]):
            turn = turned(angle * up)
            poses.append((turn, here - turn @ centre))
        for pose in poses:
            yield self.moved(*pose)

    def moved(self, turn: Array, shift: Array) -> Array:
        """The rest posture carried along by a rigid motion: the root's coordinates for p -> turn p + shift."""
        R, p = (part[self.roots[0]] for part in _core.segment_poses(self.model, self.state(self.rest)))
        spec = self.model.spec
        target = (turn @ R, turn @ p + shift)
        found = joint_coordinates(spec.segments[self.roots[0]], spec.coordinates, target, spec.parameters)
        q: Array = self.rest.copy()
        q[self.base] = [found[self.free[k]] for k in self.base]
        return q

    def mended(self, fit: _Fit) -> _Fit:
        """Starts the joints above the segment that fits worst again, elsewhere within their limits."""
        rng = np.random.default_rng(0)  # the same start for the same markers
        for _ in range(_RESTARTS):
            if fit.rms < self.good_m:
                break
            away = self.distances(fit.q)
            worst = self.segment_of[int(np.nanargmax(away))]
            again = [k for k in self.paths[worst] if k not in set(self.base.tolist())]
            if not again:
                break
            start = fit.q.copy()
            low = np.where(np.isfinite(self.lower), self.lower, self.rest - np.where(self.turns, np.pi, 0.1))
            high = np.where(np.isfinite(self.upper), self.upper, self.rest + np.where(self.turns, np.pi, 0.1))
            start[again] = rng.uniform(low[again], high[again])
            found = self.solve(start)
            fit = found if found.rms < fit.rms else fit
        return fit


def _turned(by: Array, turns: npt.NDArray[np.bool_]) -> float:
    return float(np.abs(by[turns]).sum())


def laid(points: Array, targets: Array) -> tuple[Array, Array] | None:
    """Rotation (3, 3) and shift (3,) m that lay points (K, 3) best on targets (K, 3); None where they lie in a line."""
    if len(points) < 3:
        return None
    a, b = points - points.mean(axis=0), targets - targets.mean(axis=0)
    size = np.linalg.svd(b.T @ a, compute_uv=False)
    if size[1] < 1e-6 * size[0]:
        return None
    turn = nearest_rotation(b.T @ a)
    return turn, targets.mean(axis=0) - turn @ points.mean(axis=0)


def bare(spec: _core.ModelSpec) -> _core.ModelSpec:
    """The same model, changed in place, with nothing in its state but coordinates, speeds and accelerations."""
    parameters, segments, markers = spec.parameters, spec.segments, spec.markers
    for parameter in parameters:
        parameter.estimated = False
    for segment in segments:
        segment.inertia_estimated = [False] * 10
    for marker in markers:
        marker.estimated = marker.soft_tissue = [False] * 3
    spec.parameters, spec.segments, spec.markers = parameters, segments, markers
    spec.wrench_offset, spec.wrench_delay, spec.contacts = [False] * 6, False, []
    return spec


def _paths(spec: _core.ModelSpec, order: dict[str, int]) -> tuple[list[list[int]], npt.NDArray[np.intp]]:
    """Free coordinates that move each segment, and those of the root."""
    found: dict[str, list[int]] = {"ground": []}
    base: list[int] = []
    for segment in spec.segments:
        own = [order[axis.coordinate] for axis in segment.axes if axis.coordinate in order]
        found[segment.name] = list(dict.fromkeys([*found[segment.parent], *own]))
        if segment.parent == "ground":
            base += own
    return [found[s.name] for s in spec.segments], np.array(list(dict.fromkeys(base)), dtype=np.intp)


def _refuse(body: _Body, fit: _Fit, bad_m: float, where: str) -> None:
    """Raises a ModelError that says what is wrong, where the fit is bad."""
    if fit.rms < body.good_m:
        return
    found = f"{where}: the model fits the markers to {1000.0 * fit.rms:.0f} mm only (root mean square)"
    at_rest, own = _core.marker_positions(body.model, body.state(body.rest))[body.seen], body.measured[body.seen]
    spread = float(np.sqrt(own.var(axis=0).sum() / at_rest.var(axis=0).sum()))
    if not 1.0 / _UNITS < spread < _UNITS:
        raise ModelError(f"{found}: they lie {spread:.3g} times as far apart as the model's, expected metres")
    mirrored = _mirror(body).fit()
    if mirrored.rms < MIRROR_RATIO * fit.rms:
        raise ModelError(
            f"{found}, and its mirror image to {1000.0 * mirrored.rms:.0f} mm: left and right are swapped, "
            "or an axis of the laboratory points the wrong way"
        )
    if fit.rms < bad_m:
        return
    away = body.distances(fit.q)
    worst = [k for k in np.argsort(-np.nan_to_num(away))[:3] if np.isfinite(away[k])]
    raise ModelError(
        f"{found}, expected less than {1000.0 * bad_m:.0f} mm: furthest off are "
        + ", ".join(f"{body.names[k]} ({1000.0 * away[k]:.0f} mm)" for k in worst)
    )


def _mirror(body: _Body) -> _Body:
    """The same body with its markers seen in a mirror (upright, across the ground's z)."""
    limits = {name: (low, high) for name, low, high in zip(body.free, body.lower, body.upper, strict=True)}
    return _Body(body.model, body.measured * np.array([1.0, 1.0, -1.0]), limits, "mirror")
