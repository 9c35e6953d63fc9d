"""Only the tree of bodies that carries the markers is the person."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ModelError
from dynakin.model.opensim.definition import load_opensim
from dynakin.model.opensim.sites import with_mass
from support.osim.files import coordinates, version_4

CHAIR = '<Body name="chair"><mass>200</mass><mass_center>0 0 0</mass_center><inertia>9 9 9 0 0 0</inertia></Body>'
SLIDER = (
    '<SliderJoint name="rail"><socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>/bodyset/chair'
    f"</socket_child_frame><coordinates>{coordinates(('rail_x',))}</coordinates></SliderJoint>"
)


def coupler(dependent: str, independent: str) -> str:
    line = "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"
    return (
        f'<CoordinateCouplerConstraint name="c"><coupled_coordinates_function>{line}</coupled_coordinates_function>'
        f"<independent_coordinate_names>{independent}</independent_coordinate_names>"
        f"<dependent_coordinate_name>{dependent}</dependent_coordinate_name></CoordinateCouplerConstraint>"
    )


def write(path: Path, constraints: str = "", marker: str = "") -> Path:
    text = version_4("PinJoint", ("q",), "", constraints)
    text = text.replace("<BodySet><objects>", f"<BodySet><objects>{CHAIR}")
    text = text.replace("<JointSet><objects>", f"<JointSet><objects>{SLIDER}")
    path.write_text(text.replace("<MarkerSet><objects>", f"<MarkerSet><objects>{marker}"))
    return path


def test_a_chair_on_the_ground_is_left_out_and_named(tmp_path: Path) -> None:
    alone = tmp_path / "alone.osim"
    alone.write_text(version_4("PinJoint", ("q",)))
    person, found = (
        load_opensim(alone).source,
        load_opensim(write(tmp_path / "chair.osim", coupler("rail_x", "q"))).source,
    )
    assert (found.bodies, found.joints, found.couplers) == (person.bodies, person.joints, person.couplers)
    assert found.floating == person.floating != ()
    assert [text for text in found.left_out if "chair (200 kg)" in text and "base" in text]
    assert not any("person" in text for text in person.left_out)
    np.testing.assert_allclose([body.mass for body in with_mass(found, 70.0).bodies], [42.0, 28.0])


def test_markers_on_both_and_a_person_that_follows_the_chair_are_refused(tmp_path: Path) -> None:
    place = "<socket_parent_frame>/bodyset/chair</socket_parent_frame><location>0 0 0</location>"
    with pytest.raises(ModelError, match=r"both\.osim: .*chair \(back\) and base \(m\); expected one person"):
        load_opensim(write(tmp_path / "both.osim", "", f'<Marker name="back">{place}</Marker>'))
    with pytest.raises(ModelError, match="coupler 'c': q follows rail_x"):
        load_opensim(write(tmp_path / "follows.osim", coupler("q", "rail_x")))


def test_without_markers_nothing_is_told_apart(tmp_path: Path) -> None:
    path = write(tmp_path / "bare.osim")
    text = path.read_text()
    start, end = text.index("<MarkerSet>"), text.index("</MarkerSet>")
    path.write_text(text[:start] + "<MarkerSet><objects/>" + text[end:])
    assert [body.name for body in load_opensim(path).source.bodies] == ["chair", "base", "tip"]
