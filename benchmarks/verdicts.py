"""Thresholds of the verdicts, chosen on trials with known truth and judged on others.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/verdicts.py [--write] [--again] [--present]
        [--truth3d FOLDER --since TIME]

Simulated planar squats, and squats and walks of the whole body, good ones and with one trouble each
(`known_truth_cases.TROUBLES`), and what dynakin made after TIME, with no option but --lag and --live-like, of truth3d's
whole trials in FOLDER (its cache; the newest results of each method and options). Of each run: what it can compute
itself (`statistics_of`), and its true deviation over error and coverage by group. A group *is* overconfident where
deviations are below half of the errors or hold the truth in less than 85 %, conservative where they are above 2.5
times. For each group and word, of runs with declared noise and with calibrated noise apart, the statistic and threshold
with the best balanced accuracy on one half of the seeds are taken; the tables are of the other. Where no threshold
reaches `LEAST_ACCURACY`, the limit lies beyond all runs of that half.

``--write`` puts thresholds into ``results/measures/verdicts.toml`` and the tables into ``docs/validation/verdicts.md``;
``--present`` judges the thresholds as they are and chooses none, ``--write`` then puts down tables alone; ``--again``
runs everything anew (else what was kept); ``--kept`` takes only what was kept.
"""

from __future__ import annotations

import argparse
import json
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
import xarray as xr
from known_truth import KEPT, ROOT, Array, run
from known_truth_cases import TROUBLES, troubled
from pages import put

from dynakin.results.measures.consistency import (
    INSIDE,
    SD_OVER_ERROR,
    Judgement,
    Limit,
    Limits,
    NoiseFrom,
    judge_group,
    limits,
    noise_from,
    statistics_of,
)
from dynakin.results.measures.sources import MEASURED
from dynakin.results.records import REFUSED
from dynakin.validation.coverage import Z_95

TRUTH3D = Path("/work/t3d/cache")
TARGET = ROOT / "src" / "dynakin" / "results" / "measures" / "verdicts.toml"
SEEDS = {"sagittal": (1, 2, 3, 4), "gait": (1, 2, 3, 4, 5, 6), "squat": (1, 2, 3, 4, 5, 6)}
WINDOWS_S = {"squat": (2.0, np.inf), "walk": (0.3, 3.1)}
"""As truth3d judges."""
BLOCKS = {"motion": ("coordinates", "speeds"), "moments": ("moments",)}
WORDS: tuple[Judgement, ...] = ("conservative", "consistent", "overconfident")
CANDIDATES = ("markers_larger", "wrench_larger")
"""Statistics that may judge. Either part alone did worse: that of single frames misses soft tissue, the averaged one
noise of the cameras."""
LEAST_ACCURACY = 0.75
"""Balanced accuracy below which a threshold tells nothing (0.5: as good as chance)."""
BEYOND = {
    ("motion", "conservative"): "markers_larger",
    ("motion", "overconfident"): "markers_larger",
    ("moments", "conservative"): "markers_larger",
    ("moments", "overconfident"): "wrench_larger",
}
"""What a limit beyond all runs is of: nearly all of a moment's deviation is the motion's."""
LEAST_RUNS = 3
"""Fewer runs of a word are no ground for a threshold."""
ROOM = 4.0
"""How far beyond all runs the limit of a word lies that cannot be told: real recordings, without known truth, go to
twice what the simulated ones have."""
PULL = 0.03
"""Of two thresholds whose balanced accuracies differ by less, that with more room to the nearest trials is taken."""


class Truth(NamedTuple):
    """Of one group: deviation over error (geometric mean over coordinates), share of the truth in 95 %."""

    ratio: float
    inside: float

    @property
    def word(self) -> Judgement:
        if self.ratio < SD_OVER_ERROR[0] or self.inside < INSIDE:
            return "overconfident"
        return "conservative" if self.ratio > SD_OVER_ERROR[1] else "consistent"


AllLimits = Mapping[NoiseFrom, Mapping[str, Limits]]


@dataclass(frozen=True)
class Trial:
    motion: str
    trouble: str
    seed: int
    statistics: Mapping[str, float]
    truth: Mapping[str, Truth]
    noise: NoiseFrom
    warned: tuple[str, ...] = ()
    """Titles of its other warnings."""

    @property
    def chooses(self) -> bool:
        """Whether thresholds are chosen on it; else they are judged on it. Own simulator: odd seeds; truth3d: 1, 2."""
        return self.seed <= 2 if self.motion.startswith("truth3d") else self.seed % 2 == 1


def simulated(again: bool, kept: bool) -> Iterator[Trial]:
    for motion, seeds in SEEDS.items():
        for seed in seeds:
            for trouble in TROUBLES:
                spec = troubled(trouble, motion, seed)
                if kept and not (KEPT / f"{spec.key()}.pickle").exists():
                    continue
                found = run(spec, again)
                if found.data is None or found.truth is None or found.window is None:
                    print(f"{motion}, {trouble}, {seed}: refused: {found.said}", flush=True)
                    continue
                warned = tuple(title for level, title, _ in found.insights if level == "warning")
                made = _trial(motion, trouble, seed, found.data, found.truth, found.window)
                yield replace(made, warned=tuple(dict.fromkeys(t for t in warned if t != "Uncertainty")))


def of_truth3d(cache: Path, since: datetime) -> Iterator[Trial]:
    """What was made of truth3d's trials: of each trial, method and options the newest, none older than ``since``."""
    for folder in sorted(cache.glob("trials/*_s[0-9]*")):
        motion, _, seed = folder.name.rpartition("_")[0].rpartition("_s")
        if json.loads((folder / "trial.json").read_text())["settings"]["without"]:
            continue
        made: dict[str, Path] = {}
        for file in sorted(folder.glob("runs/*/results/estimate.nc"), key=lambda f: f.stat().st_mtime):
            run_folder = file.parents[1]
            unfinished = run_folder.suffix == ".part" or not (run_folder / "run.json").exists()
            if unfinished or file.stat().st_mtime < since.timestamp():
                continue
            options = json.loads((run_folder / "run.json").read_text())["options"]
            if options.startswith(("--lag", "--live-like")) or not options:
                made[f"{run_folder.name.split('_')[0].removesuffix('s')} {options or 'smoothed'}"] = file
        content = np.load(folder / "truth.npz", allow_pickle=True)
        truth = xr.Dataset(
            {
                name: (("time", "coordinate"), content[key])
                for name, key in (("coordinates", "q"), ("speeds", "u"), ("moments", "tau"))
            },
            coords={"time": content["t"], "coordinate": [str(name) for name in content["names"]]},
        )
        for method, file in made.items():
            with xr.open_dataset(file) as opened:
                data = opened.load()
            time = data["time"].values
            start, end = WINDOWS_S[motion.split("_")[0]]
            own = truth.sel(time=time, method="nearest")
            yield _trial(f"truth3d {motion}", method, int(seed), data, own, (time >= start) & (time <= end))


def _trial(motion: str, trouble: str, seed: int, data: xr.Dataset, truth: xr.Dataset, window: Array) -> Trial:
    noise = noise_from(json.loads(data.attrs["configuration"]))
    judged = {group: _truth(data, truth, window, blocks) for group, blocks in BLOCKS.items()}
    return Trial(motion, trouble, seed, _statistics(data), judged, noise)


def _statistics(data: xr.Dataset) -> dict[str, float]:
    """As a run computes them: over its own window (the whole of a short trial)."""
    from dynakin.results.measures.metrics import evaluation_window

    window = evaluation_window(data["time"].values)
    axes = data["marker_axes_modelled"].values.astype(bool)
    order = ("time", "marker", "axis")
    off, sd = (data[f"markers_innovation{end}"].transpose(*order).values[window][:, :, axes] for end in ("", "_sd"))
    refused = data["verdict"].transpose("time", "sensor").values[window, :-1] == REFUSED
    sd = np.where(refused[:, :, None], np.nan, sd)
    wrench = [data[f"wrench_innovation{e}"].transpose("time", "component").values[window] for e in ("", "_sd")]
    flat = (len(off), -1)
    return statistics_of(data["time"].values[window], (off.reshape(flat), sd.reshape(flat)), (wrench[0], wrench[1]))


def _truth(data: xr.Dataset, truth: xr.Dataset, window: Array, blocks: Sequence[str]) -> Truth:
    """Of rotations that both have; angles with their mean error taken out, moments where they are measured."""
    turns = dict(zip(map(str, data["coordinate"].values), data["coordinate_type"].values, strict=True))
    names = [name for name in map(str, truth["coordinate"].values) if turns.get(name) == "rotation"]
    ratios, inside = [], []
    for block in blocks:
        own = [name for name in names if block != "moments" or not name.startswith("pelvis")]
        order = ("time", "coordinate")
        given, sd, true = (
            source[name].sel(coordinate=own).transpose(*order).values[window]
            for source, name in ((data, block), (data, f"{block}_sd"), (truth, block))
        )
        error = np.where(sd > 0.0, given - true, np.nan)
        if block == "moments" and "moment_source" in data:
            source = data["moment_source"].sel(coordinate=own).transpose(*order).values[window]
            error = np.where(source == MEASURED, error, np.nan)
        error = error[:, np.isfinite(error).sum(axis=0) > 10], sd[:, np.isfinite(error).sum(axis=0) > 10]
        off, wide = error
        if not off.shape[1]:
            continue
        if block == "coordinates":
            off = off - np.nanmean(off, axis=0)
        known = np.isfinite(off)
        wide = np.where(known, wide, np.nan)
        ratios.append(np.sqrt(np.nanmean(wide**2, axis=0) / np.nanmean(off**2, axis=0)))
        inside.append(np.mean(np.abs(off[known]) <= Z_95 * wide[known]))
    if not ratios:
        return Truth(np.nan, np.nan)
    return Truth(float(np.exp(np.mean(np.log(np.concatenate(ratios))))), float(np.mean(inside)))


def chosen(trials: Sequence[Trial], noise: NoiseFrom, group: str) -> Limits:
    """Statistic and threshold of either word, by balanced accuracy on these trials."""
    known = [t for t in trials if t.noise == noise and np.isfinite(t.truth[group].ratio)]
    print(f"{noise}, {group}: {dict(Counter(t.truth[group].word for t in known))}")
    return Limits(_limit(known, group, "conservative", -1.0), _limit(known, group, "overconfident", 1.0))


def _limit(trials: Sequence[Trial], group: str, word: Judgement, sign: float) -> Limit:
    """The word is said where sign * (statistic - value) > 0."""
    is_so = np.array([t.truth[group].word == word for t in trials])
    best: tuple[float, float, Limit] | None = None
    for name in CANDIDATES if min(is_so.sum(), (~is_so).sum()) >= LEAST_RUNS else ():
        values = np.log([t.statistics[name] for t in trials])
        for low, high in pairwise(np.unique(values)):
            said = sign * (values - 0.5 * (low + high)) > 0.0
            score = 0.5 * (np.mean(said[is_so]) + np.mean(~said[~is_so]))
            room = min(high - low, 1.0)
            if best is None or score + PULL * room > best[0] + PULL * best[1]:
                best = (score, room, Limit(name, float(np.exp(0.5 * (low + high)))))
    if best is not None and best[0] >= LEAST_ACCURACY:
        print(f"{group}, {word}: {best[2].statistic} {best[2].value:.3g}, balanced accuracy {best[0]:.2f}")
        return best[2]
    name = BEYOND[group, word]
    outermost = sign * max(sign * np.log(t.statistics[name]) for t in trials)
    print(f"{group}, {word}: beyond all runs ({best})")
    return Limit(name, float(np.exp(outermost + sign * np.log(ROOM))))


def confusion(trials: Sequence[Trial], limits: AllLimits) -> list[str]:
    """Rows: what a run is; columns: what it says of itself."""
    lines = [
        "| noise | group | runs that are | " + " | ".join(f"said {word}" for word in WORDS) + " |",
        "|---|---|---|---|---|---|",
    ]
    for noise, groups in limits.items():
        for group, own in groups.items():
            known = [t for t in trials if t.noise == noise and np.isfinite(t.truth[group].ratio)]
            count = Counter((t.truth[group].word, judge_group(t.statistics, own)) for t in known)
            for word in WORDS:
                cells = " | ".join(str(count[word, said]) for said in WORDS)
                lines.append(f"| {noise} | {group} | {word} | {cells} |")
    return lines


def by_trouble(trials: Sequence[Trial], limits: AllLimits) -> list[str]:
    """Each kind of trial: true deviation over error and coverage, and how often each word was said."""
    heads = " | ".join(f"{group}: sd / error, in 95 %, said" for group in BLOCKS)
    lines = [f"| trial | trouble or method | noise | runs | {heads} | other warnings |"]
    lines.append("|---|---|---|---|---|" + "---|" * len(BLOCKS))
    kinds = dict.fromkeys((t.motion, t.trouble, t.noise) for t in trials)
    for motion, trouble, noise in kinds:
        own = [t for t in trials if (t.motion, t.trouble, t.noise) == (motion, trouble, noise)]
        cells = []
        for group, limit in limits[noise].items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                ratio = np.exp(np.nanmean(np.log([t.truth[group].ratio for t in own])))
                inside = 100.0 * np.nanmean([t.truth[group].inside for t in own])
            said = Counter(judge_group(t.statistics, limit) for t in own)
            words = ", ".join(f"{word} {n}" if len(own) > 1 else str(word) for word, n in said.items())
            cells.append(f"{ratio:.2g}, {inside:.0f}, {words}" if np.isfinite(ratio) else "–")
        others = Counter(title for t in own for title in t.warned)
        cells.append(", ".join(f"{title} {n}" if len(own) > 1 else title for title, n in others.items()) or "–")
        lines.append(f"| {motion} | {trouble} | {noise} | {len(own)} | " + " | ".join(cells) + " |")
    return lines


def toml(limits: AllLimits, trials: int, judged: int) -> str:
    lines = [
        "# When a run is called conservative or overconfident. Written by `benchmarks/verdicts.py --write`: chosen on",
        f"# {trials} trials with known truth, judged on {judged} others (docs/validation/verdicts.md).",
        "# A statistic is one of `statistics_of`; conservative below its value, overconfident above. Where no",
        f"# threshold told a word's runs from others, its value lies beyond all of the first by a factor of {ROOM:g}.",
    ]
    for noise, groups in limits.items():
        for group, own in groups.items():
            lines += ["", f"[limits.{noise}.{group}]"]
            for word, limit in zip(Limits._fields, own, strict=True):
                lines.append(f'{word} = {{ statistic = "{limit.statistic}", value = {limit.value:.3g} }}')
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--kept", action="store_true")
    parser.add_argument("--present", action="store_true")
    parser.add_argument("--truth3d", type=Path, default=TRUTH3D)
    parser.add_argument("--since", type=datetime.fromisoformat, default=datetime.min.replace(year=1970))
    asked = parser.parse_args()
    trials = [*simulated(asked.again, asked.kept), *of_truth3d(asked.truth3d, asked.since)]
    choosing, judging = ([t for t in trials if t.chooses == half] for half in (True, False))
    anew = {n: {group: chosen(choosing, n, group) for group in BLOCKS} for n in get_args(NoiseFrom)}
    taken: AllLimits = limits() if asked.present else anew
    said = "; ".join(
        f"{noise} noise, {group} {word} {'below' if word == 'conservative' else 'above'} {limit.value:.2g} of "
        f"`{limit.statistic}`"
        for noise, groups in taken.items()
        for group, own in groups.items()
        for word, limit in zip(Limits._fields, own, strict=True)
    )
    how = "As they are; of the half that may choose" if asked.present else "Chosen on"
    text = [
        f"{how} {len(choosing)} trials (own simulator: odd seeds; truth3d: 1, 2): {said}. On these:",
        "",
        *confusion(choosing, taken),
        "",
    ]
    text += [f"On {len(judging)} others:", "", *confusion(judging, taken), ""]
    text += ["The others by what was wrong:", "", *by_trouble(judging, taken)]
    print("\n".join(text))
    if asked.write:
        if not asked.present:
            TARGET.write_text(toml(taken, len(choosing), len(judging)), encoding="utf-8")
        put("validation/verdicts.md", "verdicts", text)


if __name__ == "__main__":
    main()
