"""Text files whose intent is clear are read as the plain file is, with a note where something was taken for something;
where it is not, they are refused in one line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.formats.mot import read_table
from dynakin.recordings.read import read
from support.made_recordings import TRC_TOP

N = 24
NAMES = ("RKNE", "RANK", "RHEE", "RTOE", "RASI", "RPSI")
PLACES = 1000.0 * (
    np.random.default_rng(4).uniform([0, 0, -0.3], [0.3, 1.2, 0.3], (1, len(NAMES), 3))
    + 0.002 * np.arange(N)[:, None, None]
)


def rows(times: np.ndarray, factor: float = 1.0) -> list[list[str]]:
    return [[f"{t:.6f}", *(f"{v:.5f}" for v in factor * PLACES[k].ravel())] for k, t in enumerate(times)]


def trc_text(times: np.ndarray | None = None, rate: float = 100.0) -> str:
    times = np.arange(N) / 100.0 if times is None else times
    axes = "\t".join(f"{a}{k}" for k in range(1, len(NAMES) + 1) for a in "XYZ")
    top = TRC_TOP.splitlines()[:2]
    body = "\n".join(f"{k + 1}\t" + "\t".join(cells) for k, cells in enumerate(rows(times)))
    values = f"{rate:g}\t{rate:g}\t{N}\t{len(NAMES)}\tmm\t{rate:g}\t1\t{N}"
    names = "Frame#\tTime\t" + "\t\t\t".join(NAMES) + "\t\t"
    return "\n".join([*top, values, names, f"\t\t{axes}", "", body]) + "\n"


def csv_text() -> str:
    head = ["time", *(f"{name}_{axis}" for name in NAMES for axis in "xyz")]
    return "\n".join(",".join(cells) for cells in [head, *rows(np.arange(N) / 100.0, 1e-3)]) + "\n"


def mot_text() -> str:
    head = ["time", *(f"{name}_{axis}" for name in NAMES for axis in "xyz")]
    body = "\n".join("\t".join(cells) for cells in [head, *rows(np.arange(N) / 100.0)])
    return f"forces\nversion=1\nnRows={N}\nnColumns={len(head)}\ninDegrees=no\nendheader\n{body}\n"


def put(folder: Path, name: str, text: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def commas(text: str) -> str:
    return re.sub(r"(?<=\d)\.(?=\d)", ",", text)


def quoted(text: str, separator: str) -> str:
    lines = [separator.join(f'"{cell}"' for cell in line.split(separator)) for line in text.splitlines()]
    return "\n".join(lines) + "\n"


def body_only(text: str, change: Callable[[str], str]) -> str:
    """The lines of numbers changed, those of the header not."""
    lines = text.splitlines(keepends=True)
    first = next(k for k, line in enumerate(lines) if re.match(r"(1\t)?0\.0+[\t,;]", line))
    return "".join(lines[:first]) + "".join(change(line) for line in lines[first:])


EVERYWHERE = [
    pytest.param(lambda t: t, id="plain"),
    pytest.param(lambda t: ("\ufeff" + t).encode(), id="BOM"),
    pytest.param(lambda t: t.encode("utf-16"), id="UTF-16"),
    pytest.param(lambda t: b"\xfe\xff" + t.encode("utf-16-be"), id="UTF-16 big end"),
    pytest.param(lambda t: t.replace("\n", "\r\n"), id="CRLF"),
    pytest.param(lambda t: t.replace("\n", "\r"), id="CR"),
    pytest.param(lambda t: t + "\n\n  \n", id="blank lines at the end"),
]
TABS = [
    pytest.param(commas, id="decimal commas"),
    pytest.param(lambda t: body_only(t, lambda line: line.replace("\t", "\t\t")), id="doubled tabs"),
    pytest.param(lambda t: body_only(t, lambda line: line.rstrip("\n") + "\t\t\t\n"), id="trailing columns"),
    pytest.param(lambda t: t + "\t" * 8 + "\n", id="trailing row"),
    pytest.param(lambda t: body_only(t, lambda line: quoted(line, "\t")), id="quoted"),
]


@pytest.mark.parametrize("change", [
    *EVERYWHERE, *TABS,
    pytest.param(lambda t: t.replace("\tRKNE\t", "\t RKNE \t").replace("\tRANK\t", '\t"RANK"\t'), id="names"),
    pytest.param(lambda t: t.replace(f"\t{N}\t6\tmm", "\t999\t2\tmm"), id="counts"),
    pytest.param(lambda t: t.replace("100\t100\t", "100\t\t100\t\t"), id="doubled tabs of the header"),
])  # fmt: skip
def test_trc(tmp_path: Path, change: Callable[[str], str | bytes]) -> None:
    recording = read(put(tmp_path, "a.TRC", change(trc_text())))
    assert recording.marker_names == NAMES
    np.testing.assert_allclose(recording.markers, 1e-3 * PLACES, atol=1e-8)
    np.testing.assert_allclose(recording.time, np.arange(N) / 100.0)


@pytest.mark.parametrize("change", [
    *EVERYWHERE, *TABS,
    pytest.param(lambda t: t.replace(f"nRows={N}", "nRows=999").replace("nColumns=19", "nColumns=3"), id="counts"),
    pytest.param(lambda t: t.replace("\tRKNE_x\t", "\t RKNE_x \t"), id="names"),
])  # fmt: skip
def test_mot(tmp_path: Path, change: Callable[[str], str | bytes]) -> None:
    table = read_table(put(tmp_path, "a.mot", change(mot_text())))
    np.testing.assert_allclose(table.values, PLACES.reshape(N, -1), atol=1e-5)
    assert table.names[0] == "RKNE_x" and len(table.names) == 18


@pytest.mark.parametrize("change", [
    *EVERYWHERE,
    pytest.param(lambda t: commas(t.replace(",", ";")), id="semicolons, decimal commas"),
    pytest.param(lambda t: commas(t.replace(",", "\t")), id="tabs, decimal commas"),
    pytest.param(lambda t: t.replace(",", ";"), id="semicolons"),
    pytest.param(lambda t: quoted(t, ","), id="quoted"),
    pytest.param(lambda t: quoted(t, ",").replace(".", ","), id="quoted decimal commas"),
    pytest.param(lambda t: t.replace("\n", ",,,\n"), id="trailing columns"),
    pytest.param(lambda t: t + "," * 18 + "\n", id="trailing row"),
    pytest.param(lambda t: t.replace("_x", ".X").replace("_y", ".Y").replace("_z", ".Z"), id="spelling of axes"),
    pytest.param(lambda t: t.replace("time,", "Time (s) , "), id="spelling of time"),
    pytest.param(lambda t: "# made by hand\n" + t, id="remark"),
])  # fmt: skip
def test_csv(tmp_path: Path, change: Callable[[str], str | bytes]) -> None:
    recording = read(put(tmp_path, "a.csv", change(csv_text())))
    assert recording.marker_names == NAMES
    np.testing.assert_allclose(recording.markers, 1e-3 * PLACES, atol=1e-5)


def test_what_was_taken_is_said(tmp_path: Path) -> None:
    def said(text: str) -> str:
        return " ".join(map(str, read(put(tmp_path, "a.trc", text)).notes))

    assert said(trc_text()) == ""
    assert "decimal commas" in said(commas(trc_text()))
    assert "The header says 999 frames, the file holds 24" in said(trc_text().replace(f"\t{N}\t6\t", "\t999\t6\t"))
    counted = read_table(put(tmp_path, "a.mot", mot_text().replace(f"nRows={N}", "nRows=999"))).notes
    assert list(map(str, counted)) == [
        "a.mot: the header says 999 rows, the file holds 24 (has it been cut off?): all of these are used."
    ]
    doubled = said(trc_text().replace("RANK", "RKNE"))
    assert "Warning: marker 'RKNE' is in the file 2 times, at different places: 'RKNE (1)' and 'RKNE (2)'" in doubled
    assert "'furlong' is not known: mm taken" in said(trc_text().replace("\tmm\t", "\tfurlong\t"))


@pytest.mark.parametrize("factor", [1.0, 100.0, 1000.0])
def test_a_csv_in_another_unit(tmp_path: Path, factor: float) -> None:
    head = ["time", *(f"{name}_{axis}" for name in NAMES for axis in "xyz")]
    lines = [head, *rows(np.arange(N) / 100.0, 1e-3 * factor)]
    recording = read(put(tmp_path, "a.csv", "\n".join(",".join(cells) for cells in lines)))
    np.testing.assert_allclose(recording.markers, 1e-3 * PLACES, atol=1e-5)
    assert any("taken, as the markers span" in note for note in map(str, recording.notes)) == (factor != 1.0)


@pytest.mark.parametrize(("rate", "decimals"), [(200.0, 2), (120.0, 2), (59.94, 2), (60.0, 2), (1000.0, 2), (250.0, 3)])
@pytest.mark.parametrize("in_header", [True, False])
def test_rounded_times_are_put_back_on_their_grid(tmp_path: Path, rate: float, decimals: int, in_header: bool) -> None:
    exact = 1.5 + np.arange(N) / rate
    text = trc_text(np.round(exact, decimals), rate if in_header else 0.0)
    recording = read(put(tmp_path, "a.trc", text))
    even = np.diff(recording.time)
    assert np.ptp(even) < 1e-9 and (even > 0).all()
    np.testing.assert_allclose(recording.time, exact, atol=0.6 * 10.0**-decimals)
    if in_header:
        assert recording.rate == pytest.approx(rate)
    rounded = not np.allclose(np.round(exact, decimals), exact, atol=1e-9)
    assert any("Times are rounded" in note for note in map(str, recording.notes)) == rounded


@pytest.mark.parametrize("twice", [2, 11])
def test_a_row_that_stands_twice_is_no_rounding(tmp_path: Path, twice: int) -> None:
    exact = np.insert(np.arange(N - 1) / 100.0, twice, twice / 100.0)
    with pytest.raises(RecordingError, match="does not come after"):
        read(put(tmp_path, "a.trc", trc_text(np.round(exact, 2), 100.0)))


def test_a_lost_frame_is_no_rounding(tmp_path: Path) -> None:
    exact = np.delete(np.arange(N + 1) / 60.0, 11)
    recording = read(put(tmp_path, "a.trc", trc_text(np.round(exact, 2), 60.0)))
    np.testing.assert_allclose(recording.time, np.round(exact, 2))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda t: t.replace("0.010000\t", "0,010000\t"),
            "found '0,010000' in column 'Time'",
        ),  # both kinds of decimals
        (lambda t: body_only(t, lambda line: line.replace("\t", "\t\t", 3)), "columns, expected 20"),
        (lambda t: body_only(t, lambda line: line.replace("\n", "\t1.5\n")), "found 21 columns, expected 20"),
        (lambda t: t.replace("0.010000", "0.020000", 1), "does not come after"),
    ],
)
def test_what_is_not_clear_is_refused(tmp_path: Path, change: Callable[[str], str], words: str) -> None:
    with pytest.raises(RecordingError) as caught:
        read(put(tmp_path, "a.trc", change(trc_text())))
    assert words in str(caught.value) and re.search(r"a\.trc, line \d+: ", str(caught.value))
    assert "\n" not in str(caught.value)
