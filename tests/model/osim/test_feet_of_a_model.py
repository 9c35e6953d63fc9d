"""On which bodies of an OpenSim model the ground acts: by names, markers, or as declared; never by a guess."""

from __future__ import annotations

from pathlib import Path

import pytest

import dynakin
from dynakin.errors import ConfigError, ModelError
from dynakin.model.opensim.definition import load_opensim
from dynakin.model.opensim.feet import feet_of
from dynakin.model.opensim.read import read_osim
from dynakin.settings.settings import Settings
from support.osim.files import version_4


@pytest.fixture(scope="module")
def folder(data_dir: Path) -> Path:
    return data_dir / "opencap_subject4"


def renamed(folder: Path, tmp_path: Path, names: dict[str, str]) -> Path:
    text = (folder / "optimized_scale_and_markers.osim").read_text()
    for old, new in names.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "renamed.osim"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("names", "right", "left"),
    [
        ({}, "calcn_r", "calcn_l"),
        ({"calcn_r": "RFoot", "calcn_l": "LFoot", "toes_": "Toes"}, "RFoot", "LFoot"),
        ({"calcn_r": "R_foot", "calcn_l": "L_foot"}, "R_foot", "L_foot"),
        ({"calcn": "hindfoot", "toes": "forefoot"}, "hindfoot_r", "hindfoot_l"),
        ({"calcn": "tarsus", "toes": "forefoot"}, "tarsus_r", "tarsus_l"),
        ({"calcn_r": "base_A", "talus_r": "tala"}, "base_A", "calcn_l"),
        ({"calcn_r": "RFoot", "calcn_l": "LFoot", "r_calc": "M1", "r_toe": "M2", "r_5meta": "M3"}, "RFoot", "LFoot"),
    ],
)
def test_the_hindfoot_is_found(folder: Path, tmp_path: Path, names: dict[str, str], right: str, left: str) -> None:
    found, said = feet_of(read_osim(renamed(folder, tmp_path, names)))
    assert found == {"right": right, "left": left}
    assert bool(said) == any(body not in ("calcn_r", "calcn_l", "hindfoot_r", "hindfoot_l") for body in (right, left))


def test_unknown_feet_are_refused_and_can_be_declared(folder: Path, tmp_path: Path) -> None:
    markers = {f"{side}_{name}": f"M{side}{name}" for side in "rL" for name in ("calc", "toe", "5meta")}
    markers = {f'<Marker name="{old}">': f'<Marker name="X{k}">' for k, old in enumerate(markers)}
    path = renamed(folder, tmp_path, {"calcn_r": "bodyA", "calcn_l": "bodyB", "talus": "tal"} | markers)
    squats = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot")
    with pytest.raises(ModelError, match=r"renamed\.osim: found neither foot among .*bodyA.*\[opensim\]") as caught:
        load_opensim(path).calibrate(squats)
    assert "\n" not in str(caught.value)
    options = Settings.model_validate({"opensim": {"feet": {"right": "bodyA", "left": "bodyB"}}}).opensim
    assert load_opensim(path, options=options).calibrate(squats).feet == {"right": "bodyA", "left": "bodyB"}
    for feet, what in (
        ({"right": "bodyA"}, "left: found none"),
        ({"right": "bodyA", "left": "bodyC"}, "left: found 'bodyC'"),
        ({"right": "bodyA", "left": "tibia_r"}, "on one leg"),
    ):
        with pytest.raises(ModelError, match=rf"opensim\.feet: .*{what}"):
            load_opensim(path, feet=feet).calibrate(squats)
    with pytest.raises((ConfigError, ModelError), match="feet"):
        load_opensim(path, feet={"both": "bodyA"})


def test_only_what_is_fixed_stands_on_its_root(tmp_path: Path) -> None:
    path = tmp_path / "small.osim"
    path.write_text(version_4("PinJoint", ("q",)))
    with pytest.raises(ModelError, match="neither foot"):
        feet_of(read_osim(path))
    path.write_text(path.read_text().replace("</Coordinate>", "<locked>true</locked></Coordinate>"))
    assert feet_of(read_osim(path)) == ({}, [])
