"""Tables of the documentation that a benchmark writes: what stands between ``<!-- NAME: begin -->`` and its end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"


def put(page: str, name: str, lines: Sequence[str]) -> None:
    """These lines in the place of what ``docs/<page>`` has under this name.

    Raises
    ------
    SystemExit
        The page has no such place.
    """
    path = DOCS / page
    begin, end = (f"<!-- {name}: {which} -->" for which in ("begin", "end"))
    before, _, rest = path.read_text(encoding="utf-8").partition(begin)
    _, mark, after = rest.partition(end)
    if not mark:
        raise SystemExit(f"{path} lacks {begin} and {end}")
    path.write_text("\n".join([before + begin, "", *lines, "", end + after]), encoding="utf-8")
