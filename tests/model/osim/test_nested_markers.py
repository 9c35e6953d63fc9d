"""Markers of version 4 that stand in bodies, frames or the model itself are the model's as those of its MarkerSet."""

from __future__ import annotations

from pathlib import Path

import pytest

from dynakin.model.opensim.read import read_osim
from support.osim.files import version_4

PIN = version_4("PinJoint", ("q",))
START, END = PIN.index("<Marker name"), PIN.index("</Marker>") + len("</Marker>")


def marker(parent: str, location: str = "0.1 0.2 0.3") -> str:
    return (
        f'<components><Marker name="m"><socket_parent_frame>{parent}</socket_parent_frame>'
        f"<location>{location}</location></Marker></components>"
    )


FRAME = (
    '<components><PhysicalOffsetFrame name="f"><socket_parent>..</socket_parent><translation>0.1 0 0</translation>'
    f"<orientation>0 0 0</orientation>{marker('..', '0 0.2 0.3')}</PhysicalOffsetFrame></components>"
)


@pytest.mark.parametrize(
    ("before", "nested"),
    [
        ('<Body name="tip">', marker("..")),
        ('<Body name="tip">', FRAME),
        ("<gravity>", marker("/bodyset/tip")),
    ],
)
def test_a_nested_marker_is_read(tmp_path: Path, before: str, nested: str) -> None:
    text = PIN[:START] + PIN[END:]
    at = text.index(before) + (len(before) if before.startswith("<Body") else 0)
    path = tmp_path / "nested.osim"
    path.write_text(PIN)
    (usual,) = read_osim(path).markers
    path.write_text(text[:at] + nested + text[at:])
    (found,) = read_osim(path).markers
    assert (found.name, found.body) == (usual.name, usual.body)
    assert found.location == pytest.approx(usual.location)
