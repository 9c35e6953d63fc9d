"""Do the stated deviations hold the truth? Coverage and deviation over error by group, and a choice of their sizes.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/intervals.py [CASE...] [--trials DIR] [--seeds 1,2] [--lag S]
        [--preset FILE] [--sizes landmarks:centre=0.008,hinge=0.1] [--choose landmarks] [--again]

A case is squat or walk with fullbody or an .osim (``truth3d``'s trials, in DIR: folders ``squat_s1_*`` with trial.trc,
grf.mot, static.trc, model.osim, trial.json, truth.npz), or one of our own simulator (``own_squat``, ``own_gait``,
``sagittal7``, ``squat7``). Each is filtered once without systematic errors; what each kind of error of size 1 would add
is worked out with it, so that sizes are tried without filtering again. Both are kept in build/intervals by what they
depend on: trial, noise, package and this file (--again: made anew).

Groups and figures are truth3d's: angles with their mean error taken off, means over coordinates and seeds; deviation
over error is the median of a group's angles and speeds. --choose searches the sizes of one kind of model over all cases
asked for; --sizes tries some. What is chosen goes into `filter/uncertainty/sizes.py` by hand.
"""

from __future__ import annotations

import argparse
import json
import pickle
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import dynakin
from dynakin.filter.uncertainty.frames import Frames
from dynakin.filter.uncertainty.geometry import BLOCKS, Parts
from dynakin.filter.uncertainty.reported import movement_intensity, reported
from dynakin.filter.uncertainty.sizes import LANDMARKS, SCALED, Sizes, usual_sizes
from dynakin.filter.uncertainty.skin import skin_found
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.filter.uncertainty.upright import hips_turned
from dynakin.model.definition import load_model
from dynakin.results.estimate import values_of
from dynakin.results.measures.sources import MEASURED, moment_sources
from dynakin.settings import presets
from dynakin.settings.noise import Noise
from dynakin.simulation.trial import simulate
from dynakin.studies.engine.build import build

KEPT = Path(__file__).resolve().parents[1] / "build" / "intervals"
TRUTH3D = ("squat/fullbody", "squat/osim", "walk/fullbody", "walk/osim")
OWN = {"own_squat": ("fullbody", 10.0, 3.0), "own_gait": ("fullbody", 4.0, 0.5)}
PLANAR = {"sagittal7": ("opencap", 15.0, 5.0), "squat7": ("plug-in-gait", 15.0, 5.0)}
CASES = (*TRUTH3D, *OWN, *PLANAR)
FILES = ("trial.trc", "grf.mot", "static.trc", "model.osim", "trial.json", "truth.npz")
WINDOW_S = {"squat": (2.0, 1e9), "walk": (0.3, 3.1)}
FLEXION = ("pelvis_tilt", "hip_flexion", "knee_angle", "ankle_angle", "lumbar_extension")
OTHER = ("pelvis_list", "pelvis_rotation", "hip_adduction", "hip_rotation", "subtalar_angle", "lumbar_bending",
         "lumbar_rotation")  # fmt: skip
MOMENTS = ("hip_flexion", "knee_angle", "ankle_angle", "hip_adduction", "hip_rotation", "subtalar_angle",
           "lumbar_extension", "lumbar_bending", "lumbar_rotation")  # fmt: skip
HOLDS = (0.85, 0.99)
RATIO = (0.5, 2.5)
Array = np.ndarray


@dataclass(frozen=True)
class Run:
    """One estimate against the truth: by block errors (T, C), frames with the filter's own deviations, and variances by
    kind of error at size 1. Frames that have no truth or no value are NaN. ``intensity``, ``moved_m``: (T,) as
    `reported` takes them. ``skin``: as of `skin_found`."""

    case: str
    seed: int
    sizes: str
    names: tuple[str, ...]
    error: dict[str, Array]
    frames: Frames
    intensity: Array
    moved_m: Array
    parts: Parts
    skin: float


def runs_of(
    case: str, seed: int, folder: Path | None, noise: Noise, lag_s: float | None, again: bool, source: str
) -> Run:
    """As kept, else made. ``source``: `build`."""
    trial = trial_of(case, seed, folder) if case in TRUTH3D else None
    key = sha256(json.dumps([source, case, seed, lag_s, noise.model_dump()], sort_keys=True).encode())
    for file in (Path(__file__), *([trial / name for name in FILES] if trial else ())):
        key.update(file.read_bytes())
    kept = KEPT / f"{case.replace('/', '_')}_s{seed}_{key.hexdigest()[:10]}.pickle"
    if kept.exists() and not again:
        loaded: Run = pickle.loads(kept.read_bytes())
        return loaded
    found = own(case, seed, noise, lag_s) if trial is None else truth3d(case, seed, trial, noise, lag_s)
    KEPT.mkdir(parents=True, exist_ok=True)
    kept.write_bytes(pickle.dumps(found))
    return found


def trial_of(case: str, seed: int, folder: Path | None) -> Path:
    """Folder of a trial of truth3d."""
    if folder is None:
        raise SystemExit(f"{case} needs --trials: the folder of truth3d's trials (CACHE/trials)")
    stem = f"{case.partition('/')[0]}_s{seed}_"
    found = [trial for trial in sorted(folder.glob(f"{stem}*")) if plain(trial)]
    if not found:
        raise SystemExit(f"{folder}: no trial {stem}* with all sources of error; truth3d.py makes it")
    return found[0]


def truth3d(case: str, seed: int, trial: Path, noise: Noise, lag_s: float | None) -> Run:
    """A trial of truth3d."""
    motion, _, kind = case.partition("/")
    subject = dynakin.Subject(mass_kg=json.loads((trial / "trial.json").read_text())["mass_kg"], height_m=1.7)
    recording = dynakin.read(trial / "trial.trc", trial / "grf.mot")
    if kind == "osim":
        definition, static = load_model(trial / "model.osim", subject=subject), None
    else:
        definition = load_model("fullbody", subject=subject, markers="opencap")
        static = dynakin.read(trial / "static.trc")
    given = np.load(trial / "truth.npz", allow_pickle=True)
    truth = dict(zip(BLOCKS, (given[name] for name in ("q", "u", "a", "tau")), strict=True))
    window = (given["t"] >= WINDOW_S[motion][0]) & (given["t"] <= WINDOW_S[motion][1])
    tracked = dynakin.Estimator(definition, noise).track(recording, static=static, lag_s=lag_s)
    return against(case, seed, tracked, [str(n) for n in given["names"]], truth, window)


def plain(trial: Path) -> bool:
    """A trial with all sources of error and nothing lost."""
    if not (trial / "truth.npz").exists():
        return False
    made = json.loads((trial / "trial.json").read_text())["settings"]
    return not (made["without"] or made["one_plate"] or made["dropouts"])


def own(case: str, seed: int, noise: Noise, lag_s: float | None) -> Run:
    """A trial of our own simulator."""
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    if case in PLANAR:
        markers, seconds, start = PLANAR[case]
        model, motion = case, "squat"
    else:
        (model, seconds, start), markers, motion = OWN[case], "opencap", case.removeprefix("own_")
    trial = simulate(model, motion, seed, seconds, markers=markers if model == "fullbody" else None)
    static = None if motion == "squat" else simulate(model, "squat", seed, 5.0, markers=markers).recording
    definition = load_model(model, subject=subject, markers=markers)
    tracked = dynakin.Estimator(definition, noise).track(trial.recording, static=static, lag_s=lag_s)
    truth = {block: trial.truth.data[block].transpose("time", "coordinate").values for block in BLOCKS}
    names = [str(n) for n in trial.truth.data["coordinate"].values]
    return against(case, seed, tracked, names, truth, trial.recording.time >= start)


def against(
    case: str, seed: int, tracked: dynakin.filter.estimator.Tracked, names: list[str], truth: dict[str, Array],
    window: Array,
) -> Run:  # fmt: skip
    """Errors, deviations and parts over the window, of the coordinates that both have and that move."""
    data, tracker = tracked.estimate.data, tracked.tracker
    sizes = replace(usual_sizes(tracker.calibrated), inertia=True)  # worked out where it is not in use, too
    turned = hips_turned(tracker.calibrated, values_of(data, "state"))
    systematic = Systematic(tracker.calibrated, tracker.noise, sizes).with_found(0.0, hips_turned=turned)
    late = bool(tracked.estimate.config["lag_s"])
    frames = Frames.of(data, len(tracker.calibrated.feet), tracker.noise.variance_scale, late=late)
    parts, free = systematic.parts(frames), systematic.geometry.free
    accelerations = values_of(data, "accelerations")[:, free]
    intensity = movement_intensity(accelerations, frames.sd["accelerations"][:, free])
    all_names = [str(n) for n in data["coordinate"].values]
    chosen = [n for n in all_names if n in names and n not in tracked.estimate.held]
    mine, theirs = [all_names.index(n) for n in chosen], [names.index(n) for n in chosen]
    blocks = [block for block in BLOCKS if block in truth]

    def values(name: str) -> Array:
        found: Array = data[name].transpose("time", "coordinate").values[window][:, mine]
        return found

    here = np.ix_(window, np.array(mine))
    error = {block: values(block) - truth[block][window][:, theirs] for block in blocks}
    error["moments"] = np.where(moment_sources(data)[here] == MEASURED, error["moments"], np.nan)
    return Run(
        case,
        seed,
        "none" if case in PLANAR else "scaled" if tracker.calibrated.plan is None else "landmarks",
        tuple(chosen),
        error,
        replace(
            frames,
            sd={block: frames.sd[block][here] for block in blocks},
            sources=frames.sources[here],
            ends=frames.ends[window],
        ),
        intensity[window],
        systematic.moved_m(frames.states)[window],
        {kind: {block: part[block][here] for block in blocks} for kind, part in parts.items()},
        skin_found(tracker.calibrated, {name: data[name].values for name in ("state", "tracking")}),
    )


def groups_of(run: Run) -> list[tuple[str, str, list[int]]]:
    """(title, block, places) of the groups of a run."""

    def places(stems: Sequence[str]) -> list[int]:
        return [k for k, n in enumerate(run.names) if n in stems or (n[:-2] in stems and n[-2:] in ("_r", "_l"))]

    if run.case in PLANAR:
        every = list(range(len(run.names)))
        return [(f"planar {block}", block, every) for block in ("coordinates", "speeds", "moments")]
    found = [
        (f"{what}{title}", block, places(stems))
        for what, block in (("", "coordinates"), ("speeds, ", "speeds"))
        for title, stems in (("flexion", FLEXION), ("other angles", OTHER))
    ]
    return found + [(f"moment {stem}", "moments", places((stem,))) for stem in MOMENTS]


def figures(run: Run, sizes: Sizes | None) -> dict[str, tuple[float, ...]]:
    """By group: share inside 95 %, deviation over error, error and deviation (RMS; rad, rad/s, N m); None: the filter's
    own deviations."""
    found = {}
    said = run.frames.sd
    if sizes is not None:
        sizes = sizes.with_skin(run.skin)
        said = reported(run.frames, sizes, run.parts, run.intensity, run.moved_m)
    for title, block, places in groups_of(run):
        e, sd = run.error[block][:, places], said[block][:, places]
        if block == "coordinates":
            e = e - np.nanmean(e, axis=0)
        sd = np.where(np.isfinite(e), sd, np.nan)
        inside = np.nanmean(np.where(np.isfinite(e), np.abs(e) < 1.96 * sd, np.nan), axis=0)
        rms_e, rms_sd = (np.sqrt(np.nanmean(x**2, axis=0)) for x in (e, sd))
        middle = np.nanmean if block == "moments" else np.nanmedian
        found[title] = tuple(
            float(x) for x in (np.nanmean(inside), middle(rms_sd / rms_e), rms_e.mean(), rms_sd.mean())
        )
    return found


def means(runs: Sequence[Run], sizes: dict[str, Sizes] | None) -> dict[str, dict[str, Array]]:
    """Case -> group -> mean figures over the seeds."""
    found: dict[str, dict[str, Array]] = {}
    for case in dict.fromkeys(run.case for run in runs):
        each = [figures(run, None if sizes is None else sizes.get(run.sizes)) for run in runs if run.case == case]
        found[case] = {title: np.mean([f[title] for f in each], axis=0) for title in each[0]}
    return found


def misses(inside: float, ratio: float) -> bool:
    return not (HOLDS[0] <= inside <= HOLDS[1] and RATIO[0] <= ratio <= RATIO[1])


def tell(runs: Sequence[Run], sizes: dict[str, Sizes]) -> None:
    own, whole = means(runs, None), means(runs, sizes)
    print("| case | group | error | filter's own: in 95 %, sd / error | with systematic errors: in 95 %, sd / error |")
    print("|---|---|---|---|---|")
    for case, rows in whole.items():
        for title, (inside, ratio, error, _) in rows.items():
            before = own[case][title]
            unit = np.degrees(1.0) if title in ("flexion", "other angles", "planar coordinates") else 1.0
            mark = "**" if misses(inside, ratio) else ""
            print(f"| {case} | {title} | {unit * error:.2f} | {100 * before[0]:.0f}, {before[1]:.1f} | "
                  f"{mark}{100 * inside:.0f}, {ratio:.1f}{mark} |")  # fmt: skip
    every = [row for rows in whole.values() for row in rows.values()]
    missed = sum(misses(row[0], row[1]) for row in every)
    print(f"\n{len(every) - missed} of {len(every)} groups hold: {HOLDS[0]:.0%} to {HOLDS[1]:.0%}, {RATIO}.")


def choose(runs: Sequence[Run], kind: str, start: dict[str, Sizes]) -> Sizes:
    """Sizes of one kind of model for which groups lie nearest to 94 % and 1.3, and none is far off."""
    fixed = ("placed", "inertia", "skin_found", "hips")  # beyond `placed` only its ratio to the centres' sizes counts
    names = [name for name, value in asdict(start[kind]).items() if value and name not in fixed]
    first = np.log([getattr(start[kind], name) for name in names])
    mine = [run for run in runs if run.sizes == kind]

    def changed(theta: Array) -> Sizes:
        return replace(start[kind], **dict(zip(names, np.exp(theta).tolist(), strict=True)))

    def loss(theta: Array) -> float:
        rows = means(mine, start | {kind: changed(theta)})
        cost = 0.1 * float(np.mean((theta - first) ** 2))  # what the trials do not tell stays
        for groups in rows.values():
            for inside, ratio, *_ in groups.values():
                cost += float(np.log(ratio / 1.3) ** 2 + 40.0 * max(0.0, 0.92 - inside) ** 2) / len(groups)
        return cost

    best = minimize(loss, first, method="Nelder-Mead", options={"maxfev": 300, "xatol": 0.02, "fatol": 1e-3})
    return changed(best.x)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES) + "; all where none is given")
    parser.add_argument("--trials", type=Path, help="folder of truth3d's trials")
    parser.add_argument("--seeds", default="1,2")
    parser.add_argument("--lag", type=float, metavar="SECONDS", help="0: at once; all frames where not given")
    parser.add_argument("--preset", default="default")
    parser.add_argument("--sizes", action="append", default=[], metavar="MODEL:KEY=VALUE,...")
    parser.add_argument("--choose", choices=("landmarks", "scaled"))
    parser.add_argument("--again", action="store_true")
    asked = parser.parse_args()
    noise = presets.preset(asked.preset, {"systematic_scale": 0.0})
    cases = asked.cases or [case for case in CASES if asked.trials or case not in TRUTH3D]
    source = build()
    runs = [
        runs_of(case, int(seed), asked.trials, noise, asked.lag, asked.again, source)
        for case in cases
        for seed in asked.seeds.split(",")
    ]
    sizes = {"landmarks": LANDMARKS, "scaled": SCALED}
    for text in asked.sizes:
        kind, _, pairs = text.partition(":")
        values = dict(pair.split("=") for pair in pairs.split(","))
        sizes[kind] = replace(sizes[kind], **{k: type(getattr(LANDMARKS, k))(float(v)) for k, v in values.items()})
    if asked.choose:
        sizes[asked.choose] = choose(runs, asked.choose, sizes)
    tell(runs, sizes)
    for kind, own in sizes.items():
        print(f"{kind}: {', '.join(f'{k} {v:.4g}' for k, v in asdict(own).items())}")


if __name__ == "__main__":
    main()
