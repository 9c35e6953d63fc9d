"""Names and units as people read them in the report."""

from __future__ import annotations

import numpy as np

from dynakin.results import Estimate, Parameter

COMPONENT_LABELS = {
    "fx": ("Forward force", "N"),
    "fy": ("Vertical force", "N"),
    "fz": ("Rightward force", "N"),
    "mx": ("Moment about the forward axis", "N m"),
    "my": ("Moment about the vertical", "N m"),
    "mz": ("Moment about the rightward axis", "N m"),
}
_LEG, _ARM = ("ankle", "knee", "hip"), ("shoulder", "elbow", "wrist")
_INERTIA = {
    "mass": "mass",
    "mx": "first moment, forward",
    "my": "first moment, up",
    "mz": "first moment, right",
    "ixx": "inertia xx",
    "iyy": "inertia yy",
    "izz": "inertia zz",
    "ixy": "inertia xy",
    "ixz": "inertia xz",
    "iyz": "inertia yz",
}


def words(name: str) -> str:
    """`upper_arm` -> `upper arm`."""
    return name.replace("_", " ")


def sentence(text: str) -> str:
    """With a capital at the start, the rest as it is."""
    return text[:1].upper() + text[1:]


def short_marker_names(names: list[str]) -> dict[str, str]:
    """Names without the subject's prefix (`S1:RKNE` -> `RKNE`), where they all share one."""
    prefixes = {name.rpartition(":")[0] for name in names}
    strip = len(prefixes) == 1
    return {name: name.rpartition(":")[2] if strip else name for name in names}


def is_planar(estimate: Estimate) -> bool:
    """Whether the model explains the markers in one plane only."""
    return int(estimate.modelled_axes().sum()) == 2


def moment_note(estimate: Estimate, coordinate: str) -> str:
    """What a moment of a planar model stands for: it has the ground for a joint and one leg for two."""
    if not is_planar(estimate):
        return ""
    if coordinate == "toe":
        return "the ground’s moment about the toe"
    if coordinate in _LEG:
        return "sum of both legs"
    if coordinate in _ARM:
        return "sum of both arms"
    return ""


def parameter_label(parameter: Parameter, marker_names: dict[str, str]) -> str:
    """`inertia/thigh/mass` -> `thigh mass`, `marker/RKNE/x` -> `RKNE on the shank, x`."""
    parts = parameter.name.split("/")
    if parameter.kind == "length":
        return f"{words(parts[-1])} length"
    if parameter.kind == "marker":
        return f"{marker_names.get(parts[1], parts[1])} on the {words(parameter.segment)}, {parts[-1]}"
    return f"{words(parameter.segment)} {_INERTIA.get(parts[-1], parts[-1])}"


def number(value: float | None, unit: str = "", digits: int = 3) -> str:
    """A number of ``digits`` significant digits with its unit; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "–"
    if value == 0.0:
        text = "0"
    elif not 1e-4 <= abs(value) < 1e5:
        text = f"{value:.{digits - 1}e}"
    else:
        rounded = abs(float(f"{value:.{digits - 1}e}"))  # 9.996 has as many decimals as 10.0
        decimals = max(0, digits - 1 - int(np.floor(np.log10(rounded))))
        text = f"{value:.{decimals}f}"
    text = text.replace("-", "−")
    return f"{text} {unit}" if unit else text


def signed_percent(value: float) -> str:
    """`+0.7 %`, `−0.2 %`, `0.0 %`."""
    text = f"{value:+.1f}"
    return "0.0 %" if float(text) == 0.0 else f"{text} %".replace("-", "−")


def listed(items: list[str], limit: int = 6) -> str:
    """`a, b and c`; the rest of a long list only counted."""
    if len(items) > limit:
        return f"{', '.join(items[:limit])} and {len(items) - limit} more"
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def plural(count: int, noun: str) -> str:
    """`1 frame`, `2 frames`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
