"""Coordinates that follow others stand in coordinates.mot, with the values that OpenSim's couplers give."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.model.opensim.definition import load_opensim
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.spec import coupled_of, in_radians
from dynakin.recordings.formats.mot import read_table
from dynakin.results.files.motion import write_coordinates
from support.osim.files import COUPLER, small_model
from support.osim.states import coupled, random_motion

LINE_OF_U = "<coefficients>0.8 0.1</coefficients>"


def test_values_are_those_of_the_couplers(tmp_path: Path) -> None:
    source = read_osim(small_model(tmp_path, "CustomJoint", 4, COUPLER))
    found = coupled_of(source)
    assert found is not None and found.kinds == {"w": ("translation", "v")}
    rng = np.random.default_rng(2)
    motions = [random_motion(source, rng) for _ in range(5)]
    names = list(motions[0][0])
    values = found.values(names, np.array([[q[name] for name in names] for q, _, _ in motions]))
    assert values[:, 0] == pytest.approx([coupled(source, motion)[0]["w"] for motion in motions], abs=1e-12)


def test_a_model_without_couplers_has_none(tmp_path: Path) -> None:
    assert coupled_of(read_osim(small_model(tmp_path, "PinJoint", 4))) is None


@pytest.mark.parametrize(
    ("slope", "radians"), [("1 0", False), ("-1 0", False), ("1 0.1", False), ("2 0", True), ("-1.5 0", True)]
)
def test_what_is_radians_in_any_table_is_so_by_its_slope(slope: str, radians: bool, tmp_path: Path) -> None:
    """Slopes as OpenSim 4.6 has them: `Coordinate.getMotionType()` is 1 (rotational) or 3 (coupled)."""
    path = small_model(tmp_path, "CustomJoint", 4)
    text = path.read_text()
    assert LINE_OF_U in text
    path.write_text(text.replace(LINE_OF_U, LINE_OF_U.replace("0.8 0.1", slope)))
    assert in_radians(read_osim(path)) == {"v", *(["u"] if radians else [])}  # v turns by a polynomial


def test_coupled_coordinates_are_in_the_file(data_dir: Path, tmp_path: Path) -> None:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", folder / "squats1_grf.mot").window(1.0, 1.5)
    model = load_opensim(folder / "optimized_scale_and_markers.osim")
    write_coordinates(dynakin.Estimator(model).run(recording), tmp_path / "coordinates.mot")
    table = read_table(tmp_path / "coordinates.mot")
    for side in "rl":  # Rajagopal's patella turns as the knee does
        beta, knee = (table.column(f"knee_angle_{side}{end}") for end in ("_beta", ""))
        np.testing.assert_allclose(beta, np.radians(knee), atol=1e-5)  # OpenSim: motion type Coupled, never degrees
    text = (tmp_path / "coordinates.mot").read_text()
    assert "In radians, as OpenSim takes what moves its joint by a function alone: knee_angle_r_beta, knee_a" in text
    assert "Follow others by the model's couplers: knee_angle_r_beta, knee_angle_l_beta." in text
    assert "where skin has moved them" in text
