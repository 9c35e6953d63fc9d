"""Contacts that plates do not resolve, with their truth: seats, rails, belts, impacts, a plate under both feet.

    OMP_NUM_THREADS=1 .venv/bin/python benchmarks/truth_contacts.py [NAME...] [--seeds 3,4] [--live] [-o FILE]

Simulated trials of the whole body, each seen with the plates that its line names. Two tables: each foot, and every
other contact that the estimate has, as `benchmarks/withheld.py` judges them; and the moments of all joints, by what
they are called: what a contact that nobody declared can reach is to be absent, and not wrong.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from kept_runs import Run, kept_run
from withheld_judge import HEAD, JOINTS, WORDS, Score, cells, judge, judge_moments, of_truth, pool

from dynakin.errors import ConfigError
from dynakin.simulation.trial import simulate
from recordings import ROOT

KEPT = ROOT / "build" / "truth_contacts"
START_S, END_S = 0.5, 0.1
"""Seconds left out at either end."""
GROUPS: dict[str, str | tuple[str, ...]] = {
    **JOINTS,
    "trunk": ("lumbar", "neck"),
    "arms": ("arm_", "elbow", "pro_sup", "wrist"),
}
"""Joints by how their coordinates begin."""


@dataclass(frozen=True)
class Case:
    """What is simulated (keys of `dynakin.simulation.simulate`), and what the program is told besides."""

    name: str
    made: dict[str, Any]
    told: dict[str, Any] = field(default_factory=dict)


def _case(motion: str, seconds: float, what: str = "", **made: Any) -> Case:
    return Case(f"{motion}{what}", {"motion": motion, "duration_s": seconds, **made})


CASES = (
    _case("squat", 6.0, ", shared plate", plates="shared"),
    _case("squat", 6.0, ", rail 0.1", rail=0.1),
    _case("gait", 4.0, ", rail 0.1", rail=0.1),
    _case("gait", 4.0, ", shared plate", plates="shared"),
    _case("belt", 5.0),
    _case("belt", 5.0, ", shared plate", plates="shared"),
    _case("belt", 5.0, ", rail 0.1", rail=0.1),
    _case("sit", 11.0, ", seat not measured"),
    _case("sit", 11.0, ", seat on a plate", plates="all"),
    _case("steps", 4.0),
    _case("steps-down", 4.0),
    _case("drop-jump", 3.0),
)


@dataclass(frozen=True, eq=False)
class Judged:
    name: str
    mass_kg: float
    run: Run | None
    said: str
    contacts: list[Score]
    moments: list[Score]


def judged(case: Case, seed: int, live: bool) -> Judged:
    """One trial, run and judged; one that this simulator does not know says so."""
    name = f"{case.name}, {seed}"
    try:
        made = simulate("fullbody", seed=seed, **case.made)
    except (ConfigError, TypeError) as error:
        return Judged(name, 0.0, None, f"not simulated: {error}", [], [])
    who = made.truth.subject
    settings = {
        "model": "fullbody",
        "mass_kg": who.mass_kg,
        "height_m": who.height_m,
        "lag_s": 0.0 if live else None,
        **case.told,
    }
    run = kept_run(KEPT, name, made.recording, None, settings)
    time = made.recording.time
    reference = of_truth(made.truth, (time >= time[0] + START_S) & (time <= time[-1] - END_S))
    if run.found is None:
        return Judged(name, who.mass_kg, run, f"refused: {run.said}", [], [])
    return Judged(name, who.mass_kg, run, "", judge(run.found, reference), judge_moments(run.found, reference))


def contacts_table(found: Sequence[Judged]) -> Iterator[str]:
    head = f"| trial, seed | contact | called | frames, % | {HEAD} |"
    yield head
    yield "|" + "---|" * (head.count("|") - 1)
    for each in found:
        if each.said:
            yield f"| {each.name} | {each.said} |" + " – |" * (head.count("|") - 3)
        for contact in dict.fromkeys(s.contact for s in each.contacts):
            for called in WORDS:
                own = {s.quantity: s for s in each.contacts if (s.contact, s.called) == (contact, called)}
                if "vertical" in own:
                    yield f"| {each.name} | {contact} | {called} | {' | '.join(cells(own, each.mass_kg))} |"


def moments_table(found: Sequence[Judged]) -> Iterator[str]:
    """A cell: percent of the frames; RMS error, N m (percent of it within 1.96 deviations)."""
    yield f"| trial, seed | called | {' | '.join(GROUPS)} |"
    yield "|" + "---|" * (2 + len(GROUPS))
    for each in found:
        for called in WORDS:
            row = [_pooled([s for s in each.moments if s.contact.startswith(own)], called) for own in GROUPS.values()]
            if any(cell != "–" for cell in row):
                yield f"| {each.name} | {called} | {' | '.join(row)} |"


def _pooled(scores: Sequence[Score], called: str) -> str:
    found = pool(scores, called)
    if found is None:
        return "–"
    share = f"{100.0 * found.frames / found.of:.0f} %"
    if found.rms is None or found.inside is None:
        return share
    return f"{share}; {found.rms:.1f} ({100.0 * found.inside:.0f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of trials' names; all where none is given")
    parser.add_argument("--seeds", default="1", help="commas between; sizes are chosen on 1 and 2, judged on others")
    parser.add_argument("--live", action="store_true", help="each frame as it would be live, instead of smoothed")
    parser.add_argument("-o", "--output", type=Path, help="JSON file (build/truth_contacts/truth_contacts*.json)")
    asked = parser.parse_args()
    found = []
    for case in CASES:
        if asked.names and not any(part in case.name for part in asked.names):
            continue
        for seed in map(int, asked.seeds.split(",")):
            found.append(judged(case, seed, asked.live))
            seconds = found[-1].run.seconds if found[-1].run else 0.0
            print(f"{found[-1].name}: {seconds:.0f} s {found[-1].said}".rstrip(), flush=True)
    print("\n".join([*contacts_table(found), "", *moments_table(found)]))
    output = asked.output or KEPT / f"truth_contacts{'_live' if asked.live else ''}.json"
    output.parent.mkdir(parents=True, exist_ok=True)
    content = [
        {"trial": j.name, "said": j.said, "mass_kg": j.mass_kg}
        | {key: [asdict(s) for s in getattr(j, key)] for key in ("contacts", "moments")}
        for j in found
    ]
    output.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(output)


if __name__ == "__main__":
    main()
