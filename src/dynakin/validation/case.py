"""A trial as a configuration names it, read and ready to be estimated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dynakin.errors import ConfigError
from dynakin.filter.build import estimator_of
from dynakin.filter.estimator import Estimator
from dynakin.recordings.plates.loads import without_plate_loads
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.settings import presets as known_presets
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.settings.settings import Settings
from dynakin.validation.setup import Setup


@dataclass(frozen=True, eq=False)
class Case:
    """A trial as read, with its subject's setup. configs: of each preset, by its title as in ``setup.noise``."""

    recording: Recording
    static: Recording | None
    setup: Setup
    config: Settings
    configs: dict[str, Settings]

    def with_config(self, title: str, estimate: Estimate) -> Estimate:
        """An estimate with one of the presets, with the configuration as used in it."""
        used = self.configs[title].as_used()
        used |= self.recording.read_with  # of a recording that was read before the settings were made
        for key, given in (("trial", self.recording), ("static", self.static)):
            if given is not None and given.path is None:  # was never a file
                used[key] = given.name
        return replace(estimate, config=used | estimate.config)


def case_of(
    config: Settings,
    presets: Sequence[str] = (),
    cutoff_hz: float = CUTOFF_HZ,
    *,
    recording: Recording | None = None,
    static: Recording | None = None,
    estimator: Estimator | None = None,
) -> Case:
    """Read what a configuration names.

    Args:
        presets: to be compared; none: the configuration's own. cutoff_hz: of the reference methods.
        recording, static: that were read before. estimator: that was made of the configuration before.

    Raises:
        DynakinError: anything wrong with the input, in one line.
    """
    common = estimator or estimator_of(config)
    configs = {known_presets.title(name): config.changed(preset=name) for name in (presets or [config.preset])}
    setup = Setup(
        common,
        {title: one.noise_settings() for title, one in configs.items()},
        cutoff_hz,
        config.lag_s,
        config.zero,
        config.signs,
    )
    if recording is None:
        if config.trial == Path():
            raise ConfigError("run: trial is missing, expected a recording or settings that name one")
        recording = read(
            config.trial,
            config.forces,
            plate_filter_hz=config.plate_filter_hz,
            force_threshold_n=config.force_threshold_n,
        )
    else:
        for key in ("forces", "plate_filter_hz", "force_threshold_n"):
            if getattr(config, key) is not None:
                raise ConfigError(f"{recording.name}: {key} takes effect while a file is read, expected its path")
    recording = without_plate_loads(recording.without_empty_ends(), config.plate_loads, config.vertical)
    if static is None and config.static is not None:
        static = read(config.static)
    return Case(recording, static, setup, config, configs)
