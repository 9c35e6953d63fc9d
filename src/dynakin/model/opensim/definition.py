"""An OpenSim model that is chosen but not yet laid on a recording, and what to make of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dynakin.model.opensim.description import OpenSimModel
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.scales import scale_names
from dynakin.settings.model import OpenSimOptions
from dynakin.settings.strict import validate
from dynakin.settings.subject import Subject


@dataclass(frozen=True, eq=False)
class OpenSimDefinition:
    """What ``load_model`` returns for an .osim file; ``initialise`` lays it on a recording.

    Attributes:
        source: the file's content.
        subject: mass, height, sex, as far as they are told.
        options: what can be estimated.
        scales: scale parameter of each body that has one.
    """

    source: OpenSimModel
    subject: Subject
    options: OpenSimOptions
    scales: dict[str, str]

    @property
    def name(self) -> str:
        """The model's name."""
        return self.source.name

    @property
    def path(self) -> Path:
        """Where it came from."""
        return self.source.path


def load_opensim(
    path: str | Path, subject: Subject | None = None, options: OpenSimOptions | None = None, **fields: object
) -> OpenSimDefinition:
    """An OpenSim model (.osim, versions 3 and 4) for the filter.

    Args:
        subject: who is measured; nothing is known where not given.
        options: what can be estimated; ``fields`` are single ones of it (``scale=None``).

    Raises:
        ModelError: the file or an option is wrong, or holds what is not supported; its place is named.
    """
    source = read_osim(path)
    given = {} if options is None else options.model_dump()
    chosen = validate(OpenSimOptions, given | fields, "OpenSim model")
    scales = scale_names(source, chosen.scale, share=chosen.share_sides)
    return OpenSimDefinition(source, subject or Subject(), chosen, scales)
