"""What a run does, stage by stage: settings, recording, estimate, comparison, observability."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from dynakin.bindings import _core
from dynakin.blas import one_blas_thread
from dynakin.errors import ConfigError, DynakinError
from dynakin.filter.prepared import Prepared
from dynakin.filter.tracker import Tracker
from dynakin.messages import note
from dynakin.progress import Progress, stage
from dynakin.recordings.read import extensions
from dynakin.recordings.recording import Recording
from dynakin.results.estimate import Estimate
from dynakin.results.failures import Failures
from dynakin.results.measures.tracking import refuse_lost
from dynakin.settings.noise import Noise
from dynakin.settings.settings import Settings, read_keys
from dynakin.settings.subject import Subject
from dynakin.validation.case import Case, case_of
from dynakin.validation.methods import ComparedTrial, estimate_each, prepare_each, trial_of, with_lost

if TYPE_CHECKING:  # loaded while the core works
    from dynakin.identification.observability.structure import Structure
    from dynakin.identification.observability.trial import Identifiability
    from dynakin.pipeline.result import Result


@one_blas_thread
def run(
    trial: str | Path | Recording | Settings,
    *,
    model: str | Path | None = None,
    subject: Subject | None = None,
    forces: str | Path | None = None,
    static: str | Path | Recording | None = None,
    noise: Noise | Mapping[str, Any] | None = None,
    output: str | Path | None = None,
    keep_lost: bool = False,
    observability: bool = True,
    progress: Progress | None = None,
    **settings: Any,
) -> Result:
    """Estimate a trial, compare it with the reference methods and judge the observability of the constants.

        result = dynakin.run("squat.c3d", model="squat7", mass_kg=70.0, height_m=1.75, sex="male")
        result.save("out/squat")

    Args:
        trial: recording (.c3d, .trc, .csv), or one that was read; a configuration (.toml), over which the other
            arguments win; or the settings themselves, without any other.
        model: a built-in model by its name, or a .toml or .osim file.
        subject: who is measured, instead of ``mass_kg``, ``height_m`` and ``sex``.
        static: the same person and markers, standing.
        noise: changes of the preset's noise settings, or all of them.
        output: folder for `Result.save`, which nothing is written into before.
        keep_lost: go on with a trial that was lost.
        observability: whether to judge the observability of the constants.
        progress: called with (frames done, frames in all) now and then; not given: a terminal or a notebook shows
            how far it is, and how much time remains.
        settings: further keys of a configuration (`dynakin print-config` lists them), such as ``preset``, ``lag_s``.

    Raises:
        DynakinError: anything that is wrong with the input, in one line. LostError: the person was lost, and
            ``keep_lost`` is false. What fails once the estimate is there is in ``Result.failures``.
    """
    if not isinstance(trial, str | Path | Recording | Settings):
        raise ConfigError(
            f"run: trial is of type {type(trial).__name__}, expected a file, or a dynakin.Recording as dynakin.read "
            "gives it"
        )
    given = settings | {"model": None if model is None else str(model), "forces": forces, "output": output}
    if subject is not None:
        if not isinstance(subject, Subject):
            raise ConfigError(
                f"run: subject is {subject!r}, expected a dynakin.Subject, such as "
                "dynakin.Subject(mass_kg=70.0, height_m=1.75)"
            )
        if twice := [key for key in ("mass_kg", "height_m", "sex") if settings.get(key) is not None]:
            raise ConfigError(f"run: {twice[0]} is given next to subject, expected it in one of them")
        given |= {"mass_kg": subject.mass_kg, "height_m": subject.height_m, "sex": subject.sex}
    if noise is not None:
        given["noise"] = noise.model_dump() if isinstance(noise, Noise) else dict(noise)
    if isinstance(static, Recording):
        given["static"] = static.path or static.name
    elif static is not None:
        given["static"] = static
    if isinstance(trial, Settings):
        if unused := [key for key, value in given.items() if value is not None]:
            raise ConfigError(f"run: {unused[0]} is given next to settings, expected it in the settings")
        config = trial
    else:
        source = Path(trial.path or trial.name) if isinstance(trial, Recording) else Path(trial)
        config = configure(source, given, {"output": Path()})
    case = case_of(
        config,
        recording=trial if isinstance(trial, Recording) else None,
        static=static if isinstance(static, Recording) else None,
    )
    return run_case(case, keep_lost=keep_lost, observability=observability, progress=progress)


def configure(
    trial: Path, given: Mapping[str, Any], defaults: Mapping[str, Any] | None = None, *, options: bool = False
) -> Settings:
    """Merge a configuration file, if that is what ``trial`` is, with what is given, which wins (None: not given).

    Args:
        options: what is given are options of the command line, and messages call them so.

    Raises:
        ConfigError: a key that is unknown or missing, or a value that is wrong.
    """
    if trial.is_dir():
        raise ConfigError(f"{trial}: is a folder, expected a recording ({extensions()}) or a configuration (.toml)")
    is_config = trial.suffix.casefold() == ".toml"
    content = {**(defaults or {}), **(read_keys(trial) if is_config else {"trial": trial})}
    known = {key: value for key, value in given.items() if value is not None}
    where = str(trial) if is_config else "run"
    return Settings.of(content, where, given=known) if options else Settings.of(content | known, where)


def prepare_case(case: Case) -> dict[str, Prepared]:
    """All of `run_case` but the estimate, by the title of each preset: what `dynakin check` says of a trial, and what
    `dynakin run` says first.

    Raises:
        DynakinError: as `run`, for all that can be known before the estimate.
    """
    return prepare_each(case.recording, case.setup, static=case.static)


@one_blas_thread
def run_case(
    case: Case,
    *,
    ready: Mapping[str, Prepared] | None = None,
    keep_lost: bool = False,
    keep: str | None = "keep_lost=True",
    observability: bool = True,
    progress: Progress | None = None,
) -> Result:
    """`run` on a trial that is read.

    Args:
        ready: what `prepare_case` gave, where that has been done.
        keep: what the caller is asked with to keep the good frames of a trial that was lost; None: cannot be asked.

    Raises:
        DynakinError, LostError: as `run`.
    """
    failures = Failures()
    if ready is None:
        with stage("measuring the person"):
            ready = prepare_case(case)
    ahead = _Ahead(next(iter(ready.values())).tracker if observability else None)
    ahead.start()
    with stage("estimating", progress) as report:
        estimates, _, trackers = estimate_each(
            case.recording,
            case.setup,
            static=case.static,
            progress=report,
            keep_lost=True,
            failures=failures,
            ready=ready,
        )
    if not keep_lost:
        for estimate in estimates.values():
            refuse_lost(estimate, keep)
    return judged(case, estimates, {}, trackers, failures, observability=observability, structure=ahead.structure)


class _Ahead(Thread):
    """Loads what comes after an estimate, and looks at what the model can identify at all, while the core works, which
    leaves the interpreter free. What fails here is tried again where it is used, and said there.

    Args:
        tracker: before the first frame; None: nothing is looked at.
    """

    def __init__(self, tracker: Tracker | None) -> None:
        super().__init__(daemon=True)
        self._tracker = tracker
        self._structure: Structure | None = None

    def run(self) -> None:
        """In a thread of its own."""
        with suppress(Exception), _core.AtWork():
            import xarray as xr  # first: the estimate itself is one

            xr.Dataset(coords={"axis": ["x"]})  # its first one has xarray load Dask, where that is installed
            import netCDF4  # noqa: F401

            import dynakin.pipeline.result
            from dynakin.identification.observability.structure import structure_of
            from dynakin.report.page import templates

            templates()
            if self._tracker is not None:
                self._structure = structure_of(self._tracker)
            import scipy.interpolate  # noqa: F401

            import dynakin.identification.observability.trial  # noqa: F401

    def structure(self) -> Structure | None:
        """What the model can identify, once that is known; None: it could not be found."""
        self.join()
        return self._structure


@one_blas_thread
def judged(
    case: Case,
    estimates: Mapping[str, Estimate],
    lost: Mapping[str, str],
    trackers: Mapping[str, Tracker],
    failures: Failures,
    *,
    tolerant: bool = True,
    observability: bool = True,
    structure: Callable[[], Structure | None] = lambda: None,
) -> Result:
    """What follows the estimates of a trial (see `estimate_each`), each stage on its own: the comparison of all with
    the reference methods, and the observability of the constants of the first.

    Args:
        failures: takes the stages that fail. tolerant: as `trial_of` takes it.
        structure: gives what the first's model can identify at all, where that has been looked at.
    """
    from dynakin.pipeline.result import Result

    estimates = {title: case.with_config(title, estimate) for title, estimate in estimates.items()}
    title, first = next(iter(estimates.items()))
    initial = list(trackers.values())[-1].calibrated
    comparison: ComparedTrial | None = None
    with failures.stage("comparison with the reference methods"), stage("comparing with the reference methods"):
        setup = case.setup
        comparison = trial_of(estimates, initial, setup.definition, setup.cutoff_hz, tolerant=tolerant)
        comparison = with_lost(comparison, lost)
    observed: Identifiability | None = None
    if observability:
        with failures.stage("observability of the constants"):
            observed, why_not = _observability(trackers[title], first, structure)
            if why_not:
                first = replace(first, messages=[*first.messages, note("results", f"{_LEFT_OUT}: {why_not}")])
    return Result(first, initial, comparison, observed, case.config, failures)


_LEFT_OUT = "Observability of the constants is left out"


def _observability(
    tracker: Tracker, estimate: Estimate, structure: Callable[[], Structure | None]
) -> tuple[Identifiability | None, str]:
    """Observability of the constants in this recording, or why it is left out, which is no failure. Of a body that is
    fixed nowhere no other movements are tried: that takes as long as the estimate of a short trial."""
    from dynakin.identification.observability.trial import identifiability

    try:
        with stage("looking at what is observed") as report:
            motions = not tracker.calibrated.feet
            return identifiability(tracker, estimate, report, motions=motions, structure=structure()), ""
    except DynakinError as error:  # a trial of a few frames, say
        return None, error.message
