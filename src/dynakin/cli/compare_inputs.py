"""What `compare` and `tune` are given, one case a trial: the recording and how it is worked on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dynakin.cli.options import Given
from dynakin.cli.prepared import forces_beside
from dynakin.errors import ConfigError, RecordingError
from dynakin.messages import Message, note
from dynakin.recordings.companions import copies_among
from dynakin.recordings.recording import Recording
from dynakin.results.naming import plural
from dynakin.settings.settings import Settings, read_keys
from dynakin.validation.case import Case, case_of
from dynakin.validation.held_out import halves


def chosen_trials(
    trials: Sequence[Path], identify_trial: Path | None, test_trial: Path | None, needs_trials: bool
) -> list[Path]:
    """The trials to read: those given, or the identifying and the judging one.

    Raises:
        ConfigError: half of a pair, or options that do not go together.
    """
    if identify_trial is None and test_trial is None:
        return list(trials)
    if identify_trial is None or test_trial is None:
        missing = "--test-on" if test_trial is None else "--identify-on"
        raise ConfigError(f"compare: {missing} is missing, expected --identify-on A together with --test-on B")
    if trials or needs_trials:
        raise ConfigError(
            "compare: --identify-on A --test-on B stands alone, expected no further TRIAL, --halves or --unseen"
        )
    return [identify_trial, test_trial]


def halves_of(case: Case) -> tuple[Case, Case]:
    """The same trial in two."""
    first, second = halves(case.recording)
    return replace(case, recording=first), replace(case, recording=second)


def cases_of(
    trials: Sequence[Path],
    forces: Sequence[Path | None],
    presets: Sequence[str],
    cutoff_hz: float,
    given: Given,
    command: str = "compare",
) -> list[Case]:
    """One case a trial; a trial may be a configuration (.toml) of its own, over which the command line wins.

    Args:
        forces: none, or one a trial in the same order, None for one that has none. presets: by name; none: the
            configuration's own.
        given: further keys of the settings, of the command line. command: opens messages.

    Raises:
        DynakinError: anything wrong with the input, in one line.
    """
    if not trials:
        pair = ", or --identify-on A --test-on B" if command == "compare" else ""
        raise ConfigError(f"{command}: no trial was given, expected TRIAL...{pair}")
    if forces and len(forces) != len(trials):
        raise ConfigError(
            f"{command}: --forces was given {_times(len(forces))} for {plural(len(trials), 'trial')}, expected one for "
            "each, in the same order, or none"
        )
    files = [{"forces": force} if force else {} for force in forces] or [{}] * len(trials)
    cases = [_case(trial, given | file, presets, cutoff_hz, command) for trial, file in zip(trials, files, strict=True)]
    names = told_apart([case.recording for case in cases])
    return [
        replace(case, recording=replace(case.recording, name=name)) for case, name in zip(cases, names, strict=True)
    ]


def named_forces(path: Path) -> Path | None:
    """Ground forces in a trial's folder: as recordings are often named, or as `dynakin simulate` names them."""
    for name in (f"{path.stem}_grf.mot", *(["forces.mot"] if path.stem == "markers" else [])):
        if path.with_name(name).is_file():
            return path.with_name(name)
    return None


def forces_each(trials: Sequence[Path], forces: Sequence[Path]) -> list[Path | None]:
    """The ground forces that were given, or by `named_forces` of each trial."""
    return [*forces] or [named_forces(trial) for trial in trials]


def refuse_copies_of(cases: Sequence[Case]) -> None:
    """A mean over trials would count a copy twice, as if it had no deviation; and predict it because it knows it.

    Raises:
        RecordingError: two trials are one recording; both are named.
    """
    if found := copies_among([case.recording for case in cases]):
        one, other = (str(recording.path or recording.name) for recording in found)
        twice = f"{one} is given twice" if one == other else f"{one} and {other} are one recording"
        raise RecordingError(f"compare: {twice} (the markers are the same), expected different trials")


def refuse_without_plates(cases: Sequence[Case]) -> None:
    """Before anything that takes long.

    Raises:
        RecordingError: nothing was measured by which a prediction could be judged.
    """
    for recording in (case.recording for case in cases):
        if not recording.plates:
            beside = forces_beside(recording) or "--forces"
            raise RecordingError(
                f"{recording.path or recording.name}: no force plates, expected at least one: what is predicted is "
                f"judged by them ({beside})"
            )


def without_plates_in_words(cases: Sequence[Case]) -> list[Message]:
    """Of trials without plates that ground forces lie next to."""
    found = []
    for recording in (case.recording for case in cases):
        if not recording.plates and (beside := forces_beside(recording)):
            found.append(note("plates", f"No force plates; {beside}.").of(recording.name))
    return found


def told_apart(recordings: Sequence[Recording]) -> list[str]:
    """Names of recordings; where several have one, with their folder before it."""
    names = [recording.name for recording in recordings]
    return [
        f"{recording.path.parent.name}/{recording.name}"
        if names.count(recording.name) > 1 and recording.path is not None
        else recording.name
        for recording in recordings
    ]


def _case(trial: Path, given: Given, presets: Sequence[str], cutoff_hz: float, command: str) -> Case:
    is_config = trial.suffix.casefold() == ".toml"
    content = read_keys(trial) if is_config else {"trial": trial}
    # a configuration's own output is not where a comparison goes
    config = Settings.of(content | {"output": Path()}, str(trial) if is_config else command, given=given)
    return case_of(config, presets, cutoff_hz)


def _times(n: int) -> str:
    return "once" if n == 1 else f"{n} times"
