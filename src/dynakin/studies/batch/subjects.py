"""Each subject of a dataset identified on its own trials: its inertia replaces the table where it predicts better."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path
from typing import Any

from dynakin.errors import DynakinError, OutputError
from dynakin.filter.build import estimator_of
from dynakin.filter.estimator import Estimator
from dynakin.identification.subject import identify_subject
from dynakin.identification.trials import Common
from dynakin.progress import Progress
from dynakin.recordings.companions import another_person, of_most
from dynakin.recordings.recording import Recording
from dynakin.settings import presets
from dynakin.settings.lag import can_smooth
from dynakin.settings.settings import Settings
from dynakin.studies.batch.dataset import OF_A_TRIAL, Dataset, Session
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import Pool, work
from dynakin.studies.engine.tasks import Outcome, Task
from dynakin.validation.case import Case, case_of

FILE = "subject.toml"
"""What identification writes into a subject's folder, and what its trials take as `parameters`."""
MOST_TRIALS = 8
"""Each trial more costs a fit of all others; a person's first eight show what a table does not know."""


@dataclass(frozen=True)
class IdentifyOptions:
    """Where subjects' files go: ``output``/SUBJECT/subject.toml."""

    output: Path


def subject_tasks(dataset: Dataset) -> list[Task]:
    """One a subject with at least two trials whose parameters are not given."""
    by_subject: dict[str, list[Session]] = {}
    for session in dataset.sessions:
        by_subject.setdefault(session.subject, []).append(session)
    return [
        Task(subject, tuple(sessions))
        for subject, sessions in by_subject.items()
        if len(sessions) > 1 and not any("parameters" in session.content for session in sessions)
    ]


def identify_on_trials(options: IdentifyOptions, payload: Sequence[Session]) -> dict[str, Any]:
    """Identify a subject on the trials that have plates, and write the file. What cannot be identified keeps the table.

    Returns:
        use: "bodies" or "table". said: sentences, the last one the verdict. doubts: those of them that say what is
            left out, or warn. file: what was written, None: nothing.
    """
    try:
        estimator, recordings, static, left_out = _trials(payload)
        if len(recordings) < 2:
            return _kept(
                f"{len(recordings)} of {len(payload)} trials can be identified on, expected two; {'; '.join(left_out)}"
            )
        found = identify_subject(estimator, recordings, static=static)
    except OutputError:
        raise
    except DynakinError as error:
        return _kept(error.message)
    file = options.output / payload[0].subject / FILE
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{file}: cannot be written ({error.strerror or error})") from None
    found.subject.write(file)
    doubts = [*(f"Left out: {text}." for text in left_out), *map(str, (*found.lost, *found.warned))]
    return {
        "use": found.subject.use,
        "said": [*doubts, *found.decision.in_words()],
        "doubts": doubts,
        "file": str(file),
    }


def identify_subjects(
    dataset: Dataset, pool: Pool, *, journal: Journal | None, progress: Progress | None
) -> dict[str, dict[str, Any]]:
    """Rows of `identify_on_trials` by subject. One that fails unexpectedly keeps the table, and says why; that is kept
    in the journal, so that a batch that goes on works on all trials of a subject alike."""
    tasks = subject_tasks(dataset)
    outcomes = work(
        pool, identify_on_trials, IdentifyOptions(dataset.output), tasks, journal=journal, progress=progress
    )
    rows = {}
    for outcome in outcomes:
        rows[outcome.key] = outcome.row or _kept(f"identification failed: {_message(outcome)}")
        if outcome.row is None and journal is not None:
            journal.add(outcome.key, rows[outcome.key])
    return rows


def with_parameters(dataset: Dataset, identified: Mapping[str, Mapping[str, Any]]) -> Dataset:
    """The dataset whose trials take what was identified of their subject (`parameters`), where that is used.

    Args:
        identified: of `identify_subjects`.
    """
    used = {subject for subject, row in identified.items() if row["use"] == "bodies"}

    def given(session: Session) -> Session:
        if session.subject not in used:
            return session
        file = dataset.output / session.subject / FILE  # where the folder lies now
        return replace(session, content=session.content | {"parameters": str(file)})

    return replace(dataset, sessions=tuple(given(session) for session in dataset.sessions))


def _message(outcome: Outcome) -> str:
    return "no reason is known" if outcome.failure is None else outcome.failure.message


def _kept(why: str) -> dict[str, Any]:
    return {"use": "table", "said": [f"The table is kept: {why}."], "doubts": [], "file": None}


def _trials(sessions: Sequence[Session]) -> tuple[Estimator, list[Recording], Recording | None, list[str]]:
    """An estimator with a smoother, the trials with plates that fit the subject, the standing trial, and a sentence on
    each of the others."""
    alike = [_shared(session.content) for session in sessions]
    if any(keys != alike[0] for keys in alike):
        other = next(s.name for s, keys in zip(sessions, alike, strict=True) if keys != alike[0])
        raise DynakinError(f"{other} has other settings than {sessions[0].name}, expected the same for all its trials")
    said: list[str] = []
    cases = _with_plates(sessions, said)
    first = list(islice(cases, MOST_TRIALS))
    if not first:
        raise DynakinError("; ".join(said))
    estimator, static = estimator_of(first[0][1].config), first[0][1].static
    if not can_smooth(estimator.noise):
        estimator = replace(estimator, noise=presets.default())
    reference = of_most([case.recording for _, case in first], static)
    chosen: list[Recording] = []
    common: Common | None = None
    for session, case in chain(first, cases):
        if len(chosen) == MOST_TRIALS:
            break
        try:
            common = common or _measured(estimator, case, reference)
            common.check(case.recording)
        except DynakinError as error:
            said.append(f"{session.name}: {error.message}")
            continue
        chosen.append(case.recording)
    return estimator, chosen, static, said


def _with_plates(sessions: Sequence[Session], said: list[str]) -> Iterator[tuple[Session, Case]]:
    """Trials that can be read and have plates, under their names in the dataset; ``said`` takes what others lack."""
    for session in sessions:
        try:
            case = case_of(Settings.of(session.content, session.name))
        except DynakinError as error:
            said.append(f"{session.name}: {error.message}")
            continue
        if case.recording.plates:
            yield session, replace(case, recording=replace(case.recording, name=session.trial))
        else:
            said.append(f"{session.name} has no force plates")


def _measured(estimator: Estimator, case: Case, reference: Recording) -> Common:
    """The model as measured on a trial of the person of ``reference``.

    Raises:
        DynakinError: it shows somebody else, or cannot be measured on.
    """
    if other := another_person(case.recording, reference):
        raise DynakinError(f"{case.recording.path or case.recording.name}: {other}")
    return Common.measure(estimator, case.recording, case.static, reference)


def _shared(content: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in content.items() if key not in OF_A_TRIAL}
