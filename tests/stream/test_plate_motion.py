"""A session asks whether plates are in step and have the right axes, as a recording is asked."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import dynakin
from dynakin.filter.ground.delay import Delay, brought_into_step
from dynakin.recordings.recording import Plate, Recording
from dynakin.simulation.trial import simulate
from dynakin.stream.plates import _other_mass
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame
from dynakin.stream.sources.replay import Replay


@cache
def squat() -> Recording:
    return simulate("fullbody", "squat", 7, 9.0).recording


def session(recording: Recording, mass_kg: float = 70.0, **options: Any) -> tuple[list[LiveFrame], list[str], Live]:
    frames: list[LiveFrame] = []
    said: list[str] = []
    subject = dynakin.Subject(mass_kg=mass_kg, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("fullbody", subject))
    source = Replay(recording, speed=0.0)
    live = Live(estimator, [source], [Callback(frames.append)], standing_s=1.0, say=said.append, **options)
    live.run()
    return frames, said, live


@cache
def as_it_is() -> tuple[list[LiveFrame], list[str], Live]:
    return session(squat())


def test_plates_in_step_are_left_alone() -> None:
    frames, said, live = as_it_is()
    assert live.fusion.plates_behind_s == 0.0 and not any("brought into step" in text for text in said)
    assert frames[-1].status.plates == "used"


@pytest.mark.parametrize("delay_s", [0.04, -0.03])
def test_plates_that_are_late_are_brought_into_step(delay_s: float) -> None:
    frames, said, live = session(brought_into_step(squat(), Delay(-delay_s, 0.0)))
    (text,) = [text for text in said if "brought into step" in text]
    side = "behind" if delay_s > 0.0 else "ahead of"
    (at,) = re.findall(
        rf"ms {side} the markers \(standard deviation 5.0 ms\); from ([0-9.]+) s on they are brought into step", text
    )
    assert live.fusion.plates_behind_s == pytest.approx(delay_s, abs=0.003)
    whole = {round(frame.fused.sample.time_s, 4): frame.fused.wrenches for frame in as_it_is()[0]}
    after = [frame.fused for frame in frames if frame.fused.sample.time_s > float(at) + 0.2]
    assert len(after) > 200
    apart = [one.wrenches - whole[round(one.sample.time_s, 4)] for one in after if one.wrenches is not None]
    assert len(apart) > 0.9 * len(after) and np.abs(np.stack(apart)[:, :, :3]).mean() < 3.0


def test_plates_with_other_axes_are_left_out_from_then_on() -> None:
    whole = squat()
    up = int(np.argmax(np.abs(whole.plates[0].force).mean(axis=0)))
    signs = np.where(np.arange(3) == up, 1.0, -1.0)

    def half_a_turn(plate: Plate) -> Plate:
        force = plate.force * signs
        moment = np.cross(np.nan_to_num(plate.cop), force) + plate.free_moment
        return replace(plate, force=force, moment=moment)

    frames, said, _ = session(whole.with_plates(tuple(half_a_turn(plate) for plate in whole.plates)))
    (text,) = [text for text in said if "not used any more" in text]
    assert text.startswith("Warning: the horizontal force of plate 1 and plate 2") and "capture system" in text
    assert frames[100].status.plates == "used" and frames[-1].status.plates == "left out"


def test_a_mass_that_the_plates_contradict_is_said_once() -> None:
    """At the start, of who stands on them; and later, of who did not."""
    heavy = tuple(replace(p, force=1.09 * p.force, moment=1.09 * p.moment) for p in squat().plates)
    _, said, _ = session(squat().with_plates(heavy))
    assert len([text for text in said if "check the mass" in text]) == 1
    empty = squat().time[:, None] < 2.5
    late = tuple(replace(p, force=np.where(empty, 0.0, p.force)) for p in heavy)
    _, said, _ = session(squat().with_plates(late))
    (text,) = [text for text in said if "check the mass" in text]
    assert "Warning: the plates carry 76." in text and "weighs 70.0 kg" in text


@pytest.mark.parametrize(("load_kg", "said"), [(70.5, "carry the person's 70.0 kg"), (60.0, "carry 60.0 kg where")])
def test_something_that_always_pulls_is_another_mass_only_where_plates_carry_one(load_kg: float, said: str) -> None:
    person: Any = SimpleNamespace(weighed_kg=70.0, unseen_kg=0.0)
    found = _other_mass(person, load_kg, 1.0)
    assert found is not None and f"the plates {said}" in found.text and "something that no plate measures" in found.text
    assert _other_mass(person, load_kg, 0.5) is None


def test_what_a_seat_bears_is_no_other_mass(data_dir: Path) -> None:
    """Sitting down and standing up: nothing is said of the mass, but that something bears the person."""
    folder = data_dir / "opencap_subject4"
    chair = dynakin.read(folder / "STS1.trc", folder / "STS1_grf.mot")
    _, said, _ = session(chair, mass_kg=60.05, static=dynakin.read(folder / "static1.trc"), standing_wait_s=1.0)
    assert any("Something that no plate measures" in text for text in said)
    assert not any("the plates carry" in text for text in said)
    assert "Lengths and marker places are those of the standing trial." in said
