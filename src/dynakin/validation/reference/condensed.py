"""The stacked least squares of all frames, condensed by one QR: a trial of any length becomes a small triangle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynakin.arrays import Array, Flags
from dynakin.errors import RecordingError

DECLARED_SIGMA = (10.0, 20.0, 10.0)
"""fx and fy (N), mz (N m): not the plates' own noise but the size of a planar model's error on a real squat."""
TOTAL_MASS_SD_KG = 0.01
"""Of the total mass as a soft constraint at each frame: the paper's R, 1e-4 kg^2 (Table I)."""


@dataclass(frozen=True, eq=False)
class Condensed:
    """``|A x - b|^2`` equals the sum of the weighted squares of all frames but for a constant.

    x = phi / scale, over the parameters that are estimated; rows are in units of the declared sigma.

    Attributes:
        names: (p,) of all parameters. table: (p,) phi of the table. scale: (p,). estimated: (p,) bool; the others are
            held at the table.
        A, b: (e, e), (e,) of the frames' wrenches alone, e estimated parameters.
        mass_row, mass: (e,) and its right-hand side, weighted; zeros where no total mass is asked for.
        frames: how many were used. tolerance: relative size below which a singular value of A is rounding.
    """

    names: tuple[str, ...]
    table: Array
    scale: Array
    estimated: Flags
    A: Array
    b: Array
    mass_row: Array
    mass: float
    frames: int
    tolerance: float

    def with_mass(self) -> tuple[Array, Array]:
        """A and b with the row of the total mass."""
        return np.vstack([self.A, self.mass_row]), np.append(self.b, self.mass)

    def full(self, x: Array) -> Array:
        """phi (p,) from x (e,); what is not estimated as the table has it."""
        phi = self.table.copy()
        phi[self.estimated] = x * self.scale[self.estimated]
        return phi


def stacked(
    names: tuple[str, ...],
    table: Array,
    scale: Array,
    estimated: Flags,
    Y: Array,
    y: Array,
    *,
    mass_kg: float | None = None,
    sigma: Sequence[float],
) -> Condensed:
    """Stack the frames in which coordinates and wrench are known, of any regressor of the wrench.

    Args:
        names, table, scale, estimated: (p,) as in `Condensed`.
        Y, y: (T, r, p) and (T, r), measured components; frames with NaN are left out.
        mass_kg: total mass held by the soft constraint; None: not held.
        sigma: (r,) declared standard deviations, N and N m.

    Raises:
        RecordingError: fewer frames than parameters.
    """
    known = np.isfinite(Y).all(axis=(1, 2)) & np.isfinite(y).all(axis=1)
    frames, unknowns = int(known.sum()), int(estimated.sum())
    if frames < unknowns:
        raise RecordingError(
            f"identification: {frames} frames have all coordinates and the wrench, expected at least {unknowns} for "
            f"{unknowns} parameters"
        )
    weight = 1.0 / np.asarray(sigma)
    rows = ((y[known] - Y[known][:, :, ~estimated] @ table[~estimated]) * weight).ravel()
    columns = (Y[known][:, :, estimated] * weight[:, None]).reshape(-1, unknowns) * scale[estimated]
    R: Array = np.asarray(np.linalg.qr(np.column_stack([columns, rows]), mode="r"))
    is_mass = np.array([name.endswith("/mass") for name in names])
    strength = 0.0 if mass_kg is None else np.sqrt(frames) / TOTAL_MASS_SD_KG
    held = float(table[is_mass & ~estimated].sum())
    return Condensed(
        names, table, scale, estimated, R[:unknowns, :unknowns], R[:unknowns, unknowns],
        strength * (is_mass * scale)[estimated], strength * ((mass_kg or 0.0) - held),
        frames, float(np.finfo(float).eps) * columns.shape[0],
    )  # fmt: skip
