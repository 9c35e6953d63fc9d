"""The table in the planar chain: against clouds of point masses of the whole body, total mass, physical
consistency."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from dynakin.errors import ModelError
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.how import Calibration
from dynakin.model.calibration.lumping import part_length
from dynakin.model.definition import load_model
from dynakin.model.inertia import RigidBody
from dynakin.model.plan import ModelPlan
from dynakin.model.table import PAIRED, load_table
from dynakin.recordings.recording import Recording
from dynakin.settings.subject import Subject

Array = npt.NDArray[np.float64]
PERSON = Subject(mass_kg=70.0, height_m=1.75, sex="female")


def cloud(mass: float, centre: Array, inertia: Array) -> tuple[Array, Array]:
    """Six point masses with the given mass, centre and tensor about it: pairs along the principal axes."""
    moments, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)  # second moments
    points, masses = [], []
    for second, axis in zip(moments, axes.T, strict=True):
        reach = np.sqrt(3.0 * second / mass)
        points += [centre + reach * axis, centre - reach * axis]
        masses += [mass / 6.0] * 2
    return np.array(points), np.array(masses)


def planar_sum(points: Array, masses: Array) -> Array:
    return np.array([masses.sum(), *(masses @ points)[:2], masses @ (points[:, 0] ** 2 + points[:, 1] ** 2)])


@pytest.fixture(params=[("sagittal7", "dumas"), ("squat7", "dumas"), ("sagittal7", "deleva"), ("squat7", "deleva")])
def measured(request: pytest.FixtureRequest, standing_person: Recording) -> tuple[ModelPlan, CalibratedModel, str]:
    model, table = request.param
    found = load_model(model, PERSON, "opencap", table).calibrate(standing_person, how=Calibration(side="right"))
    return found.measured_plan(), found, table


def test_the_masses_add_up_to_the_person(measured: tuple[ModelPlan, CalibratedModel, str]) -> None:
    plan, _, _ = measured
    assert sum(body.mass for body in plan.inertia.values()) == pytest.approx(70.0, rel=1e-14)


def test_every_segment_is_a_possible_body(measured: tuple[ModelPlan, CalibratedModel, str]) -> None:
    plan, _, _ = measured
    for name, body in plan.inertia.items():
        assert body.possible_in_plane(), name
        assert body.possible(), name


def test_each_segment_equals_the_points_of_its_parts_on_both_sides(
    measured: tuple[ModelPlan, CalibratedModel, str],
) -> None:
    """Given each part of the table as a cloud of points, when all sides and parts are summed, then the lump
    is met."""
    plan, found, name = measured
    table = load_table(name, "female")
    for segment in plan.model.segments:
        points, masses = [], []
        for part in found.parts[segment.name]:
            entry = table.part(part.name)
            mass = entry.mass_fraction * 70.0
            own, weights = cloud(mass, entry.centre * part.length, entry.inertia * mass * part.length**2)
            for mirror in (1.0, -1.0) if part.name in PAIRED else (1.0,):
                points.append(own @ part.rotation.T * [1.0, 1.0, mirror] + part.origin)
                masses.append(weights)
        expected = planar_sum(np.vstack(points), np.concatenate(masses))
        np.testing.assert_allclose(plan.inertia[segment.name].vector[[0, 1, 2, 6]], expected, rtol=1e-10, atol=1e-12)


def test_the_whole_body_is_where_the_parts_are(standing_person: Recording) -> None:
    """The centre of mass of the chain equals the one of the parts placed at the landmarks, in the ground
    frame."""
    found = load_model("sagittal7", PERSON, "opencap").calibrate(standing_person, how=Calibration(side="right"))
    plan = found.measured_plan()
    height = sum(
        body.mass * (plan_pose(plan, name) @ [*body.centre[:2], 1.0])[1] for name, body in plan.inertia.items()
    )
    assert 0.50 * 1.75 < height / 70.0 + 0.03 < 0.60 * 1.75  # 53 to 57 % of the height in women and men
    assert found.mass_kg == 70.0


def plan_pose(plan: ModelPlan, name: str) -> Array:
    """Planar pose (2, 3) of a segment at the start, by walking up the chain."""
    chain = []
    segments = {segment.name: segment for segment in plan.model.segments}
    while name != "ground":
        chain.append(segments[name])
        name = segments[name].parent
    rotation, origin = np.eye(2), np.zeros(2)
    for segment in reversed(chain):
        origin = origin + rotation @ plan.geometry.placement(segment)[:2]
        axis = segment.axes[0]
        angle = axis.coefficients[1] * plan.start[axis.coordinate]
        c, s = np.cos(angle), np.sin(angle)
        rotation = rotation @ np.array([[c, -s], [s, c]])
    return np.column_stack([rotation, origin])


def test_foot_frame_is_turned_from_heel_to_metatarsals(standing_person: Recording) -> None:
    found = load_model("sagittal7", PERSON, "opencap").calibrate(standing_person, how=Calibration(side="right"))
    foot = found.parts["foot"][0]
    heel, middle = np.array([-0.21, -0.01]), 0.5 * np.array([-0.03, -0.02])
    direction = (middle - heel) / np.linalg.norm(middle - heel)
    np.testing.assert_allclose(foot.rotation[:2, 0], direction, atol=1e-9)
    assert foot.length == pytest.approx(np.linalg.norm(middle - 0.16 * np.array([-0.95, np.sqrt(1 - 0.95**2)])))


def test_proximal_table_origin_goes_to_the_distal_joint(standing_person: Recording) -> None:
    """A shank of the table hangs from the knee; in the toe-rooted chain its origin is the ankle."""
    plan = (
        load_model("sagittal7", PERSON, "opencap")
        .calibrate(standing_person, how=Calibration(side="right"))
        .measured_plan()
    )
    body, entry = plan.inertia["shank"], load_table("dumas", "female").part("shank")
    length = plan.geometry.lengths["shank"]
    np.testing.assert_allclose(body.centre[:2], [entry.centre[0] * length, (1.0 + entry.centre[1]) * length])
    about_centre = body.inertia[2, 2] - body.mass * float(body.centre[:2] @ body.centre[:2])
    assert about_centre == pytest.approx(entry.inertia[2, 2] * body.mass * length**2)


def test_a_straight_arm_is_laid_part_after_part(standing_person: Recording) -> None:
    found = load_model("squat7", PERSON, "opencap").calibrate(standing_person, how=Calibration(side="right"))
    upper, fore, hand = found.parts["arm"]
    np.testing.assert_allclose(fore.origin, [0.0, -upper.length, 0.0])
    np.testing.assert_allclose(hand.origin, [0.0, -upper.length - fore.length, 0.0])
    assert upper.measured
    assert not hand.measured
    assert hand.length == pytest.approx(1.75 * 71 / 1610, rel=1e-3)


def test_a_length_that_nothing_gives_is_an_error() -> None:
    thigh = load_table("dumas", None).part("thigh")
    with pytest.raises(ModelError, match="part 'thigh' needs landmarks hip and knee"):
        part_length(thigh, {}, 1.7, "model")


def test_a_segments_own_inertia_may_stand_in_the_file(tmp_path: Path, standing_person: Recording) -> None:
    source = Path(load_model("sagittal7").path).read_text(encoding="utf-8")
    ten = "inertia = [2.0, 0.0, -0.4, 0.0, 0.2, 0.01, 0.2, 0.0, 0.0, 0.0]"
    path = tmp_path / "mine.toml"
    path.write_text(source.replace('parts = ["forearm", "hand"]', ten), encoding="utf-8")
    text = path.read_text(encoding="utf-8").replace('["upper_arm"]\nboth', '["upper_arm", "forearm"]\nboth')
    path.write_text(text, encoding="utf-8")
    plan = load_model(path, PERSON, "opencap").calibrate(standing_person, how=Calibration(side="right")).measured_plan()
    np.testing.assert_allclose(
        plan.inertia["forearm"].vector, RigidBody.from_vector([2, 0, -0.4, 0, 0.2, 0.01, 0.2, 0, 0, 0]).vector
    )
