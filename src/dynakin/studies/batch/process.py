"""Every trial by itself, over all cores or a cluster, and what is true of all of them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dynakin.errors import DynakinError
from dynakin.files import write_csv, write_json
from dynakin.messages import warnings_of
from dynakin.pipeline.stages import judged
from dynakin.progress import Progress
from dynakin.report.insights import doubts_forces, in_short, insights
from dynakin.results.failures import Failures
from dynakin.results.files.config import versions
from dynakin.results.measures.fit import SignalFit
from dynakin.results.measures.metrics import compute_metrics
from dynakin.settings.defaults import CUTOFF_HZ
from dynakin.settings.settings import Settings
from dynakin.studies.batch.dataset import Dataset, Session
from dynakin.studies.engine.build import build
from dynakin.studies.engine.journal import Journal, writing
from dynakin.studies.engine.pools import Pool, work
from dynakin.studies.engine.tasks import Failure, Task
from dynakin.units import COMPONENTS
from dynakin.validation.case import case_of
from dynakin.validation.files import flat
from dynakin.validation.methods import estimate_each
from dynakin.validation.table2 import MARKERS, Row, mean_fit, table2_of, trial_fits

Fits = dict[tuple[str, str], SignalFit]


@dataclass(frozen=True)
class Options:
    """How each trial is worked on. presets: to be compared; empty: each configuration's own. cutoff_hz: of the
    reference methods. files: whether each trial's results are written too."""

    presets: tuple[str, ...] = ()
    cutoff_hz: float = CUTOFF_HZ
    files: bool = True


@dataclass(frozen=True, eq=False)
class Batch:
    """What came of a dataset.

    Attributes:
        rows: by session: ``fits`` (quantity, method, figures of `SignalFit`), ``verdict`` by preset, ``findings`` (the
            titles of what it warns of), ``doubts_forces`` (whether of its mass or forces), ``notes``, of these
            ``warnings``, ``events``, ``nis_per_dof``.
        failures: by session, why it gave nothing.
    """

    sessions: tuple[Session, ...]
    rows: dict[str, dict[str, Any]]
    failures: dict[str, Failure]

    def fits(self) -> dict[str, Fits]:
        """Fit of each (quantity, method), by session."""
        return {name: {(q, m): SignalFit(*values) for q, m, *values in row["fits"]} for name, row in self.rows.items()}

    @property
    def doubted(self) -> list[str]:
        """Sessions with findings that doubt their mass or forces."""
        return [name for name, row in self.rows.items() if row["doubts_forces"]]

    def table2(self) -> list[Row]:
        """The paper's Table II, mean and standard deviation over trials."""
        return table2_of([_without_markers(fits) for fits in self.fits().values()])

    def table2_of_subjects(self) -> list[Row]:
        """The same over subjects, each the mean of its trials: the figure for people who were not measured."""
        by_subject: dict[str, list[Fits]] = {}
        for name, fits in self.fits().items():
            by_subject.setdefault(name.split("/")[0], []).append(_without_markers(fits))
        return table2_of([_mean(fits) for fits in by_subject.values()])


def _without_markers(fits: Fits) -> Fits:
    """Not marker by marker: subjects may wear other ones."""
    return {key: fit for key, fit in fits.items() if key[0] in (MARKERS, *COMPONENTS)}


def _mean(every: Sequence[Fits]) -> Fits:
    keys = dict.fromkeys(key for fits in every for key in fits)
    return {key: mean_fit([fits[key] for fits in every if key in fits]) for key in keys}


def work_on(options: Options, payload: Session) -> dict[str, Any]:
    """One trial: read, estimated, compared with the reference methods, and written where files are wanted."""
    config = Settings.of(payload.content, payload.name)
    case = case_of(config, options.presets, options.cutoff_hz)
    failures = Failures()
    estimates, lost, estimators = estimate_each(case.recording, case.setup, static=case.static, failures=failures)
    result = judged(case, estimates, lost, estimators, failures, tolerant=False, observability=False)
    if options.files:
        result.save(config.output, check=False)
    trial = result.comparison
    if trial is None or failures.found:
        saved = "the results are saved. " if options.files else ""
        raise DynakinError(f"{saved}{' '.join(map(str, failures.messages()))}")
    metrics = {name: compute_metrics(estimate) for name, estimate in estimates.items()}
    found = {name: insights(estimate, metrics[name]) for name, estimate in estimates.items()}
    said = [*trial.notes, *result.estimate.messages]
    return {
        "fits": [[*key, *fit] for key, fit in trial_fits(trial).items()],
        "verdict": {name: in_short(each) for name, each in found.items()},
        "findings": list(dict.fromkeys(i.title for each in found.values() for i in each if i.level == "warning")),
        "doubts_forces": any(map(doubts_forces, found.values())),
        "notes": list(map(str, said)),
        "warnings": [message.text for message in warnings_of(said)],
        "lost": lost,
        "nis_per_dof": {name: m["consistency"]["mean_nis_per_dof"] for name, m in metrics.items()},
        "events": {
            name: {key: m["events"][key] for key in ("gated", "missing", "resets")} for name, m in metrics.items()
        },
        "parameters_at_bound": {name: m["events"]["parameters_at_bound"] for name, m in metrics.items()},
    }


TRIALS = "trials"
"""Of `belongs_to`: what each trial's row depends on alone, unless subjects are identified on several."""


def belongs_to(dataset: Dataset, options: Options, *, identify: bool = False) -> dict[str, Any]:
    """All that the rows of a batch depend on, for its journal: settings, and the files with their sizes and times.

    Files inside the study are named from its folder, so that this may be called from elsewhere, or moved.

    Args:
        identify: whether subjects are identified first (`identify_subjects`).
    """
    folder = dataset.path.parent
    return {
        "what": "batch",
        "version of dynakin": build(),
        "presets": {_inside(folder, name): _stamp(Path(name)) for name in options.presets},
        "--cutoff-hz": options.cutoff_hz,
        "results of single trials": options.files,
        "--identify": identify,
        TRIALS: {s.name: _depends_on(s.content, folder) for s in dataset.sessions},
    }


FILES = ("trial", "forces", "static", "parameters", "model", "markers", "table", "preset")
"""Keys that name files, or may."""


def _depends_on(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """A trial's keys, and size and time of each of its files: one that was changed has others. Not the folder of
    results, which may be moved."""
    named: dict[str, Any] = {key: _inside(folder, str(content[key])) for key in FILES if key in content}
    files = [str(content[key]) for key in FILES if key in content]
    functional = content.get("functional")
    if isinstance(functional, Mapping):
        files += map(str, functional.values())
        named["functional"] = {joint: _inside(folder, str(file)) for joint, file in functional.items()}
    stamps = {_inside(folder, name): stamp for name in files if (stamp := _stamp(Path(name)))}
    return {key: value for key, value in content.items() if key != "output"} | named | {"files": stamps}


def _inside(folder: Path, name: str) -> str:
    """A file from a study's folder where it lies in there, else in full; a name (of a preset, say) as it is."""
    if Path(name).name == name and not Path(name).is_file():
        return name
    file, of = (Path(os.path.normpath(path.absolute())) for path in (Path(name), folder))
    return file.relative_to(of).as_posix() if file.is_relative_to(of) else str(file)


def _stamp(file: Path) -> str:
    """Size and time of a file; "" of what is none, as a preset's name."""
    if not file.is_file():
        return ""
    changed = file.stat()
    return f"{changed.st_size} bytes of {changed.st_mtime_ns / 1e9:.6f}"


def run_batch(
    dataset: Dataset, options: Options, pool: Pool, *, journal: Journal | None, progress: Progress | None
) -> Batch:
    """Work on all trials; what is wrong with one is kept in ``failures`` and stops nothing."""
    tasks = [Task(session.name, session) for session in dataset.sessions]
    outcomes = work(pool, work_on, options, tasks, journal=journal, progress=progress)
    rows = {o.key: o.row for o in outcomes if o.row is not None}
    failures = {o.key: o.failure for o in outcomes if o.failure is not None}
    return Batch(dataset.sessions, rows, failures)


def write_batch(folder: Path, batch: Batch, identified: Mapping[str, Mapping[str, Any]] | None = None) -> list[str]:
    """``table2.csv`` (over trials), ``table2_subjects.csv`` (over subjects), ``trials.csv`` (a row a trial, quantity
    and method, with the trial's findings) and ``batch.json`` (what failed and why, verdicts, notes, events, subjects).

    Args:
        identified: what came of `identify_subjects`.

    Returns:
        names of the files; tables without a row are not written.

    Raises:
        OutputError: a file cannot be written.
    """
    tables = {
        "table2": [flat(row) for row in batch.table2()],
        "table2_subjects": [flat(row) for row in batch.table2_of_subjects()],
    }
    tables["trials"] = [
        {"trial": name, "quantity": quantity, "method": method}
        | dict(zip(SignalFit._fields, fit, strict=True))
        | {"findings": "; ".join(batch.rows[name]["findings"])}
        for name, fits in batch.fits().items()
        for (quantity, method), fit in fits.items()
    ]
    filled = {f"{name}.csv": rows for name, rows in tables.items() if rows}
    with writing(folder):
        for name, rows in filled.items():
            write_csv(folder / name, rows)
        write_json(
            folder / "batch.json",
            {
                "versions": versions(),
                "subjects": dict(identified or {}),
                "trials": {name: {k: v for k, v in row.items() if k != "fits"} for name, row in batch.rows.items()},
                "failed": {
                    name: {"message": failure.message, "unexpected": failure.unexpected, "details": failure.details}
                    for name, failure in batch.failures.items()
                },
            },
        )
    return [*filled, "batch.json"]
