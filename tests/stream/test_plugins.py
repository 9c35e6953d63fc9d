"""Sources and sinks of other packages, found by their entry points."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from dynakin.errors import ConfigError
from dynakin.stream.sources.plugins import SINKS, SOURCES, plugin

MODULE = """
from dynakin.stream import MarkerPacket, Sink, StreamInfo, Streams

class Source:
    def __init__(self, address, options):
        self.address, self.options = address, options

class Counter(Sink):
    frames = 0
    def frame(self, frame):
        self.frames += 1

def counter(address, options):
    return Counter()
"""
ENTRY_POINTS = """
[dynakin.sources]
mylab = their_package:Source
broken = a_package_that_is_not_there:Source

[dynakin.sinks]
counter = their_package:counter
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another package as an installer leaves it."""
    (tmp_path / "their_package.py").write_text(MODULE)
    about = tmp_path / "their_package-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "their_package", raising=False)


@pytest.mark.usefixtures("package")
def test_address_and_options_reach_the_plug_in() -> None:
    source = plugin(SOURCES, "mylab:192.168.0.5,rate=200,slow", forces="x.mot")
    assert source.address == "192.168.0.5" and source.options == {"rate": "200", "slow": "yes", "forces": "x.mot"}
    assert plugin(SINKS, "counter").frames == 0


@pytest.mark.usefixtures("package")
def test_a_package_that_is_missing_and_a_kind_that_is_unknown_are_named() -> None:
    with pytest.raises(ConfigError, match=r"broken: needs a package that is not here .*a_package_that_is_not_there"):
        plugin(SOURCES, "broken:x")
    with pytest.raises(ConfigError, match=r"'mylib' is unknown \(did you mean mylab|expected one of .*mylab:"):
        plugin(SOURCES, "mylib:x")
