"""An output folder is replaced as a whole, and only if it is ours."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from dynakin.errors import OutputError
from dynakin.files import unfinished
from dynakin.pipeline import result as result_module
from dynakin.pipeline.result import Result
from dynakin.results.estimate import Estimate
from dynakin.results.files.folder import check_output_writable, replacing
from support.estimates.synthetic import make_estimate


@pytest.fixture(scope="module")
def small() -> Estimate:
    return make_estimate(1.0)


def test_an_earlier_output_is_replaced(small: Estimate, tmp_path: Path) -> None:
    out = tmp_path / "out"
    Result(small).save(out)
    (out / "metrics.json").write_text("{}")
    Result(small).save(out)
    assert len((out / "metrics.json").read_text()) > 100
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


def test_what_a_killed_process_left_goes_and_nothing_else(small: Estimate, tmp_path: Path) -> None:
    code = "from pathlib import Path; from dynakin.files import unfinished; print(unfinished(Path()).name)"
    gone = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    left = tmp_path / gone.stdout.strip()
    mine, other = unfinished(tmp_path), tmp_path / ".dynakin-old-abc"
    elsewhere = tmp_path / left.name.replace(left.name[9:17], "00000000")  # of another computer
    for folder in (left, mine, other, elsewhere):
        folder.mkdir()
        (folder / "moments.sto").write_text("half of it")
    (tmp_path / f"{left.name}.csv").write_text("half of it")
    Result(small).save(tmp_path / "out")
    assert {entry.name for entry in tmp_path.iterdir()} == {"out", mine.name, other.name, elsewhere.name}


def test_a_link_to_a_folder_stays_one(small: Estimate, tmp_path: Path) -> None:
    (tmp_path / "elsewhere" / "real").mkdir(parents=True)
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "elsewhere" / "real")
    for _ in range(2):
        Result(small).save(link)
        assert link.is_symlink() and (tmp_path / "elsewhere" / "real" / "report.html").exists()
    assert [entry.name for entry in (tmp_path / "elsewhere").iterdir()] == ["real"]
    (tmp_path / "round").symlink_to(tmp_path / "round")
    with pytest.raises(OutputError, match="cannot write results there"):
        Result(small).save(tmp_path / "round")


def test_overwriting_can_be_forbidden(small: Estimate, tmp_path: Path) -> None:
    Result(small).save(tmp_path / "out")
    with pytest.raises(OutputError, match="already holds results"):
        Result(small).save(tmp_path / "out", overwrite=False)


def test_an_empty_folder_and_missing_parents_are_fine(small: Estimate, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert (Result(small).save(tmp_path / "empty") / "report.html").exists()
    assert (Result(small).save(tmp_path / "a" / "b" / "out") / "report.html").exists()


def test_a_folder_of_somebody_else_is_left_alone(small: Estimate, tmp_path: Path) -> None:
    (tmp_path / "thesis.docx").write_text("years of work")
    with pytest.raises(OutputError, match=r"thesis\.docx"):
        Result(small).save(tmp_path)
    assert (tmp_path / "thesis.docx").read_text() == "years of work"


def test_a_foreign_file_in_our_own_output_stops_the_replacement(small: Estimate, tmp_path: Path) -> None:
    out = Result(small).save(tmp_path / "out")
    (out / "notes.txt").write_text("mine")
    with pytest.raises(OutputError, match=r"notes\.txt"):
        check_output_writable(out)
    (out / "notes.txt").unlink()
    (out / ".DS_Store").write_text("")
    assert check_output_writable(out) == out


def test_the_home_folder_is_where_a_shell_has_it(
    small: Estimate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert Result(small).save("~/out") == tmp_path / "out"
    assert check_output_writable("~/other") == tmp_path / "other"
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        check_output_writable(tmp_path / "out")
    with pytest.raises(OutputError, match="is a file"):
        check_output_writable(tmp_path / "out" / "below")


def test_a_place_that_cannot_be_written_is_refused() -> None:
    with pytest.raises(OutputError, match="cannot write"):
        check_output_writable("/proc/dynakin/out")


def test_checking_leaves_nothing_behind(tmp_path: Path) -> None:
    check_output_writable(tmp_path / "a" / "out")
    assert list(tmp_path.iterdir()) == []


def test_a_failure_half_way_leaves_what_was_there(
    small: Estimate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = Result(small).save(tmp_path / "out")
    before = (out / "metrics.json").read_bytes()

    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(result_module, "write_netcdf", full_disk)
    with pytest.raises(OutputError, match="No space left on device"):
        Result(small).save(out)
    assert (out / "metrics.json").read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["out"]


def test_an_error_of_another_kind_passes_and_cleans_up(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), replacing(tmp_path / "out") as made:
        (made / "metrics.json").write_text("{}")
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
