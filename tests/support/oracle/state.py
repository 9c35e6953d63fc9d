"""The state (3) with soft tissue, plate errors and contacts: its names in order, and what a specification means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.oracle.spec import INERTIA_NAMES

WRENCH_NAMES = ("fx", "fy", "fz", "mx", "my", "mz")


@dataclass
class Values:
    """Everything the mechanics needs: what is estimated from x, the rest from the specification."""

    q: NDArray  # (..., coordinates), all of them, locked ones at their value
    qd: NDArray
    qdd: NDArray
    parameters: dict[str, NDArray]  # (...) m
    markers: NDArray  # (..., M, 3) m, in the segments' frames
    soft_tissue: NDArray  # (..., M, 3) m, displacement from there
    inertia: NDArray  # (..., S, 10)
    offset: NDArray  # (..., 6) N and N m, the plates' slow error about the spec's point
    delay: NDArray  # (...) s, of the plates behind the markers
    contacts: NDArray  # (..., C, 6), what is not known of the contacts' wrenches


class Layout:
    """Where every number of x belongs. ``targets[i]`` = (block, ...indices) of element i."""

    def __init__(self, spec: Any) -> None:
        self.spec = spec
        free = [(i, c.name) for i, c in enumerate(spec.coordinates) if not c.locked]
        entries: dict[str, list[tuple[str, tuple]]] = {
            "coordinates": [(name, ("q", i)) for i, name in free],
            "speeds": [(f"{name}/speed", ("qd", i)) for i, name in free],
            "accelerations": [(f"{name}/acceleration", ("qdd", i)) for i, name in free],
            "lengths": [(f"length/{p.name}", ("parameters", p.name)) for p in spec.parameters if p.estimated],
            "markers": [
                (f"marker/{m.name}/{'xyz'[a]}", ("markers", k, a))
                for k, m in enumerate(spec.markers)
                for a in range(3)
                if m.estimated[a]
            ],
            "soft_tissue": [
                (f"soft_tissue/{m.name}/{'xyz'[a]}", ("soft_tissue", k, a))
                for k, m in enumerate(spec.markers)
                for a in range(3)
                if m.soft_tissue[a]
            ],
            "inertia": [
                (f"inertia/{s.name}/{INERTIA_NAMES[a]}", ("inertia", k, a))
                for k, s in enumerate(spec.segments)
                for a in range(10)
                if s.inertia_estimated[a]
            ],
            "plates": [(f"plates/{WRENCH_NAMES[a]}", ("offset", a)) for a in range(6) if spec.wrench_offset[a]]
            + [("plates/delay", ("delay",))] * bool(spec.wrench_delay),
            "contacts": [
                (f"contact/{name}/{WRENCH_NAMES[a]}", ("contacts", k, a))
                for k, name in enumerate(spec.contacts)
                for a in range(6)
            ],
        }
        self.names = [name for block in entries.values() for name, _ in block]
        self.targets = [target for block in entries.values() for _, target in block]
        self.size = len(self.names)
        self.blocks: dict[str, tuple[int, int]] = {}
        offset = 0
        for block, items in entries.items():
            self.blocks[block] = (offset, len(items))
            offset += len(items)

    def block(self, name: str) -> slice:
        offset, size = self.blocks[name]
        return slice(offset, offset + size)

    def initial_state(self) -> NDArray:
        """x of the specification's own values, at rest."""
        spec = self.spec
        fixed = unpack(self, np.zeros(self.size), values_of_spec=True)
        assert len(spec.coordinates) == len(fixed.q)
        x = []
        for block, *where in self.targets:
            values = getattr(fixed, block)
            x.append(values[where[0]] if block == "parameters" else values[tuple(where)])
        return np.array(x, float)


def unpack(layout: Layout, x: NDArray, values_of_spec: bool = False) -> Values:
    """The values that x (..., n) stands for; ``values_of_spec``: ignore x and take the specification's."""
    spec = layout.spec
    batch, dtype = x.shape[:-1], x.dtype

    def filled(rows: Any, shape: tuple[int, ...]) -> NDArray:
        base = np.array([np.asarray(r, float) for r in rows], float).reshape(shape)
        return np.broadcast_to(base, batch + base.shape).astype(dtype)

    n = len(spec.coordinates)
    values = Values(
        q=filled([c.value for c in spec.coordinates], (n,)),
        qd=filled(np.zeros(n), (n,)),
        qdd=filled(np.zeros(n), (n,)),
        parameters={p.name: np.full(batch, p.value, dtype) for p in spec.parameters},
        markers=filled([m.position for m in spec.markers], (len(spec.markers), 3)),
        soft_tissue=filled(np.zeros((len(spec.markers), 3)), (len(spec.markers), 3)),
        inertia=filled([s.inertia for s in spec.segments], (len(spec.segments), 10)),
        offset=filled(np.zeros(6), (6,)),
        delay=np.zeros(batch, dtype),
        contacts=filled(np.zeros((len(spec.contacts), 6)), (len(spec.contacts), 6)),
    )
    if values_of_spec:
        return values
    for i, (block, *where) in enumerate(layout.targets):
        if block == "parameters":
            values.parameters[where[0]] = x[..., i]
        else:
            getattr(values, block)[(..., *where)] = x[..., i]
    return values
