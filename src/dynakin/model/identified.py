"""A subject's identified parameters: the file that `dynakin identify` writes and `dynakin run --parameters` reads; the
constants of a run, which `dynakin live` takes too."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import tomli_w
from pydantic import Field, model_validator

from dynakin.bindings import _core
from dynakin.elements import element
from dynakin.errors import ModelError
from dynakin.files import LARGEST_TEXT, read_bytes, write_text
from dynakin.messages import note, warning
from dynakin.model.calibration.calibrated import CalibratedModel
from dynakin.model.inertia import inertia_from
from dynakin.model.state_priors import JointPrior
from dynakin.results.naming import listed, plural, words
from dynakin.settings.strict import Strict, read_toml, validate

_WIDE = 3.0  # standard deviations that bounds leave on both sides
_MASS_APART = 0.05
_TOTAL_SD_KG = 0.5  # of the total mass, whose sum the batch holds exactly: a filter's covariance must not be singular


class Batch(Strict):
    """The batch estimate of the inertial parameters (SI, by their names in the state), whether it is used or not: two
    sessions are compared by it. Base parameters are K values."""

    names: tuple[str, ...]
    values: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    prior_covariance: tuple[tuple[float, ...], ...]
    base_names: tuple[str, ...]
    base_words: tuple[str, ...]
    K: tuple[tuple[float, ...], ...]

    @model_validator(mode="after")
    def _fits_together(self) -> Batch:
        count, rank = len(self.names), len(self.base_names)
        rows = {"covariance": count, "prior_covariance": count, "K": rank}
        if len(self.values) != count:
            raise ValueError(f"{len(self.values)} values for {count} names")
        for key, expected in rows.items():
            matrix = getattr(self, key)
            if len(matrix) != expected or any(len(row) != count for row in matrix):
                raise ValueError(f"{key} is no matrix of {expected} rows and {count} columns")
        if len(self.base_words) != rank:
            raise ValueError(f"{len(self.base_words)} base_words for {rank} base_names")
        numbers = (self.values, *self.covariance, *self.prior_covariance, *self.K)
        if not all(np.isfinite(row).all() for row in numbers):
            raise ValueError("a number is not finite")
        return self


class HeldOut(Strict):
    """What cross-validation found: RMS error of the wrench of each part that was left out and predicted from its
    markers alone, a row a part, N and N m by ``components``; with the table's inertia, and with the identified."""

    parts: tuple[str, ...]
    components: tuple[str, ...]
    table: tuple[tuple[float, ...], ...]
    bodies: tuple[tuple[float, ...], ...]

    @model_validator(mode="after")
    def _fits_together(self) -> HeldOut:
        for key in ("table", "bodies"):
            rows = getattr(self, key)
            if len(rows) != len(self.parts) or any(len(row) != len(self.components) for row in rows):
                raise ValueError(f"{key} has no row a part with a number a component")
            if not all(np.isfinite(x) and x > 0.0 for row in rows for x in row):
                raise ValueError(f"{key}: an RMS error is not a positive number")
        if not self.parts or not self.components:
            raise ValueError("no part was left out")
        return self

    def in_words(self) -> str:
        """The gain of the identified inertia over the table, over all and by component."""
        gain = 100.0 * (1.0 - (np.array(self.bodies) / np.array(self.table)).mean(axis=0))
        each = [f"{name.upper()} {value:+z.0f} %" for name, value in zip(self.components, gain, strict=True)]
        return (
            f"of trials that were left out the wrench is predicted {gain.mean():+z.0f} % better from markers alone "
            f"({', '.join(each)}), which is no measure of moments on plates"
        )


class IdentifiedSubject(Strict):
    """What was identified of one subject; ``use`` says whether cross-validation lets ``batch`` replace the table, and
    ``held_out`` by how much it predicts better (not in files of earlier versions); ``warnings`` what makes the trials
    doubtful."""

    schema_version: Literal[1] = 1
    model: str
    mass_kg: float = Field(gt=0.0)
    use: Literal["table", "bodies"]
    trials: tuple[str, ...]
    report: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    held_out: HeldOut | None = None
    batch: Batch

    def write(self, path: Path) -> None:
        """As TOML.

        Raises:
            ModelError: the file cannot be written.
        """
        write_text(path, tomli_w.dumps(self.model_dump(mode="json", exclude_none=True)), ModelError)


def read_identified(path: Path) -> IdentifiedSubject:
    """The subject of a file.

    Raises:
        ModelError: it cannot be read, or holds something else; the key is named.
    """
    if path.suffix.casefold() == ".json":
        raise ModelError(
            f"{path}: expected what dynakin identify wrote (.toml); a run's parameters.json is for dynakin live"
        )
    return validate(IdentifiedSubject, read_toml(path), str(path))


class Constant(NamedTuple):
    """What a run found of one constant, SI; ``sd``: one standard deviation; ``bounds`` where the file states them."""

    value: float
    sd: float
    estimated: bool
    bounds: tuple[float, float] | None = None


@dataclass(frozen=True)
class RunConstants:
    """What a run's ``parameters.json`` holds.

    Attributes:
        path: the file. model: of which model; None: it does not say.
        constants: by their names in the state.
    """

    path: Path
    model: str | None
    constants: dict[str, Constant]

    @property
    def values(self) -> dict[str, float]:
        """Name -> value."""
        return {name: constant.value for name, constant in self.constants.items()}

    def check(self, model: str, known: Iterable[str], bounds: Mapping[str, tuple[float, float]]) -> None:
        """That the values are of this model.

        Args:
            model: its name. known: all that it has, ``length/thigh``, ``marker/RKNE``, ``inertia/pelvis``.
            bounds: of values of which the file states none.

        Raises:
            ModelError: another model's, or a value outside its bounds.
        """
        if self.model not in (None, model):
            raise ModelError(f"{self.path}: found parameters of model {self.model}, another model's; expected {model}")
        names = set(known)
        for name, constant in self.constants.items():
            kind, owner, _ = element(name)
            if kind != "plates" and f"{kind}/{owner}" not in names:
                raise ModelError(
                    f"{self.path}: model {model} has no {name} as measured here: the parameters are another model's, "
                    "or of other markers"
                )
            low, high = constant.bounds or bounds.get(name, (-np.inf, np.inf))
            slack = 1e-6 * (high - low) if np.isfinite(high - low) else 0.0
            if not low - slack <= constant.value <= high + slack:
                raise ModelError(f"{self.path}: {name} is {constant.value:g}, expected {low:.4g} to {high:.4g}")

    def check_mass(self, found_kg: float, expected_kg: float) -> None:
        """That the segments with these values weigh what they weigh without them: the total mass is a prior of the run.

        Raises:
            ModelError: they are more than 5 % apart.
        """
        if abs(found_kg - expected_kg) > _MASS_APART * expected_kg:
            raise ModelError(
                f"{self.path}: the segments hold {found_kg:.1f} kg together, expected {expected_kg:.1f} kg within "
                f"{100.0 * _MASS_APART:.0f} %: the parameters are another person's, or --mass is not that of the run"
            )


def read_constants(path: Path) -> RunConstants:
    """A run's ``parameters.json``.

    Raises:
        ModelError: the file cannot be read, is none of that kind, or holds no parameters.
    """
    try:
        content = json.loads(read_bytes(path, ModelError, LARGEST_TEXT))
        found = {str(entry["name"]): _constant(entry) for entry in content["parameters"]}
        if not np.isfinite([constant[:2] for constant in found.values()]).all():
            raise ValueError("a number is not finite")
        model = content.get("model")
    except (ValueError, KeyError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
        raise ModelError(f"{path}: no parameters.json of a run ({error})") from None
    if not found:
        raise ModelError(f"{path}: holds no parameters, expected those of a run")
    return RunConstants(path, None if model is None else str(model), found)


def _constant(entry: Mapping[str, Any]) -> Constant:
    low, high = entry.get("lower"), entry.get("upper")
    bounds = None if low is None or high is None else (float(low), float(high))
    return Constant(float(entry["value"]), float(entry["sd"]), bool(entry["estimated"]), bounds)


def with_identified(initial: CalibratedModel, subject: IdentifiedSubject) -> CalibratedModel:
    """The same model with the subject's inertia, and its covariance, where the filter starts; bounds are moved where
    they would cut it off. A subject whose table is kept changes nothing.

    Raises:
        ModelError: another model, or a body mass that is more than 5 % apart.
    """
    if subject.model != initial.spec.name:
        raise ModelError(f"identified parameters: they are of model {subject.model}, expected {initial.spec.name}")
    if abs(subject.mass_kg - initial.mass_kg) > _MASS_APART * initial.mass_kg:
        raise ModelError(
            f"identified parameters: of somebody of {subject.mass_kg:.1f} kg, expected {initial.mass_kg:.1f} kg within "
            f"{100.0 * _MASS_APART:.0f} %; identify again, or give the mass"
        )
    strange = [name for name in subject.batch.names if name not in initial.names]
    if strange:
        raise ModelError(
            f"identified parameters: {strange[0]} (and {len(strange) - 1} more) is not estimated by model "
            f"{initial.spec.name}, expected parameters of this model: identify again"
        )
    if subject.use == "table":
        gain = "" if subject.held_out is None else f"; with the identified inertia {subject.held_out.in_words()}"
        message = f"Identified parameters: the table is kept{gain}."
        return replace(initial, messages=(*initial.messages, note("identified", message)))
    scale = initial.mass_kg / subject.mass_kg  # the same body, weighed anew
    values = scale * np.array(subject.batch.values)
    covariance = scale**2 * np.array(subject.batch.covariance)
    covariance += (_TOTAL_SD_KG / initial.mass_kg) ** 2 * np.outer(values, values)  # all of it, a little
    known = dict(zip(subject.batch.names, zip(values, np.sqrt(np.diag(covariance)), strict=True), strict=True))
    x0, sd0, lower, upper = (v.copy() for v in (initial.x0, initial.sd0, initial.lower, initial.upper))
    for k, name in enumerate(initial.names):
        if name in known:
            x0[k], sd0[k] = known[name]
            lower[k] = min(lower[k], x0[k] - _WIDE * sd0[k])
            upper[k] = max(upper[k], x0[k] + _WIDE * sd0[k])
    spec = _core.Model(initial.spec).spec  # a copy; what is not estimated is held there
    segments, identified = spec.segments, dict(zip(subject.batch.names, values, strict=True))
    for segment in segments:
        segment.inertia = inertia_from(identified, segment.name, segment.inertia)
    spec.segments = segments
    found = JointPrior(subject.batch.names, covariance)
    gain = "" if subject.held_out is None else f"; {subject.held_out.in_words()}"
    whose = list(dict.fromkeys(words(element(name).owner) for name in known))
    text = f"Identified inertial parameters are used, of {listed(whose, 8)}, from {', '.join(subject.trials)}{gain}."
    messages = [note("identified", text)]
    if subject.warnings:
        count = len(subject.warnings)
        text = f"the identified parameters come from trials that are doubted ({plural(count, 'warning')} in the"
        messages.append(warning("identified", f"{text} subject file)."))
    return replace(
        initial,
        spec=spec,
        x0=x0,
        sd0=sd0,
        lower=lower,
        upper=upper,
        joint_prior=found if initial.joint_prior is None else initial.joint_prior.with_known(found),
        own_inertia=True,
        messages=(*initial.messages, *messages),
    )
