"""Everything that can be set, each once: strict classes, read from and written to TOML."""

from dynakin.settings import presets
from dynakin.settings.model import Bounds, OpenSimOptions, Priors
from dynakin.settings.noise import Noise
from dynakin.settings.settings import Settings
from dynakin.settings.subject import CarriedLoad, PlateLoad, Subject

__all__ = [
    "Bounds",
    "CarriedLoad",
    "Noise",
    "OpenSimOptions",
    "PlateLoad",
    "Priors",
    "Settings",
    "Subject",
    "presets",
]
