"""Names and units as people read them in the report."""

from __future__ import annotations

from dynakin.elements import element
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import evaluation_window
from dynakin.results.naming import INERTIA_WORDS, words
from dynakin.results.records import Parameter

COMPONENT_LABELS = {
    "fx": ("Forward force", "N"),
    "fy": ("Vertical force", "N"),
    "fz": ("Rightward force", "N"),
    "mx": ("Moment about the forward axis", "N m"),
    "my": ("Moment about the vertical", "N m"),
    "mz": ("Moment about the rightward axis", "N m"),
}
_LEG, _ARM = ("ankle", "knee", "hip"), ("shoulder", "elbow", "wrist")


def short_marker_names(names: list[str]) -> dict[str, str]:
    """Names without the subject's prefix (`S1:RKNE` -> `RKNE`), where they all share one."""
    prefixes = {name.rpartition(":")[0] for name in names}
    strip = len(prefixes) == 1
    return {name: name.rpartition(":")[2] if strip else name for name in names}


def moment_note(estimate: Estimate, coordinate: str) -> str:
    """What a moment of a planar model stands for: it has the ground for a joint and one leg for two."""
    if not estimate.planar:
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
    _, owner, last = element(parameter.name)
    if parameter.kind == "length":
        return words(owner) if parameter.unit == "1" or parameter.is_correction else f"{words(owner)} length"
    if parameter.kind == "marker":
        return f"{marker_names.get(owner, owner)} on the {words(parameter.segment)}, {last}"
    last = last or owner
    return f"{words(parameter.segment)} {INERTIA_WORDS.get(last, last)}"


def since(estimate: Estimate) -> str:
    """A sentence for a section whose numbers leave the first seconds out beside curves that show them; else ""."""
    start = float(estimate.time[evaluation_window(estimate.time)][0])
    return f" Numbers above panels are from {start:.4g} s on." if start > estimate.time[0] else ""


def signed_percent(value: float) -> str:
    """`+0.7 %`, `−0.2 %`, `0.0 %`."""
    text = f"{value:+.1f}"
    return "0.0 %" if float(text) == 0.0 else f"{text} %".replace("-", "−")
