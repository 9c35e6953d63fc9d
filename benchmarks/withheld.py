"""Plates withheld: what dynakin says of forces and moments that it was not given, against the plates themselves.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/withheld.py [NAME...] [--live] [--model fullbody] [--write] [-o FILE]

Recordings of ``../shared/data`` and simulated trials run with all their plates, with none of them ("all" withheld),
without those of the right and of the left foot, and with all of them summed into one ("shared"). Forces and centres of
pressure are judged against the withheld plates (simulated: the truth), moments against those that the run with all
plates calls measured (simulated: the truth). What is kept in ``build/withheld`` is found by inputs and source.
``--write`` puts the tables into ``docs/validation/plates.md``, a JSON with every figure goes to ``build/withheld``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from kept_runs import Run, kept_run
from pages import put
from withheld_judge import (
    FORCES,
    HEAD,
    JOINTS,
    QUANTITIES,
    WORDS,
    Reference,
    Score,
    cells,
    judge,
    measured_moments,
    of_plates,
    of_truth,
    pool,
    within,
)

from dynakin.recordings.orientation import axis_vector
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.pushes import LOADED_N
from dynakin.recordings.read import read
from dynakin.recordings.recording import Plate, Recording
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.trial import simulate
from dynakin.units import GRAVITY_M_S2
from recordings import DATA, ROOT, TRIALS

KEPT = ROOT / "build" / "withheld"
NOTHING, ALL, RIGHT, LEFT, SHARED = ARMS = ("nothing", "all", "right", "left", "shared")
POOLED = {NOTHING: (NOTHING,), ALL: (ALL,), "one of two": (RIGHT, LEFT), SHARED: (SHARED,)}
Spans = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Case:
    """A recording of `recordings.TRIALS`, or a simulated motion.

    Attributes:
        spans: seconds in which the plates together carry the person, so that no other contact is in doubt.
        owners: plates of each foot by their names; simulated: found by their load.
        kind: of movement, by which trials are pooled.
        weighed_kg: mass by the plates over a stride or while standing, where it is not the declared one: it is not the
            mass that is judged here.
        cut_s: only that part of the recording is run. seed: of a simulated one.
    """

    name: str
    spans: Spans
    owners: Mapping[str, tuple[str, ...]]
    kind: str
    weighed_kg: float | None = None
    cut_s: tuple[float, float] | None = None
    seed: int | None = None


_OPENCAP = {"right": ("plate 1",), "left": ("plate 2",)}
WALK, STILL, FAST = "walks", "standing, squats", "run, drop jump"
WALKING, SQUAT = "simulated walks", "simulated squats"
_STANDING_UP = ((1.07, 2.26), (3.74, 4.89), (6.36, 7.46))
"""Of STS1: while the feet alone carry the body (README of the recordings)."""
CASES = (
    Case("opencap_subject4/squats1", ((0.5, 8.0),), _OPENCAP, STILL, cut_s=(0.0, 8.0)),
    Case("opencap_subject4/walking1", ((0.15, 1.20),), _OPENCAP, WALK, 63.3),
    Case("opencap_subject4/STS1", _STANDING_UP, _OPENCAP, STILL, cut_s=(0.0, 8.0)),
    Case("opencap_subject4/DJ1", ((1.42, 2.68),), _OPENCAP, FAST),
    Case("rajagopal/motion_capture_walk", ((0.45, 1.80),), {"right": ("plate r",), "left": ("plate l",)}, WALK),
    Case("rajagopal/motion_capture_run", ((0.40, 5.20),), {"right": ("plate r",), "left": ("plate l",)}, FAST),
    Case("gait2354/subject01_walk1", ((0.20, 2.45),), {"right": ("plate",), "left": ("plate 1",)}, WALK),
    Case(
        "plugin_gait/GaitNormal_1", ((0.30, 1.90),), {"right": ("plate 1", "plate 3"), "left": ("plate 2",)}, WALK, 58.2
    ),
    Case("plugin_gait/S1_StandingRef", ((0.20, 0.99),), {"right": ("plate 2",), "left": ("plate 1",)}, STILL, 81.3),
    *(Case("simulated squat", ((0.5, 7.0),), {}, SQUAT, cut_s=(0.0, 7.0), seed=seed) for seed in (1, 2)),
    *(Case("simulated walk", ((0.0, 4.0),), {}, WALKING, cut_s=(0.0, 4.0), seed=seed) for seed in (1, 2, 3)),
)
_MOTIONS = {"simulated squat": "squat", "simulated walk": "gait"}


@dataclass(frozen=True, eq=False)
class Input:
    """What is run, and the plates by the foot that stands on them."""

    recording: Recording
    static: Recording | None
    model: str
    mass_kg: float
    height_m: float | None
    plates: dict[str, list[Plate]]
    made: SimulatedTrial | None


def read_case(case: Case, fullbody: bool) -> Input:
    """The recording of a case, cut to its part."""
    if case.seed is not None:
        assert case.cut_s is not None
        made = simulate("fullbody", _MOTIONS[case.name], case.seed, case.cut_s[1])
        owners = owners_by_load(made)
        subject = made.truth.subject
        return Input(made.recording, None, "fullbody", subject.mass_kg, subject.height_m, owners, made)
    trial = next(t for t in TRIALS if t.name == case.name)
    recording = read(DATA / trial.path, None if trial.forces is None else DATA / trial.forces)
    if case.cut_s is not None:
        recording = recording.window(*case.cut_s)
    static = None if trial.static is None else read(DATA / trial.static)
    by_name = {plate.name: plate for plate in recording.plates}
    owners = {foot: [by_name[name] for name in names] for foot, names in case.owners.items()}
    mass_kg = case.weighed_kg or trial.mass_kg
    assert mass_kg is not None
    model = trial.model("fullbody" if fullbody else "own")
    return Input(recording, static, model, mass_kg, None, owners, None)


def owners_by_load(made: SimulatedTrial) -> dict[str, list[Plate]]:
    """Plates of each foot: that whose true load is nearest to what the plate measures."""
    data = made.truth.data
    owners: dict[str, list[Plate]] = {}
    for plate in made.recording.plates:
        on = plate.force[:, 1] > LOADED_N
        away = {
            str(name): float(
                np.abs(data["contact_wrench"].sel(contact=name, component="fy").values - plate.force[:, 1])[on].mean()
            )
            for name in data["contact"].values
        }
        owners.setdefault(min(away, key=lambda name: away[name]).removesuffix(" foot"), []).append(plate)
    return owners


def carried(made: SimulatedTrial) -> np.ndarray:
    """(T,) frames in which the plates of a simulated trial measure all that carries the person, within a 20th of it."""
    measured = np.sum([plate.force[:, 1] for plate in made.recording.plates], axis=0)
    true = made.truth.data["contact_wrench"].sel(component="fy").sum("contact").values
    return np.asarray(np.abs(measured - true) < 0.05 * made.truth.subject.mass_kg * GRAVITY_M_S2)


def without(given: Input, arm: str, vertical: str) -> Recording:
    """The recording with the plates of one arm."""
    recording = given.recording
    if arm == NOTHING:
        return recording
    if arm == ALL:
        return recording.with_plates(())
    if arm == SHARED:
        return recording.with_plates((summed(recording.plates, vertical),))
    names = {plate.name for plate in given.plates[arm]}
    return recording.with_plates(tuple(plate for plate in recording.plates if plate.name not in names))


def summed(plates: Sequence[Plate], vertical: str) -> Plate:
    """One plate as large as all of those that were pressed, at their mean height."""
    used = [plate for plate in plates if np.isfinite(plate.cop).any()]
    up = axis_vector(vertical)
    level = float(np.nanmedian(np.concatenate([plate.cop for plate in used]) @ up))
    corners = None
    if all(plate.corners is not None for plate in used):
        every = np.concatenate([plate.corners for plate in used if plate.corners is not None])
        low, high = every.min(axis=0), every.max(axis=0)
        flat = [k for k in range(3) if not up[k]]
        corners = np.tile(level * up, (4, 1))
        corners[:, flat] = [
            [(low, high)[i][flat[0]], (low, high)[j][flat[1]]] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))
        ]
    force, moment = (np.sum([getattr(plate, key) for plate in used], axis=0) for key in ("force", "moment"))
    return plate_from_wrench(
        "plate 1", force, moment, Surface(level * up, up), corners=corners, threshold_n=LOADED_N,
        zero_unloaded=False,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Judged:
    """A case with the scores of each arm."""

    case: Case
    model: str
    mass_kg: float
    runs: dict[str, Run]
    scores: dict[str, list[Score]]


def judged(case: Case, live: bool, fullbody: bool, say: Callable[[str], None]) -> Judged:
    """Run and judge all arms of one case."""
    given = read_case(case, fullbody)
    recording = given.recording
    runs: dict[str, Run] = {}
    vertical = "+Y"
    settings = {
        "model": given.model,
        "mass_kg": given.mass_kg,
        "height_m": given.height_m,
        "lag_s": 0.0 if live else None,
    }
    for arm in ARMS:
        runs[arm] = kept_run(KEPT, f"{title(case)}-{arm}", without(given, arm, vertical), given.static, settings)
        if arm == NOTHING and (first := runs[arm].found) is not None:
            vertical = first.ground.vertical
        say(f"{title(case)}: {arm} withheld, {runs[arm].seconds:.0f} s {runs[arm].said}".rstrip())
    judged_frames = within(recording.time, case.spans)
    first = runs[NOTHING].found
    if given.made is not None:
        reference = of_truth(given.made.truth, judged_frames & carried(given.made))
    else:
        moments = {} if first is None else measured_moments(first)
        reference = Reference(of_plates(given.plates), moments, judged_frames, given.mass_kg)
    scores = {}
    for arm, made in runs.items():
        if made.found is not None:
            itself = arm == NOTHING and given.made is None  # where its own moments are the reference
            scores[arm] = judge(made.found, replace(reference, moments={}) if itself else reference)
    return Judged(case, Path(given.model).name, given.mass_kg, runs, scores)


def title(case: Case) -> str:
    return case.name if case.seed is None else f"{case.name} {case.seed}"


def table(all_judged: Sequence[Judged]) -> Iterator[str]:
    """Markdown, line by line: a cell is the RMS error (part of the truth within 95 %; deviation over error)."""
    head = f"| trial, model | withheld | foot | called | frames, % | {HEAD} |"
    yield head
    yield "|" + "---|" * (head.count("|") - 1)
    for each in all_judged:
        for arm in ARMS:
            where = f"| `{title(each.case)}`, {each.model} | {arm} "
            if each.runs[arm].found is None:
                yield f"{where}| – | refused: {each.runs[arm].said} |" + " – |" * 8
                continue
            scores = each.scores[arm]
            for foot in dict.fromkeys(s.contact for s in scores):
                if arm in (RIGHT, LEFT) and foot != arm:
                    continue
                for called in WORDS:
                    own = {s.quantity: s for s in scores if (s.contact, s.called) == (foot, called)}
                    if any(own.get(q) for q in (*FORCES, *JOINTS)):
                        yield f"{where}| {foot} | {called} | {' | '.join(cells(own, each.mass_kg))} |"


def summary(all_judged: Sequence[Judged]) -> Iterator[str]:
    """By kind of movement, pooled over trials and the feet whose plates were withheld; cells as those of `table`."""
    head = f"| movement (trials) | withheld | called | frames, % | {HEAD} |"
    yield head
    yield "|" + "---|" * (head.count("|") - 1)
    for kind in dict.fromkeys(each.case.kind for each in all_judged):
        of_kind = [each for each in all_judged if each.case.kind == kind and each.scores]
        for words, arms in POOLED.items():
            scores = [
                _per_kg(score, each.mass_kg)
                for each in of_kind
                for arm in arms
                for score in each.scores.get(arm, [])
                if len(arms) == 1 or score.contact == arm
            ]
            for called in WORDS:
                pooled = {q: pool([s for s in scores if s.quantity == q], called) for q in QUANTITIES}
                own = {q: found for q, found in pooled.items() if found is not None}
                if any(q in own for q in (*FORCES, *JOINTS)):
                    yield f"| {kind} ({len(of_kind)}) | {words} | {called} | {' | '.join(cells(own, 1.0))} |"


def _per_kg(score: Score, mass_kg: float) -> Score:
    """With a vertical force over the person's mass, so that trials of several people can be pooled."""
    if score.quantity != "vertical":
        return score
    rms, bias, sd = (None if value is None else value / mass_kg for value in (score.rms, score.bias, score.sd))
    return replace(score, rms=rms, bias=bias, sd=sd)


def rows(all_judged: Sequence[Judged]) -> Iterator[dict[str, Any]]:
    """Every score, for the JSON file; in SI."""
    for each in all_judged:
        for arm, scores in each.scores.items():
            for score in scores:
                yield {
                    "trial": title(each.case),
                    "kind": each.case.kind,
                    "model": each.model,
                    "withheld": arm,
                    "mass_kg": each.mass_kg,
                    **asdict(score),
                    "sd_over_error": score.sd_over_error,
                }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of trials' names; all where none is given")
    parser.add_argument("--live", action="store_true", help="each frame as it would be live, instead of smoothed")
    parser.add_argument("--model", choices=("own", "fullbody"), default="own", help="own: a recording's .osim")
    parser.add_argument("-o", "--output", type=Path, help="JSON file (build/withheld/withheld*.json)")
    parser.add_argument("--write", action="store_true", help="put the table into docs/validation/plates.md")
    asked = parser.parse_args()
    chosen = [c for c in CASES if not asked.names or any(part in title(c) for part in asked.names)]
    found = [judged(c, asked.live, asked.model == "fullbody", lambda t: print(t, flush=True)) for c in chosen]
    lines = [*summary(found), "", *table(found)]
    print("\n".join(lines))
    kind = ("_live" if asked.live else "") + ("_fullbody" if asked.model == "fullbody" else "")
    output = asked.output or KEPT / f"withheld{kind}.json"
    output.parent.mkdir(parents=True, exist_ok=True)
    content = {
        "units": "N, m, N m; parts of 1",
        "refused": {f"{title(j.case)}, {arm}": r.said for j in found for arm, r in j.runs.items() if r.found is None},
        "seconds": sum(r.seconds for j in found for r in j.runs.values()),
        "scores": list(rows(found)),
    }
    output.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(f"{output}, {content['seconds']:.0f} s of estimates")
    if asked.write:
        put("validation/plates.md", "withheld", lines)


if __name__ == "__main__":
    main()
