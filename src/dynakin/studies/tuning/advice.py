"""What a fit comes to, in plain words."""

from __future__ import annotations

from dynakin.results.measures.consistency import judge
from dynakin.studies.tuning.fit import Fit

WORSE = 1.05
"""A prediction that is this much worse counts as worse."""
NIS = (0.5, 2.0)
"""Of a row, as fitted settings should have it: the likelihood's best scale has 1, and half of it says otherwise."""


def recommendation(fit: Fit) -> list[str]:
    """Sentences: whether to use the fitted settings, which of them the recordings do not identify, what to look at."""
    found = []
    limit = [s.name for s in fit.settings if s.at_limit]
    if limit:
        rest = " ".join(f"--vary {s.name}" for s in fit.settings if not s.at_limit)
        found.append(
            f"Do not use the fitted settings as they are: at the end of its range: {', '.join(limit)}. Such a setting "
            "stands for something else, mostly for recordings that were smoothed before; fit again without it"
            f"{f' ({rest})' if rest else ''}. Held out, still: "
        )
        found[-1] += _whether(fit)[0].lower() + _whether(fit)[1:]
    else:
        found.append(_whether(fit))
    unknown = [s.name for s in fit.settings if not s.known and not s.at_limit and s.low is not None]
    if unknown:
        found.append(f"Not identified by these recordings (interval wider than a factor 3): {', '.join(unknown)}.")
    nis = fit.figures["fitted"]["nis_per_row"]
    if nis is not None and (kind := judge(nis, NIS)) != "consistent":
        found.append(f"With the fitted settings the filter is {kind}: its NIS is {nis:.2g} a row, expected about 1.")
    if len(fit.shared.trials) == 1:
        found.append(
            "One trial was held out by halves: the same person, markers and movement. Judge on another trial before "
            "you use these settings for a laboratory."
        )
    return found


def _whether(fit: Fit) -> str:
    name, unit = ("log-likelihood", " nats a row") if fit.criterion == "nll" else (f"criterion {fit.criterion}", "")
    pairs = [(f.figures["fitted"][fit.criterion], f.figures["start"][fit.criterion]) for f in fit.folds]
    if any(fitted is None for fitted, _ in pairs):
        return "Keep the settings that you started from: with the fitted ones the filter diverges where it is held out."
    gains = [float("inf") if start is None else start - fitted for fitted, start in pairs]
    listed_gains = ", ".join(f"{gain:+.3g}" for gain in gains).replace("-", "−")
    if min(gains) <= 0.0:
        return (
            f"Keep the settings that you started from: the fitted ones are not better in each held-out part ({name}: "
            f"{listed_gains}{unit})."
        )
    ahead = [(f.figures["fitted"]["ahead"], f.figures["start"]["ahead"]) for f in fit.folds]
    worse = [a / b for a, b in ahead if a is not None and b is not None and a > WORSE * b]
    if worse:
        return (
            f"Do not use the fitted settings without a look: they are better in each held-out part by {name} "
            f"({listed_gains}{unit}), but 100 ms ahead up to {100.0 * (max(worse) - 1.0):.0f} % worse."
        )
    return f"Use the fitted settings: they are better in each held-out part ({name}: {listed_gains}{unit})."
