"""Wrong files and subjects get one line that names the file and the key."""

from __future__ import annotations

from pathlib import Path

import pytest

from dynakin.errors import ModelError
from dynakin.model.definition import available_models, load_model
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.settings.subject import Subject

SOURCE = Path(__file__).resolve().parents[2] / "src" / "dynakin" / "model"


def changed(tmp_path: Path, folder: str, name: str, old: str, new: str) -> Path:
    """A copy of a built-in file with one passage replaced."""
    text = (SOURCE / folder / f"{name}.toml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


def test_every_built_in_model_loads() -> None:
    assert available_models() == ["fullbody", "sagittal7", "squat7"]
    assert len(load_model("fullbody").model.segments) == 17
    for name in ("sagittal7", "squat7"):
        definition = load_model(name)
        assert definition.name == name
        assert len(definition.model.coordinates) == 7
        assert len(definition.model.lengths) == 6
        assert all(coordinate.source for coordinate in definition.model.coordinates)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("planar = true", "plannar = true", ["mine.toml", "'plannar'", "did you mean 'planar'"]),
        ('parent = "foot"', 'parrent = "foot"', ['segments[1] "shank"', "'parrent'", "you mean 'parent'"]),
        ('parent = "shank"', 'parent = "shnak"', ['"thigh"', "'shnak'", "did you mean 'shank'"]),
        ('coordinate = "knee"', 'coordinate = "kneee"', ['"thigh"', "'kneee'", "did you mean 'knee'"]),
        ('{ length = "shank"', '{ length = "tibia"', ["placement.length", "'tibia'", "a name in lengths"]),
        ("minimum_deg = -15.0", "minimum_deg = 170.0", ['coordinates[2] "knee"', "170", "less than max"]),
        ("planar = true", 'planar = "perhaps"', ["planar", "'perhaps'"]),
        ('name = "shank"\nparent', 'name = "foot"\nparent', ["'foot' is given twice"]),
        ('frame = { y = ["knee", "hip"] }', "frame = {}", ["one or two of x, y, z"]),
        ("planar = true", "planar = true\ngravity = [0.0, -981.0, 0.0]", ["gravity: found 0 -981 0", "9.7 to 9.9"]),
        ("planar = true", "planar = true\ngravity = [-9.81, 0.0, 0.0]", ["gravity: found -9.81 0 0", "along -Y"]),
        ("schema_version = 1\n", "", ["schema_version", "required"]),
        ('lock_to = "trunk"', 'lock_to = "foot"', ["lock_to", "no neighbour"]),
        ("direction = [0.0, 1.0, 0.0] }]\naxes = [{ coordinate = \"knee\" }]",
         "direction = [0.0, 1.0, 0.0] }]\naxes = [{ coordinate = \"knee\", direction = [0, 0, 2] }]",
         ["unit vector", "2"]),
    ],
)  # fmt: skip
def test_a_wrong_model_file_names_the_key(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    path = changed(tmp_path, "builtin", "sagittal7", old, new)
    with pytest.raises(ModelError) as error:
        load_model(path)
    for word in [str(path), *words]:
        assert word in error.value.message
    assert "\n" not in error.value.message


def test_no_toml_names_the_line(tmp_path: Path) -> None:
    path = tmp_path / "broken.toml"
    path.write_text('name = "a"\nplanar = = true\n', encoding="utf-8")
    with pytest.raises(ModelError, match=r"broken\.toml: not a TOML file: .*line 2"):
        load_model(path)


def test_unknown_names_suggest_the_nearest() -> None:
    with pytest.raises(ModelError, match=r"'sagital7'.*did you mean 'sagittal7'"):
        load_model("sagital7")
    with pytest.raises(ModelError, match=r"'opencp'.*did you mean 'opencap'"):
        load_model("sagittal7", markers="opencp")
    with pytest.raises(ModelError, match=r"'duma'.*did you mean 'dumas'"):
        load_model("sagittal7", table="duma")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("SHO = ", "SHOO = ", ["places", "did you mean 'SHO'"]),
        ("[clusters]\nshank", "[clusters]\nshnak", ["clusters", "did you mean 'shank'"]),
        ('"{r,L}_knee"', '"{r}_knee"', ["'{r}_knee'", "right and left in braces"]),
        ('"{r,L}_knee"', '{ names = "{r,L}_knee", alias = "x" }', ['"KNE"', "'alias'"]),
        ('"{r,L}_knee"', '{ names = "{r,L}_knee", variance = -1 }', ['"KNE"', "variance"]),
        ("[places]", "places = 3\n[other]", ["tables of names"]),
        ("[places]", 'heel_toe = ["HEE", "TOW"]\n[places]', ["heel_toe", "did you mean 'TOE'"]),
        ("[places]", '[landmarks]\nknee = [{ mean = ["KNES"] }]\n[places]', ["landmarks.knee", "did you mean 'KNE'"]),
        ("[places]", '[landmarks]\nknee = [{ mean = ["knee"] }]\n[places]', ["knee -> knee is a circle"]),
        ("[places]", '[landmarks]\nhip = [{ mean = ["KNE"], note = "x" }]\n[places]', ["landmarks.hip", "'note'"]),
    ],
)
def test_a_wrong_marker_set_names_the_key(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    path = changed(tmp_path, "markers/sets", "opencap", old, new)
    with pytest.raises(ModelError) as error:
        load_marker_set(path)
    for word in [str(path), *words]:
        assert word in error.value.message


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"mass_kg": 0.0}, ["mass_kg", "greater than 0", "found 0.0"]),
        ({"mass_kg": float("nan")}, ["mass_kg"]),
        ({"height_m": 175.0}, ["height_m", "less than 2.8"]),
        ({"sex": "woman"}, ["sex", "'male' or 'female'", "'woman'"]),
        ({"mas_kg": 70.0}, ["'mas_kg'", "did you mean 'mass_kg'"]),
    ],
)
def test_a_wrong_subject_names_the_key(fields: dict[str, object], words: list[str]) -> None:
    with pytest.raises(ModelError) as error:
        Subject(**fields)
    for word in ["subject", *words]:
        assert word in error.value.message
