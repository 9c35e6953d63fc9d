"""The report's summary in words: what was run, how well it fits, and what a reader should know before using it."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from dynakin.messages import Topic
from dynakin.report.findings import fit, forces, recording, said, uncertainty
from dynakin.report.findings.finding import Insight, Metrics
from dynakin.results.estimate import Estimate
from dynakin.results.naming import listed, plural, sentence


def in_short(found: list[Insight]) -> str:
    """One sentence for who reads no further: what holds, and what does not."""
    titles = [insight.title[:1].lower() + insight.title[1:] for insight in found if insight.level == "warning"]
    if not titles:
        return "Nothing in this run speaks against using it."
    return f"{sentence(plural(len(titles), 'finding'))} to look at before using this run: {listed(titles, 8)}."


OF_FORCES: frozenset[Topic] = frozenset(
    {
        *("weight", "mass", "height", "sex", "carried"),
        *("plates", "sum of the plates", "in step", "rate", "place", "zero", "gain", "free moment", "plate noise"),
        "vertical only",
    }
)
"""Topics of warnings after which a trial's forces, or the mass that they are compared with, may be wrong."""


def doubts_forces(found: Iterable[Insight]) -> bool:
    """Whether some of these warn of that."""
    return any(insight.level == "warning" and not OF_FORCES.isdisjoint(insight.topics) for insight in found)


def insights(estimate: Estimate, metrics: Metrics) -> list[Insight]:
    """All findings, in the order of the report; one whose blocks of ``metrics`` are None, because the stage that makes
    them failed (`dynakin.results.failures`), is left out."""
    found: list[Insight] = []
    for make, blocks in FINDINGS:
        if all(metrics[block] is not None for block in blocks) and (made := make(estimate, metrics)):
            found += made if isinstance(made, list) else [made]
    return found


FINDINGS: tuple[tuple[Callable[[Estimate, Metrics], Insight | list[Insight] | None], tuple[str, ...]], ...] = (
    (said.warned, ()),
    (forces.left, ("feet",)),
    (recording.failed, ()),
    (forces.moments, ("moments",)),
    (fit.markers, ("markers",)),
    (forces.wrench, ("wrench",)),
    (uncertainty.prediction, ("prediction", "wrench")),
    (uncertainty.consistency, ("consistency", "markers")),
    (uncertainty.speeds, ()),
    (fit.adaptation, ("adaptation",)),
    (fit.constants, ()),
    (fit.bounds, ("bounds",)),
    (fit.soft_tissue, ("soft_tissue",)),
    (fit.joint_limits, ()),
    (recording.missing, ("events",)),
    (recording.gated, ()),
    (recording.locked, ()),
    (recording.step_time, ()),
)
"""What looks for each finding, and the blocks of the metrics that it needs."""
