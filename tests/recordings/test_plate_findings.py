"""Plates that are exchanged, off their place, or drift: found by the feet, and said with what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin import read
from dynakin.messages import together
from dynakin.model.markers.recognise import foot_markers_of
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.loads import SWING, UNKNOWN
from dynakin.recordings.feet.zero_offset import without_blanks, without_offsets
from dynakin.recordings.frame import find_ground_frame
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.plates.stuck import without_frames
from dynakin.recordings.recording import Plate, Recording
from support.made_steps import FOOT_MARKERS, LABORATORY, Made, MadePlate, Stance, lasting, steps, walk


def walked(length: float = 0.6, count: int = 4, changed: str = "p1", **changes: object) -> Made:
    """Steps over as many plates; one is changed."""
    feet = walk(count, length)
    plates = []
    for side in ("right", "left"):
        for s in feet[side]:
            plate = MadePlate(s.plates[0], (s.x - 0.25, s.x + 0.25), (s.z - 0.2, s.z + 0.2))
            plates.append(replace(plate, **changes) if plate.name == changed else plate)
    return steps(lasting(count), feet, plates)


def messages(recording: Recording) -> list[str]:
    return [t for t in map(str, foot_loads(recording, LABORATORY, FOOT_MARKERS).messages) if t.startswith("Warning")]


def test_plates_that_are_what_they_should_be_are_not_complained_of() -> None:
    assert messages(walked().recording) == []


def exchanged(one: Plate, other: Plate) -> tuple[Plate, Plate]:
    """Each one's own readings at the other's place."""

    def at(plate: Plate, place: Plate) -> Plate:
        assert plate.corners is not None and place.corners is not None
        shift = (place.corners - plate.corners).mean(axis=0)
        moment = plate.moment + np.cross(shift, plate.force)
        surface = Surface(place.corners.mean(axis=0), np.array([0.0, 1.0, 0.0]))
        return plate_from_wrench(
            plate.name, plate.force, moment, surface, corners=place.corners, threshold_n=10.0, zero_unloaded=False
        )

    return at(one, other), at(other, one)


def test_exchanged_plates_are_named_and_their_loads_left_out() -> None:
    made = walked()
    plates = list(made.recording.plates)
    a, b = (next(k for k, p in enumerate(plates) if p.name == name) for name in ("p1", "p2"))
    plates[a], plates[b] = exchanged(plates[a], plates[b])
    recording = made.recording.with_plates(tuple(plates))
    said = [t for t in messages(recording) if "exchanged" in t]
    assert len(said) == 1 and said[0].startswith("Warning: p2 and p1 have been exchanged")
    assert "Exchange the two in the file" in said[0]
    loads = foot_loads(recording, LABORATORY, FOOT_MARKERS)
    known = loads.total_known
    pressed = made.push.sum(axis=1) > 100.0
    inside = pressed & (made.recording.time > 0.75) & (made.recording.time < 1.6)
    assert not known[inside].any()


@pytest.mark.parametrize(("x", "z", "under_foot"), [(0.0, 0.25, False), (0.0, -0.16, True), (0.35, 0.1, False)])
def test_a_plate_off_its_place_is_said_with_its_offset(x: float, z: float, under_foot: bool) -> None:
    """More than a shoe is wide, and beyond: what is then under no foot is left out, and nothing else is."""
    made = walked(moved=(x, z))
    said = [t for t in messages(made.recording) if "off its place" in t]
    assert len(said) == 1 and said[0].startswith("Warning: p1") and "left foot" in said[0]
    place = [float(part.split()[0].rstrip(",")) for part in (said[0].split("(X ")[1], said[0].split("Z ")[1])]
    np.testing.assert_allclose(place, [x, z], atol=0.03)
    loads = foot_loads(made.recording, LABORATORY, FOOT_MARKERS)
    on = (made.push[:, 1] > 100.0) & (made.recording.time < 1.3)
    assert on.sum() > 50 and (np.isnan(loads.wrench[on, 1]) != under_foot).all()
    assert any("where no foot stands" in text for text in messages(made.recording)) != under_foot


@pytest.mark.parametrize(
    ("turn", "said"),
    [
        (np.diag([-1.0, 1.0]), "a wrong sign of My"),
        (np.diag([1.0, -1.0]), "a wrong sign of Mx"),
        (-np.eye(2), "a wrong sign of all moments"),
        (np.array([[0.0, -1.0], [-1.0, 0.0]]), "exchanged Mx and My"),
    ],
)
@pytest.mark.parametrize("names", [("p1",), ("p0", "p1", "p2", "p3")])
def test_moments_of_the_wrong_sign_are_named(turn: np.ndarray, said: str, names: tuple[str, ...]) -> None:
    """Plates whose middle lies 0.1 m before the feet and 0.08 m beside them; the right ones are not complained of."""
    made = beside_the_middle()
    assert foot_loads(made.recording, LABORATORY, FOOT_MARKERS).turned_moments == ""
    plates = tuple(mirrored(p, turn) if p.name in names else p for p in made.recording.plates)
    text = foot_loads(made.recording.with_plates(plates), LABORATORY, FOOT_MARKERS).turned_moments
    assert text.endswith(said) and f"of {together(names)} does not go with the feet" in text


def beside_the_middle() -> Made:
    feet = walk(4, 0.6)
    plates = [
        MadePlate(s.plates[0], (s.x - 0.15, s.x + 0.35), (s.z - 0.12, s.z + 0.28))
        for side in ("right", "left")
        for s in feet[side]
    ]
    return steps(lasting(4), feet, sorted(plates, key=lambda plate: plate.name))


def mirrored(plate: Plate, turn: np.ndarray) -> Plate:
    """With its centre of pressure turned so along its axes and about its middle."""
    assert plate.corners is not None
    middle, along = plate.corners.mean(axis=0)[[0, 2]], (plate.corners[0] - plate.corners[1])[[0, 2]]
    along = along / np.linalg.norm(along)
    rows = np.array([along, [-along[1], along[0]]])
    cop = plate.cop.copy()
    cop[:, [0, 2]] = (cop[:, [0, 2]] - middle) @ rows.T @ turn.T @ rows + middle
    moment = np.cross(np.nan_to_num(cop), plate.force) + plate.free_moment
    return replace(plate, cop=cop, moment=moment)


def zeroed(recording: Recording) -> tuple[Recording, list[str]]:
    found, said = without_offsets(recording, LABORATORY, FOOT_MARKERS)
    return found, list(map(str, said))


@pytest.mark.parametrize("drift_n", [25.0, -40.0, 45.0])
def test_a_drift_of_unknown_size_is_said_and_bears_nobody(drift_n: float) -> None:
    """No foot is far from the plate but at the end."""
    made = walked(drift_n=drift_n)
    recording, said = zeroed(made.recording)
    assert recording is made.recording and len(said) == 1
    assert said[0].startswith("Warning: p1 reads") and "plate_loads" in said[0]
    loads = foot_loads(made.recording, LABORATORY, FOOT_MARKERS)
    swings = (made.push[:, 1] == 0.0) & loads.aloft[:, 1] & (loads.reason[:, 1] != UNKNOWN)
    assert swings.any() and (loads.reason[swings, 1] == SWING).all()


@pytest.mark.parametrize("drift_n", [-40.0, 45.0, 90.0])
def test_a_drift_that_is_seen_before_and_after_a_step_is_taken_off(drift_n: float) -> None:
    made, still = (walked(0.6, 7, "p3", drift_n=drift) for drift in (drift_n, 0.0))
    recording, said = zeroed(made.recording)
    assert len(said) == 1 and said[0].startswith("Warning: While no foot is near, p3 reads")
    forces = [next(plate.force for plate in each.plates if plate.name == "p3") for each in (recording, still.recording)]
    np.testing.assert_allclose(*forces, atol=0.05 * abs(drift_n))
    loads = foot_loads(recording, LABORATORY, FOOT_MARKERS)
    assert loads.all_measured.all() and zeroed(recording)[0] is recording


def with_read(recording: Recording, name: str, newton: np.ndarray, *, alone: bool = False) -> Recording:
    """With so much more (T,) N read by a plate, at its middle; alone: nothing else."""
    plates = list(recording.plates)
    k = next(k for k, plate in enumerate(plates) if plate.name == name)
    force = np.outer(newton, [0.0, 1.0, 0.0])
    points = plates[k].cop if plates[k].corners is None else plates[k].corners
    assert points is not None
    middle = np.nanmean(points, axis=0)
    wrench = (0.0 if alone else plates[k].wrench) + np.hstack([force, np.cross(middle, force)])
    plates[k] = plate_from_wrench(
        name,
        wrench[:, :3],
        wrench[:, 3:],
        Surface(middle, np.array([0.0, 1.0, 0.0])),
        corners=plates[k].corners,
        threshold_n=10.0,
        zero_unloaded=False,
    )
    return recording.with_plates(tuple(plates))


def test_an_offset_of_a_plate_that_nobody_steps_on_is_taken_off_without_its_edges() -> None:
    made = walked().recording
    idle = with_read(made, "p0", 15.0 + 0.3 * np.sin(np.arange(made.n_frames)), alone=True)
    idle = idle.with_plates(tuple(replace(plate, corners=None) for plate in idle.plates))
    found, said = zeroed(idle)
    assert len(said) == 1 and "p0 reads 15 N" in said[0]
    assert np.abs(next(plate.force for plate in found.plates if plate.name == "p0")).max() < 1.0


def test_what_changes_while_no_foot_is_near_is_said_and_stays() -> None:
    """A cane on a plate that the feet have left."""
    made = walked().recording
    cane = with_read(made, "p3", 30.0 + 25.0 * np.sin(12.0 * made.time), alone=True)
    found, said = zeroed(cane)
    assert found is cane and len(said) == 1
    assert said[0].startswith("Warning: p3 reads") and "plate_loads" in said[0]


def test_a_drift_beyond_what_is_judged_shows_no_place() -> None:
    """It rises above it while the last foot stands beside the plates, as if it came with that."""
    made = walked(drift_n=70.0).recording
    said = messages(made.with_plates(tuple(plate for plate in made.plates if plate.name != "p3")))
    assert not any("off its place" in t for t in said)


def test_an_offset_is_not_the_foots_that_steps_on_its_plate_last() -> None:
    """Two frames of a foot that sets down as a recording ends say nothing of what was read before."""
    made = walked().recording
    recording = with_read(made, "p3", np.full(made.n_frames, 15.0)).window(0.0, 1.67)
    on = foot_loads(recording, LABORATORY, FOOT_MARKERS).on.any(axis=1)  # (T, P)
    p = [plate.name for plate in recording.plates].index("p3")
    assert on[-1, p] and not on[recording.time < 1.4, p].any()


@pytest.mark.parametrize("lost", ["RHEE", "LTOE"])
@pytest.mark.parametrize("edges", [True, False])
def test_a_foot_without_a_marker_reaches_as_far_as_the_other(lost: str, edges: bool) -> None:
    made = walked(edges=edges)
    markers = made.recording.markers.copy()
    markers[:, made.recording.marker_names.index(lost)] = np.nan
    recording = replace(made.recording, markers=markers)
    assert messages(recording) == []
    loads = foot_loads(recording, LABORATORY, FOOT_MARKERS)
    assert loads.all_measured.all()
    np.testing.assert_allclose(loads.wrench[..., 1], made.push, atol=5.0)


def test_a_foot_whose_length_is_not_seen_accuses_no_plate() -> None:
    made = walked().recording
    markers = made.markers.copy()
    for name in ("RHEE", "LHEE"):
        markers[:, made.marker_names.index(name)] = np.nan
    assert not any("off its place" in t for t in messages(replace(made, markers=markers)))


def test_a_plate_that_reads_nothing_under_a_foot_is_dead() -> None:
    made = walked().recording
    nothing = {name: 0.0 * getattr(made.plates[1], name) for name in ("force", "moment", "free_moment")}
    dead = replace(made.plates[1], **nothing, cop=np.full_like(made.plates[1].cop, np.nan))
    said = messages(made.with_plates((made.plates[0], dead, *made.plates[2:])))
    assert sum("reads nothing although the" in t for t in said) == 1
    assert any(t.startswith(f"Warning: {dead.name} reads nothing") for t in said)
    assert not any("reads nothing" in t for t in messages(made))
    unknown = without_frames(made.plates[1], np.ones(made.n_frames, dtype=bool))
    assert not any(
        "reads nothing" in t for t in messages(made.with_plates((made.plates[0], unknown, *made.plates[2:])))
    )


def test_a_drift_below_the_noise_is_no_warning() -> None:
    _, said = zeroed(walked(drift_n=8.0).recording)
    assert not any(t.startswith("Warning") for t in said)


def test_exchanged_plates_under_feet_that_stand_are_no_ones_business_here() -> None:
    """Both loads then lie under a foot: only that they push the feet apart shows it (`check_plates`)."""
    feet = {
        "right": [Stance(0.0, 2.0, 0.0, 0.15, 0.0, ("p0",))],
        "left": [Stance(0.0, 2.0, 0.0, -0.15, 0.0, ("p1",))],
    }
    made = steps(2.0, feet, [MadePlate("p0", z=(0.0, 0.3)), MadePlate("p1", z=(-0.3, 0.0))])
    plates = exchanged(*made.recording.plates)
    assert messages(made.recording.with_plates(plates)) == []


@pytest.mark.parametrize("trial", ["squats1", "walking1"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_gaps_at_push_off_in_a_real_foot_leave_the_plates_where_they_were(
    data_dir: Path, trial: str, side: str
) -> None:
    """Eight gaps of a second (squats), or one that begins up to 0.8 s before toe-off (a walk of 1.3 s)."""
    folder = data_dir / "opencap_subject4"
    recording = read(folder / f"{trial}.trc", folder / f"{trial}_grf.mot")
    ground, markers = find_ground_frame(recording), foot_markers_of(recording)
    whole = foot_loads(recording, ground, markers)
    k = whole.feet.index(side)
    if trial == "squats1":
        cases = [np.linspace(10, recording.n_frames - 110, 8).astype(int)]
    else:
        leaves = int(np.flatnonzero(np.nan_to_num(whole.wrench[:, k, 1]) > 20.0)[-1])
        cases = [np.array([max(0, leaves - early)]) for early in range(5, 85, 10)]
    columns = [recording.marker_names.index(name) for name in markers[side]]
    for starts in cases:
        gap = np.zeros(recording.n_frames, dtype=bool)
        for start in starts:
            gap[start : start + 100] = True
        hidden = recording.markers.copy()
        hidden[np.ix_(gap, columns)] = np.nan
        loads = foot_loads(replace(recording, markers=hidden), ground, markers)
        known = np.isfinite(loads.wrench[..., 1]) & np.isfinite(whole.wrench[..., 1])
        assert np.abs(loads.wrench - whole.wrench)[known].max() < 25.0
        if trial == "squats1":
            assert known.all() and loads.all_measured.all()


def blanked(recording: Recording, blank: dict[str, np.ndarray]) -> Recording:
    """Without numbers in these frames (T,) of these plates."""

    def of(plate: Plate) -> Plate:
        gone = blank.get(plate.name, np.zeros(recording.n_frames, dtype=bool))[:, None]
        values = (np.where(gone, np.nan, each) for each in (plate.force, plate.moment, plate.cop, plate.free_moment))
        force, moment, cop, free = values
        return replace(plate, force=force, moment=moment, cop=cop, free_moment=free)

    return recording.with_plates(tuple(of(plate) for plate in recording.plates))


def test_plates_without_numbers_while_nobody_is_on_them_are_empty() -> None:
    """As programs write an empty plate: no frame had all plates."""
    full = walked().recording
    gaps = {plate.name: plate.force[:, 1] < 20.0 for plate in full.plates}
    recording = blanked(full, gaps)
    assert not foot_loads(recording, LABORATORY, FOOT_MARKERS).total_known.any()
    found, said = without_blanks(recording, LABORATORY, FOOT_MARKERS)
    assert [str(each) for each in said] == ["p0, p2, p1, p3: no numbers while no foot is near, taken as empty there."]
    loads, before = (foot_loads(each, LABORATORY, FOOT_MARKERS) for each in (found, full))
    assert np.count_nonzero(loads.all_measured) > 0.9 * np.count_nonzero(before.all_measured)
    known = loads.total_known
    np.testing.assert_allclose(found.total_wrench()[known], full.total_wrench()[known], atol=20.0)
    assert without_blanks(full, LABORATORY, FOOT_MARKERS) == (full, [])


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_what_a_plate_without_numbers_bears_of_a_foot_is_not_known(share: float) -> None:
    """For a part of a stance, or all of it."""
    full = walked().recording
    gaps = {plate.name: plate.force[:, 1] < 20.0 for plate in full.plates}
    pressed = np.flatnonzero(~gaps["p1"])
    gone = pressed[: round(share * len(pressed))]
    gaps["p1"][gone] = True
    found, _ = without_blanks(blanked(full, gaps), LABORATORY, FOOT_MARKERS)
    plate = next(plate for plate in found.plates if plate.name == "p1")
    loads = foot_loads(found, LABORATORY, FOOT_MARKERS)
    heavy = gone[full.plates[[p.name for p in full.plates].index("p1")].force[gone, 1] > 50.0]
    assert len(heavy) > 10 and np.isnan(plate.force[heavy]).all()
    assert not loads.total_known[heavy].any() and np.isnan(loads.wrench[heavy, 1]).all()


@pytest.mark.parametrize(("height_m", "taken_off"), [(0.05, False), (0.5, True)])
def test_a_steady_hand_on_a_plate_is_no_zero_of_it(height_m: float, taken_off: bool) -> None:
    """Of all fours with the hands on plates 90 N were taken off, and L5/S1 was 88 N m off, said to 9."""
    made = walked().recording
    idle = with_read(made, "p0", np.full(made.n_frames, 60.0), alone=True)
    plate = next(plate for plate in idle.plates if plate.name == "p0")
    hand = np.nanmean(plate.cop, axis=0) + np.array([0.1, height_m, 0.05])
    markers = np.concatenate([idle.markers, np.tile(hand, (made.n_frames, 1, 1))], axis=1)
    found, said = zeroed(replace(idle, marker_names=(*idle.marker_names, "RFIN"), markers=markers))
    assert bool(said) == taken_off
    assert (np.abs(next(plate.force for plate in found.plates if plate.name == "p0")).max() < 1.0) == taken_off
