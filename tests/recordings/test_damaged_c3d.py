"""Damaged C3D files: one clear RecordingError each, before ezc3d can hang on them or crash the interpreter.

What ezc3d 1.7.2 does without the checks stands beside each damage; a test that fails may take pytest with it.
"""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.formats import c3d
from dynakin.recordings.formats.c3d import read_c3d
from dynakin.recordings.formats.c3d_records import read_records
from support.made_recordings import write_c3d

T = 20
START = 512  # of the parameter section that ezc3d writes


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """One marker and a plate of type 2, T frames of 10 analog samples, floating-point data."""
    corners = np.array([[200.0, 300, 0], [-200, 300, 0], [-200, -300, 0], [200, -300, 0]])
    path = write_c3d(
        tmp_path_factory.mktemp("whole") / "a.c3d",
        {"LASI": np.full((T, 3), 500.0)},
        kinds=[2],
        channels=np.ones((6, 10 * T)),
        corners=[corners],
        origins=[[0.0, 0.0, -40.0]],
    )
    return path.read_bytes()


def spot(data: bytes, group: str, name: str, what: str) -> int:
    """Place of a byte of a parameter: its "group" number, "offset", "type", "dimensions" (their number),
    "dimension" (the first), "values" or "description" length."""
    at, number = START + 4, 0
    while data[at]:
        length, owner = struct.unpack("bb", data[at : at + 2])
        here = at + 2 + abs(length)
        label = data[at + 2 : here].decode()
        if owner < 0 and label == group:
            number = -owner
        if owner > 0 and owner == number and label == name:
            n_dimensions = data[here + 3]
            values = here + 4 + n_dimensions
            count = math.prod(data[here + 4 : values])
            size = {0xFF: 1}.get(data[here + 2], data[here + 2])
            places: dict[str, int] = {
                "group": at + 1,
                "offset": here,
                "type": here + 2,
                "dimensions": here + 3,
                "dimension": here + 4,
                "values": values,
                "description": values + count * size,
            }
            return places[what]
        at = here + struct.unpack("<H", data[here : here + 2])[0]
    raise AssertionError(f"{group}:{name} is not in the file")


def refused(folder: Path, data: bytes) -> str:
    path = folder / "damaged.c3d"
    path.write_bytes(data)
    with pytest.raises(RecordingError) as caught:
        read_c3d(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message.removeprefix(f"{path}: ")


def changed(data: bytes, at: int, new: bytes) -> bytes:
    return data[:at] + new + data[at + len(new) :]


def test_the_whole_file_is_read(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(whole)
    recording = read_c3d(path)
    assert (recording.n_frames, recording.marker_names, len(recording.plates)) == (T, ("LASI",), 1)


@pytest.mark.parametrize(
    ("name", "what", "byte", "expected"),
    [
        ("USED", "dimensions", 0xFF, "has -1 dimensions, expected 0 to 7"),  # segmentation fault
        ("LABELS", "dimensions", 0x80, "has -128 dimensions, expected 1 to 7"),  # segmentation fault
        ("UNITS", "dimensions", 0, "has 0 dimensions, expected 1 to 7"),  # segmentation fault: a text without length
        ("LABELS", "dimensions", 110, "has 110 dimensions, expected 1 to 7"),  # can hang
        ("LABELS", "dimension", 255, "reaches up to byte"),
        ("UNITS", "offset", 40, "where the next record begins"),
        ("UNITS", "offset", 1, "expected an end by byte"),  # points into itself: a walk that would not advance
        ("USED", "description", 0xFF, "expected an end by byte"),  # segmentation fault
        ("USED", "type", 3, "has type 3, expected -1, 1, 2 or 4"),
        ("USED", "group", 0, "is in group 0, expected 1 to 127"),
    ],
)
def test_damaged_record(tmp_path: Path, whole: bytes, name: str, what: str, byte: int, expected: str) -> None:
    message = refused(tmp_path, changed(whole, spot(whole, "POINT", name, what), bytes([byte])))
    assert message.startswith("damaged C3D parameters, ")
    assert f"parameter '{name}' at byte " in message
    assert expected in message


def test_section_without_an_end(tmp_path: Path, whole: bytes) -> None:
    last = spot(whole, "EZC3D", "CONTACT", "offset")
    message = refused(tmp_path, changed(whole, last, struct.pack("<H", 0xFFFF)))
    expected = f"at byte {last + 0xFFFF}, expected it before byte 1536, the end of the section"
    assert message.startswith("damaged C3D parameters, found the record after parameter 'CONTACT' at byte ")
    assert message.endswith(expected)
    group = b"\x01\xffA\x03\x00\x00"  # a group A, again and again, up to the data
    message = refused(tmp_path, changed(whole, START + 4, (group * 200)[: 1536 - START - 4]))
    assert "expected an end by byte 1536" in message


def test_section_that_ends_with_its_last_byte(tmp_path: Path, whole: bytes) -> None:
    end = 1536
    last = spot(whole, "EZC3D", "CONTACT", "offset")
    at = last + struct.unpack("<H", whole[last : last + 2])[0]  # of the section's terminator
    group = whole[spot(whole, "EZC3D", "CONTACT", "group")]
    filling = b""
    while left := end - 1 - at - len(filling):  # parameters of bytes until nothing is left behind the terminator
        count = min(left, 200 if left > 220 else 100) - 11
        assert count >= 0
        record = bytes([1, 1, count]) + bytes(count) + b"\0"
        filling += bytes([3, group]) + b"PAD" + struct.pack("<H", 2 + len(record)) + record
    path = tmp_path / "a.c3d"
    path.write_bytes(whole[:at] + filling + b"\0" + whole[end:])
    assert path.stat().st_size == len(whole)
    assert read_c3d(path).n_frames == T


@pytest.mark.parametrize(
    ("group", "name", "value", "expected"),
    [
        ("POINT", "SCALE", struct.pack("<f", np.nan), "POINT:SCALE holds no number, expected one"),
        ("POINT", "RATE", struct.pack("<f", 1e-30), "found 6 analog channels of 1 samples a frame"),
        ("ANALOG", "RATE", struct.pack("<f", np.inf), "ANALOG:RATE holds no number, expected one"),
        ("ROTATION", "RATIO", struct.pack("<h", -1), "found 0 rotations of 65535 samples a frame"),  # exhausts memory
    ],
)
def test_counts_that_contradict_the_header(
    tmp_path: Path, whole: bytes, group: str, name: str, value: bytes, expected: str
) -> None:
    assert expected in refused(tmp_path, changed(whole, spot(whole, group, name, "values"), value))


@pytest.mark.parametrize(
    ("group", "name", "value", "expected"),
    [
        ("POINT", "USED", struct.pack("<h", -1), "POINT:USED says 65535, the header and the file's size 1:"),
        ("POINT", "USED", struct.pack("<h", 2), "POINT:USED says 2, the header and the file's size 1:"),
        ("POINT", "SCALE", struct.pack("<f", 0.1), "POINT:SCALE says 0.1, the header and the file's size -1:"),
        ("POINT", "FRAMES", struct.pack("<h", 9999), "POINT:FRAMES says 9999, the header and the file's size 20:"),
        ("ANALOG", "RATE", struct.pack("<f", 1e30), "ANALOG:RATE says 1e+30, the header and the file's size 1000:"),
        ("ANALOG", "RATE", struct.pack("<f", 999.9), "ANALOG:RATE says 999.9, the header and the file's size 1000:"),
        ("ANALOG", "USED", struct.pack("<h", 5), "ANALOG:USED says 5, the header and the file's size 6:"),
    ],
)
def test_counts_that_the_files_size_settles(
    tmp_path: Path, whole: bytes, group: str, name: str, value: bytes, expected: str
) -> None:
    """Without the correction ezc3d exhausts memory, or reads every value after the first frame out of place."""
    path = tmp_path / "a.c3d"
    path.write_bytes(whole)
    expected_recording = read_c3d(path)
    path.write_bytes(changed(whole, spot(whole, group, name, "values"), value))
    found = read_c3d(path)
    assert any(note.startswith(expected) for note in map(str, found.notes))
    np.testing.assert_array_equal(found.markers, expected_recording.markers)
    np.testing.assert_array_equal(found.plates[0].force, expected_recording.plates[0].force)
    path.write_bytes(changed(whole, spot(whole, group, name, "values"), value) + bytes(4096))
    with pytest.raises(RecordingError):  # more than the header promises: neither is to be trusted
        read_c3d(path)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("USED", b"\xff\xff\xff\xff", "no plate read: found nan in FORCE_PLATFORM:USED"),
        ("USED", struct.pack("<f", 1.5), "no plate read: found 1.5 in FORCE_PLATFORM:USED, expected a whole number"),
        ("TYPE", struct.pack("<f", np.inf), "plate 1 left out: found type inf, expected a force plate of type 1 to 7."),
        ("TYPE", struct.pack("<f", 2.5), "plate 1 left out: found type 2.5, expected a force plate of type 1 to 7."),
        ("CHANNEL", struct.pack("<f", np.nan), "plate 1 left out: lists channels [nan, 2, 3, 4, 5, 6], expected 6"),
        ("CHANNEL", struct.pack("<f", 1.5), "plate 1 left out: lists channels [1.5, 2, 3, 4, 5, 6], expected 6"),
        ("CORNERS", struct.pack("<f", np.nan), "plate 1 left out: its corners in the file do not span a surface."),
        ("ORIGIN", struct.pack("<f", 1e30), "plate 1 left out: "),
    ],
)
def test_damaged_plates_are_left_out(tmp_path: Path, whole: bytes, name: str, value: bytes, expected: str) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(changed(whole, spot(whole, "FORCE_PLATFORM", name, "values"), value))
    recording = read_c3d(path)
    assert recording.plates == () and recording.marker_names == ("LASI",)
    assert [note for note in map(str, recording.notes) if note.startswith(f"Warning: {expected}")]


@pytest.mark.parametrize("name", ["SCALE", "OFFSET"])
def test_every_channel_has_a_scale_and_an_offset(tmp_path: Path, whole: bytes, name: str) -> None:
    """ezc3d would take those that are missing from beyond its array."""
    record = spot(whole, "ANALOG", name, "dimension")
    offset = spot(whole, "ANALOG", name, "offset")
    size = abs(struct.unpack("b", whole[spot(whole, "ANALOG", name, "type") :][:1])[0])
    values = spot(whole, "ANALOG", name, "values")
    assert whole[record] == 6
    shorter = bytearray(whole)
    shorter[record] = 2
    shorter[offset : offset + 2] = struct.pack("<H", struct.unpack("<H", whole[offset : offset + 2])[0] - 4 * size)
    del shorter[values : values + 4 * size]
    block_end = 1536 - 4 * size
    shorter[block_end:block_end] = bytes(4 * size)
    assert f"found 2 values in ANALOG:{name}, expected one for 6 channels" in refused(tmp_path, bytes(shorter))


@pytest.mark.parametrize(
    ("at", "new", "expected"),
    [
        (0, b"\x03", "found processor type"),
        (
            START + 3,
            b"\x56",
            "processor type 86 (SGI, MIPS) in the C3D parameters, expected 84 (Intel) or 85 (DEC): save",
        ),
        (0, b"\xff", "truncated C3D file, found"),
        (2, b"\xff\xff", "for 20 frames of 65535 points and 60 analog values"),
        (4, b"\x3b\x00", "expected the 59 analog values a frame of the header"),
        (8, b"\xff\xff", "for 65535 frames of 1 points"),
        (16, b"\x01\x00", "found data in block 1, expected 2 or later"),
        (16, b"\x03\x00", "expected it before byte 1024, the end of the section"),
    ],
)
def test_damaged_header(tmp_path: Path, whole: bytes, at: int, new: bytes, expected: str) -> None:
    assert expected in refused(tmp_path, changed(whole, at, new))


def floated(whole: bytes, frames: float) -> bytes:
    """With POINT:FRAMES as a float."""
    kind, values = spot(whole, "POINT", "FRAMES", "type"), spot(whole, "POINT", "FRAMES", "values")
    (offset,) = struct.unpack("<H", whole[kind - 2 : kind])
    record = struct.pack("<H", offset + 2) + b"\x04" + whole[kind + 1 : values] + struct.pack("<f", frames)
    data_start = 512 * (struct.unpack("<H", whole[16:18])[0] - 1)
    found = whole[: kind - 2] + record + whole[values + 2 : data_start - 2] + whole[data_start:]
    assert len(found) == len(whole)
    return found


def test_a_number_of_frames_that_is_a_float_is_read(tmp_path: Path, whole: bytes) -> None:
    """The user guide's way beyond 65535 frames; ezc3d asks for an integer."""
    path = tmp_path / "a.c3d"
    path.write_bytes(floated(whole, float(T)))
    recording = read_c3d(path)
    assert recording.n_frames == T
    np.testing.assert_allclose(recording.marker("LASI"), 0.5)


@pytest.mark.parametrize("frames", [np.inf, np.nan, -np.inf])
def test_a_number_of_frames_that_is_none_is_refused(tmp_path: Path, whole: bytes, frames: float) -> None:
    assert "POINT:FRAMES holds no number, expected one" in refused(tmp_path, floated(whole, frames))


def test_a_number_of_frames_beyond_the_file_gives_way_to_its_size(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(floated(whole, 1e30))
    recording = read_c3d(path)
    assert recording.n_frames == T
    np.testing.assert_allclose(recording.marker("LASI"), 0.5)
    assert any(
        "POINT:FRAMES says 65535, the header and the file's size 20" in note for note in map(str, recording.notes)
    )


@pytest.mark.parametrize(("group", "size"), [("POINT", 2), ("TRIAL", 4)])
def test_only_the_number_of_frames_of_the_points_is_rewritten(tmp_path: Path, group: str, size: int) -> None:
    def record(name: bytes, number: int, content: bytes) -> bytes:
        return struct.pack("bb", len(name), number) + name + struct.pack("<H", 2 + len(content)) + content

    section = bytes([0, 0, 1, 84]) + record(group.encode(), -1, b"\0")
    section += record(b"FRAMES", 1, b"\x04\x00" + struct.pack("<f", 7.0) + b"\0")
    groups, anew = read_records(section + bytes(8), 512, tmp_path, dec=False)
    found = groups[group]["FRAMES"]
    assert found.kind == size and found.first() == 7.0 and bool(anew) == (group == "POINT")


def test_harmless_contradictions_are_noted(tmp_path: Path, whole: bytes) -> None:
    fewer = changed(whole, spot(whole, "POINT", "FRAMES", "values"), struct.pack("<h", 12))
    elsewhere = changed(fewer, spot(whole, "POINT", "DATA_START", "values"), struct.pack("<h", 5))
    path = tmp_path / "a.c3d"
    path.write_bytes(elsewhere)
    recording = read_c3d(path)
    assert recording.n_frames == 12
    np.testing.assert_allclose(recording.marker("LASI"), 0.5)
    assert "The header says 20 frames, POINT:FRAMES 12: the latter is used." in map(str, recording.notes)
    assert any(
        "data begin in block 4, POINT:DATA_START 5: the former is used." in note for note in map(str, recording.notes)
    )


def test_names_that_are_not_utf8_can_be_printed(tmp_path: Path, whole: bytes) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(changed(whole, spot(whole, "POINT", "LABELS", "values"), "KNÖC".encode("latin-1")))
    assert read_c3d(path).marker_names == ("KNÖC",)
    path.write_bytes(changed(whole, spot(whole, "POINT", "LABELS", "values"), b"K\nE\x01"))
    assert read_c3d(path).marker_names == ("K E",)


def test_stray_exception_names_the_file(tmp_path: Path, whole: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    def stray(*_: object) -> None:
        raise IndexError("index 7 is\nout of bounds")

    monkeypatch.setattr(c3d, "read_plates", stray)
    message = refused(tmp_path, whole)
    assert message == "the C3D's parameters contradict each other (IndexError: index 7 is out of bounds)"


def _header(rng: random.Random) -> int:
    return rng.randrange(24)


def _parameters(rng: random.Random) -> int:
    return rng.randrange(START, START + 800)


@pytest.mark.parametrize("where", [_header, _parameters])
def test_random_damage_is_refused_or_read(tmp_path: Path, whole: bytes, where: Callable[[random.Random], int]) -> None:
    """A hundred seeded damages of 1 to 5 bytes; a stray exception or a crash fails."""
    rng = random.Random(3)
    outcomes = {"refused": 0, "read": 0}
    for k in range(100):
        data = bytearray(whole)
        for _ in range(rng.randint(1, 5)):
            data[where(rng)] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
        path = tmp_path / f"{k}.c3d"
        path.write_bytes(data)
        try:
            assert read_c3d(path).n_frames > 0
            outcomes["read"] += 1
        except RecordingError as error:
            assert str(path) in str(error) and "\n" not in str(error)
            outcomes["refused"] += 1
    assert outcomes["refused"] > 10
