"""Masses of an OpenSim file that are no person's are refused or questioned; those of persons and prostheses are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import dynakin
from dynakin.errors import ModelError
from dynakin.messages import about, warnings_of
from dynakin.model.opensim.definition import load_opensim
from dynakin.model.opensim.description import GROUND, Body, Coordinate, Joint, JointAxis, Offset, OpenSimModel
from dynakin.model.opensim.functions import polynomial
from dynakin.model.opensim.masses import doubtful_masses
from support.osim.files import version_4

KG = {"pelvis": 40.0, "femur": 8.0, "tibia": 4.0, "talus": 0.1, "calcn": 1.2, "toes": 0.2}
ON = {"femur": "pelvis", "tibia": "femur", "talus": "tibia", "calcn": "talus", "toes": "calcn"}
BELOW_M = {"femur": 0.0, "tibia": 0.4, "talus": 0.43, "calcn": 0.05, "toes": 0.18}
Z, Y = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)


def hinge(child: str, parent: str, below_m: float, axis: tuple[float, float, float] = Z, locked: bool = False) -> Joint:
    at = Offset((0.0, -below_m, 0.0))
    turn = JointAxis("rotation", axis, f"{child}_q", (polynomial(0.0, 1.0),))
    return Joint(child, "PinJoint", parent, at, child, Offset(), (Coordinate(f"{child}_q", locked=locked),), (turn,))


def legs(kg: dict[str, float] | None = None, **changed: Joint) -> OpenSimModel:
    """A pelvis with two legs of hinges; ``kg`` and ``changed`` are by body ("tibia_r")."""
    names = [f"{name}_{side}" for side in "rl" for name in ON]
    joints = {"pelvis": hinge("pelvis", GROUND, 0.0)}
    for name in names:
        plain, side = name.split("_")
        parent = ON[plain] if ON[plain] == "pelvis" else f"{ON[plain]}_{side}"
        joints[name] = hinge(name, parent, BELOW_M[plain])
    mass = {name: KG[name.split("_")[0]] for name in joints} | (kg or {})
    bodies = tuple(Body(name, m, (0.0, 0.0, 0.0), (0.1, 0.1, 0.1, 0.0, 0.0, 0.0)) for name, m in mass.items())
    return OpenSimModel("legs", Path("legs.osim"), (0.0, -9.8, 0.0), bodies, tuple((joints | changed).values()), (), ())


def said(source: OpenSimModel) -> str:
    return " ".join(message.text for message in doubtful_masses(source))


def test_bodies_without_mass_are_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "nothing.osim"
    path.write_text(version_4("PinJoint", ("q",)).replace("<mass>3.0<", "<mass>0<").replace("<mass>2.0<", "<mass>0<"))
    with pytest.raises(ModelError, match=r"nothing\.osim: the bodies of the person have no mass"):
        load_opensim(path)


def test_a_limb_without_mass_is_questioned_on_one_side_and_on_both() -> None:
    one = said(legs({"tibia_r": 0.0}))
    assert "legs.osim" in one and "tibia_r 0 kg, 0.43 m long" in one and "tibia_r 0 kg beside 4 kg of tibia_l" in one
    assert "tibia_l 0 kg" not in one and "talus" not in one
    both = said(legs({"tibia_r": 0.0, "tibia_l": 0.0}))
    assert "tibia_r 0 kg, 0.43 m" in both and "tibia_l 0 kg, 0.43 m" in both and "beside" not in both
    assert "calcn_l 0.1 kg beside 1.2 kg of calcn_r" in said(legs({"calcn_l": 0.1}))


def test_small_bodies_and_prostheses_are_not() -> None:
    assert said(legs()) == ""
    assert said(legs({"talus_r": 0.0, "toes_r": 0.0, "toes_l": 0.0})) == ""
    assert said(legs({"tibia_r": 1.6, "calcn_r": 0.5})) == ""


def test_what_does_not_move_against_a_body_is_of_its_mass() -> None:
    """A shank whose mass hangs on it by a weld, a bone that turns about its own length beside one that has the mass."""
    hung = {side: hinge(f"calf_{side}", f"tibia_{side}", 0.1, locked=True) for side in "rl"}
    source = legs({"tibia_r": 0.0, "tibia_l": 0.0}, calf_r=hung["r"], calf_l=hung["l"])
    calves = [replace(source.body("tibia_r"), name=f"calf_{side}", mass=4.0) for side in "rl"]
    assert said(replace(source, bodies=(*source.bodies, *calves))) == ""
    along = {f"tibia_{side}": hinge(f"tibia_{side}", f"femur_{side}", 0.4, Y) for side in "rl"}
    assert said(legs({"tibia_r": 0.0, "tibia_l": 0.0}, **along)) == ""


@pytest.mark.parametrize("file", ["optimized_scale_and_markers", "manually_scaled"])
def test_a_calibrated_model_says_so_and_real_files_are_not_accused(data_dir: Path, tmp_path: Path, file: str) -> None:
    folder = data_dir / "opencap_subject4"
    squats = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    definition = load_opensim(folder / f"{file}.osim")
    assert not about(definition.calibrate(squats).messages, "masses")
    source = definition.source
    bodies = tuple(replace(body, mass=0.0) if body.name == "tibia_r" else body for body in source.bodies)
    light = replace(definition, source=replace(source, bodies=bodies))
    (found,) = about(warnings_of(light.calibrate(squats).messages), "masses")
    assert "tibia_r 0 kg beside" in found.text
