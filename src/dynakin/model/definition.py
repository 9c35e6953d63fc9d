"""A model that is chosen but not yet measured: its file, the subject, the marker set and the table."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from dynakin.errors import ModelError
from dynakin.files import is_file
from dynakin.model.markers.marker_set import load_marker_set
from dynakin.model.markers.schema import MarkerSetFile
from dynakin.model.opensim.definition import OpenSimDefinition, load_opensim
from dynakin.model.schema import ModelFile
from dynakin.model.table import BodyTable, load_table
from dynakin.settings.model import OpenSimOptions
from dynakin.settings.strict import nearest, read_toml, validate
from dynakin.settings.subject import Subject

_FOLDER = resources.files("dynakin.model") / "builtin"


def available_models() -> list[str]:
    """Names of the built-in models."""
    return sorted(entry.name.removesuffix(".toml") for entry in _FOLDER.iterdir() if entry.name.endswith(".toml"))


@dataclass(frozen=True, eq=False)
class ModelDefinition:
    """What ``load_model`` returns; ``initialise`` measures it on a recording.

    Attributes:
        model: the model file.
        path: where it came from.
        subject: mass, height, sex, as far as they are told.
        marker_set: None: chosen by the recording's markers.
        table: inertial parameters for the subject's sex.
    """

    model: ModelFile
    path: Path
    subject: Subject
    marker_set: MarkerSetFile | None
    table: BodyTable

    @property
    def name(self) -> str:
        """The model's name."""
        return self.model.name


Definition = ModelDefinition | OpenSimDefinition


def load_model(
    name_or_path: str | Path,
    subject: Subject | None = None,
    markers: str | Path = "auto",
    table: str | Path = "dumas",
    opensim: OpenSimOptions | None = None,
) -> Definition:
    """A built-in model ("sagittal7", "squat7"), a TOML file, or an OpenSim model (.osim, versions 3 and 4).

    An OpenSim model brings its own markers and inertia.

    Args:
        subject: who is measured; nothing is known where not given.
        markers: "auto" (by the recording's names), a built-in set ("opencap", "plug-in-gait"), or a TOML
            file.
        table: "dumas", "deleva" or a CSV file of the same shape.
        opensim: what of an OpenSim model can be estimated; other models do not read it.

    Raises:
        ModelError: an unknown name (the nearest is suggested), or a wrong file (file and key are named).
    """
    name = str(name_or_path)
    if Path(name_or_path).suffix.casefold() == ".osim":
        if str(markers) != "auto":
            raise ModelError(f"markers is {str(markers)!r}, expected auto: {name} has markers of its own")
        return load_opensim(name, subject, opensim)
    return load_built_in_or_toml(name, subject, markers, table)


def load_built_in_or_toml(
    name: str, subject: Subject | None = None, markers: str | Path = "auto", table: str | Path = "dumas"
) -> ModelDefinition:
    """``load_model`` of what is no OpenSim model."""
    known = available_models()
    path = Path(str(_FOLDER / f"{name}.toml")) if name in known else Path(name)
    if name not in known and (path.suffix != ".toml" or not is_file(path)):
        raise ModelError(
            f"model {name!r}: unknown{nearest(name, known)}; expected {', '.join(known)}, or a .toml or .osim file "
            "that exists"
        )
    model = validate(ModelFile, read_toml(path), str(path))
    who = subject or Subject()
    body = load_table(table, who.sex)
    for segment in model.segments:
        for part in segment.parts:
            body.part(part)  # a misspelt part is said now, with the table's own names
    marker_set = None if str(markers) == "auto" else load_marker_set(markers)
    return ModelDefinition(model, path, who, marker_set, body)
