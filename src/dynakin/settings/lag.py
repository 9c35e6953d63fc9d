"""By how much an estimate may come late, so that the frames of that time help to make it; which settings
allow it."""

from __future__ import annotations

import math

from dynakin.errors import ConfigError
from dynakin.messages import Message, note
from dynakin.settings.noise import Noise

LIVE_LAG_S = 0.05
"""What live use is recommended: accelerations come 16 to 44 ms late without, and need the frames after them."""
LONGEST_LAG_S = 1.0
"""An estimate that is later still differs from that of all frames by nothing; each frame takes time with the lag."""
ALL_FRAMES = math.inf
"""The lag of an estimate from all frames."""


def check_lag(lag_s: float, what: str = "lag_s", *, live: bool = False) -> float:
    """The lag itself.

    Raises:
        ConfigError: neither seconds in 0 to `LONGEST_LAG_S` nor, but for ``live``, `ALL_FRAMES`.
    """
    number = isinstance(lag_s, int | float) and not isinstance(lag_s, bool)
    if number and (0.0 <= lag_s <= LONGEST_LAG_S or (lag_s == ALL_FRAMES and not live)):
        return float(lag_s)
    end = "; live, not all frames are known" if live else "; or inf: all frames of a recording"
    raise ConfigError(
        f"{what} is {lag_s!r}, expected seconds (no longer frames), 0 to {LONGEST_LAG_S:g}, such as {LIVE_LAG_S:g}"
        f"{_meant(lag_s) if number else ''}{end}"
    )


def _meant(lag_s: float) -> str:
    """What a number that is too large for seconds is as milliseconds."""
    return f" ({lag_s:g} ms are {lag_s / 1e3:g})" if 1.0 < lag_s <= 1e3 * LONGEST_LAG_S else ""


def lag_frames(lag_s: float, rate_hz: float) -> int:
    """Frames of a lag (s, not `ALL_FRAMES`): the nearest number within `LONGEST_LAG_S`, at least 1 but for 0."""
    return max(1, min(round(lag_s * rate_hz), int(LONGEST_LAG_S * rate_hz))) if lag_s > 0.0 else 0


def frames_later(lag_s: float, rate_hz: float) -> int | None:
    """`lag_frames`, and None for `ALL_FRAMES`."""
    return None if lag_s == ALL_FRAMES else lag_frames(lag_s, rate_hz)


def in_words(lag_s: float) -> str:
    """How each frame was estimated: "from all frames", "as it would be live", "as it would be live, 50 ms late"."""
    if lag_s == ALL_FRAMES:
        return "from all frames"
    return "as it would be live" + (f", {1e3 * lag_s:.3g} ms late" if lag_s else "")


SMOOTHED_WITH = ("projection", "none")
"""Ways to keep bounds that have a smoother."""


def can_smooth(noise: Noise) -> bool:
    """Whether bounds are kept in a way that has a smoother."""
    return noise.constraint in SMOOTHED_WITH


def known_lag(asked_s: float | None, noise: Noise) -> tuple[float, list[Message]]:
    """The lag of a recording's estimate, s: as asked, else all frames wherever these settings have a smoother; a
    sentence where not.

    Raises:
        ConfigError: no lag that can be, or these settings have no smoother for it.
    """
    if asked_s is not None:
        check_lag(asked_s)
        if asked_s:
            check_can_smooth(noise)
        return float(asked_s), []
    if can_smooth(noise):
        return ALL_FRAMES, []
    text = (
        f"Not smoothed: bounds are kept by constraint {noise.constraint!r}, which has no smoother; each frame is "
        "estimated from the frames until then, as it would be live."
    )
    return 0.0, [note("smoothing", text)]


def live_lag(asked_s: float | None, noise: Noise) -> float:
    """The lag of live use, s: as asked, else the recommended one wherever these settings have a smoother, else 0.

    Raises:
        ConfigError: no lag that can be, or these settings have no smoother for it.
    """
    if asked_s is None:
        return LIVE_LAG_S if can_smooth(noise) else 0.0
    return known_lag(check_lag(asked_s, live=True), noise)[0]


def check_can_smooth(noise: Noise) -> None:
    """
    Raises:
        ConfigError: these settings keep bounds in a way that has no smoother.
    """
    if not can_smooth(noise):
        raise ConfigError(
            f"lag_s: bounds are kept by constraint {noise.constraint!r}, which has no smoother; expected 0 "
            "(--lag 0), or 'projection' or 'none' (preset default)"
        )
