"""What is wrong with a file is said in one line: file, line, element, what was found and what was expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from dynakin.errors import ModelError
from dynakin.model.opensim.definition import scale_names
from dynakin.model.opensim.read import read_osim
from support.osim.files import COUPLER, CUSTOM, small_model, transform, version_3, version_4

PIN = version_4("PinJoint", ("q",))
CUSTOM_4 = version_4("CustomJoint", ("u", "v", "w"), transform(CUSTOM, 4), COUPLER)
MARKER = PIN[PIN.index("<Marker ") : PIN.index("</Marker>")] + "</Marker>"
INERTIA = "0.11 0.12 0.15 0.01 0.02 0.03"
WRONG = {
    "unknown joint": (version_4("EllipsoidJoint", ("a", "b", "c")), 'EllipsoidJoint "tried": .*not supported'),
    "unknown joint, version 3": (version_3("EllipsoidJoint", ("a",)), 'EllipsoidJoint "tried": .*not supported'),
    "no such body": (PIN.replace("/base</socket_parent>", "/bass</socket_parent>"), "bass.*base, ground, tip"),
    "no such parent, version 3": (
        version_3("PinJoint", ("q",)).replace(">base</parent_body>", ">bass</parent_body>"),
        "parent body 'bass'.*did you mean 'base'",
    ),
    "no socket": (PIN.replace("socket_child_frame", "connector_child"), "socket_child_frame"),
    "too few coordinates": (version_4("UniversalJoint", ("q",)), "found 1 coordinates, expected 2"),
    "truncated": (PIN[: len(PIN) // 2], "line 2: not a whole XML file"),
    "no XML": ("ply\nformat ascii", "line 1: not a whole XML file"),
    "another document": ("<html><body/></html>", "expected an OpenSimDocument"),
    "too old": (PIN.replace("40000", "10905"), "found version 10905"),
    "not a number": (PIN.replace(">2.0</mass>", ">two</mass>"), "mass: found 'two', expected numbers"),
    "negative mass": (PIN.replace(">2.0</mass>", ">-2</mass>"), "found -2 kg"),
    "two numbers": (PIN.replace("-0.2 0.3</mass_center>", "-0.2</mass_center>"), "found 2 numbers, expected 3"),
    "an infinite number": (PIN.replace("<range>-2 2", "<range>-2 inf"), "expected finite"),
    "an empty range": (PIN.replace("<range>-2 2", "<range>2 -2"), "range: found 2 to -2"),
    "no word for a truth": (PIN.replace("<range>", "<locked>maybe</locked><range>"), "locked: found 'maybe'"),
    "prescribed": (PIN.replace("<range>", "<prescribed>true</prescribed><range>"), "prescribed"),
    "unknown function": (CUSTOM_4.replace("PiecewiseLinearFunction", "GCVSpline"), "GCVSpline.*not supported"),
    "unknown inner function": (CUSTOM_4.replace("SimmSpline", "StepFunction"), "StepFunction.*not supported"),
    "knots that do not increase": (CUSTOM_4.replace("-1 -0.3 0.2", "-1 -1 0.2"), "increasing"),
    "a coordinate of another joint": (CUSTOM_4.replace(">v</coord", ">base_rx</coord"), "'base_rx' is none of joint"),
    "an idle coordinate": (CUSTOM_4.replace(">v</coordinates>", ">u</coordinates>"), "'v' moves no axis"),
    "two coordinates": (CUSTOM_4.replace(">v</coordinates>", ">u v</coordinates>"), "several coordinates"),
    "no direction": (CUSTOM_4.replace("0.6 0.8 0", "0 0 0"), "no direction"),
    "another constraint": (
        version_4("PinJoint", ("q",), "", '<PointConstraint name="p"/>'),
        'PointConstraint "p": .*not supported',
    ),
    "a coupler of two": (CUSTOM_4.replace("names>v<", "names>v u<"), "found 2 independent"),
    "a coupler of nothing": (CUSTOM_4.replace("names>v<", "names>z<"), "'z' is in no joint"),
    "a coupler of itself": (CUSTOM_4.replace("names>v<", "names>w<"), "circle"),
    "a coordinate twice": (PIN.replace('name="q"', 'name="base_rx"'), "'base_rx' is in two joints"),
    "inertia in kg mm2": (PIN.replace(INERTIA, "1e5 1.2e5 1.5e5 0 0 0"), 'Body "base".*1e.05.*radius of gyration'),
    "negative inertia": (PIN.replace(INERTIA, "-0.13 0.03 0.14 0 0 0"), 'Body "base".*expected none below 0'),
    "a negative principal moment": (PIN.replace(INERTIA, "0.11 0.12 0.15 0.3 0 0"), "expected none below 0"),
    "no triangle": (PIN.replace(INERTIA, "0.01 0.02 0.15 0 0 0"), "at most the sum of the others \\(0.03\\)"),
    "parallel axes": (
        CUSTOM_4.replace('<axis>1 0 0</axis><PolynomialFunction', '<axis>0 0 -2</axis><PolynomialFunction'),
        'CustomJoint "tried": found parallel rotation axes of u and v',
    ),
    "a marker twice": (PIN.replace("</Marker>", "</Marker>" + MARKER), "already"),
    "a joint that hides": (
        PIN.replace("<BodySet>", '<components><WeldJoint name="x"/></components><BodySet>'),
        "found in components",
    ),
    "a loop": (
        PIN.replace("<JointSet><objects>", '<JointSet><objects><WeldJoint name="extra"><socket_parent_frame>/ground'
        "</socket_parent_frame><socket_child_frame>/bodyset/tip</socket_child_frame></WeldJoint>"),
        "'tip' is a child of joint 'extra' already",
    ),
    "a lost body": (PIN.replace("<BodySet><objects>", '<BodySet><objects><Body name="lost"/>'), "no joint carries"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files_are_refused(name: str, tmp_path: Path) -> None:
    text, said = WRONG[name]
    assert text not in (PIN, CUSTOM_4)
    path = tmp_path / "wrong.osim"
    path.write_text(text)
    with pytest.raises(ModelError, match=said) as caught:
        read_osim(path)
    assert caught.value.message.startswith(f"{path}, line ")
    assert "\n" not in caught.value.message


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="cannot be read"):
        read_osim(tmp_path / "absent.osim")


def test_a_constraint_that_is_switched_off_is_said(tmp_path: Path) -> None:
    path = tmp_path / "off.osim"
    path.write_text(PIN.replace("<ConstraintSet><objects>", "<ConstraintSet><objects><PointConstraint "
                                'name="p"><isEnforced>false</isEnforced></PointConstraint>'))  # fmt: skip
    assert any("Constraint p is switched off" in text for text in read_osim(path).left_out)


def test_scales_of_unknown_bodies_are_refused(tmp_path: Path) -> None:
    model = read_osim(small_model(tmp_path, "PinJoint", 4))
    assert scale_names(model) == {"base": "scale_base", "tip": "scale_tip"}
    assert scale_names(model, None) == {}
    with pytest.raises(ModelError, match=r"no body 'bas'.*did you mean 'base'"):
        scale_names(model, ["bas"])
    with pytest.raises(ModelError, match="expected 'all'"):
        scale_names(model, "base")
