"""The run itself: what could not be made, what is locked, how long a step took."""

from __future__ import annotations

from dynakin.report.findings.finding import Insight, Metrics
from dynakin.results.estimate import Estimate
from dynakin.results.failures import LOG
from dynakin.results.naming import listed, number, sentence, words


def failed(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Stages that failed after the estimate."""
    said = [message.text for message in estimate.messages if message.level == "failure"]
    if not said:
        return None
    return Insight("warning", "Not made", " ".join(said), f"{LOG} has the details; please report them.")


def locked(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Coordinates that are held still."""
    free = {str(name) for name in estimate.data["element"].values}
    held = [words(name) for name in estimate.coordinate_names if name not in free]
    if not held:
        return None
    verb = "is" if len(held) == 1 else "are"
    return Insight("note", "Locked", f"{sentence(listed(held))} {verb} held still; the notes below say why.")


def step_time(estimate: Estimate, metrics: Metrics) -> Insight:
    """How long a step took."""
    timing = estimate.timing
    factor, unit = (1e-3, "ms") if timing.median_us >= 1000.0 else (1.0, "µs")
    times = number(timing.realtime_factor, digits=2)
    speed = f"{times} times faster than" if timing.realtime_factor >= 1.0 else f"only {times} times as fast as"
    return Insight(
        "note",
        "Time of a step",
        f"A step took {number(factor * timing.median_us, unit)} (median; 99 of 100 within "
        f"{number(factor * timing.p99_us, unit)}), {speed} the recording went.",
    )
