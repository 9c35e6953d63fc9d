"""What markers show of how each segment lies: it has some in sight, or those on what hangs on it show it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dynakin.bindings import _core
from dynakin.filter.joint_errors import floats
from dynakin.results.measures.sources import LEAST_OF_ROOT, Hidden, in_use, out_of_sight, taken_back, too_long
from dynakin.results.records import REFUSED

Flags = npt.NDArray[np.bool_]
Array = npt.NDArray[np.float64]

SKIN_M, SHOWN_RAD = 0.01, np.deg2rad(10.0)
"""A segment out of sight is known where markers that skin moves by so much show its joint to so much. Of a person of
`truth3d` thighs between pelvis and shank come to 2 to 7 deg (five markers on the shank) and are as sure as said, shanks
between thigh and foot to 5; upper arms between trunk and wrist to 16 and more, bent as they may be, and are up to 115
deg off."""


def hidden_segments(
    model: _core.Model, states: Array, markers: Array, time: Array, verdicts: Array | None = None
) -> Hidden:
    """Segment with markers -> (T,) frames in which nobody knows how it lies: it is `out_of_sight`, and not shown by
    those that hang on it (`Shown`).

    Args:
        states: (T, n), of the model, or one for all frames (n,). markers: (T, M, 3). verdicts: (T, M + 1) of the
            filter, as the core gives them.
    """
    spec, seen = model.spec, np.asarray(np.isfinite(markers).any(axis=2))
    if verdicts is not None:
        seen = taken_back(seen, np.asarray(verdicts[:, :-1] == REFUSED))
    hidden = out_of_sight(seen, owners_of(spec), time, root_of(spec))
    if not any(own.any() for own in hidden.values()):
        return hidden
    return Shown(model).without(hidden, np.broadcast_to(states, (len(time), model.layout.size)), in_use(seen, time))


def owners_of(spec: _core.ModelSpec) -> list[str]:
    """The markers' segments."""
    return [marker.segment for marker in spec.markers]


def root_of(spec: _core.ModelSpec) -> str:
    """The segment that floats; "" of a model that stands on its root."""
    return next((segment.name for segment in spec.segments if floats(segment)), "")


def next_marked(
    parents: Sequence[int] | npt.NDArray[np.int_], marked: Sequence[bool]
) -> tuple[list[int], list[list[int]]]:
    """Of each segment the next one with markers that it hangs on (-1: none), and those that hang on it."""
    above, beyond = [-1] * len(parents), list[list[int]]([] for _ in parents)
    for k, parent in enumerate(parents):  # parents stand before their children
        if parent >= 0:
            above[k] = int(parent) if marked[int(parent)] else above[int(parent)]
    for k in reversed(range(len(parents))):
        if parents[k] >= 0:
            beyond[int(parents[k])] += [k] if marked[k] else beyond[k]
    return above, beyond


class Shown:
    """Whether markers on what hangs on a segment show how it lies, where the next one that it hangs on is seen.

    They do where no turn of its joint leaves them where they are: five on a shank show the thigh, as the knee is a
    hinge; two at a wrist do not show the upper arm, which may turn about the line from shoulder to wrist with the
    forearm turning back. A root that floats hangs on nothing.
    """

    def __init__(self, model: _core.Model) -> None:
        spec, columns = model.spec, {name: k for k, name in enumerate(model.layout.names)}
        self._model, self._names = model, [segment.name for segment in spec.segments]
        self._parents = [self._names.index(s.parent) if s.parent in self._names else -1 for s in spec.segments]
        self._columns = [
            list(dict.fromkeys(columns[a.coordinate] for a in s.axes if a.coordinate in columns)) for s in spec.segments
        ]
        self._owners = [self._names.index(owner) for owner in owners_of(spec)]
        self._root = root_of(spec)
        self._above, self._beyond = next_marked(self._parents, [k in self._owners for k in range(len(self._names))])

    def without(self, hidden: Hidden, states: Array, used: Flags) -> Hidden:
        """Segments out of sight (T,), without the frames in which others show them.

        Args:
            states: (T, n). used: (T, M) markers that show where the body is (`in_use`).
        """
        found = {}
        for name, own in hidden.items():
            k, found[name] = self._names.index(name), own.copy()
            for t in np.flatnonzero(own) if name != self._root else ():
                found[name][t] = not self._shows(k, states[t], used[t], {n for n, gone in hidden.items() if gone[t]})
        return found

    def _shows(self, k: int, state: Array, used: Flags, hidden: set[str]) -> bool:
        above = self._above[k]
        ends = [end for end in self._beyond[k] if self._names[end] not in hidden]
        if not ends or (above >= 0 and self._names[above] in hidden) or not np.isfinite(state).all():
            return False
        own = self._between(above, k)
        columns = list(dict.fromkeys(column for end in ends for column in self._between(above, end)))
        rows = [3 * m + axis for m, owner in enumerate(self._owners) if used[m] and owner in ends for axis in range(3)]
        J = _core.marker_jacobian(self._model, state)[np.ix_(rows, columns)]
        values, vectors = np.linalg.eigh(J.T @ J)
        variance = np.square(vectors) @ (1.0 / np.maximum(values, 1e-12))
        at = [columns.index(column) for column in own]
        return bool(SKIN_M * np.sqrt(variance[at].max(initial=0.0)) < SHOWN_RAD)

    def _between(self, above: int, k: int) -> list[int]:
        """Columns of the coordinates of all joints by which a segment hangs on another."""
        found: list[int] = []
        while k not in (above, -1):
            found += self._columns[k]
            k = self._parents[k]
        return found


class LiveSight:
    """`hidden_segments`, frame by frame: what is hidden counts from `UNSEEN_S` on, because nobody knows before how long
    it will be."""

    def __init__(self, model: _core.Model) -> None:
        owners, root = owners_of(model.spec), root_of(model.spec)
        self._shown = Shown(model)
        self._segments = list(dict.fromkeys(owners))
        self._own = [[k for k, owner in enumerate(owners) if owner == segment] for segment in self._segments]
        self._least = [
            min(LEAST_OF_ROOT, len(own)) if segment == root else 1
            for segment, own in zip(self._segments, self._own, strict=True)
        ]
        self._lost_s = np.full(len(owners), -np.inf)  # when each was lost; inf: it is seen, -inf: it never was
        self.used = np.zeros(len(owners), dtype=bool)  # `in_use`

    def look(self, time_s: float, markers: Array, state: Array, refused: Flags | None = None) -> Hidden:
        """Segment -> (1,) whether nobody knows how it lies, by the markers (M, 3), the state (n,) and what the filter
        refused (M,); empty where none is out of sight."""
        seen = np.isfinite(markers).any(axis=1)
        if refused is not None:
            seen &= ~(refused & np.isfinite(self._lost_s))  # `taken_back`
        self._lost_s = np.where(seen, np.inf, np.minimum(self._lost_s, time_s))
        self.used = ~too_long(time_s - self._lost_s)
        # when the last of each segment's markers was lost, of the root the last but one
        last = np.array([np.sort(self._lost_s[own])[-n] for own, n in zip(self._own, self._least, strict=True)])
        hidden = too_long(time_s - last) & np.isfinite(last)
        if not hidden.any():
            return {}
        out = dict(zip(self._segments, hidden[:, None], strict=True))
        return self._shown.without(out, state[None], self.used[None])
