"""How late an estimate may be: seconds in the settings, frames in the filter, words in the report."""

import math
from typing import Any

import pytest

from dynakin.errors import ConfigError
from dynakin.settings.lag import in_words, lag_frames
from dynakin.settings.settings import Settings


def test_a_lag_is_the_nearest_number_of_frames_and_one_at_least() -> None:
    found = [lag_frames(lag, rate) for lag, rate in ((0.05, 100.0), (0.05, 119.88), (0.02, 60.0), (0.001, 100.0))]
    assert found == [5, 6, 1, 1]
    assert lag_frames(0.0, 100.0) == 0


def test_it_is_said_in_words() -> None:
    words = [in_words(lag) for lag in (0.0, 0.05, 1.0 / 60.0, math.inf)]
    late = "as it would be live, {} ms late"
    assert words == ["as it would be live", late.format(50), late.format(16.7), "from all frames"]


@pytest.mark.parametrize("lag_s", [None, 0.0, 0.05, 1, math.inf])
def test_lags_that_can_be(lag_s: float | None) -> None:
    assert Settings.of({"lag_s": lag_s}, "test", ()).lag_s == lag_s


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"lag_s": 20.0}, r"the lag is 20.0, expected seconds \(no longer frames\), 0 to 1"),
        ({"lag_s": -0.05}, "lag_s: .*greater than or equal to 0"),
        ({"lag_s": math.nan}, "lag_s"),
        ({"lag": 5}, r"unknown key 'lag' \(did you mean 'lag_s'\?\)"),
        ({"lag_s": True}, "lag_s: .*found True"),
        ({"smooth": False}, r"'smooth' is now called 'lag_s' \(0 for false, inf for true\)"),
    ],
)
def test_others_are_refused(content: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Settings.of(content, "test", ())
