"""What a run has to say of itself: sentences that know what they are about, and whether they warn.

Whoever shows or judges a message asks for its topic and its level, never for its words, which may be put better at any
time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

Level = Literal["note", "warning", "failure"]
"""A note needs nothing done; after a warning a trial may not be what it is taken for; a failure was not made at all."""
Topic = Literal[
    "recording",  # what a file holds, and what its reader changed
    "routine",  # the same, as it is done to every file of its kind
    "plates",  # what the plates hold, and who stands on them
    "sum of the plates",  # what is said of the plates as a whole
    "in step",  # plates whose delay was taken off
    "place",  # plates that press beside where the movement needs them to
    "rate",  # movement and forces that do not fit each other's times
    "weight",  # plates beside the mass
    "zero",  # plates that read something with nobody on them, or push sideways all the time
    "gain",  # plates whose forces are too large or small
    "free moment",  # plates whose moment about the vertical is off what the motion needs
    "plate noise",  # plates with more noise than plates have
    "vertical only",  # plates that measure no horizontal force
    "carried",  # what is in the hands
    "marker set",  # which one was chosen
    "labels",  # markers that are not where their names say
    "guessed",  # markers whose places no name says
    "joints",  # joints that no marker shows
    "held",  # knees held between a pelvis and a foot that are seen
    "mass",  # where the mass comes from
    "height",
    "physique",  # a person unlike those of the inertia tables
    "sex",
    "ground",  # what is up, and ahead
    "calibration",  # how the model was measured, and what is held still
    "details",  # the numbers of it
    "standing",  # a standing trial, or a stretch of standing, with bent legs
    "ankles",  # feet that nothing shows flat
    "identified",  # parameters of a subject file, and what they come from
    "scaling",  # a model that does not fit the person
    "masses",  # a model's file whose masses are hardly a person's
    "range",  # a model whose file clamps what the person does
    "noise",  # how large it was found
    "low-passed",  # markers that were filtered before they were given
    "smoothing",  # settings that have no smoother
    "angles",  # angles that can hardly be told apart
    "numbers",  # those that are none
    "lost",  # frames, or trials, in which the person was lost
    "method",  # methods that are compared with
    "results",  # stages that follow the estimate
]
TOPICS: tuple[Topic, ...] = get_args(Topic)
_OPENINGS: dict[Level, str] = {"note": "", "warning": "Warning: ", "failure": "Failed: "}


@dataclass(frozen=True)
class Message:
    """A sentence or two for people. ``str(message)`` is what files and consoles show: a warning opens with "Warning: ",
    a failure with "Failed: "; ``text`` is without."""

    topic: Topic
    level: Level
    text: str

    def __str__(self) -> str:
        return f"{_OPENINGS[self.level]}{self.text}"

    def of(self, whom: str) -> Message:
        """The same, said of one of several recordings."""
        return replace(self, text=f"{whom}: {self.text}")


def note(topic: Topic, text: str) -> Message:
    """A message that needs nothing done."""
    return Message(topic, "note", text)


def warning(topic: Topic, text: str) -> Message:
    """A message after which a trial may not be what it is taken for."""
    return Message(topic, "warning", text)


@dataclass
class Findings:
    """What a check says of what it looks at, on a topic where it names no other, and why that cannot be used."""

    topic: Topic
    messages: list[Message] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)

    def say(self, text: str, topic: Topic | None = None) -> None:
        """A note."""
        self.messages.append(note(topic or self.topic, text))

    def warn(self, text: str, topic: Topic | None = None) -> None:
        """A warning."""
        self.messages.append(warning(topic or self.topic, text))

    def refuse(self, text: str) -> None:
        """A reason for which it cannot be used."""
        self.refusals.append(text)


def about(messages: Iterable[Message], *topics: Topic) -> list[Message]:
    """Those on these topics."""
    return [message for message in messages if message.topic in topics]


def warnings_of(messages: Iterable[Message]) -> list[Message]:
    """The warnings among them."""
    return [message for message in messages if message.level == "warning"]


def notes_of(messages: Iterable[Message]) -> list[Message]:
    """Those that need nothing done."""
    return [message for message in messages if message.level == "note"]


def together(names: Sequence[str]) -> str:
    """Names in one sentence: `a, b and c`."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def as_attributes(messages: Iterable[Message]) -> dict[str, str]:
    """For the attributes of a file: ``messages`` as they are shown, and ``message_topics``, a line each."""
    messages = list(messages)
    return {
        "messages": "\n".join(str(message).replace("\n", " ") for message in messages),
        "message_topics": "\n".join(message.topic for message in messages),
    }


def from_attributes(attributes: Mapping[str, Any]) -> list[Message]:
    """Messages that `as_attributes` wrote. Files of dynakin 0.1 have no topics: "recording" stands for all of them."""
    lines, topics = (str(attributes.get(key, "")).split("\n") for key in ("messages", "message_topics"))
    if lines == [""]:
        return []
    topics = topics if "message_topics" in attributes else ["recording"] * len(lines)
    return [_read(topic, line) for topic, line in zip(topics, lines, strict=True)]


def _read(topic: str, line: str) -> Message:
    level: Level = "note"
    for other, opening in _OPENINGS.items():
        if opening and line.startswith(opening):
            level = other
    known: Topic = "recording"
    for one in TOPICS:
        if one == topic:
            known = one
    return Message(known, level, line.removeprefix(_OPENINGS[level]))
