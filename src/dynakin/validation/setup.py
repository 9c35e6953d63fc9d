"""What a comparison is made with: the model, the noise presets to be compared, and the reference's cut-off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from dynakin.errors import ConfigError
from dynakin.filter.estimator import Estimator
from dynakin.filter.zero import Zero
from dynakin.model.definition import Definition
from dynakin.model.identified import IdentifiedSubject
from dynakin.results.measures.angles import Signs
from dynakin.settings import presets
from dynakin.settings.contacts import DeclaredContact
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.settings.model import QUANTITIES, Bounds, Priors, Quantity
from dynakin.settings.noise import Noise
from dynakin.settings.subject import CarriedLoad


@dataclass(frozen=True, eq=False)
class Setup:
    """How every trial of a comparison is worked on.

    Attributes:
        definition: what `load_model` returns.
        noise: settings of each filter that is compared, by the name of its preset.
        cutoff_hz: of the reference methods' zero-lag low-pass, Hz.
        priors, bounds, side, vertical, forward, estimate, plates, contacts, loads, parameters: as `Estimator` takes
            them.
        lag_s: as `Estimator.run`. zero, signs: of the joint angles, as in a run's configuration.
    """

    definition: Definition
    noise: Mapping[str, Noise] = field(default_factory=lambda: {"default": presets.default()})
    cutoff_hz: float = CUTOFF_HZ
    priors: Priors | None = None
    bounds: Bounds | None = None
    side: str = "auto"
    vertical: str = "auto"
    forward: str | tuple[float, float, float] = "auto"
    estimate: tuple[Quantity, ...] = QUANTITIES
    plates: Mapping[str, str] | None = None
    contacts: tuple[DeclaredContact, ...] = ()
    loads: tuple[CarriedLoad, ...] = ()
    parameters: IdentifiedSubject | None = None
    lag_s: float | None = None
    zero: Zero = "model"
    signs: Signs = "opensim"

    def __post_init__(self) -> None:
        if not self.noise:
            raise ConfigError("comparison: no preset was given, expected at least one")
        if not self.cutoff_hz > 0.0:
            raise ConfigError(f"comparison: the cut-off is {self.cutoff_hz:g} Hz, expected a positive number")

    @property
    def plate_load_tolerance(self) -> float | None:
        """The widest of the presets', by which plates are judged."""
        return max((t for noise in self.noise.values() if (t := noise.plate_load_tolerance)), default=None)

    def estimator(self, preset: str) -> Estimator:
        """A filter with the noise of one of the presets, not started yet."""
        return Estimator(
            self.definition,
            self.noise[preset],
            priors=self.priors,
            bounds=self.bounds,
            side=self.side,
            vertical=self.vertical,
            forward=self.forward,
            estimate=self.estimate,
            plates=self.plates,
            contacts=self.contacts,
            loads=self.loads,
            parameters=self.parameters,
        )
