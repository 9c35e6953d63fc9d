"""The tables: their check sums, the rule for a sex that is not given, and a user's CSV."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ModelError
from dynakin.model.inertia import RigidBody
from dynakin.model.table import PAIRED, Point, load_table

SOURCE = Path(__file__).resolve().parents[2] / "src" / "dynakin" / "model" / "tables"


@pytest.mark.parametrize(
    ("name", "sex", "total"),
    [
        ("dumas", "male", 1.002),
        ("dumas", "female", 1.004),
        ("deleva", "male", 1.0),
        ("deleva", "female", 0.9999),
    ],
)
def test_check_sums_as_printed_and_normalised(name: str, sex: str, total: float) -> None:
    lines = (SOURCE / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    rows = [row for row in csv.DictReader(x for x in lines if not x.startswith("#")) if row["sex"] in (sex, "any")]
    printed = sum((2 if row["part"] in PAIRED else 1) * float(row["mass_percent"]) for row in rows)
    assert printed == pytest.approx(100.0 * total, abs=1e-10)
    table = load_table(name, sex)  # type: ignore[arg-type]
    whole = sum((2 if part in PAIRED else 1) * entry.mass_fraction for part, entry in table.parts.items())
    assert whole == pytest.approx(1.0, abs=1e-15)
    assert len(table.parts) == 10


@pytest.mark.parametrize("name", ["dumas", "deleva"])
@pytest.mark.parametrize("sex", ["male", "female", None])
def test_every_part_is_a_possible_body(name: str, sex: str | None) -> None:
    for part in load_table(name, sex).parts.values():  # type: ignore[arg-type]
        assert RigidBody.from_centre(1.0, part.centre, part.inertia).possible(), part.name


def test_numbers_of_a_row() -> None:
    thigh = load_table("dumas", "male").part("thigh")
    assert thigh.mass_fraction == pytest.approx(0.123 / 1.002)
    np.testing.assert_allclose(thigh.centre, [-0.041, -0.429, 0.033])
    assert thigh.inertia[2, 2] == pytest.approx(0.30**2)
    assert thigh.inertia[0, 1] == pytest.approx(0.07**2)
    assert thigh.inertia[1, 2] == pytest.approx(-(0.07**2))


def test_sex_not_given_is_the_mean_of_masses_centres_and_signed_tensors() -> None:
    male, female, mean = (load_table("dumas", sex) for sex in ("male", "female", None))  # type: ignore[arg-type]
    foot = mean.part("foot")
    expected = 0.5 * (0.012 + 0.010) / 0.067  # the head's is the same of both
    assert foot.mass_fraction / mean.part("head").mass_fraction == pytest.approx(expected)
    np.testing.assert_allclose(foot.centre, 0.5 * (male.part("foot").centre + female.part("foot").centre))
    assert foot.inertia[0, 1] == pytest.approx(0.5 * (0.17**2 - 0.15**2))  # not the square of the mean radius
    middle = load_table("deleva", None).part("abdomen").length_from
    assert middle.fraction == pytest.approx(0.5 * (0.4013 + 0.3709))


def test_trunk_parts_of_de_leva_join() -> None:
    table = load_table("deleva", "male")
    assert table.part("thorax").length_to.fraction == table.part("abdomen").origin.fraction
    assert table.part("abdomen").length_to.fraction == table.part("pelvis").origin.fraction
    for name in ("thorax", "abdomen", "pelvis"):  # as long as from C7, before whose tip the trunk lies
        part = table.part(name)
        assert part.length_to in (part.axis_from, Point("c7", "hip", part.axis_from.fraction))
    trunk = [table.part(name).mass_fraction for name in ("thorax", "abdomen", "pelvis")]
    assert sum(trunk) == pytest.approx(0.4346)


def test_point_on_a_line() -> None:
    landmarks = {"c7": np.array([0.0, 1.0, 0.0]), "hip": np.array([0.0, 0.0, 0.0])}
    point = Point.parse("c7>hip:0.25").at(landmarks)
    assert point is not None
    np.testing.assert_allclose(point, [0.0, 0.75, 0.0])
    assert Point.parse("ankle").at(landmarks) is None


def test_a_users_csv(tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    path.write_text((SOURCE / "dumas.csv").read_text(encoding="utf-8").replace(",male,", ",any,"), encoding="utf-8")
    table = load_table(path, "female")
    assert table.name == "mine"
    assert table.part("head").centre[0] == pytest.approx(0.02)  # the row for any sex goes before the one for women


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("part,sex", "part,sexe", ["line 8", "'sexe'", "did you mean 'sex'"]),
        ("head,male,y", "head,man,y", ["line 9", "sex is 'man'", "male, female or any"]),
        ("6.7,2.0", "6.7,two", ["line 9", "com_x is 'two'", "a number"]),
        ("6.7,2.0", "-6.7,2.0", ["line 9", "mass_percent is -6.7", "more than 0"]),
        ("28,21,30,-7,-2,3", "28,2,50,-7,-2,3", ["line 9", "no real body"]),
        ("head,male,y,cervical", "head,male,y", ["line 9", "18 cells, expected 19"]),
    ],
)
def test_a_wrong_cell_names_file_line_and_column(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    path = tmp_path / "mine.csv"
    text = (SOURCE / "dumas.csv").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line.startswith("#")]
    assert len(lines) == 7
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ModelError) as error:
        load_table(path, "male")
    for word in [str(path), *words]:
        assert word in error.value.message


def test_a_table_without_rows_for_the_sex(tmp_path: Path) -> None:
    path = tmp_path / "men.csv"
    lines = (SOURCE / "deleva.csv").read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if ",female," not in line), encoding="utf-8")
    assert load_table(path, "male").part("thigh").mass_fraction == pytest.approx(0.1416)
    with pytest.raises(ModelError, match=r"men\.csv: part 'head' has no row for sex female"):
        load_table(path, "female")
