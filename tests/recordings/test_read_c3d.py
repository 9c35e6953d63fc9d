"""C3D files written by hand: markers, the seven types of plate, turned plates, damaged files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynakin.errors import RecordingError
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from support.made_recordings import write, write_c3d

T = 20
PER_FRAME = 10

# A plate of 0.4 x 0.6 m whose centre is (1, 2, 0.1) m, in a laboratory with Z up. Plate axes: x along the
# laboratory's X, y along its -Y, z into the floor. Corners 1 to 4 at (+x, +y), (-x, +y), (-x, -y), (+x, -y).
CENTRE = np.array([1.0, 2.0, 0.1])
R_LP = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]])
LOCAL_CORNERS = np.array([[0.2, 0.3, 0], [-0.2, 0.3, 0], [-0.2, -0.3, 0], [0.2, -0.3, 0]])

# What the person gets from the ground, in the plate's frame: 10 N along x, 800 N up (negative z), at (0.05,
# -0.1, 0), and 4 N m about z.
FORCE_P = np.array([10.0, -20.0, -800.0])
POINT_P = np.array([0.05, -0.1, 0.0])
FREE_P = np.array([0.0, 0.0, 4.0])
MOMENT_CENTRE_P = np.cross(POINT_P, FORCE_P) + FREE_P  # (80, 40, 4) by hand
DEPTH = 0.04  # the transducers lie this much below the surface
MOMENT_TRANSDUCER_P = MOMENT_CENTRE_P + np.cross([0, 0, -DEPTH], FORCE_P)


def body(turn: np.ndarray = R_LP, above: float = 1.0) -> dict[str, np.ndarray]:
    """One marker above the plate, mm."""
    return {"LASI": np.tile(1e3 * (CENTRE - above * turn[:, 2]), (T, 1))}


def calibration_of(kind: int) -> np.ndarray | None:
    """Some matrix (outputs, channels) that no other can be taken for."""
    rows, columns = {4: (6, 6), 5: (6, 8), 6: (12, 12), 7: (8, 8)}.get(kind, (0, 0))
    if not rows:
        return None
    mixed = np.random.default_rng(kind).normal(size=(rows, columns))
    return 100.0 * (3.0 * np.eye(rows, columns) + 0.3 * mixed)


def channels_of(kind: int, sign: float = 1.0) -> np.ndarray:
    """Channels of a plate under FORCE_P and MOMENT (N, N mm, mm; behind a calibration whatever gives these), constant
    in time."""
    if (calibration := calibration_of(kind)) is not None:
        return np.linalg.lstsq(calibration, outputs_of(kind, sign), rcond=None)[0]
    return outputs_of(kind, sign)


def outputs_of(kind: int, sign: float) -> np.ndarray:
    """What the channels hold after the calibration: of types 6 and 7 the forces of four sensors."""
    f, m = sign * FORCE_P, sign * MOMENT_TRANSDUCER_P * 1e3
    if kind == 6:  # shear forces spread evenly over the pairs
        x12, x34, y14, y23, *z = outputs_of(3, sign)[:, 0]
        sensors = [(x12, y14, z[0]), (x12, y23, z[1]), (x34, y23, z[2]), (x34, y14, z[3])]
        forces = np.array([(0.5 * x, 0.5 * y, z) for x, y, z in sensors])
        return np.repeat(forces.reshape(-1, 1), T * PER_FRAME, axis=1)
    if kind == 1:
        values = [*f, *(POINT_P[:2] * 1e3), sign * 4e3]
    elif kind in (3, 7):
        a, b = 0.12, 0.2
        # Vertical forces at (+-a, +-b) with sum F_z and moments M_x = b(z1+z2-z3-z4), M_y = a(-z1+z2+z3-z4).
        mx, my, mz = sign * MOMENT_TRANSDUCER_P
        z = np.array([[1, 1, 1, 1], [b, b, -b, -b], [-a, a, a, -a], [1, -1, 1, -1]])
        z14 = np.linalg.solve(z, [f[2], mx, my, 0.0])
        # f_y14 = f_y23, and the rest of M_z = b(x34 - x12) + a(y14 - y23) comes from x12, x34.
        x34 = 0.5 * (f[0] + mz / b)
        values = [f[0] - x34, x34, f[1] / 2, f[1] / 2, *z14]
    else:
        values = [*f, *m]
    return np.repeat(np.array(values, dtype=float)[:, None], T * PER_FRAME, axis=1)


def origin_of(kind: int, depth_sign: float = -1.0) -> list[float]:
    return [120.0, 200.0, depth_sign * 40.0] if kind in (3, 6, 7) else [0.0, 0.0, depth_sign * 40.0]


def turned(turn: np.ndarray) -> np.ndarray:
    return np.asarray(1e3 * (CENTRE + LOCAL_CORNERS @ turn.T))


def expected_wrench(turn: np.ndarray) -> np.ndarray:
    force = turn @ FORCE_P
    return np.concatenate([force, turn @ MOMENT_CENTRE_P + np.cross(CENTRE, force)])


def test_moment_by_hand() -> None:
    np.testing.assert_allclose(MOMENT_CENTRE_P, [80, 40, 4])
    # (1, 2, 0.1) x (10, 20, 800) = (1598, -799, 0), and (80, -40, -4) of the plate in laboratory axes
    np.testing.assert_allclose(expected_wrench(R_LP), [10, 20, 800, 1678, -839, -4])


@pytest.mark.parametrize("kind", [1, 2, 3, 4, 5, 6, 7])
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["reaction", "action"])
@pytest.mark.parametrize("depth_sign", [1.0, -1.0])
@pytest.mark.parametrize("turn_deg", [0.0, 26.0])
def test_all_types(tmp_path: Path, kind: int, sign: float, depth_sign: float, turn_deg: float) -> None:
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ R_LP
    path = write_c3d(
        tmp_path / "a.c3d",
        body(turn),
        kinds=[kind],
        channels=channels_of(kind, sign),
        corners=[turned(turn)],
        origins=[origin_of(kind, depth_sign)],
        calibration=calibration_of(kind),
    )
    recording = read(path)
    (plate,) = recording.plates
    wrench = np.hstack([plate.force, plate.moment])
    np.testing.assert_allclose(wrench, np.tile(expected_wrench(turn), (T, 1)), rtol=1e-5, atol=2e-2)
    np.testing.assert_allclose(plate.cop, np.tile(CENTRE + turn @ POINT_P, (T, 1)), atol=1e-5)
    np.testing.assert_allclose(plate.free_moment, np.tile(turn @ FREE_P, (T, 1)), atol=1e-3)
    assert plate.corners is not None
    np.testing.assert_allclose(plate.corners, CENTRE + LOCAL_CORNERS @ turn.T, atol=1e-6)
    assert any("person's action" in note for note in map(str, recording.notes)) == (sign < 0)


def two_plates(tmp_path: Path, pushes: tuple[np.ndarray, np.ndarray]) -> Path:
    """Two plates 1 m apart, each with these multiples (T * PER_FRAME,) of the usual wrench."""
    places = [1e3 * (CENTRE + [at, 0.0, 0.0] + LOCAL_CORNERS @ R_LP.T) for at in (0.0, 1.0)]
    return write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[2, 2],
        channels=np.vstack([channels_of(2) * push for push in pushes]),
        corners=places,
        origins=[origin_of(2)] * 2,
    )


ALL = np.ones(T * PER_FRAME)
SHORT = np.where(np.arange(T * PER_FRAME) < 40, 1.0, 0.0)  # a step, then nobody


@pytest.mark.parametrize("turned", [0, 1])
def test_one_plate_of_the_opposite_sign_is_turned_and_named(tmp_path: Path, turned: int) -> None:
    signs = [-1.0 if k == turned else 1.0 for k in range(2)]
    recording = read(two_plates(tmp_path, (signs[0] * ALL, signs[1] * SHORT)))
    for plate in recording.plates:
        np.testing.assert_allclose(plate.force[0], R_LP @ FORCE_P, rtol=0.05)
    assert [note for note in map(str, recording.notes) if "action" in note] == [
        f"The file stores the person's action on plate {turned + 1}, unlike its other plates; turned into the ground's "
        "reaction."
    ]


def test_an_idle_plate_that_drifts_is_not_turned(tmp_path: Path) -> None:
    """It has the sign of the loaded one; a long offset does not outweigh a short step."""
    drift, offset = -0.15 * np.linspace(0.0, 1.0, T * PER_FRAME), np.where(SHORT > 0.0, 1.0, -0.1)
    recording = read(two_plates(tmp_path, (ALL, drift)))
    np.testing.assert_array_equal(recording.plates[1].force, 0.0)
    assert any(note.startswith("Warning: plate 2 pulls by up to 120 N") for note in map(str, recording.notes))
    recording = read(two_plates(tmp_path, (ALL, offset)))
    np.testing.assert_allclose(recording.plates[1].force[0], R_LP @ FORCE_P, rtol=0.05)
    assert not any("action" in note for note in map(str, recording.notes))


@pytest.mark.parametrize(
    "names", [("POINT", "ANALOG", "FORCE_PLATFORM"), ("POINT", "USED", "RATE", "LABELS", "CORNERS")]
)
def test_names_of_groups_and_parameters_in_small_letters(tmp_path: Path, names: tuple[str, ...]) -> None:
    path = two_plates(tmp_path, (ALL, SHORT))
    expected, content = read(path), path.read_bytes()
    for name in names:
        content = content.replace(name.encode(), name.lower().encode())
    path.write_bytes(content)
    found = read(path)
    assert found.marker_names == expected.marker_names and found.rate == expected.rate
    for one, other in zip(found.plates, expected.plates, strict=True):
        np.testing.assert_array_equal(one.force, other.force)
        np.testing.assert_array_equal(one.cop, other.cop)


def test_type_4_calibration_mixes_channels(tmp_path: Path) -> None:
    calibration = np.diag([500.0, 500, 1000, 2e5, 3e5, 1e5])
    calibration[0, 2] = 12.0  # asymmetric: rows are outputs
    path = write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[4],
        channels=np.linalg.solve(calibration, outputs_of(2, 1.0)),
        corners=[turned(R_LP)],
        origins=[origin_of(4)],
        calibration=calibration,
        analog_units=["V"] * 6,
    )
    np.testing.assert_allclose(read(path).total_wrench()[5], expected_wrench(R_LP), rtol=1e-5, atol=1e-2)


@pytest.mark.parametrize("kind", [4, 5, 7])
@pytest.mark.parametrize("layout", ["by column", "by row", "in a larger one", "channels first"])
def test_layouts_of_the_calibration(tmp_path: Path, kind: int, layout: str) -> None:
    """A file gives its matrices by column, or says ByRow; those of plates of several types have one size."""
    matrix = calibration_of(kind)
    assert matrix is not None
    rows, columns = matrix.shape
    stored = matrix
    if layout == "by row":
        stored = matrix.ravel().reshape((rows, columns), order="F")
    elif layout == "in a larger one":
        stored = np.full((12, 12), np.nan)
        stored[:rows, :columns] = matrix
    elif layout == "channels first":
        if rows == columns:
            pytest.skip("a square matrix does not show which is first")
        stored = matrix.T
    path = write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[kind],
        channels=channels_of(kind),
        corners=[turned(R_LP)],
        origins=[origin_of(kind)],
        calibration=stored,
        by_row=layout == "by row",
    )
    np.testing.assert_allclose(read(path).total_wrench()[5], expected_wrench(R_LP), rtol=1e-4, atol=2e-2)


def test_units_of_channels_and_metres(tmp_path: Path) -> None:
    channels = channels_of(2)
    channels[3:] *= 1e-3
    points = {name: 1e-3 * values for name, values in body().items()}
    path = write_c3d(
        tmp_path / "a.c3d",
        points,
        unit="m",
        kinds=[2],
        channels=channels,
        corners=[1e-3 * turned(R_LP)],
        origins=[[0, 0, -DEPTH]],
        analog_units=["N"] * 3 + ["Nm"] * 3,
    )
    recording = read(path)
    assert recording.length_unit == "m"
    np.testing.assert_allclose(recording.total_wrench()[0], expected_wrench(R_LP), rtol=1e-5, atol=1e-2)
    mixed = write_c3d(
        tmp_path / "b.c3d",
        body(),
        kinds=[2],
        channels=channels,
        corners=[turned(R_LP)],
        origins=[origin_of(2)],
        analog_units=["N"] * 3 + ["N.m"] * 3,
    )
    np.testing.assert_allclose(read(mixed).total_wrench()[0], expected_wrench(R_LP), rtol=1e-5, atol=1e-2)


@pytest.mark.parametrize(
    ("force", "moment", "newtons", "newton_metres"),
    [
        ("lbf", "in-lbf", 4.4482216, 0.11298483),
        ("kgf", "kgf.cm", 9.80665, 0.0980665),
        ("kN", "kN*m", 1e3, 1e3),
        ("furlong", "mN", 1.0, 1e-3),  # unknown, both
    ],
)
def test_other_units_are_converted_and_unknown_ones_are_named(
    tmp_path: Path, force: str, moment: str, newtons: float, newton_metres: float
) -> None:
    channels = channels_of(2)  # N, N mm
    channels[:3] /= newtons
    channels[3:] *= 1e-3 / newton_metres
    path = write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[2],
        channels=channels,
        corners=[turned(R_LP)],
        origins=[origin_of(2)],
        analog_units=[force] * 3 + [moment] * 3,
    )
    recording = read(path)
    np.testing.assert_allclose(recording.total_wrench()[5], expected_wrench(R_LP), rtol=1e-4, atol=2e-2)
    said = [note for note in map(str, recording.notes) if "unknown unit" in note]
    assert said == (
        [
            "Warning: plate 1: unknown unit 'furlong' of its forces in ANALOG:UNITS, N taken.",
            "Warning: plate 1: unknown unit 'mN' of its moments in ANALOG:UNITS, N times the unit of its points taken.",
        ]
        if force == "furlong"
        else []
    )


@pytest.mark.parametrize("offset_n", [2.0, 6.0])
def test_each_plate_is_kept_and_an_idle_one_is_empty(tmp_path: Path, offset_n: float) -> None:
    """Noise is 0; whether more than that is somebody's load markers will say."""
    idle = np.full_like(channels_of(2), 0.0)
    idle[2] = -offset_n
    shifted = turned(R_LP) + np.array([0, 700.0, 0])
    path = write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[2, 2],
        channels=np.vstack([channels_of(2), idle]),
        corners=[turned(R_LP), shifted],
        origins=[origin_of(2), origin_of(2)],
    )
    recording = read(path)
    assert [plate.name for plate in recording.plates] == ["plate 1", "plate 2"]
    idle_plate = recording.plates[1]
    assert np.isnan(idle_plate.cop).all()
    np.testing.assert_allclose(idle_plate.force[:, 2], 0.0 if offset_n < 3.0 else offset_n, rtol=1e-5)
    said = [note for note in map(str, recording.notes) if "where nobody stands" in note]
    assert len(said) == (offset_n > 3.0) and all("plate 2 reads 6 N" in text for text in said)
    kept = read(path, force_threshold_n=0.0)
    np.testing.assert_allclose(kept.plates[1].force[:, 2], offset_n, rtol=1e-5)
    emptied = read(path, force_threshold_n=10.0)
    np.testing.assert_array_equal(emptied.plates[1].force, 0.0)


@settings(max_examples=15, deadline=None)
@given(angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_turning_the_plate_turns_its_wrench(
    tmp_path_factory: pytest.TempPathFactory, angles: tuple[float, ...]
) -> None:
    """The wrench about the plate's own centre, in its own axes, does not depend on how it lies in the
    laboratory."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_euler("xyz", angles).as_matrix()
    path = write_c3d(
        tmp_path_factory.mktemp("turned") / "a.c3d",
        body(turn),
        kinds=[2],
        channels=channels_of(2),
        corners=[turned(turn)],
        origins=[origin_of(2)],
    )
    recording = read(path)
    wrench = recording.total_wrench(about=CENTRE)[0]
    np.testing.assert_allclose(turn.T @ wrench[:3], FORCE_P, atol=1e-2)
    np.testing.assert_allclose(turn.T @ wrench[3:], MOMENT_CENTRE_P, atol=1e-2)


def test_markers_missing_unlabelled_and_prefixed(tmp_path: Path) -> None:
    base = np.tile([100.0, 200.0, 300.0], (T, 1))
    seen = base.copy()
    seen[3] = 0.0
    residuals = np.zeros((3, T))
    residuals[1, 5] = -1
    points = {"S1:LASI": seen, "S1:RASI": base + 1, "*12": base + 2}
    path = write_c3d(tmp_path / "a.c3d", points, residuals=residuals)
    recording = read(path)
    assert recording.marker_names == ("S1:LASI", "S1:RASI")
    assert np.isnan(recording.marker("S1:LASI")[3]).all()
    assert np.isnan(recording.marker("S1:RASI")[5]).all()
    assert np.isnan(recording.markers).sum() == 6
    np.testing.assert_allclose(recording.marker("S1:LASI")[0], [0.1, 0.2, 0.3])
    assert any("1 unlabelled points left out" in note for note in map(str, recording.notes))
    assert recording.plates == ()
    assert any("no force plates" in note for note in map(str, recording.notes))
    with pytest.raises(RecordingError, match="no force plates"):
        recording.total_wrench()


def test_files_that_are_no_c3d(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file"):
        read(tmp_path / "none.c3d")
    for text in ("", "P", "not a C3D at all " * 100):
        path = write(tmp_path, "a.c3d", text)
        with pytest.raises(RecordingError) as caught:
            read(path)
        assert str(caught.value).startswith(f"{path}: is not a C3D file")


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.95])
def test_truncated_file_is_one_clear_error(tmp_path: Path, share: float) -> None:
    whole = write_c3d(tmp_path / "a.c3d", {f"M{k}": np.ones((200, 3)) + k for k in range(10)})
    data = whole.read_bytes()
    cut = tmp_path / "cut.c3d"
    cut.write_bytes(data[: int(share * len(data))])
    with pytest.raises(RecordingError, match=r"truncated C3D file, found \d+ bytes, ") as caught:
        read(cut)
    assert "\n" not in str(caught.value)


def test_plates_that_cannot_be_understood(tmp_path: Path) -> None:
    common = {"channels": channels_of(2), "corners": [turned(R_LP)], "origins": [origin_of(2)]}

    def said(**other: object) -> str:
        recording = read(write_c3d(tmp_path / "a.c3d", body(), **(common | other)))  # type: ignore[arg-type]
        assert recording.plates == () and recording.marker_names == ("LASI",)
        return " ".join(map(str, recording.notes))

    assert "Warning: plate 1 left out: found type 21, expected a force plate of type 1 to 7." in said(kinds=[21])
    assert "plate 1 left out: it has type 5 and no calibration in FORCE_PLATFORM:CAL_MATRIX" in said(
        kinds=[5], channels=channels_of(3)
    )
    assert "plate 1 left out: it has type 4 and no calibration" in said(kinds=[4], analog_units=["V"] * 6)
    assert "plate 1 left out: FORCE_PLATFORM:CAL_MATRIX is 6 by 6, type 7 needs 8 by 8" in said(
        kinds=[7], channels=channels_of(3), calibration=np.eye(6)
    )
    assert "plate 1 left out: lists channels [1, 2, 3, 4, 5, 6, 7, 8], expected 8 of 1 to 6" in said(kinds=[3])
    assert "plate 1 left out: its corners in the file do not span" in said(kinds=[2], corners=[np.zeros((4, 3))])


def test_a_plate_that_cannot_be_read_does_not_take_the_others_along(tmp_path: Path) -> None:
    path = write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[21, 2],
        channels=np.vstack([np.zeros_like(channels_of(2)), channels_of(2)]),
        corners=[turned(R_LP) + np.array([0, 700.0, 0]), turned(R_LP)],
        origins=[origin_of(2), origin_of(2)],
    )
    recording = read(path)
    assert [plate.name for plate in recording.plates] == ["plate 2"]
    np.testing.assert_allclose(recording.total_wrench()[3], expected_wrench(R_LP), rtol=1e-5, atol=2e-2)


def test_channels_without_a_calibration_are_taken_as_calibrated(tmp_path: Path) -> None:
    """Motion Analysis' files have type 4 and an empty matrix."""
    common = {"corners": [turned(R_LP)], "analog_units": ["N"] * 3 + ["Nmm"] * 3}
    path = write_c3d(tmp_path / "a.c3d", body(), kinds=[4], channels=channels_of(2), origins=[origin_of(2)], **common)  # type: ignore[arg-type]
    recording = read(path)
    np.testing.assert_allclose(recording.total_wrench()[3], expected_wrench(R_LP), rtol=1e-5, atol=2e-2)
    assert "plate 1 has no calibration in the file: its channels are taken as calibrated." in map(str, recording.notes)


def test_causal_reading_says_its_delay(tmp_path: Path) -> None:
    path = write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[2],
        channels=channels_of(2),
        corners=[turned(R_LP)],
        origins=[origin_of(2)],
    )
    recording = read(path, causal=True, plate_filter_hz=20.0)
    np.testing.assert_allclose(recording.total_wrench()[7], expected_wrench(R_LP), rtol=1e-5, atol=2e-2)
    assert any("ms late" in note for note in map(str, recording.notes))
    with pytest.raises(RecordingError, match="expected less than 500 Hz"):
        read(path, plate_filter_hz=600.0)


def stands_aside(path: Path, kind: int, word: str, factor: float, aside_m: float = 0.2) -> Recording:
    """A person some 0.2 m beside the middle of a plate of this type, whose channels or calibration give moments in N m
    times a factor, and the unit ``word``."""
    t = np.arange(1000) / 1000.0
    push = -600.0 - 50.0 * np.sin(2.0 * np.pi * 2.0 * t)
    channels = np.stack([0.0 * t, 0.0 * t, push, 0.25 * aside_m * push, -aside_m * push, 0.0 * t])
    channels[3:] *= factor
    corners = np.array([[300.0, 300, 0], [-300, 300, 0], [-300, -300, 0], [300, -300, 0]])
    return read(
        write_c3d(
            path,
            {"LASI": np.full((100, 3), 900.0)},
            kinds=[kind],
            channels=channels if kind == 2 else 0.01 * channels,
            corners=[corners],
            origins=[[0.0, 0.0, -40.0]],
            calibration=None if kind == 2 else 100.0 * np.eye(6)[:, :, None],
            analog_units=(["N"] * 3 if kind == 2 else ["V"] * 3) + [word] * 3,
        )
    )


@pytest.mark.parametrize(
    ("kind", "word", "factor", "said"),
    [
        (2, "", 1.0, "no unit for its moments: N m taken"),
        (2, "Nmm", 1.0, "Warning: plate 1: by the unit that the file gives for its moments"),
        (4, "V", 1.0, "no unit for its moments: N m taken"),  # a calibration in N m/V
        (4, "V", 1000.0, ""),
        (2, "Nmm", 1000.0, ""),
        (2, "Nm", 0.001, "Warning: plate 1: by the unit of its moments"),
    ],
)
def test_moments_in_another_unit_than_the_file_says(
    tmp_path: Path, kind: int, word: str, factor: float, said: str
) -> None:
    recording = stands_aside(tmp_path / "a.c3d", kind, word, factor)
    about = [note for note in map(str, recording.notes) if "moments" in note]
    assert [said in note for note in about] == [True] * bool(said)
    away = np.abs(np.nanmedian(recording.plates[0].cop, axis=0)).max()
    assert away == pytest.approx(0.2 if factor != 0.001 else 0.0, abs=0.01)


def made_plates(path: Path, kind: int, channels: np.ndarray, origins: list[list[float]], units: str = "") -> Recording:
    """Plates side by side, the same corners for all, each with these channels."""
    count = len(origins)
    return read(
        write_c3d(
            path,
            body(),
            kinds=[kind] * count,
            channels=np.tile(channels, (count, 1)),
            corners=[turned(R_LP)] * count,
            origins=origins,
            analog_units=[units] * (count * len(channels)) if units else (),
        )
    )


@pytest.mark.parametrize("spot", [0, 3])
def test_a_sample_without_a_number_says_nothing_about_units(tmp_path: Path, spot: int) -> None:
    """Nor does it cost more than itself, and no frame where it is shorter than one."""
    channels = channels_of(2)
    channels[spot, 55] = np.nan
    recording = made_plates(tmp_path / "a.c3d", 2, channels, [origin_of(2)])
    said = list(map(str, recording.notes))
    assert not [text for text in said if "unit" in text]
    assert [text for text in said if "bridged by straight lines (samples without a number: 1)" in text]
    np.testing.assert_allclose(recording.total_wrench(), np.tile(expected_wrench(R_LP), (T, 1)), rtol=1e-4, atol=2e-2)
    channels[spot, 50:80] = np.nan  # too long to be bridged
    recording = made_plates(tmp_path / "b.c3d", 2, channels, [origin_of(2)])
    assert not [text for text in map(str, recording.notes) if "unit" in text or "bridged" in text]
    assert np.isnan(recording.total_wrench()[5:8]).all()


def test_sensors_beyond_the_edges_have_been_exchanged(tmp_path: Path) -> None:
    """Half widths are 200 and 300 mm: 210 along x lies beyond, and along y within."""
    a, b = 210.0, 150.0
    recording = made_plates(tmp_path / "a.c3d", 3, channels_of(3), [[a, b, -40.0], [b, a, -40.0], [a, b, -40.0]])
    assert [plate.name for plate in recording.plates] == ["plate 2"]
    (said,) = [text for text in map(str, recording.notes) if "left out" in text]
    assert said.startswith(
        "Warning: plate 1 and plate 3 left out: by FORCE_PLATFORM:ORIGIN its sensors lie 210 and 150 mm"
    )
    assert "edges 200 and 300 mm: a and b have been exchanged" in said


def test_sensors_beyond_the_edges_either_way_are_said(tmp_path: Path) -> None:
    recording = made_plates(tmp_path / "a.c3d", 3, channels_of(3), [[320.0, 350.0, -40.0]])
    assert len(recording.plates) == 1
    assert (
        len([text for text in map(str, recording.notes) if "Warning: plate 1: by FORCE_PLATFORM:ORIGIN" in text]) == 1
    )


@pytest.mark.parametrize(
    ("origins", "said"),
    [
        ([[np.nan] * 3] * 2, "plate 1 and plate 2 left out: FORCE_PLATFORM:ORIGIN holds no numbers for it"),
        ([[0.0, 0.0, -40.0]] * 2, "plate 1 and plate 2 left out: FORCE_PLATFORM:ORIGIN has its sensors on its axes"),
    ],
)
def test_plates_that_are_left_out_for_one_reason_are_said_once(
    tmp_path: Path, origins: list[list[float]], said: str
) -> None:
    recording = made_plates(tmp_path / "a.c3d", 3, channels_of(3), origins)
    assert not recording.plates
    assert len([text for text in map(str, recording.notes) if said in text]) == 1


def test_volts_that_are_none_are_a_note(tmp_path: Path) -> None:
    recording = made_plates(tmp_path / "a.c3d", 2, channels_of(2), [origin_of(2)] * 2, "V")
    (said,) = [text for text in map(str, recording.notes) if "volts" in text or "unknown unit" in text]
    assert said.startswith("plate 1 and plate 2: the channels read up to")
    small = made_plates(tmp_path / "b.c3d", 2, 1e-4 * channels_of(2), [origin_of(2)] * 2, "V")
    strange = [text for text in map(str, small.notes) if "unknown unit 'V'" in text]
    assert len(strange) == 2 and strange[0].startswith("Warning: plate 1 and plate 2: unknown unit 'V' of its forces")


def test_a_weight_at_the_middle_of_a_plate_is_no_other_unit(tmp_path: Path) -> None:
    """In N m it would lie beyond the edges."""
    recording = stands_aside(tmp_path / "a.c3d", 2, "Nmm", 1000.0, aside_m=0.002)
    assert np.abs(np.nanmedian(recording.plates[0].cop, axis=0)).max() < 0.003


@pytest.mark.parametrize(("word", "unit_m"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("", 0.001), ("furlong", 0.001)])
def test_type_1_has_its_centre_of_pressure_in_the_unit_that_the_file_gives(
    tmp_path: Path, word: str, unit_m: float
) -> None:
    channels = channels_of(1)
    channels[3:5] *= 1e-3 / unit_m
    path = write_c3d(
        tmp_path / "a.c3d",
        body(),
        kinds=[1],
        channels=channels,
        corners=[turned(R_LP)],
        origins=[[0.0, 0.0, 0.0]],
        analog_units=["N"] * 3 + [word] * 2 + ["Nmm"],
    )
    recording = read(path)
    np.testing.assert_allclose(recording.total_wrench()[5], expected_wrench(R_LP), rtol=1e-4, atol=2e-2)
    said = [note for note in map(str, recording.notes) if "unknown unit 'furlong' of its centre of pressure" in note]
    assert bool(said) == (word == "furlong")
