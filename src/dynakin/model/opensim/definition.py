"""An OpenSim model that is chosen but not yet laid on a recording, and what to make of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import Field

from dynakin.model.opensim.description import OpenSimModel
from dynakin.model.opensim.read import read_osim
from dynakin.model.opensim.scales import scale_names
from dynakin.model.subject import Subject
from dynakin.model.validation import Strict, validate


class OpenSimOptions(Strict):
    """What of an OpenSim model can be estimated, and what is taken as the file has it."""

    scale: Literal["all"] | tuple[str, ...] | None = "all"
    """Bodies with a scale parameter, on which the joints placed on that body depend; []: none."""
    share_sides: bool = True
    """Whether mirrored bodies (femur_r, femur_l) share one."""
    scale_masses: bool = True
    """Whether all masses and inertias are multiplied so that they sum to the subject's mass."""
    lightest_share: float = Field(default=0.01, ge=0.0, lt=1.0)
    """Bodies of less than this part of the whole mass keep the file's mass and inertia: no recording tells of them."""
    lock_unseen: bool = True
    """Whether coordinates that move no measured marker (toes, often) are locked at the file's default value."""
    leave_out: tuple[str, ...] = ()
    """Markers of the file that are not measurements (regressed joint centres, say)."""


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
