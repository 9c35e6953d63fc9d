"""A disk that takes no more leaves a whole file, the one before, or none."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from dynakin.errors import ConfigError, DynakinError, OutputError
from dynakin.files import whole_file, write_csv, write_json, write_text
from dynakin.report.paper_figures.figures import save_figures
from dynakin.results.estimate import Estimate
from dynakin.results.files.netcdf import write_netcdf
from dynakin.settings import presets
from dynakin.settings.presets import write_preset


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """What a full disk does, by the limit of a process."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_text_is_whole_or_what_was_there_before(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    with files_of_at_most(1000), pytest.raises(ConfigError, match=r"a\.toml: cannot be written \(File too large\)"):
        write_text(file, "x" * 5000, ConfigError)
    assert list(tmp_path.iterdir()) == []
    write_text(file, "before", ConfigError)
    with files_of_at_most(1000), pytest.raises(OutputError):
        write_preset(file, presets.default(), "default", ["x" * 5000])
    assert file.read_text() == "before" and list(tmp_path.iterdir()) == [file]
    for write in (write_json, write_csv):
        with files_of_at_most(1000), pytest.raises(OSError, match="too large"):
            write(file, [{"a": "x" * 5000}])  # type: ignore[operator]
        assert file.read_text() == "before"


def test_what_a_link_leads_to_is_written_and_errors_name_the_file(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    link = tmp_path / "link.toml"
    link.symlink_to(tmp_path / "folder" / "file.toml")
    write_text(link, "text", ConfigError)
    assert link.is_symlink() and (tmp_path / "folder" / "file.toml").read_text() == "text"
    with pytest.raises(OSError, match=r"no/file\.toml"), whole_file(tmp_path / "no" / "file.toml") as made:
        made.write_text("text")


def test_figures_are_whole_or_absent(estimate: Estimate, tmp_path: Path) -> None:
    with files_of_at_most(20_000), pytest.raises(DynakinError, match="cannot write figures there"):
        save_figures(estimate, tmp_path, ("svg",))
    for file in tmp_path.iterdir():
        assert file.suffix == ".svg" and file.read_text().rstrip().endswith("</svg>")


def test_an_estimate_that_the_disk_does_not_take_is_said_to_be_too_large(estimate: Estimate, tmp_path: Path) -> None:
    """The netCDF library says that permission was denied, or "HDF error"."""
    with files_of_at_most(20_000), pytest.raises(OSError, match="too large"):
        write_netcdf(estimate, tmp_path / "estimate.nc")
