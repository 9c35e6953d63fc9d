"""An OpenSim model laid on a recording: what is measured, what the file gives, what is estimated."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.bindings import _core
from dynakin.errors import ModelError
from dynakin.filter.augment import initial_covariance
from dynakin.filter.measurements import Measurements
from dynakin.filter.uncertainty.systematic import Systematic
from dynakin.messages import Message
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.calibration.how import Calibration
from dynakin.model.definition import Definition, load_model
from dynakin.model.opensim.calibrate import limits_of
from dynakin.model.opensim.definition import load_opensim
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.sites import skin_of
from dynakin.model.state_priors import cluster_covariance
from dynakin.recordings.recording import Recording
from dynakin.settings import presets
from dynakin.settings.model import OpenSimOptions, Priors
from dynakin.settings.noise import Noise
from dynakin.settings.subject import Subject
from support.osim.files import small_model, version_4

FILE = "optimized_scale_and_markers.osim"


@pytest.fixture(scope="module")
def folder(data_dir: Path) -> Path:
    return data_dir / "opencap_subject4"


@pytest.fixture(scope="module")
def squats(folder: Path) -> Recording:
    return dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")


def test_markers_of_a_body_are_known_together(folder: Path, squats: Recording) -> None:
    """What is wrong with their places moves them alike: one that is not seen goes along with the others."""
    found = load_model(folder / FILE, Subject(mass_kg=60.05)).calibrate(squats)
    own = [m for m in found.spec.markers if m.segment == "pelvis"]
    at = [found.names.index(f"marker/{m.name}/{axis}") for m in own for axis in "xyz"]
    expected = cluster_covariance(np.array([m.position for m in own]), Priors())
    assert len(own) > 3
    np.testing.assert_allclose(initial_covariance(found, Noise())[np.ix_(at, at)], expected, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(found.sd0[at] ** 2, np.diag(expected))
    kept = load_model(folder / FILE, Subject(mass_kg=60.05), opensim=OpenSimOptions(marker_places="kept"))
    assert kept.calibrate(squats).joint_prior is None


def test_everything_from_the_file_but_mass_and_posture(folder: Path, squats: Recording) -> None:
    definition = load_model(folder / FILE, Subject(mass_kg=60.05))
    found = definition.calibrate(squats)
    source = read_osim(folder / FILE)
    assert len(found.spec.markers) == 45
    assert found.mass_kg == pytest.approx(60.05)
    assert sum(s.inertia[0] for s in found.spec.segments) == pytest.approx(60.05)
    assert found.feet == {"right": "calcn_r", "left": "calcn_l"}
    places = {marker.name: marker.location for marker in source.markers}
    for marker in found.spec.markers:
        np.testing.assert_array_equal(marker.position, places[marker.name])
    assert (found.lower <= found.x0).all() and (found.x0 <= found.upper).all()
    assert (found.sd0 > 0.0).all() and np.isfinite(found.sd0).all()
    measured = found.ground.points_to_ground(np.stack([squats.marker(name)[0] for name in found.recorded_markers]))
    gap = _core.marker_positions(_core.Model(found.spec), found.x0) - measured
    assert np.sqrt(np.nanmean((gap**2).sum(axis=1))) < 0.012
    assert any("fits the markers to 11 mm" in text for text in map(str, found.messages))
    assert any("93 muscles" in text for text in map(str, found.messages))


def test_coordinates_that_the_file_locks_are_named(folder: Path, squats: Recording, tmp_path: Path) -> None:
    """A run said to scale the model again where the file held hips and an ankle that move."""
    text = (folder / FILE).read_text(encoding="utf-8")
    for name in ("hip_rotation_r", "ankle_angle_r"):
        head, own, rest = text.partition(f'<Coordinate name="{name}">')
        text = head + own + re.sub(r"<locked>.*?</locked>", "<locked>true</locked>", rest, count=1)
    locked = tmp_path / "locked.osim"
    locked.write_text(text, encoding="utf-8")
    found = load_model(locked, Subject(mass_kg=60.05)).calibrate(squats)
    assert any("The file locks hip_rotation_r, ankle_angle_r: held at its values." in m.text for m in found.messages)
    (misfit,) = _moved(found, 0.03)
    assert "held still are right hip rotation and right ankle angle" in misfit.text
    whole = load_model(folder / FILE, Subject(mass_kg=60.05)).calibrate(squats)
    assert not any("The file locks" in m.text for m in whole.messages)


def _moved(calibrated: CalibratedModel, by_m: float) -> list[Message]:
    """What is said where all markers turn out to lie so far from where the model has them."""
    known = Systematic(calibrated, presets.default())
    x = np.array(calibrated.x0)
    for k, name in enumerate(calibrated.names):
        if name.startswith("marker/") and name.endswith("/x"):
            x[k] += by_m
    return known.misfit(x)


def test_what_is_estimated_is_a_choice(folder: Path, squats: Recording) -> None:
    path = folder / FILE

    def started(estimate: tuple[str, ...], **options: object) -> CalibratedModel:
        noise = presets.default().changed(plate_force_sd_n=0.0, plate_moment_sd_nm=0.0, plate_delay_sd_s=0.0)
        return dynakin.Estimator(load_opensim(path, **options), noise, estimate=estimate).start(squats).calibrated

    nothing = started(())
    assert len(nothing.names) == 3 * 31 + 2 * 6  # toes have no markers; six states a foot
    assert [c.name for c in nothing.spec.coordinates if c.locked] == ["mtp_angle_r", "mtp_angle_l"]
    assert len(started((), lock_unseen=False).names) == 3 * 33 + 2 * 6
    places = started(("markers",))
    assert len(places.names) == 3 * 31 + 3 * 45 + 2 * 6
    # Of a place that is held, what is not known of it is noise of its marker.
    assert (nothing.unmodelled_m > places.unmodelled_m).all()
    few = started(("lengths",), scale=("femur_r", "femur_l"), share_sides=False)
    assert [name for name in few.names if name.startswith("length")] == ["length/scale_femur_r", "length/scale_femur_l"]
    shared = started(("lengths", "inertia"), scale=("femur_r", "femur_l"))
    k = shared.names.index("length/scale_femur")
    assert (shared.x0[k], shared.lower[k], shared.upper[k]) == (1.0, 0.8, 1.2)
    assert shared.dimensionless == {"scale_femur"}
    bodies = {name.split("/")[1] for name in shared.names if name.startswith("inertia")}
    assert "femur_r" in bodies and "patella_r" not in bodies


def test_marker_places_are_calibrated_or_kept(folder: Path, squats: Recording) -> None:
    """Kept places are no states, and not doubted either: no noise is added for them."""
    path = folder / FILE

    def started(places: str) -> CalibratedModel:
        return dynakin.Estimator(load_opensim(path, marker_places=places)).start(squats).calibrated

    calibrated, kept = started("calibrated"), started("kept")
    free = [name for name in calibrated.names if name.startswith("marker/")]
    assert len(free) == 3 * 45 and [name for name in calibrated.names if name not in free] == list(kept.names)
    np.testing.assert_array_equal(kept.unmodelled_m, calibrated.unmodelled_m)
    for before, after in zip(calibrated.spec.markers, kept.spec.markers, strict=True):
        np.testing.assert_array_equal(after.position, before.position)
    assert "Marker places: kept as the OpenSim file has them." in map(str, kept.messages)
    assert "Marker places: the OpenSim file's, calibrated by the recording." in map(str, calibrated.messages)
    with pytest.raises(ModelError, match="marker_places is 'kept', but fullbody has no marker places"):
        load_model("fullbody", opensim=OpenSimOptions(marker_places="kept"))


def test_every_model_answers_to_the_same_questions(folder: Path, squats: Recording) -> None:
    """So that nobody asks which kind a model is."""
    names = squats.marker_names
    for name, planar, has_mass in (
        (folder / FILE, False, True),
        ("sagittal7", True, False),
        ("fullbody", False, False),
    ):
        definition: Definition = load_model(name)
        assert (definition.planar, definition.has_mass) == (planar, has_mass)
        heavier = definition.with_subject(Subject(mass_kg=75.0))
        assert heavier.has_mass and heavier.subject.mass_kg == 75.0 and definition.subject.mass_kg is None
        whose, expected, found, lacks = definition.markers_among(squats)
        assert whose and not lacks and set(found) <= set(names) and len(expected) >= len(found) > 0.8 * len(expected)
        calibrated = heavier.calibrate(squats)
        assert isinstance(calibrated, CalibratedModel) and calibrated.mass_kg == pytest.approx(75.0)


def test_file_mass_where_nothing_tells(folder: Path) -> None:
    recording = dynakin.read(folder / "squats1.trc")
    assert load_model(folder / FILE).calibrate(recording).mass_kg == pytest.approx(62.6)
    unscaled = load_opensim(folder / FILE, Subject(mass_kg=70.0), scale_masses=False)
    assert unscaled.calibrate(recording).mass_kg == pytest.approx(62.6)


def test_the_filter_runs_on_it(folder: Path, squats: Recording) -> None:
    """Half a second: finite, and nearer to the markers than the file's places are."""
    estimator = dynakin.Estimator(load_model(folder / FILE, Subject(mass_kg=60.05)))
    tracker = estimator.start(squats)
    from dynakin.filter.samples import marker_paths, total_wrench

    markers, wrench = (read(squats, tracker.calibrated, gaps=True)[:50] for read in (marker_paths, total_wrench))
    arrays = tracker.run_arrays(Measurements(squats.time[:50], markers, wrench))
    gap = arrays["markers_estimated"] - markers
    assert np.isfinite(arrays["state"]).all()
    assert np.sqrt(np.nanmean((gap**2).sum(axis=2))) < 0.0085


def test_wrong_requests_are_refused(folder: Path, squats: Recording, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="0 of the 1 markers"):
        load_opensim(small_model(tmp_path, "PinJoint", 4)).calibrate(squats)
    with pytest.raises(ModelError, match=r"no marker 'R_HJ'.*did you mean 'R_HJC'"):
        load_opensim(folder / FILE, leave_out=("R_HJ",)).calibrate(squats)
    with pytest.raises(ModelError, match="lightest_share"):
        load_opensim(folder / FILE, lightest_share=1.0)
    with pytest.raises(ModelError, match="unknown key 'scal'"):
        load_opensim(folder / FILE, scal=None)
    with pytest.raises(ModelError, match="expected auto"):
        load_model(folder / FILE, markers="opencap")
    for gravity in ("0 0 -9.80665", "0 -9806.65 0", "0 -1.62 0", "0 0 0"):
        other = tmp_path / "other.osim"
        other.write_text(version_4("PinJoint", ("q",)).replace("0 -9.80665 0", gravity))
        with pytest.raises(
            ModelError, match=rf"other\.osim: gravity: found {gravity}, expected 0 -9\.80665 0 .*9\.7 to"
        ):
            load_opensim(other)


def test_a_whole_turn_is_no_limit(tmp_path: Path) -> None:
    path = tmp_path / "turns.osim"
    path.write_text(version_4("PinJoint", ("q",)).replace("<range>-2 2", "<range>-3.1415 3.1416", 1))
    limits = limits_of(read_osim(path))
    assert limits["base_rx"] == (-np.inf, np.inf)
    assert limits["q"] == (-2.0, 2.0)
    assert limits["base_tx"] == (-np.inf, np.inf)  # the laboratory of the file is not that of the recording


def test_noise_of_a_marker_comes_from_its_name_or_its_body() -> None:
    assert skin_of("r.ASIS", "pelvis") == skin_of("L.ASIS", "elsewhere")
    assert skin_of("cluster_7", "femur_r")[1] > skin_of("cluster_7", "calcn_r")[1] > 0.0


def test_too_few_markers_for_a_posture_are_refused(folder: Path, squats: Recording) -> None:
    few = [squats.marker_names.index(name) for name in ("C7", "r_toe", "L_toe")]
    poor = replace(squats, marker_names=tuple(squats.marker_names[k] for k in few), markers=squats.markers[:, few])
    with pytest.raises(ModelError, match=r"squats1.*3 of the 49 markers .*C7.*expected at least \d+ for its \d+ free"):
        load_model(folder / FILE, Subject(mass_kg=60.05)).calibrate(poor, how=Calibration(forward=(1.0, 0.0, 0.0)))


def test_what_no_marker_moves_is_held_and_its_mass_unseen(folder: Path, squats: Recording) -> None:
    upper = ("C7", "Sternum", "Shoulder", "humerus", "elbow", "forearm", "wrist", "clav", "head")
    kept = [k for k, name in enumerate(squats.marker_names) if not any(part in name for part in upper)]
    legs = replace(squats, marker_names=tuple(squats.marker_names[k] for k in kept), markers=squats.markers[:, kept])
    whole, found = (load_model(folder / FILE, Subject(mass_kg=60.05)).calibrate(each) for each in (squats, legs))
    assert {"lumbar_extension", "arm_flex_r", "elbow_flex_l"} <= set(found.held)
    assert not {"lumbar_extension", "arm_flex_r"} & set(whole.held) and whole.unseen_kg == 0.0
    assert 0.3 * found.mass_kg < found.unseen_kg < 0.6 * found.mass_kg
