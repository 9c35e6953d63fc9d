"""What a frame measures: z and R of all rows, which are present, and which are believed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.oracle import gate


def carried_to_origin(covariance: NDArray, r: NDArray) -> NDArray:
    """From a wrench about the point r to the same wrench about the origin: m_O = m_r + r x f; (6, 6)."""
    x, y, z = r
    carry = np.eye(6)
    carry[3:, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    return carry @ covariance @ carry.T


def rows(
    spec: Any, s: Any, markers: NDArray, wrench: NDArray, wrench_covariance: NDArray | None = None
) -> tuple[NDArray, NDArray, NDArray]:
    """z, R of all 3 M + 7 rows (R of absent ones is arbitrary) and which are present.

    ``wrench_covariance`` (6, 6) about the ground's origin: of this frame, in place of the settings'.
    """
    n_markers = len(spec.markers)
    n = 3 * n_markers + 7
    z, R, present = np.zeros(n), np.eye(n), np.zeros(n, bool)
    for k, marker in enumerate(spec.markers):
        here = slice(3 * k, 3 * k + 3)
        measured = np.array(marker.measured, bool)
        seen = np.isfinite(markers[k][measured]).all() and np.isfinite(s.marker_variance[k])
        present[here] = measured & seen
        z[here] = markers[k]
        if seen:
            R[here, here] = np.eye(3) * s.marker_variance[k]
    here = slice(3 * n_markers, 3 * n_markers + 6)
    R[here, here], known = wrench_noise(s)
    if wrench_covariance is not None:
        R[here, here] = wrench_covariance
    present[here] = np.array(spec.wrench_measured, bool) & np.isfinite(wrench) & known
    z[here] = wrench
    if s.total_mass is not None and np.isfinite(s.total_mass_variance):
        z[-1], R[-1, -1], present[-1] = s.total_mass, s.total_mass_variance, True
    return z, R, present


def wrench_noise(s: Any) -> tuple[NDArray, NDArray]:
    """Covariance at the origin, and which components have a finite variance there.

    An infinite variance of a force is carried by its lever into the moments, which are then unknown too.
    """
    block = np.array(s.wrench_covariance, float)
    infinite = np.isinf(np.diag(block))
    block[infinite, :] = 0.0
    block[:, infinite] = 0.0
    reached = carried_to_origin(np.diag(infinite.astype(float)), s.reference_point)
    return carried_to_origin(block, s.reference_point), np.diag(reached) == 0


def reports(s: Any, v: NDArray, H: NDArray, P: NDArray, R: NDArray, present: NDArray) -> dict[str, Any]:
    """Keys as the core's ``sensors``, with verdicts: of each marker and, last, of the plates, each judged alone."""
    sd = np.sqrt(np.diag(H @ P @ H.T + R))
    ratios, verdicts = [], []
    for first in range(0, len(v) - 7 + 1, 3):
        plates = first == len(v) - 7
        here = np.arange(first, first + (6 if plates else 3))
        here = here[present[here]]
        limit = s.wrench_gate if plates else s.marker_gate
        gated = len(here) > 0 and limit is not None
        ratios.append(gate.ratio(v[here], H[here], P, R[np.ix_(here, here)], limit) if gated else 0.0)
        verdicts.append("missing" if len(here) == 0 else "accepted" if ratios[-1] <= 1 else "refused")
    return {
        "innovation": np.where(present, v, np.nan)[:-1],
        "innovation_sd": np.where(present, sd, np.nan)[:-1],
        "test_ratio": np.where(np.array(verdicts) == "missing", np.nan, ratios),
        "verdicts": verdicts,
    }


def believed(s: Any, verdicts: list[str], present: NDArray) -> NDArray:
    """The rows that the update uses."""
    use = present.copy()
    for k, verdict in enumerate(verdicts):
        if verdict == "refused":
            use[3 * k : (3 * k + 3 if k < len(verdicts) - 1 else -1)] = False
    if s.wrench_needs_markers and "accepted" not in verdicts[:-1]:
        use[-7:-1] = False
    return use
