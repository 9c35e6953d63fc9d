"""The settings of a run: one definition of every key, its default and its meaning, for file and command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from dynakin.errors import ConfigError, DynakinError
from dynakin.files import is_file
from dynakin.settings import presets
from dynakin.settings.contacts import DeclaredContact, check_names
from dynakin.settings.lag import check_lag
from dynakin.settings.model import QUANTITIES, Bounds, OpenSimOptions, Priors, Quantity
from dynakin.settings.noise import Noise
from dynakin.settings.strict import Strict, read_toml, validate
from dynakin.settings.subject import CarriedLoad, PlateLoad, Sex, Subject

# How keys are called on the command line, where it is not --key.
_OPTIONS = {
    "trial": ("TRIAL",),
    "output": ("-o", "--output"),
    "mass_kg": ("--mass",),
    "height_m": ("--height",),
    "lag_s": ("--lag",),
    "contacts": ("--contact",),
    "opensim.marker_places": ("--marker-places",),
}
# Keys that name files: relative to the configuration file that they stand in.
_PATHS = ("trial", "forces", "static", "parameters", "output")
FunctionalJoint = Literal["hip_r", "hip_l", "knee_r", "knee_l"]
"""Joints whose centre or axis a trial of their own can show."""
NEEDED = {"trial": "TRIAL", "output": "-o OUT"}
RECORDED = ("ground", "held", "marker_places", "unmarked_joints", "identified", "noise_used", "versions")
"""Keys that an output's config.toml has for the record: not for people to set, and not read."""


class Settings(Strict, use_attribute_docstrings=True):
    """What a run needs to know; the keys of a configuration file are the options of the command line."""

    renamed: ClassVar = {"smooth": "lag_s (0 for false, inf for true)"}

    trial: Path = Field(default=Path(), examples=["squat.c3d"])
    """Recording to estimate: .c3d, .trc or .csv.

    Paths are relative to this file."""
    model: str = Field(default="fullbody", examples=["squat7"])
    """Model: fullbody (where none is given), squat7, sagittal7, or a .toml or .osim file of your own."""
    output: Path = Field(default=Path(), examples=["out/squat"])
    """Folder for the results. It is replaced if it holds an earlier output, and refused if it holds anything else."""

    forces: Path | None = Field(default=None, examples=["squat_grf.mot"])
    """Ground forces, where the recording does not hold them: .mot, .sto or .csv."""
    static: Path | None = Field(default=None, examples=["standing.c3d"])
    """Recording of the same person and markers standing, from which lengths and marker places are taken."""
    functional: dict[FunctionalJoint, Path] | None = Field(default=None, examples=[{"hip_r": "right_hip.c3d"}])
    """Recordings of the same person and markers that show where joints lie, for models in space: hip_r, hip_l (the leg
    swung forward, sideways and around) and knee_r, knee_l (the knee bent); as an option with commas,
    hip_r=right_hip.c3d,knee_r=right_knee.c3d. One file may serve several joints."""
    parameters: Path | None = Field(default=None, examples=["subject.toml"])
    """Identified subject that `dynakin identify` wrote: the filter starts from its values and deviations."""
    markers: str = "auto"
    """Marker set: auto (by the names in the recording), a built-in one, or a .toml file of your own."""
    table: str = "dumas"
    """Table of inertial parameters: dumas, deleva, or a .csv file of your own."""

    mass_kg: float | None = Field(default=None, examples=[70.0])
    """Body mass, kg. Not given: from the plates (quiet standing, squats, the impulse of a walk) or from the file."""
    height_m: float | None = Field(default=None, examples=[1.75])
    """Body height, m. Not given: from the markers, where a length needs it."""
    sex: Sex | None = Field(default=None, examples=["female"])
    """male or female, for the table. Not given: the mean of both."""

    preset: str = "default"
    """Noise settings to start from (default, paper, or a .toml file that `tune` wrote); [noise] changes single ones."""
    lag_s: float | None = Field(default=None, ge=0.0, strict=True, allow_inf_nan=True, examples=[0.05])
    """Estimate each frame from the frames until so many seconds later, as it would be live with that lag (0: without
    any); inf: from all frames. Not given: inf wherever the noise settings have a smoother (preset paper has none)."""
    side: Literal["auto", "right", "left", "both"] = "auto"
    """Which side's markers a model uses that has one leg for both: auto (fewest gaps), right, left, both."""
    estimate: tuple[Quantity, ...] = QUANTITIES
    """Which parameters are estimated, of lengths, markers (their places), soft_tissue (displacements) and inertia; as
    an option with commas, or none. The others stay as they are at the start."""
    plates: dict[str, str] | None = Field(default=None, examples=[{"plate 1": "right"}])
    """What bears on a plate, for floating models: a foot ("plate 1" = "right"), or a declared contact ("plate 3" =
    "seat"). Not given: the foot that stands on it."""
    contacts: tuple[DeclaredContact, ...] = ()
    """What else bears or pulls the person, measured or not, for floating models: "seat", "hand_right", a segment of the
    model, or {name = "rail", segment = "hand_r"}; as an option with commas, seat,rail=hand_r."""
    vertical: str = "auto"
    """Axis of the laboratory that points up: auto (found), or one of +X -X +Y -Y +Z -Z."""
    forward: str | tuple[float, float, float] = "auto"
    """Direction in which the person faces, in the laboratory: auto (found), an axis, or three numbers (0,1,0). Given, X
    of all results is along it; else a floating model is estimated in the laboratory's own frame."""
    plate_filter_hz: float | None = Field(default=None, examples=[20.0])
    """Low-pass filter on the plates, Hz. Not given: only what resampling to the marker rate needs."""
    force_threshold_n: float | None = Field(default=None, examples=[10.0])
    """Load below which a plate counts as empty, N. Not given: 10 N for plates that are resampled and read
    nothing while they are empty."""

    zero: Literal["model", "standing"] = "model"
    """Zero of the joint angles in angles.sto: model, or standing (in the static trial, else in the trial itself)."""
    signs: Literal["opensim", "clinical"] = "opensim"
    """Names and signs of the joint angles in angles.sto: opensim (the coordinates'), or clinical."""
    loads: tuple[CarriedLoad, ...] = ()
    """Known masses that the person carries: [[loads]] with segment, mass_kg, place_m (centre of mass in the segment's
    frame, m), inertia_kg_m2 and name. mass_kg, the person's own, is then needed."""
    plate_loads: tuple[PlateLoad, ...] = ()
    """Constant loads on plates that are not the person's (a rail): [[plate_loads]] with plate, force_n, point_m,
    moment_nm, laboratory frame."""

    noise: dict[str, Any] = Field(default_factory=dict)
    """What the filter assumes of noise; names say which are variances, standard deviations and densities. Defaults:
    those of the preset."""
    priors: Priors = Priors()
    """Standard deviations at the first frame."""
    bounds: Bounds = Bounds()
    """Half widths of the bounds of equation (9)."""
    opensim: OpenSimOptions = OpenSimOptions()
    """What of an OpenSim model can be estimated; other models do not read it."""
    grid: dict[str, tuple[float, float, int]] | None = Field(
        default=None, examples=[{"jerk_density_rad2_s5": [1.0, 1e4, 5]}]
    )
    """Settings that `tune grid` varies: NAME = [from, to, steps], logarithmic. `run` does not read it."""

    ground: dict[str, Any] = Field(default_factory=dict)
    """Written into an output's config.toml for the record: the ground frame that was found. Not read."""
    held: dict[str, str] = Field(default_factory=dict)
    """Written into an output's config.toml for the record: coordinates that no marker shows, and why. Not read."""
    marker_places: str | None = None
    """Written into an output's config.toml for the record: named by a marker set, or guessed. Not read."""
    unmarked_joints: list[str] = Field(default_factory=list)
    """Written into an output's config.toml for the record: knees and ankles that no marker shows. Not read."""
    identified: str | None = None
    """Written into an output's config.toml for the record: what was taken of `parameters`. Not read."""
    noise_used: dict[str, Any] = Field(default_factory=dict)
    """Written into an output's config.toml for the record: the noise's scales, found in the recording or fixed. Not
    read."""
    versions: dict[str, Any] = Field(default_factory=dict)
    """Written into an output's config.toml for the record. Not read."""

    @classmethod
    def of(
        cls,
        content: Mapping[str, Any],
        where: str,
        needed: Iterable[str] = NEEDED,
        given: Mapping[str, Any] | None = None,
    ) -> Self:
        """Settings from the keys of a file, of the command line, or both.

        Args:
            where: the file, or the command; opens the message of what is wrong. needed: keys that must be there.
            given: keys of the command line, which win; messages call them by their options.

        Raises:
            ConfigError: a key that is unknown (the nearest is suggested) or missing, or a value that is wrong.
        """
        given = given or {}
        tables = {key.partition(".")[0] for key in _OPTIONS if "." in key}  # whose single keys are options
        own = {key: content[key] for key in tables & given.keys() if isinstance(content.get(key), Mapping)}
        content = {**content, **given, **{key: {**table, **given[key]} for key, table in own.items()}}
        for key in needed:
            if content.get(key) is None:
                option = NEEDED[key]
                raise ConfigError(f'{where}: {key} is missing, expected {option} or {key} = "..." in the configuration')
        keys = [key for key in given if key not in tables]
        keys += [f"{table}.{key}" for table in sorted(tables & given.keys()) for key in given[table]]
        return validate(cls, content, where, ConfigError, {key: option_names(key)[0] for key in keys})

    @field_validator("lag_s")
    @classmethod
    def _seconds(cls, lag_s: float | None) -> float | None:
        try:
            return None if lag_s is None else check_lag(lag_s, "the lag")
        except ConfigError as error:
            raise ValueError(error.message) from None

    @model_validator(mode="after")
    def _checked(self) -> Self:
        try:
            self.subject()
            self.noise_settings()
            check_names(self.contacts)
            if self.loads and self.mass_kg is None:
                raise ConfigError("loads: the plates carry them too, expected mass_kg, the person's own")
        except DynakinError as error:
            raise ValueError(error.message) from None
        return self

    def subject(self) -> Subject:
        """Who is measured."""
        return Subject(mass_kg=self.mass_kg, height_m=self.height_m, sex=self.sex)

    def noise_settings(self) -> Noise:
        """The preset with the changes of [noise].

        Raises:
            ConfigError: an unknown preset, an unknown key in [noise], or a value out of range.
        """
        return presets.preset(self.preset, self.noise)

    def as_used(self) -> dict[str, Any]:
        """Plain data for an output's config.toml: every path absolute, so that the file works from where it lies."""
        plain = self.model_dump(mode="json", exclude={*RECORDED, "grid"})
        if presets.is_file(self.preset):
            plain["preset"] = str(Path(self.preset).absolute())
        for key in _PATHS:
            path = getattr(self, key)
            plain[key] = None if path in (None, Path()) else str(path.absolute())
        if self.functional is not None:
            plain["functional"] = {joint: str(path.absolute()) for joint, path in self.functional.items()}
        return plain


def option_names(key: str) -> tuple[str, ...]:
    """How a key is called on the command line."""
    return _OPTIONS.get(key, ("--" + key.replace("_", "-"),))


def read_keys(path: Path, paths: Sequence[str] = _PATHS) -> dict[str, Any]:
    """The keys of a configuration file, its relative paths made relative to where the file lies.

    Args:
        paths: keys that name files.

    Raises:
        ConfigError: no such file, or not TOML (with the line).
    """
    content = read_toml(path, ConfigError)
    for key in paths:
        if isinstance(content.get(key), str):
            content[key] = str(path.parent / content[key])
    functional = content.get("functional")
    if "functional" not in paths and isinstance(functional, dict):
        content["functional"] = {
            joint: str(path.parent / file) if isinstance(file, str) else file for joint, file in functional.items()
        }
    return with_named_files(content, path)


def with_named_files(content: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """The keys of (a part of) a configuration file, of which some have a name or a file next to it."""
    named = {key: content[key] for key in ("model", "markers", "table", "preset") if isinstance(content.get(key), str)}
    return dict(content) | {key: named_beside(path, value) for key, value in named.items()}


def named_beside(path: Path, value: str) -> str:
    """What a configuration file names: a file next to it where there is one, else the name as it is."""
    return str(path.parent / value) if is_file(path.parent / value) else value
