"""Base parameters: what of the inertia acts on the ground at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin import load_model
from dynakin.bindings import _core
from dynakin.errors import DynakinError, ModelError
from dynakin.identification.observability.element_words import base_words
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.simulated import tracker_of
from dynakin.identification.observability.structure import base_of, identified_alone, in_no_base_parameter, structure_of
from support.identifiability import changed_model

FIXED_FOOT = (
    'both_sides = true\naxes = [{ coordinate = "toe", coefficients = [0.0, -1.0] }]\n',
    "both_sides = true\n",
)
NO_TOE = (
    '[[coordinates]]\nname = "toe"\ndescription = "heel rise positive (as OpenSim mtp_angle: toes extended)"\n'
    'minimum_deg = -20.0\nmaximum_deg = 80.0\nsource = "AAOS 1965: extension of the first metatarsophalangeal joint '
    "70 deg; 10 deg and the sole's zero added\"\n",
    "",
)


def test_seven_hinges_in_the_plane_show_22_of_28(measured: MeasuredModel) -> None:
    base = base_of(measured)
    assert (base.rank, len(base.over)) == (22, 28)
    assert in_no_base_parameter(base, measured) == []


def test_a_whole_body_in_space_is_told_too() -> None:
    """Neighbours share what a hinge lets move; gauges that are said alike are one sentence."""
    structure = structure_of(tracker_of(load_model("fullbody")))
    assert structure.base.rank == 105 and len(structure.base.over) == 150
    said = structure.gauges_in_words
    assert len(set(said)) == len(said) < len(structure.gauges.found)
    assert "joint of the right hand: a mass at it may belong to the right forearm or to the right hand" in said


def test_parameters_with_the_same_base_parameters_give_the_same_wrench(measured: MeasuredModel) -> None:
    """And those with others do not: the base parameters are all that the wrench depends on."""
    base = base_of(measured)
    at = measured.block("inertia")
    null = np.linalg.svd(base.K)[2][base.rank :]
    rng = np.random.default_rng(5)
    for x in measured.random_states(5, seed=7):
        other = x.copy()
        other[at] += null.T @ rng.standard_normal(len(null))
        same = _core.wrench(measured.core, other) - _core.wrench(measured.core, x)
        assert np.abs(same).max() < 1e-7
        other = x.copy()
        other[at] += 0.1 * base.K[rng.integers(base.rank)]
        assert np.abs(_core.wrench(measured.core, other) - _core.wrench(measured.core, x)).max() > 1e-3


def test_what_is_identified_alone_is_what_no_hidden_change_touches(measured: MeasuredModel) -> None:
    base = base_of(measured)
    null = np.linalg.svd(base.K)[2][base.rank :]
    untouched = {name for name, column in zip(base.over, np.abs(null).max(axis=0), strict=True) if column < 1e-9}
    assert identified_alone(base, measured) == untouched
    assert not any(name.endswith("/mass") for name in untouched)
    last = measured.initial.spec.segments[-1].name
    assert {f"inertia/{last}/{number}" for number in ("mx", "my", "izz")} <= untouched


def test_each_base_parameter_in_words(measured: MeasuredModel) -> None:
    said = base_words(base_of(measured), measured.initial.spec)
    assert said[0] == "foot mass + mass of all that it carries"
    assert "shank first moment (forward)" in said
    shank = next(p for p in measured.initial.spec.parameters if p.name == "shank").value
    assert f"shank first moment (up) + {shank:.3f} m × mass of all that it carries" in said


def test_a_foot_that_is_fixed_hides_its_height_and_its_moment_of_inertia(tmp_path: Path) -> None:
    path = changed_model(tmp_path, FIXED_FOOT, NO_TOE)
    structure = structure_of(tracker_of(load_model(path)))
    assert set(structure.in_none) == {"inertia/foot/my", "inertia/foot/izz"}
    text = " ".join(structure.in_words())
    assert "without any effect on the ground reaction: foot first moment (up) and foot moment of inertia" in text
    assert any(
        said == "foot moment of inertia: nothing that is measured depends on it" for said in structure.gauges_in_words
    )


def test_a_motion_with_a_joint_at_rest_shows_less(measured: MeasuredModel) -> None:
    """The trial's own motion decides, where it is given: here the toe never moves."""
    states = measured.random_states(300, seed=2)
    for block in ("coordinates", "speeds", "accelerations"):
        states[:, measured.block(block).start] = 0.0
    base = base_of(measured, states)
    assert base.rank == 20
    assert set(in_no_base_parameter(base, measured)) == {"inertia/foot/my", "inertia/foot/izz"}


def test_a_model_that_fits_no_simulated_person_asks_for_a_recording(tmp_path: Path) -> None:
    definition = load_model("sagittal7")
    lost = replace(definition, model=definition.model.model_copy(deep=True))
    lost.model.segments[1].__dict__["origin"] = "nowhere"
    with pytest.raises(DynakinError, match=r"expected --trial FILE"):
        tracker_of(lost)


def test_a_model_that_estimates_no_inertia_is_refused(tmp_path: Path) -> None:
    path = changed_model(tmp_path, ('\nparts = ["', '\ninertia_estimated = false\nparts = ["'))
    with pytest.raises(ModelError, match="estimates no inertial number"):
        structure_of(tracker_of(load_model(path)))
