"""Which plates are declared contacts' own, and which several of them share."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError
from dynakin.filter.ground.declared import low_beside_feet, plates_of_their_own
from dynakin.filter.ground.expected import ContactPaths, expected_loads
from dynakin.filter.ground.ground import Ground
from dynakin.filter.ground.known import known_ground
from dynakin.filter.samples import marker_paths
from dynakin.model.definition import load_model
from dynakin.recordings.feet.assignment import foot_loads
from dynakin.recordings.feet.contact import ON_PLATE, SHARED_PLATE
from dynakin.recordings.feet.loads import MEASURED, UNKNOWN, FootLoads
from dynakin.recordings.plates.ground_plate import GroundPlate
from dynakin.recordings.plates.pressure import Surface, plate_from_wrench
from dynakin.recordings.recording import Plate, Recording
from support.simulated import simulate

HANDS = ("hand_right", "hand_left")


def person() -> dynakin.ModelDefinition:
    return load_model("fullbody", subject=dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male"))


@cache
def by_hands() -> tuple[Recording, dynakin.CalibratedModel, np.ndarray, FootLoads]:
    """A squat whose hands are declared: markers, and its feet's loads."""
    squat = simulate("fullbody", "squat", 3, 6.0, 50.0, 70.0, 1.75, "male").recording
    initial = dynakin.Estimator(person(), contacts=HANDS).calibrate(squat)
    markers = marker_paths(squat, initial, gaps=True)
    loads = foot_loads(squat, initial.ground, initial.foot_markers, others=HANDS)
    return squat, initial, ContactPaths.of(initial).at(markers), loads


def pressed(name: str, at: np.ndarray) -> Plate:
    """A plate that bears 150 N at (T, 3) m of the ground frame."""
    ground = by_hands()[1].ground
    force = ground.vectors_to_laboratory(np.tile([0.0, 150.0, 0.0], (len(at), 1)))
    place = ground.points_to_laboratory(at * [1.0, 0.0, 1.0])
    surface = Surface(place[0], ground.vectors_to_laboratory(np.array([0.0, 1.0, 0.0])))
    moment = np.cross(place, force)
    return plate_from_wrench(name, force, moment, surface, corners=None, threshold_n=10.0, zero_unloaded=False)


def whose(
    *plates: Plate, paths: np.ndarray | None = None, given: dict[str, str] | None = None
) -> dict[str, tuple[str, ...]]:
    squat, initial, own, loads = by_hands()
    every = (*loads.plates, *(GroundPlate.of(plate, initial.ground) for plate in plates))
    on = np.concatenate([loads.on, np.repeat(loads.on[:, :, :1], len(plates), axis=2)], axis=2)
    on[:, :, 2:] &= paths is not None  # that a foot is said to stand on, too
    paths = own if paths is None else paths
    may = np.ones((len(paths), 2), dtype=bool)
    return plates_of_their_own(squat, initial, replace(loads, on=on, plates=every), paths, may, given or {})


def test_each_declared_contact_has_the_plate_that_presses_under_it() -> None:
    """The refusal offered a configuration for one of them."""
    _, _, paths, _ = by_hands()
    found = whose(pressed("a", paths[:, 2]), pressed("b", paths[:, 1] + [0.02, 0.0, 0.03]))
    assert found == {"a": ("hand_left",), "b": ("hand_right",)}
    assert whose(pressed("a", paths[:, 2] + [1.0, 0.0, 0.0])) == {}


@pytest.mark.parametrize("given", [None, {"a": "hand_right"}])
def test_two_contacts_on_one_plate_share_it(given: dict[str, str] | None) -> None:
    """All of two hands' load was "measured" of the one that had the plate: elbows were 58 N m off, said to 6."""
    _, _, paths, _ = by_hands()
    assert set(whose(pressed("a", paths[:, 1:].mean(axis=1)), given=given)["a"]) == set(HANDS)
    assert whose(pressed("a", paths[:, 1]), given={"a": "hand_right"}) == {}


def test_a_shared_plate_measures_the_sum_of_what_is_on_it() -> None:
    squat, initial, paths, _ = by_hands()
    recording = squat.with_plates((*squat.plates, pressed("a", paths[:, 1:].mean(axis=1))))
    loads = foot_loads(recording, initial.ground, initial.foot_markers, others=HANDS, given={"a": HANDS})
    assert loads.total_known.all() and loads.sharing == [HANDS]
    nothing = np.zeros(len(paths), dtype=bool)
    bears = np.zeros((len(paths), 2), dtype=bool)
    found = expected_loads(Ground(loads, nothing, bears, usable=True), initial, dynakin.presets.default(), paths)
    assert (found.contact[:, 2:4] == SHARED_PLATE).all() and (found.contact[:, :2] == ON_PLATE).all()
    both = found.wrench[:, 2:4]
    np.testing.assert_allclose(both.sum(axis=1)[:, 1], 150.0, atol=1.0)
    np.testing.assert_allclose(both[:, :, 1], 75.0, atol=15.0)
    alone = np.sqrt(found.covariance[:, 13, 13])
    assert (alone > 30.0).all()  # by a prior


def test_a_hand_low_over_its_plate_has_it_and_not_the_foot_beside_it() -> None:
    """ "Plate 1 and plate 3 under the right foot" though the hand was declared: a hip was 22 N m off, said to 3."""
    _, initial, paths, loads = by_hands()
    ahead = initial.ground.vectors_to_ground(initial.ground.forward)
    beside = loads.soles.middle[:, 0] + (loads.soles.half_m[0, 0] + 0.08) * ahead
    for height, owner in ((0.1, {"a": ("hand_right",)}), (0.6, {})):
        low = paths.copy()
        low[:, 1] = beside + np.array([0.0, height, 0.0])
        assert whose(pressed("a", beside), paths=low) == owner
    low[:, 1] = loads.soles.middle[:, 0] + [0.0, 0.1, 0.0]
    assert whose(pressed("a", loads.soles.middle[:, 0]), paths=low) == {}  # under the sole, it is the foot's


def test_a_declared_hand_low_over_a_foots_plate_may_press_it_too() -> None:
    """150 N of a hand before the foot were the foot's: a hip 47 N m off, said to 3, and the hand "bore nothing"."""
    squat, initial, paths, loads = by_hands()
    low = paths[:, 1:].copy()
    low[100:150, 0] = loads.soles.middle[100:150, 0] + np.array([0.0, 0.1, 0.0])
    nothing = np.zeros((len(low), 2), dtype=bool)
    left, bears = low_beside_feet(initial, squat.time, loads, low, nothing, [0, 1])
    assert (left.reason[100:150, 0] == UNKNOWN).all() and (left.reason[:, 1] == MEASURED).all()
    assert bears[100:150, 0].all() and bears.sum() == 50
    (said,) = [each.text for each in left.reasons if "is low over" in each.text]
    assert said.startswith("The hand_right is low over plate 1, on which the right foot stands")
    beside = nothing.copy()
    beside[110:120, 0] = True  # the plates lack what it bears: it is beside them
    assert low_beside_feet(initial, squat.time, loads, low, beside, [0, 1])[0] is loads
    assert low_beside_feet(initial, squat.time, loads, paths[:, 1:], nothing, [0, 1])[0] is loads


@pytest.mark.parametrize(("owner", "who"), [("left", "the left foot is"), ("hand_right", "hand_right is")])
def test_a_foots_plate_that_is_given_to_another_is_refused(owner: str, who: str) -> None:
    squat, initial, _, _ = by_hands()
    name = squat.plates[0].name
    paths = marker_paths(squat, initial, gaps=True)
    known_ground(squat, initial, paths, {name: "right"})
    with pytest.raises(ConfigError, match=rf'plates: "{name}" is given to "{owner}", but {who} .* m from its centre'):
        known_ground(squat, initial, paths, {name: owner})
