"""Tables of the documentation that a benchmark writes: what stands between ``<!-- NAME: begin -->`` and its end, the
first line of which says of which state of the program it is."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"


def put(page: str, name: str, lines: Sequence[str]) -> None:
    """These lines in the place of what ``docs/<page>`` has under this name, and above them of what build they are.

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
    path.write_text("\n".join([before + begin, made_with(), "", *lines, "", end + after]), encoding="utf-8")


def made_with() -> str:
    """The commit that is checked out, whether its sources were changed since, and the day."""
    commit = _git("rev-parse", "--short=8", "HEAD") or "a tree without git"
    changed = " with changes that are not committed" if _git("status", "--porcelain", "--", "src", "cpp") else ""
    return f"*Made with {commit}{changed}, {datetime.now(UTC):%Y-%m-%d}.*"


def _git(*arguments: str) -> str:
    """What git says, "" where it has nothing to say: sources without their history."""
    try:
        done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
