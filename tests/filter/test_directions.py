"""Which way a model's coordinates count, by how its segments turn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.bindings import _core
from dynakin.filter.directions import clinical_signs
from dynakin.model.definition import load_model
from dynakin.report.sections.joints import angle_section, moment_section
from dynakin.report.sections.repetitions import side_plots
from dynakin.report.sections.section import Page
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import angle_columns, convention_of, with_angles
from dynakin.results.measures.mean_curves import estimate_curves
from dynakin.results.measures.metrics import compute_metrics
from support.simulated import simulate

WHO = dynakin.Subject(mass_kg=72.6, height_m=1.8, sex="male")


def signs(spec: _core.ModelSpec) -> dict[str, int]:
    return {c.name: s for c, s in zip(spec.coordinates, clinical_signs(_core.Model(spec)), strict=True)}


def as_named(spec: _core.ModelSpec) -> dict[str, int]:
    """As OpenSim's models since version 4 have them."""
    found = {c.name: convention_of(c.name) for c in spec.coordinates}
    return {name: one[0].sign if one else 0 for name, one in found.items()}


@pytest.mark.parametrize("model", ["squat7", "sagittal7", "fullbody"])
def test_built_in_models_count_as_opensims_do(model: str) -> None:
    spec = load_model(model, subject=WHO).calibrate(simulate(model, "squat", 3, 5.0).recording).spec
    assert signs(spec) == as_named(spec)


def test_a_joint_about_another_axis_has_no_clinical_direction() -> None:
    spec = load_model("squat7", subject=WHO).calibrate(simulate("squat7", "squat", 3, 5.0).recording).spec
    names = [c.name for c in spec.coordinates]
    segments = spec.segments
    axes = segments[names.index("hip")].axes
    assert axes[0].coordinate == "hip"
    axes[0].direction = np.array([0.0, 1.0, 0.0])
    segments[names.index("hip")].axes = axes
    spec.segments = segments
    assert signs(spec) == as_named(spec) | {"hip": 0}


def test_rajagopals_knees_bend_with_positive_angles(data_dir: Path) -> None:
    folder = data_dir / "rajagopal"
    model = load_model(str(folder / "subject_scaled_walk.osim"), subject=WHO)
    spec = model.calibrate(dynakin.read(folder / "motion_capture_walk.trc").window(0.5, 1.0)).spec
    assert signs(spec) == as_named(spec)


@pytest.fixture(scope="module")
def walk(data_dir: Path) -> Estimate:
    folder = data_dir / "gait2354"
    recording = dynakin.read(folder / "subject01_walk1.trc", folder / "subject01_walk1_grf.mot")
    return dynakin.Estimator(load_model(str(folder / "subject01_simbody.osim"), WHO)).run(recording, lag_s=0.0)


def test_the_knees_of_opensims_oldest_example_extend_with_positive_angles(walk: Estimate) -> None:
    found = dict(zip(walk.coordinate_names, walk.data["clinical_sign"].values, strict=True))
    wanted = {name: one[0].sign if (one := convention_of(name)) else 0 for name in found}
    assert found == wanted | {"knee_angle_r": -1, "knee_angle_l": -1}
    assert np.degrees(walk.data["coordinates"].sel(coordinate="knee_angle_r").values.min()) < -50.0


def test_titles_and_clinical_angles_follow_the_model(walk: Estimate) -> None:
    def titles(estimate: Estimate) -> list[str]:
        page = Page(estimate, compute_metrics(estimate))
        sections = [angle_section(page), moment_section(page)]
        return [panel.title for section in sections for part in section.parts for panel in part.panels]

    assert {"Knee angle (+ extension)", "Knee (+ extension)", "Hip flexion (+ flexion)"} <= set(titles(walk))
    asked = with_angles(walk, {}, "clinical")
    assert {"Knee angle (+ flexion)", "Knee (+ extension)"} <= set(titles(asked))
    names, values, lines = angle_columns(asked)
    k = names.index("knee_flexion_r")
    assert values[:, k].max() > 50.0 and lines[k].startswith("knee_flexion_r: + flexion, - extension")
    plots, _ = side_plots(asked, estimate_curves(asked))
    assert {plot.title for plot in plots["moments"]} >= {"Knee (+ extension)", "Ankle (+ dorsiflexion)"}
    assert "Knee angle (+ flexion)" in {plot.title for plot in plots["angles"]}
