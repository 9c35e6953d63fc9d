"""C3D files byte by byte, as the format's guide has it: also those that ezc3d cannot write."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

BLOCK = 512
RATE_HZ = 100.0
Groups = Mapping[str, Mapping[str, Any]]


def made_c3d(
    path: Path,
    points: Mapping[str, np.ndarray] | Sequence[tuple[str, np.ndarray]],
    groups: Groups | None = None,
    *,
    unit: str | None = "mm",
    scale: float = -1.0,
    seen: np.ndarray | None = None,
    analog: np.ndarray | None = None,
    analog_scale: float = 1.0,
    per_frame: int = 1,
    analog_rate: float | None = None,
    first: int = 1,
    padding: int = 0,
    description: str = "",
) -> Path:
    """A file of an Intel processor.

    Args:
        points: names -> (T, 3) in ``unit``; pairs where a name is used twice.
        groups: further parameters, or others than those that follow from the data; None takes one away.
        unit: POINT:UNITS; None leaves it out.
        scale: positive: integer data, in steps of ``scale``; negative: floats.
        seen: (T, N), False: residual -1.
        analog: (C, T * per_frame), None: no ANALOG group.
        first: number of the first frame, from 1.
        padding: bytes between a parameter and the next one, which the format's guide does not have.
        description: of every parameter.
    """
    named = list(points.items()) if isinstance(points, Mapping) else list(points)
    places = np.stack([place for _, place in named], axis=1)  # (T, N, 3)
    n_frames, n_points = places.shape[:2]
    channels = np.empty((0, n_frames)) if analog is None else analog
    labels = [name for name, _ in named]
    point: dict[str, Any] = {"USED": n_points, "FRAMES": n_frames, "SCALE": scale, "RATE": RATE_HZ, "DATA_START": 0}
    for part in range(0, n_points, 255):
        point["LABELS" + (str(part // 255 + 1) if part else "")] = labels[part : part + 255]
    if unit is not None:
        point["UNITS"] = [unit]
    made: dict[str, dict[str, Any]] = {"POINT": point}
    if analog is not None:
        made["ANALOG"] = {
            "USED": len(analog),
            "RATE": RATE_HZ * per_frame if analog_rate is None else analog_rate,
            "GEN_SCALE": 1.0,
            "SCALE": [analog_scale] * len(analog),
            "OFFSET": [0] * len(analog),
            "LABELS": [f"ch{k + 1}" for k in range(len(analog))],
        }
    for group, entries in (groups or {}).items():
        made[group] = {key: value for key, value in (made.get(group, {}) | dict(entries)).items() if value is not None}
    data_block = 2 + len(_section(made, padding, description)) // BLOCK
    made["POINT"]["DATA_START"] = data_block
    section = _section(made, padding, description)
    last = first + n_frames - 1
    header = struct.pack(
        "<BBHHHHHfHHf", 2, 0x50, n_points, len(channels) * per_frame * (analog is not None), min(first, 65535),
        min(last, 65535), 0, scale, data_block, per_frame if analog is not None else 0, RATE_HZ,
    )  # fmt: skip
    kind = "<f4" if scale < 0 else "<i2"
    rows = np.zeros((n_frames, n_points, 4))
    rows[:, :, :3] = places / (1.0 if scale < 0 else scale)
    rows[:, :, 3] = 0.0 if seen is None else np.where(seen, 0.0, -1.0)
    data = rows.reshape(n_frames, -1)
    if analog is not None:
        samples = channels.T.reshape(n_frames, -1) / analog_scale
        data = np.hstack([data, samples])
    body = (data if scale < 0 else np.rint(data)).astype(kind).tobytes()
    path.write_bytes(header.ljust(BLOCK, b"\0") + section + body)
    return path


def _section(groups: Groups, padding: int, description: str) -> bytes:
    out = b""
    for number, (group, entries) in enumerate(groups.items(), 1):
        out += struct.pack("bb", len(group), -number) + group.encode() + struct.pack("<HB", 3, 0)
        for name, value in entries.items():
            content = _content(value) + bytes([len(description)]) + description.encode() + b"\xaa" * padding
            out += struct.pack("bb", len(name), number) + name.encode()
            out += struct.pack("<H", 2 + len(content)) + content
    out += b"\0\0"
    blocks = (len(out) + 4) // BLOCK + 1
    return (struct.pack("BBBB", 1, 0x50, blocks, 84) + out).ljust(blocks * BLOCK, b"\0")


def _content(value: Any) -> bytes:
    """Type, dimensions and values."""
    if isinstance(value, str):
        return struct.pack("bBB", -1, 1, len(value)) + value.encode()
    if isinstance(value, list) and value and isinstance(value[0], str):
        width = max(1, max(len(text) for text in value))
        return struct.pack("bBBB", -1, 2, width, len(value)) + b"".join(t.ljust(width).encode() for t in value)
    array = np.asarray(value)
    kind, size = ("<i2", 2) if array.dtype.kind in "iu" else ("<f4", 4)
    raw = (array & 0xFFFF).astype("<u2") if size == 2 else array.astype(kind)
    return struct.pack("bB", size, array.ndim) + bytes(array.shape) + raw.tobytes(order="F")
