"""Names and numbers as people read them: on the page, on screen and in the sentences of ``metrics.json``."""

from __future__ import annotations

import re

import numpy as np

from dynakin.messages import together

_WORD, _PUNCTUATION = re.compile(r"[^\W\d_][a-z'’-]*"), ",.;:!?)"

INERTIA_WORDS = {
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
    """`upper_arm` -> `upper arm`, `hip_flexion_r` -> `right hip flexion`."""
    for suffix, side in (("_r", "right"), ("_l", "left")):
        if len(name) > 2 and name.endswith(suffix):
            return f"{side} {name[:-2]}".replace("_", " ")
    return name.replace("_", " ")


def sentence(text: str) -> str:
    """With a capital at the start, the rest as it is; names (``r_sh2``, ``r.ASIS``, ``walk.mot``) stay as they are."""
    first = text.split(maxsplit=1)[0].rstrip(_PUNCTUATION) if text.strip() else ""
    return text[:1].upper() + text[1:] if _WORD.fullmatch(first) else text


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


def shown_unit(unit: str) -> tuple[float, str]:
    """Factor and unit in which a constant is shown: lengths in mm, angles in degrees."""
    if unit.partition("/")[0] == "m":
        return 1000.0, f"m{unit}"
    if unit == "rad":
        return float(np.rad2deg(1.0)), "deg"
    return 1.0, unit.replace("m2", "m²")


def listed(items: list[str], limit: int = 6) -> str:
    """`a, b and c`; the rest of a long list only counted."""
    if len(items) > limit:
        return f"{', '.join(items[:limit])} and {len(items) - limit} more"
    return together(items)


def plural(count: int, noun: str) -> str:
    """`1 frame`, `2 frames`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
