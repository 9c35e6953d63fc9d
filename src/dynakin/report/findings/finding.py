"""One finding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Level = Literal["good", "note", "warning"]
Metrics = dict[str, Any]


@dataclass(frozen=True)
class Insight:
    """One finding: how much it matters, a short title, a sentence or two, and what to try, where something helps."""

    level: Level
    title: str
    text: str
    advice: str = ""
