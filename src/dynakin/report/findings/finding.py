"""One finding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from dynakin.messages import Topic

Level = Literal["good", "note", "warning"]
Metrics = dict[str, Any]


@dataclass(frozen=True)
class Insight:
    """One finding: how much it matters, a short title, a sentence or two, and what to try, where something helps."""

    level: Level
    title: str
    text: str
    advice: str = ""
    topics: tuple[Topic, ...] = ()
    """Of the messages that it is about, where it is about some."""
