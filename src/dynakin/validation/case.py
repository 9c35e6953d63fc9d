"""A trial as a configuration names it, read and ready to be estimated, and what a comparison on it is made with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dynakin.errors import ConfigError
from dynakin.filter.build import estimator_of
from dynakin.filter.estimator import Estimator
from dynakin.filter.zero import Zero
from dynakin.model.definition import Definition
from dynakin.recordings.plates.loads import without_plate_loads
from dynakin.recordings.read import read
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.results.measures.angles import Signs
from dynakin.settings import presets as known_presets
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.settings.noise import Noise
from dynakin.settings.settings import Settings


@dataclass(frozen=True, eq=False)
class Setup:
    """How every trial of a comparison is worked on.

    Attributes:
        common: what all filters have in common; its own noise is not used.
        noise: settings of each filter that is compared, by the name of its preset.
        cutoff_hz: of the reference methods' zero-lag low-pass, Hz.
        lag_s: as `Estimator.run`. zero, signs: of the joint angles, as in a run's configuration.
    """

    common: Estimator
    noise: Mapping[str, Noise] = field(default_factory=lambda: {"default": known_presets.default()})
    cutoff_hz: float = CUTOFF_HZ
    lag_s: float | None = None
    zero: Zero = "model"
    signs: Signs = "opensim"

    def __post_init__(self) -> None:
        if not self.noise:
            raise ConfigError("comparison: no preset was given, expected at least one")
        if not self.cutoff_hz > 0.0:
            raise ConfigError(f"comparison: the cut-off is {self.cutoff_hz:g} Hz, expected a positive number")

    @property
    def definition(self) -> Definition:
        """The model, not measured yet."""
        return self.common.model

    @property
    def plate_load_tolerance(self) -> float | None:
        """The widest of the presets', by which plates are judged."""
        return max((t for noise in self.noise.values() if (t := noise.plate_load_tolerance)), default=None)

    def estimator(self, preset: str) -> Estimator:
        """A filter with the noise of one of the presets, not started yet."""
        return replace(self.common, noise=self.noise[preset])


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
