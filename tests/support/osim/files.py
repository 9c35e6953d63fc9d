"""Small .osim files of both versions: a base on a free joint (version 4 only where asked), and a joint to try on it."""

from __future__ import annotations

from pathlib import Path

BASE = ("base_rx", "base_ry", "base_rz", "base_tx", "base_ty", "base_tz")
COUNTS = {
    "WeldJoint": 0,
    "PinJoint": 1,
    "SliderJoint": 1,
    "UniversalJoint": 2,
    "BallJoint": 3,
    "GimbalJoint": 3,
    "PlanarJoint": 3,
    "FreeJoint": 6,
}
PARENT = ("0.1 -0.3 0.05", "0.3 -0.2 0.4")
CHILD = ("-0.02 0.12 0.03", "-0.1 0.5 0.2")
SPLINE = "<SimmSpline><x>-1 -0.3 0.2 0.9 1.5</x><y>0.1 0.3 0.2 -0.2 0.1</y></SimmSpline>"
SCALED = f"<MultiplierFunction><function>{SPLINE}</function><scale>0.6</scale></MultiplierFunction>"
POLYNOMIAL = "<PolynomialFunction><coefficients>0.2 -0.5 0.9 0.1</coefficients></PolynomialFunction>"
LINES = "<PiecewiseLinearFunction><x>-1 -0.3 0.4 1.5</x><y>0.1 0.3 -0.2 -0.1</y></PiecewiseLinearFunction>"
LINE = "<LinearFunction><coefficients>0.8 0.1</coefficients></LinearFunction>"
CONSTANT = "<Constant><value>0.2</value></Constant>"
NOTHING = "<Constant><value>0</value></Constant>"

# name, axis, coordinate and function of each of the six axes
CUSTOM = (
    ("rotation1", "0 0 1", "u", LINE),
    ("rotation2", "1 0 0", "v", POLYNOMIAL),
    ("rotation3", "0.6 0.8 0", "", CONSTANT),
    ("translation1", "1 0 0", "u", SCALED),
    ("translation2", "0 1 0", "u", LINES),
    ("translation3", "0 0 1", "w", SPLINE),
)
COUPLER = f"""<CoordinateCouplerConstraint name="c"><coupled_coordinates_function>{POLYNOMIAL}
</coupled_coordinates_function><independent_coordinate_names>v</independent_coordinate_names>
<dependent_coordinate_name>w</dependent_coordinate_name><scale_factor>1.5</scale_factor></CoordinateCouplerConstraint>"""


def transform(axes: tuple[tuple[str, str, str, str], ...], version: int) -> str:
    """A SpatialTransform; version 3 wraps its functions."""
    rows = []
    for name, axis, coordinate, function in axes:
        text = f"<function>{function}</function>"
        if version == 4:
            kind = function[1:].split(">")[0]
            text = function.replace(f"<{kind}>", f'<{kind} name="function">', 1)
        place = f"<coordinates>{coordinate}</coordinates><axis>{axis}</axis>{text}"
        rows.append(f'<TransformAxis name="{name}">{place}</TransformAxis>')
    return f"<SpatialTransform>{''.join(rows)}</SpatialTransform>"


def coordinates(names: tuple[str, ...]) -> str:
    """Coordinates that are clamped to +-2."""
    return "".join(f'<Coordinate name="{name}"><range>-2 2</range></Coordinate>' for name in names)


def _inertia(version: int) -> str:
    entries, numbers = ["xx", "yy", "zz", "xy", "xz", "yz"], ["0.11", "0.12", "0.15", "0.01", "0.02", "0.03"]
    if version == 4:
        return f"<inertia>{' '.join(numbers)}</inertia>"
    return "".join(f"<inertia_{e}>{v}</inertia_{e}>" for e, v in zip(entries, numbers, strict=True))


def _body(name: str, mass: float, version: int, joint: str = "") -> str:
    mechanics = f"<mass>{mass}</mass><mass_center>0.1 -0.2 0.3</mass_center>{_inertia(version)}"
    return f'<Body name="{name}">{mechanics}{joint}</Body>'


def _offset(name: str, body: str, place: tuple[str, str]) -> str:
    inner = f"<socket_parent>/bodyset/{body}</socket_parent><translation>{place[0]}</translation>"
    return f'<PhysicalOffsetFrame name="{name}">{inner}<orientation>{place[1]}</orientation></PhysicalOffsetFrame>'


def version_4(kind: str, names: tuple[str, ...], inner: str = "", constraints: str = "") -> str:
    """A base on a free joint and a body on the joint to try, with offset frames on either side."""
    free = (
        '<FreeJoint name="ground_base"><socket_parent_frame>/ground</socket_parent_frame>'
        f"<socket_child_frame>/bodyset/base</socket_child_frame><coordinates>{coordinates(BASE)}</coordinates></FreeJoint>"
    )
    joint = (
        f'<{kind} name="tried"><socket_parent_frame>p</socket_parent_frame>'
        f"<socket_child_frame>c</socket_child_frame><coordinates>{coordinates(names)}</coordinates>"
        f"<frames>{_offset('p', 'base', PARENT)}{_offset('c', 'tip', CHILD)}</frames>{inner}</{kind}>"
    )
    place = "<socket_parent_frame>/bodyset/tip</socket_parent_frame><location>0.1 0.2 0.3</location>"
    marker = f'<Marker name="m">{place}</Marker>'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<OpenSimDocument Version="40000"><Model name="small">'
        "<gravity>0 -9.80665 0</gravity>"
        f"<BodySet><objects>{_body('base', 3.0, 4)}{_body('tip', 2.0, 4)}</objects></BodySet>"
        f"<JointSet><objects>{free}{joint}</objects></JointSet>"
        f"<ConstraintSet><objects>{constraints}</objects></ConstraintSet>"
        f"<MarkerSet><objects>{marker}</objects></MarkerSet></Model></OpenSimDocument>"
    )


def version_3(kind: str, names: tuple[str, ...], inner: str = "", constraints: str = "") -> str:
    """The same model as it was written before version 4."""

    def joint(tag: str, name: str, parent: str, places: tuple[str, ...], members: str, more: str) -> str:
        tags = ("location_in_parent", "orientation_in_parent", "location", "orientation")
        offsets = "".join(f"<{t}>{v}</{t}>" for t, v in zip(tags, places, strict=True))
        return (
            f'<Joint><{tag} name="{name}"><parent_body>{parent}</parent_body>{offsets}'
            f"<CoordinateSet><objects>{members}</objects></CoordinateSet>{more}</{tag}></Joint>"
        )

    free = joint("FreeJoint", "ground_base", "ground", ("0 0 0",) * 4, coordinates(BASE), "")
    tried = joint(kind, "tried", "base", (*PARENT, *CHILD), coordinates(names), inner)
    bodies = _body("base", 3.0, 3, free) + _body("tip", 2.0, 3, tried)
    marker = '<Marker name="m"><body>tip</body><location>0.1 0.2 0.3</location></Marker>'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<OpenSimDocument Version="30000"><Model name="small">'
        "<gravity>0 -9.80665 0</gravity>"
        f'<BodySet><objects><Body name="ground"><mass>0</mass></Body>{bodies}</objects></BodySet>'
        f"<ConstraintSet><objects>{constraints}</objects></ConstraintSet>"
        f"<MarkerSet><objects>{marker}</objects></MarkerSet></Model></OpenSimDocument>"
    )


def small_model(folder: Path, kind: str, version: int, constraints: str = "") -> Path:
    """A file with one joint of the kind on a free base; the custom one has a coordinate of each sort."""
    write = version_4 if version == 4 else version_3
    if kind == "CustomJoint":
        text = write(kind, ("u", "v", "w"), transform(CUSTOM, version), constraints)
    else:
        text = write(kind, tuple(f"q{k}" for k in range(COUNTS[kind])), "", constraints)
    path = folder / f"{kind}_{version}.osim"
    path.write_text(text)
    return path
