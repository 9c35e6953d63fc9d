"""What bears the person, or is carried: the plates' clock, hands, and arms that a model does not have."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from dynakin.bindings import _core
from dynakin.filter.uncertainty.geometry import BLOCKS, Geometry
from dynakin.filter.uncertainty.loads import HANDS
from dynakin.filter.uncertainty.mass_centres import Arms, unseen_limbs
from dynakin.filter.uncertainty.sizes import LANDMARKS
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.filter.uncertainty.upright import trunks_of
from dynakin.model.calibration.declared import with_loads
from dynakin.model.spec import free_names
from dynakin.recordings.feet.contact import UNMEASURED
from dynakin.results.measures.sources import MEASURED
from dynakin.settings.noise import Noise
from dynakin.settings.subject import CarriedLoad
from support.made_in_space import measured
from support.systematic_leg import (
    CONTACT,
    NONE,
    QD,
    QDD,
    RATE,
    Q,
    by_rate,
    calibrated,
    one_frame,
    parts_of,
    systematic,
    with_errors,
    with_motion,
)

Array = npt.NDArray[np.float64]


def test_a_clock_that_is_off_moves_moments_by_how_fast_loads_change() -> None:
    """Over time as live, and in each frame: a load passes faster than frames are sampled."""
    subject, x = Systematic(calibrated(), Noise(), replace(NONE, clock=0.004, inertia=False)), np.r_[Q, QD, QDD]
    time = 0.01 * np.arange(5)
    data = xr.Dataset(
        {
            "state": (("time", "element"), np.tile(x, (5, 1))),
            "state_sd": (("time", "element"), np.zeros((5, 30))),
            "final_covariance": (("element", "element_"), np.zeros((30, 30))),
            "foot_wrench": (("time", "foot", "component"), (CONTACT + time[:, None] * RATE)[:, None]),
            "markers_measured": (("time", "marker", "axis"), np.zeros((5, 12, 3))),
        }
        | {f"{block}{end}": (("time", "coordinate"), np.zeros((5, 10))) for block in BLOCKS for end in ("", "_sd")},
        coords={"time": time, "foot_segment": ("foot", ["shank"])},
    )
    recorded = subject.added_over_time(data, late=True)
    np.testing.assert_allclose(recorded["moments_sd"], np.tile(0.004 * np.abs(by_rate()), (5, 1)), rtol=1e-9)
    assert not recorded["speeds_sd"].any()
    own = {block: np.zeros(10) for block in BLOCKS}
    live = with_errors(subject, own, x, np.zeros((30, 30)), late=True, rate=RATE)
    np.testing.assert_allclose(live["moments"], recorded["moments_sd"][2], rtol=1e-9)


def test_a_clock_that_is_known_worse_counts_for_more() -> None:
    subject = Systematic(calibrated(), Noise())
    assert subject.with_found(0.5 * subject.sizes.clock).sizes == subject.sizes
    coarse = subject.with_found(0.01)
    assert coarse.sizes == replace(subject.sizes, clock=0.01) and subject.sizes.clock < 0.01
    own = dict.fromkeys(BLOCKS, np.zeros(10))
    state = (own, np.r_[Q, QD, QDD], np.zeros((30, 30)))
    surer, less = (with_errors(each, *state, late=True, rate=RATE)["moments"] for each in (subject, coarse))
    still = with_errors(subject, *state, late=True)["moments"]
    by_clock = (less**2 - still**2) / (surer**2 - still**2)
    np.testing.assert_allclose(by_clock[surer > 1.001 * still], (0.01 / subject.sizes.clock) ** 2)


def test_a_clock_that_is_off_counts_in_what_contacts_give_as_in_moments() -> None:
    """A load that comes on 8 ms later than it did is off by 8 ms of its change, in the foot's wrench and in the sum."""
    time = 0.01 * np.arange(4.0)
    wrench = CONTACT + time[:, None, None] * RATE
    wrench = np.concatenate([wrench, 0.5 * wrench], axis=1)
    per_coordinate, per_contact = ("time", "coordinate"), ("time", "foot", "component")
    state = np.tile(with_motion(calibrated().x0), (4, 1))
    data = xr.Dataset(
        {f"{block}_sd": (per_coordinate, np.full((4, 10), 0.1)) for block in BLOCKS}
        | {
            "moments": (per_coordinate, np.zeros((4, 10))),
            "state": (("time", "element"), state),
            "state_sd": (("time", "element"), np.zeros_like(state)),
            "final_covariance": (("element", "element_"), np.zeros((state.shape[1],) * 2)),
            "markers_measured": (("time", "marker", "axis"), np.zeros((4, 12, 3))),
            "foot_contact": (("time", "foot"), np.ones((4, 2), np.uint8)),
            "foot_wrench": (per_contact, wrench),
            "foot_wrench_sd": (per_contact, np.full((4, 2, 6), 3.0)),
            "wrench_measured": (("time", "component"), np.where(time[:, None] < 0.03, wrench.sum(axis=1), np.nan)),
            "wrench_estimated": (("time", "component"), wrench.sum(axis=1)),
            "wrench_sd": (("time", "component"), np.full((4, 6), 4.0)),
        },
        coords={"time": time, "foot_segment": ("foot", ["shank", "pelvis"])},
    )
    before, after = (systematic().with_found(clock_s).added_over_time(data, late=True) for clock_s in (0.0, 0.008))
    for found, clock_s in ((before, LANDMARKS.clock), (after, 0.008)):
        each = np.hypot(3.0, clock_s * np.stack([RATE, 0.5 * RATE]))
        np.testing.assert_allclose(found["foot_wrench_sd"], np.broadcast_to(each, (4, 2, 6)))
        np.testing.assert_allclose(found["wrench_sd"][:3], np.tile(np.hypot(4.0, clock_s * 1.5 * RATE), (3, 1)))
        np.testing.assert_array_equal(found["wrench_sd"][3], np.full(6, 4.0))  # derived: no plate's clock is in it
    assert (after["moments_sd"][:, 9] > before["moments_sd"][:, 9]).all()
    beside = data.assign(foot_contact=(("time", "foot"), np.array([[1, UNMEASURED]] * 4, np.uint8)))
    found = systematic().with_found(0.008).added_over_time(beside, late=True)["foot_wrench_sd"]
    np.testing.assert_array_equal(found[:, 0], after["foot_wrench_sd"][:, 0])
    np.testing.assert_array_equal(found[:, 1], np.full((4, 6), 3.0))


def test_a_load_in_the_hands_counts_in_the_moments_that_bear_it() -> None:
    """As much as bodies do that are welded to both hands of a model that stands still, bent at the elbows."""
    person = measured()
    names = list(person.names)
    x = np.array(person.x0)
    x[[names.index(f"elbow_flex_{side}") for side in "rl"]] += 1.2
    own = {segment.name: np.asarray(segment.inertia) for segment in person.spec.segments}
    free = _core.joint_moments(_core.Model(person.spec), x, np.zeros((len(own), 6)))
    square = np.zeros(len(free))
    for hand in HANDS:
        place = tuple(own[hand][1:4] / own[hand][0])
        laden = with_loads(person, [CarriedLoad(segment=hand, mass_kg=1.0, place_m=place)])
        square += 0.5 * np.square(_core.joint_moments(_core.Model(laden.spec), x, np.zeros((len(own) + 1, 6))) - free)
    coordinates = [c.name for c in person.spec.coordinates]
    subject = Systematic(person, Noise())
    motion = x[: 3 * len(subject.geometry.free)].reshape(3, -1)
    borne = parts_of(subject, *motion)["hands"]["moments"]
    inner = [k for k, name in enumerate(coordinates) if not name.startswith("pelvis")]
    np.testing.assert_allclose(borne[inner], square[inner], atol=1e-9)
    elbow, knee = (coordinates.index(name) for name in ("elbow_flex_r", "knee_angle_r"))
    assert 1.0 < np.sqrt(borne[elbow]) < 3.0 and borne[knee] == 0.0
    with_it = subject.with_found(0.0, 3.0)
    assert with_it.sizes == replace(subject.sizes, hands=3.0)
    own_sd = {block: np.zeros(len(coordinates)) for block in BLOCKS}
    frames = replace(
        one_frame(own_sd, x, np.zeros((len(x), len(x))), late=True),
        wrench=np.zeros((1, 0, 6)),
        wrench_rate=np.zeros((1, 0, 6)),
        segments=[],
        used=np.ones((1, len(person.spec.markers)), dtype=bool),
        sources=np.full((1, len(coordinates)), MEASURED, dtype=np.uint8),
    )
    without, held = (each.added(frames)["moments"][0] for each in (subject, with_it))
    np.testing.assert_allclose(held[inner] ** 2 - without[inner] ** 2, 9.0 * borne[inner], atol=1e-9)


def test_arms_that_a_file_does_not_have_swing_at_the_joint_below_the_trunk() -> None:
    person = replace(measured(), plan=None)
    assert Arms.of(person) is None and Arms.of(measured()) is None
    gone = set(person.tree.below(*trunks_of(person))) - trunks_of(person)
    bare = copy(person.spec)
    bare.segments = [segment for segment in bare.segments if segment.name not in gone]
    bare.markers = [marker for marker in bare.markers if marker.segment not in gone]
    kept = {axis.coordinate for segment in bare.segments for axis in segment.axes}
    bare.coordinates = [c for c in bare.coordinates if c.name in kept]
    model = _core.Model(bare)
    armless = replace(person, spec=bare)
    arms = Arms.of(armless)
    assert arms is not None and arms.trunk in trunks_of(person)
    assert 2.0 < arms.mass_kg < 4.0 and 0.2 < arms.reach_m < 0.6
    assert not unseen_limbs(armless)  # nothing of the model is: plates are looked for as of any other
    assert arms.raised == {arms.trunk: arms.mass_kg * arms.reach_m}
    names = [c.name for c in bare.coordinates]
    free = free_names(bare)
    still, walking = np.zeros(len(free)), np.zeros(len(free))
    walking[[free.index("hip_flexion_r"), free.index("hip_flexion_l")]] = 10.0, -10.0
    x = np.array(model.initial_state())
    geometry: Any = SimpleNamespace(model=model, x0=x, count=len(names))
    geometry.moments_by = partial(Geometry.moments_by, geometry)
    found = np.sqrt(arms.variances(geometry, (x[: len(free)], still, walking)))
    spine = [names.index(name) for name in ("lumbar_extension", "lumbar_bending", "lumbar_rotation")]
    legs = [k for k, name in enumerate(names) if name.startswith(("hip", "knee", "ankle"))]
    assert found[spine[0]] > 1.5 and found[spine[2]] > 1.5 and not found[legs].any()
    assert not arms.variances(geometry, (x[: len(free)], still, still)).any()
