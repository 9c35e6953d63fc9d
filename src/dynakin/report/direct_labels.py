"""Words at the ends of lines instead of a legend, never closer than a line of text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes


def label_ends(
    axes: Axes, labels: Sequence[tuple[str, float, str]], *, size: float = 7.5, height_in: float = 2.5
) -> None:
    """Write (text, y in data, colour) to the right of the axes, pushed apart; call it after the limits are set.

    Args:
        height_in: of the axes, inches: how much a line of text takes.
    """
    low, high = axes.get_ylim()
    gap = 1.25 * size / 72.0 / height_in
    wanted = np.array([(y - low) / (high - low) for _, y, _ in labels])
    for (text, _, colour), y, start in zip(labels, spread(wanted, gap), wanted, strict=True):
        axes.annotate(
            text,
            (1.0, float(np.clip(start, 0.0, 1.0))),
            xycoords="axes fraction",
            xytext=(1.05, y),
            textcoords="axes fraction",
            va="center",
            color=colour,
            fontsize=size,
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": colour,
                "linewidth": 0.5,
                "shrinkA": 1,
                "shrinkB": 0,
                "relpos": (0.0, 0.5),
            },
        )


def spread(wanted: np.ndarray, gap: float) -> np.ndarray:
    """Places as near as they get to ``wanted`` that keep their order and are at least ``gap`` apart."""
    order = np.argsort(np.round(wanted / gap, 2), kind="stable")  # those at one place stay in the order given
    groups = [(float(wanted[k]), 1) for k in order]  # middle, members
    merged: list[tuple[float, int]] = []
    for group in groups:
        merged.append(group)
        while len(merged) > 1 and merged[-1][0] - merged[-2][0] < 0.5 * gap * (merged[-1][1] + merged[-2][1]):
            (b, n), (a, m) = merged.pop(), merged.pop()
            merged.append(((a * m + b * n) / (m + n), m + n))
    placed = np.empty_like(wanted)
    at = 0
    for middle, members in merged:
        placed[order[at : at + members]] = middle + gap * (np.arange(members) - 0.5 * (members - 1))
        at += members
    return placed
