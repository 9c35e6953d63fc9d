"""Accuracy as a function of what is given, from simulation: the tables and the figure of ``docs/accuracy.md``.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/given.py --write [--again] [--seeds 1,2,3,4,5,6,7,8]

Walks (2.5 s) and squats (2.7 s) of the whole body at 60 Hz, smoothed; one factor at a time is changed from a base case
(`known_truth_cases.GIVEN`), and all of them at once. A cell is the mean over seeds (each another person, skin and way
of moving) and sides, and the standard deviation over seeds. Runs are kept (`known_truth`); ``--again`` makes them anew.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from known_truth import KEPT, Array, Run, run
from known_truth_cases import GIVEN, given
from pages import DOCS, put

from dynakin.results.measures.sources import ABSENT, MEASURED
from dynakin.validation.coverage import Z_95

FIGURE = DOCS / "figures" / "accuracy.png"
MOTIONS = {"gait": "Walking", "squat": "Squatting"}
JOINTS = {"hip": "hip_flexion", "knee": "knee_angle", "ankle": "ankle_angle"}
BLOCKS = {"angles": "coordinates", "speeds": "speeds", "moments": "moments"}
UNITS = {"angles": "deg", "offset": "deg", "speeds": "rad/s", "moments": "N m", "moments, derived": "N m"}
LEAST_FRAMES = 10


@dataclass(frozen=True)
class Errors:
    """Of one run, by quantity: RMS errors of `JOINTS` (mean over sides; NaN where there are none), RMS deviation over
    RMS error (geometric mean), share of the truth in 95 %."""

    size: dict[str, Array]
    ratio: dict[str, float]
    inside: dict[str, float]


def errors(found: Run) -> Errors:
    """Angles about their mean error, which is the offset; moments where all that they need is measured, and where they
    are derived or a prior."""
    assert found.data is not None and found.truth is not None and found.window is not None
    size: dict[str, Array] = {}
    ratio: dict[str, float] = {}
    inside: dict[str, float] = {}
    names = [f"{stem}_{side}" for stem in JOINTS.values() for side in "rl"]
    order = ("time", "coordinate")
    source = found.data["moment_source"].sel(coordinate=names).transpose(*order).values[found.window]
    for title, block in BLOCKS.items():
        given_, sd, true = (
            data[name].sel(coordinate=names).transpose(*order).values[found.window]
            for data, name in ((found.data, block), (found.data, f"{block}_sd"), (found.truth, block))
        )
        off = given_ - true
        if title == "angles":
            size["offset"] = _by_joint(np.degrees(np.abs(off.mean(axis=0))))
            off = off - off.mean(axis=0)
        parts = {title: np.ones_like(off, dtype=bool)}
        if title == "moments":
            parts = {title: source == MEASURED, "moments, derived": (source != MEASURED) & (source != ABSENT)}
        for part, taken in parts.items():
            error, wide = np.where(taken, off, np.nan), np.where(taken, sd, np.nan)
            rms_error, rms_sd = _rms(error), _rms(wide)
            size[part] = _by_joint(np.degrees(rms_error) if title == "angles" else rms_error)
            known = np.isfinite(rms_error)
            if known.any():
                ratio[part] = float(np.exp(np.mean(np.log(rms_sd[known] / rms_error[known]))))
                seen = np.isfinite(error)
                inside[part] = float(np.mean(np.abs(error[seen]) <= Z_95 * wide[seen]))
    return Errors(size, ratio, inside)


def _rms(values: Array) -> Array:
    """Of each column (T, C); NaN where it has fewer than `LEAST_FRAMES`."""
    count = np.isfinite(values).sum(axis=0)
    return np.where(count >= LEAST_FRAMES, np.sqrt(np.nansum(values**2, axis=0) / np.maximum(count, 1)), np.nan)


def _by_joint(values: Array) -> Array:
    """(6,) right and left of each joint -> (3,), a side without a number left out."""
    pairs = values.reshape(3, 2)
    known = np.isfinite(pairs)
    count = known.sum(axis=1)
    return np.where(count > 0, np.where(known, pairs, 0.0).sum(axis=1) / np.maximum(count, 1), np.nan)


def _cell(values: Sequence[float], scale: float = 1.0) -> str:
    """Mean and standard deviation over the seeds that have one."""
    known = scale * np.array([value for value in values if np.isfinite(value)])
    if not len(known):
        return "–"
    digits = max(0, 1 - int(np.floor(np.log10(max(abs(known.mean()), 1e-9)))))
    spread = f" ± {known.std(ddof=1):.{digits}f}" if len(known) > 1 else ""
    return f"{known.mean():.{digits}f}{spread}"


def tables(found: dict[str, list[Errors]], title: str) -> Iterator[str]:
    """Errors of angles and speeds, errors of moments, and how the deviations compare with them."""
    for quantities in (("angles", "offset", "speeds"), ("moments", "moments, derived")):
        heads = [f"{joint}, {q if q != 'offset' else 'zero'}, {UNITS[q]}" for q in quantities for joint in JOINTS]
        yield f"**{title}: {' and '.join(quantities[::2] if len(quantities) > 2 else quantities[:1])}**\n"
        yield f"| given | seeds | {' | '.join(heads)} |"
        yield "|---" * (2 + len(heads)) + "|"
        for name, runs in found.items():
            cells = [_cell([e.size[q][k] for e in runs if q in e.size]) for q in quantities for k in range(len(JOINTS))]
            yield f"| {_level(name)} | {len(runs)} | {' | '.join(cells)} |"
        yield ""
    parts = ("angles", "speeds", "moments", "moments, derived")
    yield f"**{title}: standard deviations, over the error (1 is right), and truth within 95 %, per cent**\n"
    yield f"| given | {' | '.join(parts)} |"
    yield "|---" * (1 + len(parts)) + "|"
    for name, runs in found.items():
        cells = []
        for part in parts:
            own = [e for e in runs if part in e.ratio]
            ratio, inside = _cell([e.ratio[part] for e in own]), [e.inside[part] for e in own]
            cells.append(f"{ratio}; {100.0 * np.mean(inside):.0f}" if own else "–")
        yield f"| {_level(name)} | {' | '.join(cells)} |"
    yield ""


def _level(name: str) -> str:
    own = GIVEN[name]
    return f"**{own.factor}**: {own.level}" if name in ("base", "worst") else f"{own.factor}: {own.level}"


def draw(found: dict[str, dict[str, list[Errors]]]) -> None:
    """Mean moment error over hip, knee and ankle, measured and derived, one bar a level, with the spread over seeds."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(9.0, 4.2), sharey=True, layout="constrained")
    for ax, (motion, levels) in zip(axes, found.items(), strict=True):
        names = list(levels)[::-1]
        for part, shift, colour in (("moments", 0.2, "#2a6f97"), ("moments, derived", -0.2, "#c97b2b")):
            means = [
                [float(np.nanmean(e.size[part])) for e in levels[n] if np.isfinite(e.size[part]).any()] for n in names
            ]
            known = [k for k, values in enumerate(means) if values]
            ax.barh(
                [k + shift for k in known],
                [np.mean(means[k]) for k in known],
                0.38,
                xerr=[np.std(means[k], ddof=1) if len(means[k]) > 1 else 0.0 for k in known],
                color=colour,
                label="measured" if part == "moments" else "derived or prior",
            )
        ax.set_yticks(
            range(len(names)), [f"{GIVEN[n].factor}: {n}" if n not in ("base", "worst") else n for n in names]
        )
        ax.set_title(MOTIONS[motion])
    axes[1].legend(frameon=False)
    figure.supxlabel("RMS error of the moments, mean of hip, knee and ankle, N m", fontsize="medium")
    figure.savefig(FIGURE, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="1,2,3,4,5,6,7,8")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--kept", action="store_true", help="only what was kept")
    asked = parser.parse_args()
    found: dict[str, dict[str, list[Errors]]] = {motion: {} for motion in MOTIONS}
    for seed in map(int, asked.seeds.split(",")):
        for motion in MOTIONS:
            for name in GIVEN:
                spec = given(name, motion, seed)
                if asked.kept and not (KEPT / f"{spec.key()}.pickle").exists():
                    continue
                made = run(spec, asked.again)
                print(f"{motion}, {name}, {seed}: {made.seconds:.0f} s {made.said}".rstrip(), flush=True)
                if made.data is not None:
                    found[motion].setdefault(name, []).append(errors(made))
    lines = [line for motion, levels in found.items() for line in tables(levels, MOTIONS[motion])]
    print("\n".join(lines))
    if asked.write:
        draw(found)
        put("accuracy.md", "given", lines)


if __name__ == "__main__":
    main()
