"""``markers.trc``: the estimated markers in the frame of ``coordinates.mot`` and the recording's unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dynakin.results.estimate import Estimate

DECIMALS = 6
"""Of a metre, of estimated markers: a hundredth of what cameras see."""
_PER_METRE = {"m": 1.0, "mm": 1000.0}


def laboratory_markers(estimate: Estimate) -> np.ndarray:
    """Estimated markers (T, M, 3), m, in the frame of ``coordinates.mot``: where skin has moved them.

    A planar model knows two axes only: its markers are given in the recording's own laboratory frame, with the third
    axis as measured. Where the marker was not measured such a point is not known in the laboratory and is NaN; its
    in-plane estimate is in ``estimate.nc``.
    """
    estimated = estimate.values("markers_estimated")
    if estimate.modelled_axes().all():
        return np.asarray(estimated)
    recording = estimate.recording
    recorded = np.stack([recording.marker(name) for name in estimate.marker_names], axis=1)
    measured = estimate.ground.points_to_ground(recorded)
    points = np.where(estimate.modelled_axes(), estimated, measured)
    points[~np.isfinite(points).all(axis=-1)] = np.nan
    return np.asarray(estimate.ground.points_to_laboratory(points))


def write_markers(estimate: Estimate, path: Path) -> None:
    """Write the estimated markers as TRC; a missing marker is three blank cells."""
    write_trc(
        path,
        estimate.time,
        estimate.marker_names,
        laboratory_markers(estimate),
        unit=estimate.recording.length_unit,
        decimals=DECIMALS,
    )


def write_trc(
    path: Path, time: np.ndarray, names: list[str], points: np.ndarray, *, unit: str, decimals: int = 9
) -> None:
    """Write markers ``points`` (T, M, 3), m, as a TRC file in ``unit`` ("m" or "mm"), ``decimals`` of a metre;
    NaN becomes blank cells."""
    frames, count = len(time), len(names)
    rate = (frames - 1) / (time[-1] - time[0]) if frames > 1 else 0.0
    rate_text = f"{rate:.10g}"
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate_text}\t{rate_text}\t{frames}\t{count}\t{unit}\t{rate_text}\t1\t{frames}",
        "\t".join(["Frame#", "Time", *(f"{name}\t\t" for name in names)]).rstrip("\t"),
        "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, count + 1)),
        "",
    ]
    scaled = np.asarray(points, dtype=float).reshape(frames, 3 * count) * _PER_METRE[unit]
    missing = ~np.isfinite(scaled)
    gaps = [bool(row.any()) for row in missing]
    number = f"%.{decimals - (3 if unit == 'mm' else 0)}f"
    whole = "\t".join([number] * (3 * count))
    for index, row in enumerate(scaled.tolist()):
        if gaps[index]:
            cells = ["" if blank else number % value for value, blank in zip(row, missing[index].tolist(), strict=True)]
        else:
            cells = [whole % tuple(row)]
        if missing[index, -1]:
            cells.append("")  # OpenSim takes a tab as the end of a cell and would miss an empty one at the end of a row
        lines.append("\t".join([str(index + 1), f"{time[index]:.12g}", *cells]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
