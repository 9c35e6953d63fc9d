"""Sentences begin with a capital, names with what they begin with."""

from __future__ import annotations

import pytest

from dynakin.results.naming import sentence


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plate 2 carries nothing", "Plate 2 carries nothing"),
        ("plates' zero", "Plates' zero"),
        ("left, and right", "Left, and right"),
        ("r_sh2, r.ASIS look swapped", "r_sh2, r.ASIS look swapped"),
        ("rASI is lost", "rASI is lost"),
        ("short.mot has forces", "short.mot has forces"),
        ("c3d files", "c3d files"),
        ("", ""),
    ],
)
def test_names_keep_their_case(text: str, shown: str) -> None:
    assert sentence(text) == shown
