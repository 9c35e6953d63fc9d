"""What laboratories' C3D files hold: doubled names, outputs of models, events, analog channels, measures of the person,
groups that are missing. Files written byte by byte (`support.made_c3d`), and what is known of the real ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.formats.c3d import read_c3d_results
from dynakin.recordings.read import read
from dynakin.recordings.recording import Event
from support.made_c3d import made_c3d

T = 40


def place(*metres: float) -> np.ndarray:
    """Trajectory (T, 3) mm that moves by 2 mm a frame."""
    return 1e3 * np.array(metres) + 2.0 * np.arange(T)[:, None] * [1.0, 0.0, 0.0]


BODY = {"LASI": place(0.1, 0.1, 1.0), "RASI": place(0.1, -0.1, 1.0), "LHEE": place(0, 0.1, 0.0), "C7": place(0, 0, 1.5)}


def notes(path: Path) -> str:
    return " ".join(map(str, read(path).notes))


# --- points


def test_axes_and_centres_of_mass_are_no_markers(tmp_path: Path) -> None:
    origin = place(0, 0, 1.0)
    # A turning frame, axes of equal length that changes, as Plug-in Gait writes them
    turn = np.stack([[np.cos(a), np.sin(a), 0.0] for a in 0.01 * np.arange(T)])
    size = 300.0 + 0.5 * np.arange(T)[:, None]
    across, up = np.column_stack([-turn[:, 1], turn[:, 0], 0 * size]), np.array([0.0, 0.0, 1.0])
    axes = {
        "S:PELO": origin,
        "S:PELA": origin + size * turn,
        "S:PELL": origin + size * across,
        "S:PELP": origin + size * up,
        "FEMUR_O": origin,
        "FEMUR_X": origin + turn,
        "FEMUR_Y": origin + across,
        "FEMUR_Z": origin + up,
    }
    points = {**BODY, **axes, "CentreOfMass": origin, "CentreOfMassFloor": origin, "LKNE": place(0, 0.1, 0.5)}
    groups = {"POINT": {"MODELED_MARKERS": ["CentreOfMass", "LKNE"], "TYPE_GROUPS": ["MODELED_MARKERS", "X"]}}
    recording = read(made_c3d(tmp_path / "a.c3d", points, groups))
    assert recording.marker_names == (*BODY, "LKNE")
    said = " ".join(map(str, recording.notes))
    assert "8 ends of segments' axes are no markers and left out: S:PELO-A-L-P, FEMUR_O-X-Y-Z." in said
    assert "Computed centre of mass is no marker and left out: CentreOfMass, CentreOfMassFloor." in said


def test_markers_whose_names_only_look_like_axes_stay(tmp_path: Path) -> None:
    four = {f"LFO{k}": place(*p) for k, p in zip("OALP", np.diag([0.1, 0.2, 0.15, 1.0])[:, :3] + 0.1, strict=True)}
    assert read(made_c3d(tmp_path / "a.c3d", {**BODY, **four})).marker_names == (*BODY, *four)


def test_outputs_are_known_by_their_lists_or_by_their_names(tmp_path: Path) -> None:
    angles = {"LHipAngles": place(0.01, 0, 0), "RKneeMoment_1": place(0, 0, 0.01), "Custom": place(0, 0.01, 0)}
    angles["LHipAngles"][5] = 0.0
    listed = {"POINT": {"TYPE_GROUPS": ["MYGROUP", "MY"], "MYGROUP": ["Custom"]}}
    path = made_c3d(tmp_path / "a.c3d", {**BODY, **angles}, listed)
    assert read(path).marker_names == tuple(BODY)
    results = read_c3d_results(path)
    assert list(results) == list(angles)
    assert np.isnan(results["LHipAngles"][5]).all()
    np.testing.assert_allclose(results["LHipAngles"][6], [10.0 + 12.0, 0.0, 0.0])
    assert "3 computed points left out: LHipAngles, RKneeMoment_1, Custom." in notes(path)


@pytest.mark.parametrize(
    ("second", "names", "said"),
    [
        ("empty", ("LHEE",), "never at different places: taken as one"),
        ("same", ("LHEE",), "never at different places: taken as one"),
        ("rounded", ("LHEE",), "never at different places: taken as one"),
        ("later", ("LHEE",), "never at different places: taken as one"),  # fragments of one trajectory
        ("seldom", ("LHEE", "LHEE (2)"), "at different places: 'LHEE' and 'LHEE (2)'"),
        ("other", ("LHEE (1)", "LHEE (2)"), "at different places: 'LHEE (1)' and 'LHEE (2)'"),
    ],
)
@pytest.mark.parametrize("first", [True, False])
def test_doubled_names(tmp_path: Path, second: str, names: tuple[str, ...], said: str, first: bool) -> None:
    one = BODY["LHEE"].copy()
    other = np.zeros_like(one) if second == "empty" else one.copy()
    if second == "rounded":
        other = np.round(other)
    if second == "later":
        one[20:], other[:20] = 0.0, 0.0
    if second in ("seldom", "other"):
        other += 300.0
    if second == "seldom":
        other[10:] = 0.0
    pairs = [(name, p) for name, p in BODY.items() if name != "LHEE"]
    pairs += [("LHEE", one), ("LHEE", other)] if first else [("LHEE", other), ("LHEE", one)]
    recording = read(made_c3d(tmp_path / "a.c3d", pairs))
    assert set(recording.marker_names) == {"LASI", "RASI", "C7", *names}
    assert any("'LHEE' is in the file 2 times" in note and said in note for note in map(str, recording.notes))
    if "LHEE" in names:
        np.testing.assert_allclose(recording.marker("LHEE"), 1e-3 * BODY["LHEE"], atol=5e-4)


def test_more_than_255_points_and_late_frames(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = {f"M{k}": place(*rng.uniform(0, 1.5, 3)) for k in range(300)}
    words = {"ACTUAL_START_FIELD": np.array([70001 % 65536, 1]), "ACTUAL_END_FIELD": np.array([70040 % 65536, 1])}
    event = {"USED": 1, "CONTEXTS": ["Left"], "LABELS": ["Foot Strike"], "TIMES": np.array([[11.0], [40.2]])}
    path = made_c3d(tmp_path / "a.c3d", points, {"TRIAL": words, "EVENT": event}, first=70001)
    recording = read(path)
    assert recording.marker_names == tuple(points)
    np.testing.assert_allclose(recording.markers[:, 299], 1e-3 * points["M299"], atol=1e-6)
    assert "Time 0 is frame 70001 of the capture (700 s after its start)." in map(str, recording.notes)
    assert recording.events == (Event(pytest.approx(0.2, abs=1e-4), "Foot Strike", "left"),)


def test_a_start_that_is_no_whole_number_is_refused(tmp_path: Path) -> None:
    path = made_c3d(tmp_path / "a.c3d", BODY, {"TRIAL": {"ACTUAL_START_FIELD": np.array([1.5, 1.0])}})
    with pytest.raises(RecordingError, match=r"a\.c3d: found 1\.5 in TRIAL:ACTUAL_START_FIELD, expected whole numbers"):
        read(path)


def test_integer_data_and_hidden_points(tmp_path: Path) -> None:
    seen = np.ones((T, len(BODY)), dtype=bool)
    seen[7, 2] = False
    recording = read(made_c3d(tmp_path / "a.c3d", BODY, scale=0.1, seen=seen))
    assert np.isnan(recording.marker("LHEE")[7]).all() and np.isnan(recording.markers).sum() == 3
    np.testing.assert_allclose(recording.marker("C7"), 1e-3 * BODY["C7"], atol=6e-5)


@pytest.mark.parametrize(
    ("unit", "factor", "said"),
    [
        ("cm", 0.1, "The file's unit of length is cm; markers are written back in metres."),
        ("inches", 1 / 25.4, "The file's unit of length is inches; markers"),
        (None, 1.0, "names no length unit: mm taken, as the markers span 1500 of them"),
        (None, 1e-3, "names no length unit: m taken, as the markers span 1.5 of them"),
        ("", 0.1, "names no length unit: cm taken, as the markers span 150 of them"),
        ("furlong", 1.0, "The length unit 'furlong' is not known: mm taken"),
    ],
)
def test_units_of_length(tmp_path: Path, unit: str | None, factor: float, said: str) -> None:
    points = {name: factor * values for name, values in BODY.items()}
    recording = read(made_c3d(tmp_path / "a.c3d", points, unit=unit))
    np.testing.assert_allclose(recording.marker("C7"), 1e-3 * BODY["C7"], rtol=1e-5)
    assert any(said in note for note in map(str, recording.notes))
    assert recording.length_unit == ("mm" if factor == 1.0 else "m")


@pytest.mark.parametrize(("padding", "described"), [(0, 127), (0, 128), (1, 0), (3, 255), (2, 20)])
def test_parameters_that_ezc3d_cannot_read_are_written_anew(tmp_path: Path, padding: int, described: int) -> None:
    analog = np.arange(8.0 * T)[None]
    groups = {"PROCESSING": {"Bodymass": 70.0}, "ANALOG": {"LABELS": ["EMG"]}}
    path = made_c3d(
        tmp_path / "a.c3d", BODY, groups, analog=analog, per_frame=8, analog_rate=790.0, padding=padding,
        description="d" * described,
    )  # fmt: skip
    before = path.read_bytes()
    recording = read(path)
    assert recording.marker_names == tuple(BODY) and recording.subject == {"mass_kg": 70.0}
    np.testing.assert_allclose(recording.marker("C7"), 1e-3 * BODY["C7"], rtol=1e-6)
    np.testing.assert_array_equal(recording.analog[0].values, analog[0])
    assert path.read_bytes() == before
    with pytest.raises(RecordingError, match="where the next record begins"):
        read(made_c3d(tmp_path / "b.c3d", BODY, padding=4))


# --- events and analog channels


def test_analog_channels_and_their_windows(tmp_path: Path) -> None:
    analog = np.stack([np.arange(8.0 * T), np.sin(np.arange(8 * T))])
    groups = {"ANALOG": {"LABELS": ["EMG1", "Trigger"], "UNITS": ["mV", "V"]}}
    recording = read(made_c3d(tmp_path / "a.c3d", BODY, groups, analog=analog, per_frame=8, analog_rate=790.0))
    emg, trigger = recording.analog
    assert (emg.name, emg.unit, emg.rate_hz, trigger.name) == ("EMG1", "mV", pytest.approx(800.0), "Trigger")
    np.testing.assert_array_equal(emg.values, analog[0])
    np.testing.assert_allclose(emg.time, np.arange(8 * T) / 800.0)
    part = recording.window(0.1, 0.2)
    np.testing.assert_array_equal(part.analog[0].values, analog[0][80 : 8 * 21])
    assert part.analog[1].time[0] == pytest.approx(part.time[0])
    assert any("ANALOG:RATE says 790" in note for note in map(str, recording.notes))


@pytest.mark.parametrize(
    ("scale", "said", "offset"),
    [
        (0.1, "UNSIGNED", 32768),
        (0.1, "UNSIGNED", 40000),
        (0.1, None, 32768),  # no signed word lies below it
        (0.1, "UNSIGNED", 2048),  # of 12 bits
        (0.1, "SIGNED", -5),
        (0.1, None, -5),
        (-1.0, "SIGNED", -5),
        (-1.0, "UNSIGNED", 40000),
    ],
)
def test_analog_words_and_offsets_have_the_sign_that_the_file_gives(
    tmp_path: Path, scale: float, said: str | None, offset: int
) -> None:
    """Integers from -20 to 19 steps of 0.5 about the offset."""
    steps = np.arange(T) - 20.0
    words = steps + offset
    if scale > 0.0:
        words = (words + 32768.0) % 65536.0 - 32768.0  # as they are written
    analog = {"SCALE": [0.5], "OFFSET": [offset], "GEN_SCALE": 1.0, "FORMAT": said}
    path = made_c3d(tmp_path / "a.c3d", BODY, {"ANALOG": analog}, scale=scale, analog=words[None])
    np.testing.assert_allclose(read(path).analog[0].values, 0.5 * steps)


def test_events(tmp_path: Path) -> None:
    times = np.array([[0.0, 0.0, 0.0], [10.3, 10.1, 99.0]])
    event = {"USED": 3, "CONTEXTS": ["Right", "General", "Left"], "LABELS": ["Foot Off", "Go", "Foot Strike"]}
    recording = read(made_c3d(tmp_path / "a.c3d", BODY, {"EVENT": event | {"TIMES": times}}, first=1001))
    assert [(e.label, e.side, round(e.time_s, 4)) for e in recording.events] == [
        ("Go", "", 0.1),
        ("Foot Off", "right", 0.3),
    ]
    assert "1 of 3 events lie outside the file's frames: left out." in map(str, recording.notes)
    assert [e.label for e in recording.window(0.2, 0.35).events] == ["Foot Off"]
    other = read(made_c3d(tmp_path / "b.c3d", BODY, {"EVENT": event | {"TIMES": 0.001 * times}}, first=1001))
    assert len(other.events) == 3
    assert any("counted from the file's first frame" in note for note in map(str, other.notes))


# --- the person


@pytest.mark.parametrize(
    ("group", "entries", "expected"),
    [
        ("PROCESSING", {"Bodymass": 81.0, "Height": 1790.0}, {"mass_kg": 81.0, "height_m": 1.79}),
        ("SUBJECTS", {"NAMES": ["Ann"], "AnnWeight": 60.0, "HEIGHT": 1.7}, {"mass_kg": 60.0, "height_m": 1.7}),
        ("SUBJECT", {"BODY_MASS_KG": 60.0, "HEIGHT_CM": 170.0}, {"mass_kg": 60.0, "height_m": 1.7}),
        ("PROCESSING", {"LLegLength": 910.0, "R_KNEE_WIDTH": 11.0}, {"leg_length_m_l": 0.91, "knee_width_m_r": 0.11}),
        (
            "PROCESSING",
            {"LeftAnkleWidth": 0.07, "RAnkleWidth": 70.0},
            {"ankle_width_m_l": 0.07, "ankle_width_m_r": 0.07},
        ),
        ("ANALYSIS", {"NAMES": ["Bodymass", "Cadence"], "VALUES": np.array([70.0, 100.0])}, {"mass_kg": 70.0}),
        ("PROCESSING", {"Bodymass": 0.0, "Height": 0.0, "LLegLength": 0.0, "LKneeWidth": 5000.0}, {}),
    ],
)
def test_what_is_said_of_the_person(tmp_path: Path, group: str, entries: dict, expected: dict) -> None:  # type: ignore[type-arg]
    assert read(made_c3d(tmp_path / "a.c3d", BODY, {group: entries})).subject == pytest.approx(expected)


# --- the recordings


def test_results_of_real_files(data_dir: Path) -> None:
    """Frames with a ground force, left and right, as the data's own table has them."""
    for name, frames in (("FMC/MH0222_BP06", (59, 62)), ("FMC/MH0222_BP15", (61, 61)), ("RBWH/bfnd w1", (79, 79))):
        path = data_dir / "c3d_parser" / f"{name}.c3d"
        results, recording = read_c3d_results(path), read(path)
        found = [int(np.isfinite(results[f"{side}GroundReactionForce"][:, 2]).sum()) for side in "LR"]
        assert tuple(found) == frames
        assert all(len(values) == recording.n_frames for values in results.values())
        assert not set(results) & set(recording.marker_names)


def test_events_of_real_files_are_where_the_plates_are_loaded(data_dir: Path) -> None:
    """The strikes on plates 2 and 3, within 30 ms of the first frame with a load: right time zero, right unit."""
    recording = read(data_dir / "c3d_parser" / "FMC" / "MH0222_BP06.c3d")
    strikes = [event.time_s for event in recording.events if event.label == "Foot Strike"]
    offs = [event.time_s for event in recording.events if event.label == "Foot Off"]
    assert (len(strikes), len(offs)) == (6, 6)
    for plate in recording.plates[1:3]:
        loaded = recording.time[np.linalg.norm(plate.force, axis=1) > 20.0]
        assert min(abs(strike - loaded[0]) for strike in strikes) < 0.03
        assert min(abs(off - loaded[-1]) for off in offs) < 0.03


def test_markers_of_real_files(data_dir: Path) -> None:
    folder = data_dir / "c3d_parser"
    walk = read(folder / "FMC" / "MH0222_BP06.c3d")
    assert sorted(walk.marker_names) == sorted(
        f"{side}{name}" for side in "LR" for name in ["ASI", "PSI", "THI", "KNE", "TIB", "ANK", "HEE", "TOE"]
    )
    alignment = read(folder / "FMC" / "MH0222_BP01.c3d")
    assert {"LKAX", "LKD1", "LKD2", "LKNE", "LMED"} <= set(alignment.marker_names)  # a modelled marker stays
    assert alignment.subject["knee_width_m_l"] == pytest.approx(0.107)
    assert len(read(data_dir / "pycgm" / "Movement_trial.c3d").marker_names) == 39
    assert len(read(data_dir / "functional" / "right_hip.c3d").marker_names) == 73


def test_a_file_of_unlabelled_points_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"\d+ unlabelled points and no marker; expected points labelled"):
        read(made_c3d(tmp_path / "a.c3d", {"*1": place(1, 1, 1), "Unlabeled 1234": place(1, 1, 2)}))
