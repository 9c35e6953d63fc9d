"""From the wrenches of two feet to what laboratories read, through filter, estimate and files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.filter.assemble import assemble
from dynakin.filter.contacts import RESIDUAL, ContactLoads
from dynakin.filter.core_filter import smoothed
from dynakin.filter.measurements import Measurements
from dynakin.model.calibration.calibrated import Provenance
from dynakin.pipeline.result import Result
from dynakin.recordings.feet.contact import NO_CONTACT, ON_PLATE, UNMEASURED
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.frame import GroundFrame
from dynakin.recordings.recording import Plate, Recording
from dynakin.results.estimate import Estimate
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.pressure import floor_height, foot_pressure
from dynakin.results.measures.sources import DERIVED, MEASURED, PRIOR
from dynakin.settings.noise import Noise
from dynakin.tree import Tree
from support.core.bridge import filter_of, to_core
from support.core.random_models import FEET, ROOT, Trial, floating_model, prior_sd, settings, trial
from support.oracle import measurement
from support.oracle.state import Layout

FRAMES = 60
SPEC = floating_model(5)
NAMES = ("left", "right")
REFERENCE = np.array([[0.1, 0.0, -0.2], [0.1, 0.0, 0.2]])


def contacts() -> np.ndarray:
    """Both measured, one in the air, one beside the plates, none, both beside the plates."""
    codes = np.full((FRAMES, 2), ON_PLATE, np.uint8)
    codes[20:25, 1] = NO_CONTACT
    codes[25:35, 0] = UNMEASURED
    codes[35:40] = NO_CONTACT
    codes[40:45] = UNMEASURED
    return codes


@pytest.fixture(scope="module")
def data() -> Trial:
    return trial(SPEC, 31, FRAMES, uneven=False, gaps=False)


def feet_of(data: Trial, codes: np.ndarray) -> ContactLoads:
    total = measurement.wrench(Layout(SPEC), data.truth)
    share = np.linspace(0.3, 0.7, FRAMES)[:, None]
    wrench = np.stack([share * total, (1 - share) * total], axis=1)
    wrench += np.random.default_rng(32).normal(size=wrench.shape) * [3.0, 3.0, 3.0, 1.0, 1.0, 1.0]
    return ContactLoads.of(NAMES, FEET, wrench, codes, 5.0, 2.0, REFERENCE)


def estimate_of(data: Trial, feet: ContactLoads | None, smooth: bool = False) -> Estimate:
    chosen = settings(SPEC, 33, bounds=False) | {"constraint": "none"}
    core = filter_of(SPEC, chosen, data.x0, data.P0)
    loads = None if feet is None else feet.core()
    if smooth:
        arrays = smoothed(core.run_smoothed(data.time, data.markers, data.wrench, outputs=True, feet=loads))
    else:
        arrays = core.run(data.time, data.markers, data.wrench, output_sd=True, feet=loads)
    layout, spec = Layout(SPEC), to_core(SPEC)
    ground = GroundFrame(np.eye(3), np.zeros(3), "+Y", np.array([1.0, 0.0, 0.0]))
    zero = np.zeros((FRAMES, 3))
    plate = Plate("plate 1", data.wrench[:, :3], data.wrench[:, 3:], zero + np.array([0.1, -0.05, 0.0]), zero)
    names = tuple(m.name for m in SPEC.markers)
    recording = Recording("fall", None, data.time, names, data.markers, (plate,))
    endless = np.full(layout.size, np.inf)
    initial: Any = SimpleNamespace(
        spec=spec,
        tree=Tree.of(spec.segments),
        names=tuple(layout.names),
        dimensionless=frozenset(),
        feet={},
        contacts={},
        held={},
        provenance=Provenance(),
        joint_prior=None,
        unmarked_feet={},
        coupled=None,
        in_radians=frozenset(),
        soft_tissue_m=np.zeros(len(SPEC.markers)),
        x0=data.x0,
        sd0=prior_sd(layout),
        unshown_sd={},
        lower=-endless,
        upper=endless,
        table=np.full(layout.size, np.nan),
        ground=ground,
        recorded_markers=names,
        side="both",
        mass_kg=50.0,
        weighed_kg=50.0,
        height_m=None,
        messages=(),
    )
    tracker: Any = SimpleNamespace(
        calibrated=initial, core_model=_core.Model(spec), noise=Noise(), covariance=core.covariance
    )
    return assemble(arrays, tracker, recording, Measurements(data.time, data.markers, data.wrench, feet), {}, [])


@pytest.fixture(scope="module")
def feet(data: Trial) -> ContactLoads:
    return feet_of(data, contacts())


@pytest.fixture(scope="module", params=[False, True], ids=["filtered", "smoothed"])
def estimate(data: Trial, feet: ContactLoads, request: pytest.FixtureRequest) -> Estimate:
    return estimate_of(data, feet, request.param)


def values(estimate: Estimate, name: str) -> np.ndarray:
    return np.asarray(estimate.data[name].values)


def test_nothing_is_left_at_the_root_where_anything_touches(estimate: Estimate) -> None:
    moments = estimate.data["moments"].sel(coordinate=list(ROOT)).values
    touched = np.r_[0:35, 40:FRAMES]  # also where what touches is not measured
    assert np.abs(moments[touched]).max() < 1e-9
    assert np.abs(values(estimate, "wrench_remainder")[touched]).max() < 1e-9
    np.testing.assert_allclose(
        values(estimate, "foot_wrench")[touched].sum(axis=1), values(estimate, "wrench_estimated")[touched], atol=1e-9
    )
    np.testing.assert_allclose(
        values(estimate, "wrench_remainder")[35:40], values(estimate, "wrench_estimated")[35:40], atol=1e-12
    )


def test_what_is_derived_and_what_a_prior_divides_is_marked(estimate: Estimate) -> None:
    source = estimate.data["moment_source"].sel(coordinate="leg2_0_l").values
    other = estimate.data["moment_source"].sel(coordinate="leg2_0_r").values
    assert (source[25:35] == DERIVED).all() and (other[25:35] == MEASURED).all()
    assert (source[40:45] == PRIOR).all() and (other[40:45] == PRIOR).all()
    assert not source[:25].any() and not source[45:].any()
    sd = estimate.data["moments_sd"].sel(coordinate="leg2_0_r").values
    assert np.isfinite(sd).all() and (sd > 0.0).all()
    assert np.isfinite(estimate.data["moments"].sel(coordinate="leg2_0_r").values).all()
    arm = estimate.data["moments"].sel(coordinate="arm_0").values
    assert np.isfinite(arm).all()


def test_figures_of_the_feet(estimate: Estimate) -> None:
    figures = compute_metrics(estimate)["feet"]
    assert figures["derived_frames"] == 10 and figures["unknown_frames"] == 0 and figures["flight_frames"] == 5
    both = np.r_[0:25, 35:40, 45:FRAMES]
    adjustment = values(estimate, "foot_adjustment")[:, 0, 1]
    own = both[values(estimate, "foot_contact")[both, 0] == ON_PLATE]
    rms = np.sqrt(np.mean(adjustment[own] ** 2))
    assert figures["adjustment_rms"]["left"]["fy"] == pytest.approx(rms)
    assert "10 of 60 frames one contact was not measured" in figures["verdict"]


def test_centres_of_pressure_carry_the_whole_wrench(estimate: Estimate) -> None:
    assert floor_height(estimate) == pytest.approx(-0.05)
    wrench = values(estimate, "foot_wrench")[:, 0]
    point, free = foot_pressure(estimate, "left")
    loaded = np.nan_to_num(wrench[:, 1]) >= 20.0
    assert loaded.any() and not loaded.all()
    np.testing.assert_array_equal(np.isfinite(point).all(axis=1), loaded)
    moment = np.cross(point, wrench[:, :3]) + np.outer(free, [0.0, 1.0, 0.0])
    np.testing.assert_allclose(moment[loaded], wrench[loaded, 3:], atol=1e-9)
    assert (point[loaded, 1] == floor_height(estimate)).all()


def test_joint_loads_along_the_axes_of_either_segment(estimate: Estimate) -> None:
    ground = estimate.joint_loads()
    names = [str(name) for name in estimate.data["joint_segment"].values]
    thigh, shank = names.index("left_0"), names.index("left_1")
    R = values(estimate, "joint_orientations")
    for frame, own in (("child", shank), ("parent", thigh)):
        turned = estimate.joint_loads(frame)[:, shank]
        for k in (0, 10, 30):
            np.testing.assert_allclose(turned[k, :3], R[k, own].T @ ground[k, shank, :3], atol=1e-10)
            np.testing.assert_allclose(turned[k, 3:], R[k, own].T @ ground[k, shank, 3:], atol=1e-10)
    np.testing.assert_array_equal(np.isnan(estimate.joint_loads("child")), np.isnan(ground))
    np.testing.assert_array_equal(estimate.joint_loads("parent")[:30, 0], ground[:30, 0])  # the ground's own


def test_powers_and_work(estimate: Estimate) -> None:
    power = estimate.powers()
    np.testing.assert_array_equal(power, values(estimate, "moments") * values(estimate, "speeds"))
    work = compute_metrics(estimate)["work"]["arm_0"]
    own = power[:, estimate.coordinate_names.index("arm_0")]
    assert work["positive_j"] + work["negative_j"] == pytest.approx(np.trapezoid(own, estimate.time))
    assert work["positive_j"] >= 0.0 >= work["negative_j"]
    assert work["positive_j_per_kg"] == pytest.approx(work["positive_j"] / 50.0)
    assert not set(ROOT) & set(compute_metrics(estimate)["work"])  # the root has no muscle
    np.testing.assert_allclose(estimate.moments_per_kg(), values(estimate, "moments") / 50.0)


def test_both_sides_are_compared(estimate: Estimate) -> None:
    found = compute_metrics(estimate)["asymmetry"]
    angle = {side: estimate.data["coordinates"].sel(coordinate=f"leg0_0_{side}").values for side in "rl"}
    r, left = np.ptp(angle["r"]), np.ptp(angle["l"])
    assert found["coordinates"]["leg0_0"]["range"] == pytest.approx(100 * (r - left) / ((r + left) / 2))
    assert found["feet"] == {"peak_vertical_force": None, "impulse": None}  # no stance of the left is measured whole
    assert "The left foot has no stance" in found["reason"]


def test_feet_are_compared_over_whole_measured_stances(data: Trial) -> None:
    codes = np.full((FRAMES, 2), ON_PLATE, np.uint8)
    codes[:5, 0] = codes[25:30, 0] = codes[:10, 1] = codes[30:35, 1] = NO_CONTACT
    codes[45:50, 0] = UNMEASURED  # one contact: derived
    stepping = estimate_of(data, feet_of(data, codes))
    found = compute_metrics(stepping)["asymmetry"]
    assert found["stances"] == {"left": 1, "right": 1} and found["reason"] is None
    push = values(stepping, "foot_wrench")[:, :, 1]
    left, right = (np.abs(push[part, k]).max() for k, part in enumerate((slice(5, 25), slice(10, 30))))
    assert found["feet"]["peak_vertical_force"] == pytest.approx(100 * (right - left) / ((right + left) / 2))


def test_files(estimate: Estimate, tmp_path: Path) -> None:
    folder = Result(estimate).save(tmp_path / "out")
    feet = read_table(folder / "feet.sto")
    columns = dict(zip(feet.names, feet.values.T, strict=True))
    for side, foot in (("l", 0), ("r", 1)):
        force, point, torque = (
            np.stack([columns[f"ground_{kind}{a}"] for a in "xyz"], axis=1)
            for kind in (f"force_{side}_v", f"force_{side}_p", f"torque_{side}_")
        )
        moment = np.cross(point, force) + torque
        expected = values(estimate, "foot_wrench")[:, foot]
        np.testing.assert_allclose(np.hstack([force, moment]), expected, rtol=6e-6, atol=1e-4)  # six digits
    mass_centre = read_table(folder / "centre_of_mass.sto")
    assert list(mass_centre.names) == ["com_x", "com_y", "com_z", "com_vx", "com_vy", "com_vz"]
    np.testing.assert_allclose(mass_centre.values[:, :3], values(estimate, "mass_centre"), rtol=6e-6)
    loads = read_table(folder / "joint_reactions.sto")
    joint = [str(name) for name in estimate.data["joint"].values][3]
    here = list(loads.names).index(f"{joint}_on_left_2_in_ground_fy")
    np.testing.assert_allclose(loads.values[:, here], values(estimate, "joint_loads")[:, 3, 1], rtol=6e-6)
    powers = read_table(folder / "powers.sto")
    assert powers.names[0] == f"{estimate.coordinate_names[0]}_power"
    with xr.open_dataset(folder / "estimate.nc") as stored:
        np.testing.assert_allclose(stored["foot_wrench"].values, values(estimate, "foot_wrench"), rtol=2.0**-24)
        assert stored["foot_contact"].attrs["flag_meanings"] == "none plate unmeasured shared_plate"


def test_the_feet_alone_change_nothing_but_the_moments(data: Trial, feet: ContactLoads) -> None:
    """What the core is given of contacts is for the moments; the total that they sum to is given beside them."""
    with_feet, without = estimate_of(data, feet), estimate_of(data, None)
    for name in ("coordinates", "wrench_estimated", "state_sd", "mass_centre", "joint_centres"):
        np.testing.assert_array_equal(values(with_feet, name), values(without, name))
    assert without.foot_names == [] and compute_metrics(without)["feet"] is None


def test_errors_about_a_reference_point_are_carried_to_the_origin() -> None:
    codes = np.full((1, 2), ON_PLATE)
    feet = ContactLoads.of(NAMES, FEET, np.zeros((1, 2, 6)), codes, 20.0, 3.0, [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    rng = np.random.default_rng(34)
    force, moment = rng.normal(size=(200_000, 3)) * 20.0, rng.normal(size=(200_000, 3)) * 3.0
    drawn = np.cov(np.hstack([force, moment + np.cross([1.0, 0.0, 0.0], force)]).T)
    one, other = feet.covariance[0, :6, :6], feet.covariance[0, 6:, 6:]
    np.testing.assert_allclose(one, drawn, atol=6.0)
    np.testing.assert_allclose(other, np.diag([400.0] * 3 + [9.0] * 3))
    assert one[5, 5] == pytest.approx(409.0)  # 20 N at 1 m is 20 N m
    assert not feet.covariance[0, :6, 6:].any()


def test_late_plates_are_taken_earlier(data: Trial, feet: ContactLoads) -> None:
    late = feet.in_step(data.time, 0.01)  # a frame
    np.testing.assert_allclose(late.wrench[10], feet.wrench[11], rtol=1e-6, atol=1e-6)
    assert (late.contact[18] == ON_PLATE).all() and late.contact[19, 1] == NO_CONTACT
    half = feet.in_step(data.time, 0.005)
    assert not ((half.contact == ON_PLATE) & ~np.isfinite(half.wrench).all(axis=2)).any()
    assert feet.in_step(data.time, 0.0) is feet


def test_feet_that_do_not_fit_are_told(data: Trial) -> None:
    model = _core.Model(to_core(SPEC))
    good = feet_of(data, contacts())
    good.check(model)
    wrong = replace(good, segments=("left_2", "paw"))
    with pytest.raises(ModelError, match="contact 'right': segment 'paw' is not in the model, expected one of root"):
        wrong.check(model)
    blank = replace(good, wrench=good.wrench * np.nan)
    with pytest.raises(ModelError, match="contact 'left': in frame 1 its wrench is"):
        blank.check(model)


def with_residual(data: Trial) -> ContactLoads:
    """With what the model does not explain as a contact of its own, on the root."""
    feet = feet_of(data, contacts())
    codes = np.column_stack([contacts(), np.full(FRAMES, ON_PLATE, np.uint8)])
    wrench = np.concatenate([feet.wrench, np.zeros((FRAMES, 1, 6))], axis=1)
    sd = np.array([5.0, 5.0, 15.0])[:, None]
    points = np.vstack([REFERENCE, [0.0, 1.0, 0.0]])
    return ContactLoads.of((*NAMES, RESIDUAL), (*FEET, SPEC.segments[0].name), wrench, codes, sd, 0.4 * sd, points)


def test_the_total_is_what_contacts_give_where_plates_measure_all(data: Trial) -> None:
    feet = with_residual(data)
    estimate = estimate_of(data, feet, smooth=True)
    by_plates, elsewhere = np.r_[0:25, 35:40, 45:FRAMES], np.r_[25:35, 40:45]
    np.testing.assert_array_equal(np.flatnonzero(feet.by_plates), by_plates)
    total, needed, sd = (values(estimate, name) for name in ("wrench_estimated", "wrench_needed", "wrench_sd"))
    given, remainder = values(estimate, "foot_wrench").sum(axis=1), values(estimate, "wrench_remainder")
    np.testing.assert_allclose(total[by_plates], given[by_plates], atol=1e-9)
    np.testing.assert_allclose(needed, given + remainder, atol=1e-9)
    assert np.abs(remainder[by_plates]).max() > 1.0
    np.testing.assert_array_equal(total[elsewhere], needed[elsewhere])
    own = values(estimate, "foot_wrench_sd")
    both = np.r_[0:20, 45:FRAMES]  # two feet of 5 N each, none of the residual's 15
    expected = np.minimum(np.sqrt(2.0) * 5.0, own[both][..., :3].sum(axis=1))
    np.testing.assert_allclose(sd[both][:, :3], expected)
    np.testing.assert_allclose(sd[20:25], own[20:25, 0])  # the left foot alone
    assert (sd[35:40] == 0.0).all()  # in the air
    assert not feet_of(data, contacts()).by_plates.any()  # without a residual what is needed is what contacts give


def test_how_well_plates_and_movement_agree_is_by_what_the_movement_needs(data: Trial, tmp_path: Path) -> None:
    estimate = estimate_of(data, with_residual(data), smooth=True)
    metrics = compute_metrics(estimate)
    window = estimate.time >= metrics["window"]["start_s"]
    off = (values(estimate, "wrench_measured") - values(estimate, "wrench_needed"))[window]
    np.testing.assert_allclose(list(metrics["wrench"]["rms"].values()), np.sqrt(np.mean(off**2, axis=0)), rtol=1e-9)
    table = read_table(Result(estimate).save(tmp_path) / "wrench.sto")
    columns = dict(zip(table.names, table.values.T, strict=True))
    found = (columns["fy_measured"] - columns["fy_needed"])[window]
    assert np.sqrt(np.mean(found**2)) == pytest.approx(metrics["wrench"]["rms"]["fy"], rel=1e-4)
    np.testing.assert_allclose(columns["fy_estimated"], values(estimate, "wrench_estimated")[:, 1], rtol=1e-4)
