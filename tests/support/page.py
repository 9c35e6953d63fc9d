"""What tests read of a page: the structure of its HTML, and the numbers of its player."""

from __future__ import annotations

import base64
from html.parser import HTMLParser
from typing import Any

import numpy as np

from dynakin.report.sections.section import Section


class Structure(HTMLParser):
    """Checks that tags close in order and keeps ids and addresses."""

    VOID = frozenset({"meta", "link", "br", "img", "hr", "input"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        self._keep(attrs)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._keep(attrs)

    def _keep(self, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if key == "id":
                self.ids.append(str(value))
            if key in ("src", "href", "xlink:href"):
                self.addresses.append(str(value))

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()


def shown(section: Section | None) -> Section:
    """A section that has to be there."""
    assert section is not None
    return section


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    """What the player's `unpack` gives."""
    codes, code, place = [], 0, 0
    for byte in base64.b64decode(packed["values"]):
        code, place = code + ((byte & 127) << place), place + 7
        if byte < 128:
            codes.append(code)
            code, place = 0, 0
    columns = np.array(codes, dtype=float).reshape(packed["columns"], -1)
    changes = np.where(columns % 2, (columns - 1) / 2, -columns / 2)
    return np.where(columns > 0, packed["step"] * np.cumsum(changes, axis=1), np.nan).T
