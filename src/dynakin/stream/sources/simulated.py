"""`simulate:MOTION`: a person who was never there, for trying things out without a file or a laboratory."""

from __future__ import annotations

from dynakin.errors import ConfigError
from dynakin.stream.sources.replay import Replay

_DURATION_S = 20.0


def simulate_source(address: str, options: dict[str, str]) -> Replay:
    """`simulate:squat[,seed=1][,model=fullbody][,speed=1][,loop]`: the simulator's trial, replayed.

    Raises:
        ConfigError: an unknown option, motion or model, or a value that is no number.
    """
    from dynakin.simulation.trial import simulate

    known = ("seed", "model", "speed", "loop", "duration")
    for key in options:
        if key not in known:
            raise ConfigError(f"simulate: unknown option {key!r}, expected some of {', '.join(known)}")
    try:
        seed, speed = int(options.get("seed", "1")), float(options.get("speed", "1"))
        duration = float(options["duration"]) if "duration" in options else None
    except ValueError:
        raise ConfigError(f"simulate: found {options}, expected numbers for seed, speed and duration") from None
    motion = address or "squat"
    length = duration if duration is not None else None if motion == "gait" else _DURATION_S
    trial = simulate(options.get("model", "fullbody"), motion, seed, length)
    loop = options.get("loop", "no") not in ("no", "0", "false")
    return Replay(trial.recording, speed=speed, loop=loop)
