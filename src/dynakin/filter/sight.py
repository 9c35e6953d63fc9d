"""What markers show of how each segment lies: it has some in sight, or those on what hangs on it show it."""

from __future__ import annotations

from itertools import takewhile

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.bindings import _core
from dynakin.filter.uncertainty.upright import floats
from dynakin.results.measures.sources import LEAST_OF_ROOT, Hidden, in_use, out_of_sight, taken_back, too_long
from dynakin.results.records import REFUSED
from dynakin.tree import Tree

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


class Shown:
    """Whether markers on what hangs on a segment show how it lies, where the next one that it hangs on is seen.

    They do where no turn of its joint leaves them where they are: five on a shank show the thigh, as the knee is a
    hinge; two at a wrist do not show the upper arm, which may turn about the line from shoulder to wrist with the
    forearm turning back. A root that floats hangs on nothing.
    """

    def __init__(self, model: _core.Model) -> None:
        spec, columns = model.spec, {name: k for k, name in enumerate(model.layout.names)}
        self._model, self._tree = model, Tree.of(spec.segments)
        self._columns = {
            s.name: list(dict.fromkeys(columns[a.coordinate] for a in s.axes if a.coordinate in columns))
            for s in spec.segments
        }
        self._owners, self._root = owners_of(spec), root_of(spec)

    def without(self, hidden: Hidden, states: Array, used: Flags) -> Hidden:
        """Segments out of sight (T,), without the frames in which others show them.

        Args:
            states: (T, n). used: (T, M) markers that show where the body is (`in_use`).
        """
        found = {}
        for name, own in hidden.items():
            found[name] = own.copy()
            for t in np.flatnonzero(own) if name != self._root else ():
                found[name][t] = not self._shows(name, states[t], used[t], {n for n, gone in hidden.items() if gone[t]})
        return found

    def _shows(self, name: str, state: Array, used: Flags, hidden: set[str]) -> bool:
        above = self._tree.nearest(self._tree.parents[name], self._owners)
        ends = [end for end in self._tree.next_below(name, self._owners) if end not in hidden]
        if not ends or above in hidden or not np.isfinite(state).all():
            return False
        own = self._between(above, name)
        columns = list(dict.fromkeys(column for end in ends for column in self._between(above, end)))
        rows = [3 * m + axis for m, owner in enumerate(self._owners) if used[m] and owner in ends for axis in range(3)]
        J = _core.marker_jacobian(self._model, state)[np.ix_(rows, columns)]
        values, vectors = np.linalg.eigh(J.T @ J)
        variance = np.square(vectors) @ (1.0 / np.maximum(values, 1e-12))
        at = [columns.index(column) for column in own]
        return bool(SKIN_M * np.sqrt(variance[at].max(initial=0.0)) < SHOWN_RAD)

    def _between(self, above: str, name: str) -> list[int]:
        """Columns of the coordinates of all joints by which a segment hangs on another."""
        joints = takewhile(lambda each: each != above, self._tree.up(name))
        return [column for joint in joints for column in self._columns[joint]]


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
