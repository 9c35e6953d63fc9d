"""What a comparison is made with: the estimator, the noise presets to be compared, and the reference's cut-off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from dynakin.errors import ConfigError
from dynakin.filter.estimator import Estimator
from dynakin.filter.zero import Zero
from dynakin.model.definition import Definition
from dynakin.results.measures.angles import Signs
from dynakin.settings import presets
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.settings.noise import Noise


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
    noise: Mapping[str, Noise] = field(default_factory=lambda: {"default": presets.default()})
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
