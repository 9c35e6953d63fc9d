"""Posterior of each constant against its prior: the standard deviation at the end over that before the first frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

from dynakin.elements import element
from dynakin.results.estimate import Estimate
from dynakin.results.naming import INERTIA_WORDS, listed, sentence, words
from dynakin.results.records import Parameter

Judgement = Literal["known", "partly", "nothing"]

KNOWN = 0.3
"""Nine tenths of the prior variance are gone: the value is the data's, for any prior."""
NOTHING = 0.9
"""Four fifths of the prior variance are left: the value is the prior's, within what tables differ by."""
JUDGEMENT_WORDS: dict[Judgement, str] = {
    "known": "known from the data",
    "partly": "known in part",
    "nothing": "not known from the data",
}


def judged(share: float) -> Judgement:
    """What a standard deviation that ends at this share of the prior one says."""
    return "known" if share <= KNOWN else "nothing" if share >= NOTHING else "partly"


def share_of(parameter: Parameter) -> float | None:
    """Standard deviation at the end over that before the first frame; None where it is not estimated."""
    if not parameter.estimated or not parameter.prior_sd:
        return None
    return parameter.posterior_sd / parameter.prior_sd


def group_of(parameter: Parameter) -> str | None:
    """Lengths, marker places or a kind of inertial number; None: no constant of the person."""
    if parameter.kind == "inertia":
        last = parameter.name.rpartition("/")[2]
        return "masses" if last == "mass" else "first moments" if last.startswith("m") else "moments of inertia"
    return {"length": "lengths", "marker": "marker places"}.get(parameter.kind)


def shares_of(parameters: Iterable[Parameter]) -> dict[str, dict[str, float]]:
    """Share of each constant by name, by group; groups without any are left out."""
    found: dict[str, dict[str, float]] = {
        group: {} for group in ("lengths", "marker places", "masses", "first moments", "moments of inertia")
    }
    for p in parameters:
        share, group = share_of(p), group_of(p)
        if share is not None and group is not None:
            found[group][p.name] = share
    return {group: shares for group, shares in found.items() if shares}


def posterior_figures(estimate: Estimate) -> dict[str, Any]:
    """The block ``identifiability`` of ``metrics.json``, as far as it follows from an estimate alone."""
    groups = shares_of(estimate.parameters)
    by_name = {p.name: p for p in estimate.parameters}
    return {
        "what": "standard deviation after the last frame over that before the first (share): known up to "
        f"{KNOWN:g}, nothing from {NOTHING:g}, partly between",
        "parameters": {
            name: {
                "prior_sd": by_name[name].prior_sd,
                "sd": by_name[name].posterior_sd,
                "share": share,
                "judgement": judged(share),
            }
            for shares in groups.values()
            for name, share in shares.items()
        },
        "groups": {group: counts(shares) for group, shares in groups.items()},
        "verdict": " ".join(posterior_in_words(estimate)),
    }


def posterior_in_words(estimate: Estimate) -> list[str]:
    """A sentence on each group of constants."""
    return [_sentence(group, shares) for group, shares in shares_of(estimate.parameters).items()]


def counts(shares: Mapping[str, float]) -> dict[Judgement, int]:
    """How many are known, partly known, not known."""
    judgements = [judged(share) for share in shares.values()]
    return {judgement: judgements.count(judgement) for judgement in JUDGEMENT_WORDS}


def _sentence(group: str, shares: Mapping[str, float]) -> str:
    number = counts(shares)
    found = []
    for judgement, text in JUDGEMENT_WORDS.items():
        names = [name for name, share in shares.items() if judged(share) == judgement]
        if names:
            which = "" if group == "marker places" or len(names) == len(shares) else f" ({_which(names)})"
            found.append(f"{number[judgement]} {text}{which}")
    return f"{sentence(group)} ({len(shares)}): {listed(found)}."


def _which(names: list[str]) -> str:
    """Segments, and where several numbers of each are in the group, how many of them."""
    segments: dict[str, list[str]] = {}
    for name in names:
        _, owner, kind = element(name)
        segments.setdefault(owner, []).append(kind)
    several = any(name.rpartition("/")[2] in ("mx", "my", "mz") for name in names)
    said = [
        words(segment) + (f" {' and '.join(INERTIA_WORDS[k].rpartition(', ')[2] for k in kinds)}" if several else "")
        for segment, kinds in segments.items()
    ]
    return listed(said, 12)
