"""A trial as a configuration names it, read and ready to be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dynakin.filter.build import definition_of, identified_of
from dynakin.recordings.plates.loads import without_plate_loads
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.settings import presets as known_presets
from dynakin.settings.settings import Settings
from dynakin.validation.setup import Setup


@dataclass(frozen=True, eq=False)
class Case:
    """A trial as read, with its subject's setup."""

    recording: Recording
    static: Recording | None
    setup: Setup
    config: Settings


def case_of(config: Settings, presets: Sequence[str], cutoff_hz: float) -> Case:
    """Read what a configuration names.

    Args:
        presets: beside each other; none: the configuration's own. cutoff_hz: of the reference methods.

    Raises:
        DynakinError: anything wrong with the input, in one line.
    """
    noise = {
        known_presets.title(name): known_presets.preset(name, config.noise) for name in (presets or [config.preset])
    }
    setup = Setup(
        definition_of(config),
        noise,
        cutoff_hz,
        config.priors,
        config.bounds,
        config.side,
        config.vertical,
        config.forward,
        config.estimate,
        config.plates,
        config.loads,
        identified_of(config),
        config.smooth,
        config.zero,
        config.signs,
    )
    recording = read(
        config.trial, config.forces, plate_filter_hz=config.plate_filter_hz, force_threshold_n=config.force_threshold_n
    )
    recording = without_plate_loads(recording, config.plate_loads, config.vertical)
    return Case(recording, None if config.static is None else read(config.static), setup, config)
