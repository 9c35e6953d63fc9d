"""From trials to a subject file and back into the filter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynakin.cli.app import main
from dynakin.errors import LostError, ModelError, RecordingError
from dynakin.filter.augment import initial_covariance
from dynakin.identification import decision
from dynakin.identification.decision import Decision, decide, parts_of
from dynakin.identification.report import change_between, change_in_words
from dynakin.identification.subject import Identification, identify_subject, warned
from dynakin.identification.trials import Common, MeasuredTrial, measure_all
from dynakin.messages import note, warning, warnings_of
from dynakin.model.identified import IdentifiedSubject, read_identified, with_identified
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate
from support.identification import Case
from support.squat_estimator import estimator

TABLE, BODIES = np.zeros((1, 6)), np.ones((1, 6))
"""Predictions that stand for the candidates."""


def test_a_subject_is_possible_weighs_the_same_and_survives_its_file(
    identified: Identification, tmp_path: Path
) -> None:
    subject = identified.subject
    m, mx, my, izz = np.array(subject.batch.values).reshape(-1, 4).T
    assert (m > 0.0).all() and (m * izz > mx**2 + my**2).all()
    assert m.sum() == pytest.approx(70.0, rel=1e-9)
    subject.write(tmp_path / "subject.toml")
    assert read_identified(tmp_path / "subject.toml") == subject


def test_a_subject_says_by_how_much_it_predicts_better(identified: Identification, case: Case, tmp_path: Path) -> None:
    held_out = identified.subject.held_out
    assert held_out is not None and len(held_out.parts) == 4 and held_out.components == ("fx", "fy", "mz")
    gain = 100.0 * (1.0 - (np.array(held_out.bodies) / np.array(held_out.table)).mean())
    assert f"predicted {gain:+z.0f} % better from markers alone (FX" in held_out.in_words()
    used = with_identified(case.common.initial, identified.subject.model_copy(update={"use": "bodies"}))
    assert str(used.messages[-1]).endswith(f"{held_out.in_words()}.")
    before = identified.subject.model_copy(update={"held_out": None})  # a file of an earlier version
    before.write(tmp_path / "subject.toml")
    assert read_identified(tmp_path / "subject.toml") == before
    for wrong in ({"bodies": held_out.bodies[:1]}, {"table": ((0.0, 1.0, 1.0),) * 4}, {"parts": (), "table": ()}):
        with pytest.raises(ValueError, match=r"row a part|positive|left out"):
            type(held_out).model_validate(held_out.model_dump() | wrong)


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        ((0.96, 0.97), "bodies"),
        ((0.99, 0.98), "table"),  # a gain of less than 3 %
        ((1.0, 1.0), "table"),
        ((1.09, 0.80), "bodies"),
        ((1.12, 0.70), "table"),  # one part loses more than 10 %
    ],
)
def test_the_table_is_kept_where_bodies_do_not_predict_better(
    parts: tuple[float, float], expected: str, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bodies' predictions are made so many times as far off as the table's, part by part in turn."""
    factors = iter([factor for factor in parts for _ in range(2)])  # low-passed and in the full band

    def made(common: Common, trial: MeasuredTrial, predicted: np.ndarray) -> np.ndarray:
        return np.ones(3) if predicted is TABLE else np.full(3, next(factors))

    class Posterior:
        def __init__(self, wrench: np.ndarray) -> None:
            self.wrench = lambda common, states: wrench

    monkeypatch.setattr(decision, "parts_of", lambda trials: trials)
    monkeypatch.setattr(decision, "rms_of", made)
    candidates = {"table": Posterior(TABLE), "bodies": Posterior(BODIES)}
    monkeypatch.setattr(decision, "posteriors", lambda common, others: candidates)
    decided = decide(case.common, case.trials)
    np.testing.assert_allclose(decided.ratios, parts)
    assert decided.use == expected
    begins = "The table is kept" if expected == "table" else "The identified segment inertia is used"
    assert decided.in_words()[-1].startswith(begins)


def test_a_gain_is_said_with_its_sign() -> None:
    rms = {"table": np.ones((2, 3)), "bodies": np.full((2, 3), 1.01)}
    said = Decision("table", ("a", "b"), rms, rms).in_words()  # type: ignore[arg-type]
    assert said[-1].startswith("The table is kept: held-out gain -1 %")
    same = {"table": np.ones((2, 3)), "bodies": np.full((2, 3), 1.001)}
    assert said[1].startswith("Table: ") and said[2].startswith("Identified parameters: ")
    assert "-0 %" not in " ".join(Decision("table", ("a", "b"), same, same).in_words())  # type: ignore[arg-type]


@pytest.mark.parametrize(("full_band", "expected"), [(0.99, "bodies"), (1.01, "table")])
def test_noise_of_accelerations_may_outweigh_what_bodies_explain(full_band: float, expected: str) -> None:
    table = np.ones((2, 3))
    decided = Decision("bodies", ("a", "b"), {"table": table, "bodies": 0.7 * table},
                       {"table": 5.0 * table, "bodies": 5.0 * full_band * table})  # fmt: skip
    assert decided.full_band_use == expected
    assert replace(decided, use="table").full_band_use == "table"


def test_the_filter_starts_from_an_identified_subject(identified: Identification, case: Case) -> None:
    subject = identified.subject.model_copy(update={"use": "bodies"})
    plain = estimator()
    other = replace(plain, parameters=subject)
    before, after = (e.start(case.sims[0].recording, static=case.common.static).calibrated for e in (plain, other))
    at = [after.names.index(name) for name in subject.batch.names]
    np.testing.assert_allclose(after.x0[at], subject.batch.values, rtol=1e-9)
    P = initial_covariance(after, other.noise)
    assert np.linalg.eigvalsh(P / np.sqrt(np.outer(np.diag(P), np.diag(P)))).min() > 0.0
    masses = [after.names.index(n) for n in subject.batch.names if n.endswith("mass")]
    assert np.sqrt(P[np.ix_(masses, masses)].sum()) < 0.5
    assert (after.lower <= after.x0).all() and (after.x0 <= after.upper).all()
    kept = with_identified(before, identified.subject.model_copy(update={"use": "table"}))
    np.testing.assert_array_equal(kept.x0, before.x0)


def test_another_model_or_another_person_is_refused(identified: Identification, case: Case) -> None:
    start = case.common.initial
    with pytest.raises(ModelError, match="of model squat7, expected sagittal7"):
        with_identified(start, identified.subject.model_copy(update={"model": "squat7"}))
    with pytest.raises(ModelError, match=r"of somebody of 60\.0 kg, expected 70\.0 kg"):
        with_identified(start, identified.subject.model_copy(update={"mass_kg": 60.0}))


def test_few_trials_are_halved_and_many_are_not(case: Case) -> None:
    assert len(parts_of(case.trials)) == 4
    assert len(parts_of([*case.trials, case.trials[0]])) == 3
    brief = [trial.part(slice(0, 40)) for trial in case.trials]  # 1.6 s at 25 Hz: no half has a second
    assert [len(part.movement.time) for part in parts_of(brief)] == [40, 40]
    decided = decide(case.common, brief)
    assert decided.folds == tuple(trial.movement.recording.name for trial in brief)


def test_a_half_that_is_too_short_is_called_one(case: Case) -> None:
    brief = case.trials[0].part(slice(0, 40))  # 1.6 s at 25 Hz
    with pytest.raises(RecordingError, match=r"0\.\d+ s of frames .*, expected 1 s or more in one trial or its half: "):
        decide(case.common, [brief])


def none(subject: IdentifiedSubject) -> tuple[tuple[float, ...], ...]:
    """A covariance of 0."""
    return tuple((0.0,) * len(subject.batch.names) for _ in subject.batch.names)


def test_change_between_two_sessions(identified: Identification) -> None:
    before = identified.subject
    assert not any(change.clear for change in change_between(before, before))
    values = np.array(before.batch.values)
    values[before.batch.names.index("inertia/trunk/my")] += 5.0
    rounded = before.batch.model_copy(
        update={"values": tuple(np.array(before.batch.values) * (1.0 + 1e-15)), "covariance": none(before)}
    )
    exact = before.model_copy(update={"batch": before.batch.model_copy(update={"covariance": none(before)})})
    assert not any(change.clear for change in change_between(exact, exact.model_copy(update={"batch": rounded})))
    batch = before.batch.model_copy(update={"values": tuple(values.tolist())})
    changes = change_between(before, before.model_copy(update={"batch": batch}))
    assert changes[0].clear and changes[0].difference == pytest.approx(5.0, rel=1e-6)
    assert "trunk first moment" in " ".join(change_in_words(changes, (70.0, 70.0)))


OPTIONS = ["--model", "sagittal7", "--markers", "opencap", "--mass", "70", "--sex", "male"]


@pytest.fixture(scope="module")
def files(case: Case, tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Markers of two trials, their forces beside them."""
    root = tmp_path_factory.mktemp("trials")
    return [str(next(sim.save(root / sim.recording.name).glob("*.trc"))) for sim in case.sims]


def test_command_line(files: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command_line(files, tmp_path, capsys)


@pytest.mark.nightly
def test_command_line_and_a_run_with_what_it_wrote(
    files: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = command_line(files, tmp_path, capsys), tmp_path / "out"
    assert main(["run", files[0], "--forces", files[0].replace("markers.trc", "forces.mot"), *OPTIONS,
                 "--parameters", str(file), "-o", str(out)]) == 0  # fmt: skip
    said = " ".join(capsys.readouterr().out.split())
    assert "Parameters" in said and "Identified inertial parameters are used, of foot, shank, thigh" in said
    assert 'use = "' in file.read_text() and 'identified = "' in (out / "config.toml").read_text()
    assert main(["run", str(out / "config.toml")]) == 0  # that record is no key that a run trips over


def command_line(files: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    file = tmp_path / "subject.toml"
    assert main(["identify", *files, *OPTIONS, "-o", str(file)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for words in ("held-out gain", "70.00 kg of 70.00", "base parameters", "first half of simulated_squat_3/markers"):
        assert words in said
    assert "Identified parameters: FX" in said and "of the sums that hold" in said
    assert "/m" not in said.partition("of the sums that hold")[2].partition(": these lean")[0]
    assert [path.name for path in tmp_path.iterdir()] == ["subject.toml"]
    assert main(["identify", "--compare", str(file), str(file)]) == 0
    assert "None of 22 base parameters changed" in " ".join(capsys.readouterr().out.split())
    return file


def test_what_is_wrong_with_the_input_is_one_line_and_nothing_is_written(
    files: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "subject.toml"
    alone = tmp_path / "alone.trc"
    alone.write_bytes(Path(files[1]).read_bytes())
    copy = tmp_path / "copy" / "markers.trc"
    copy.parent.mkdir()
    for name in ("markers.trc", "forces.mot"):
        copy.with_name(name).write_bytes(Path(files[1]).with_name(name).read_bytes())
    heavier = [*OPTIONS[:4], "--mass", "75", *OPTIONS[6:]]
    no_mass = [*OPTIONS[:4], *OPTIONS[6:]]
    cases = {
        "expected at least two of the same subject": [files[0], *OPTIONS],
        f"{files[1]} and {copy}: the markers are the same": [*files, str(copy), *OPTIONS],
        "is given twice": [files[0], files[0], *OPTIONS],
        "no force plates": [files[0], str(alone), *OPTIONS],
        "the subject weighs 75.0 kg (expected within 4 %)": [*files, *heavier],
        "the body mass is not known": [*files, *no_mass],
        "nowhere.trc": [files[0], str(tmp_path / "nowhere.trc"), *OPTIONS],
        "1 force file for 2 trials": [*files, "--forces", "a.mot", *OPTIONS],
    }
    for expected, arguments in cases.items():
        assert main(["identify", *arguments, "-o", str(file)]) == 2, expected
        captured = capsys.readouterr()
        assert expected in captured.err and captured.err.count("\n") == 1
        assert not captured.out and not file.exists()
    assert main(["identify", *files, *OPTIONS, "-o", str(tmp_path / "no" / "subject.toml")]) == 2
    assert "in a folder that exists" in capsys.readouterr().err


def test_a_mass_that_the_plates_contradict_is_named(case: Case) -> None:
    lighter = replace(case.common, initial=replace(case.common.initial, mass_kg=66.0))
    with pytest.raises(
        RecordingError, match=r"the subject weighs 66\.0 kg .*: another mass \(--mass\), another person"
    ):
        lighter.check(case.sims[0].recording)


def test_another_person_and_other_markers_are_named(case: Case) -> None:
    first = case.sims[0].recording
    child = simulate("sagittal7", "squat", 3, 5.0, height_m=1.4, mass_kg=70.0).recording
    with pytest.raises(RecordingError, match=r"differ by \d+ mm .* another person.* expected trials of one person"):
        case.common.check(child)
    renamed = replace(first, marker_names=tuple(f"M{k}" for k in range(len(first.marker_names))))
    with pytest.raises(RecordingError, match=r"only 0 markers are in both .* share no marker set"):
        case.common.check(renamed)


def test_warnings_of_the_calibration_are_part_of_what_is_found(case: Case, identified: Identification) -> None:
    assert identified.warned == ()
    another, short = warning("calibration", "another person."), warning("calibration", "a leg is short.")
    doubtful = replace(case.common.initial, messages=(another, note("mass", "Mass 70 kg: given.")))
    trial = replace(case.trials[0].movement, doubts=(another, short))
    said = warned(replace(case.common, initial=doubtful), [replace(case.trials[0], movement=trial)])
    assert said == (another, short.of(case.sims[0].recording.name))


def test_a_first_trial_that_lends_its_lengths_is_not_blamed_for_moving(case: Case) -> None:
    """Nobody gave it as a standing trial, and each run of it says nothing; a given one in which nobody stands is."""
    squat, sitting = (sim.recording.window(1.5, 4.0) for sim in case.sims)
    common = Common.measure(estimator(), squat)
    trials = measure_all(common, [squat, sitting])
    assert not any("nobody stands still" in str(message) for message in warned(common, trials))
    given = Common.measure(estimator(), sitting, static=squat)
    said = [str(message) for message in warned(given, measure_all(given, [sitting]))]
    assert sum("nobody stands still in" in text for text in said) == 1


def pulled(recording: Recording, frames: slice) -> Recording:
    """By a cable that bears 300 N in some frames, which no plate measures."""
    plates = []
    for plate in recording.plates:
        force = plate.force.copy()
        force[frames, 1] -= 300.0 / len(recording.plates)
        plates.append(replace(plate, force=force))
    return recording.with_plates(tuple(plates))


def test_frames_in_which_plates_do_not_fit_the_motion_are_left_out_and_told(
    case: Case, identified: Identification, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    doubted = pulled(case.sims[0].recording, slice(300, 500))
    trial = case.common.with_plates(case.trials[0].movement, doubted)
    left_out = np.isnan(trial.wrench).all(axis=1)
    assert left_out[78:122].all() and left_out.mean() < 0.5
    (said,) = warned(case.common, [trial])
    assert said.level == "warning" and "upwards than the motion" in said.text
    assert said.text.startswith(f"{doubted.name}: the plates carry up to ")

    subject = identified.subject.model_copy(update={"use": "bodies", "warnings": (str(said),)})
    subject.write(file := tmp_path / "subject.toml")
    assert read_identified(file) == subject
    used = with_identified(case.common.initial, subject)
    assert list(map(str, warnings_of(used.messages))) == [
        "Warning: the identified parameters come from trials that are doubted (1 warning in the subject file)."
    ]
    assert not warnings_of(with_identified(used, identified.subject).messages[len(used.messages) :])
    assert main(["identify", "--compare", str(file), str(file)]) == 0
    assert "the plates carry up to" in capsys.readouterr().out


def test_a_trial_of_which_the_motion_leaves_no_second_is_refused(case: Case) -> None:
    brief = case.sims[0].recording.window(0.0, 1.6)
    with pytest.raises(RecordingError, match=r"the motion for 0\.\d+ s, expected 1 s or more: .*plates carry up to"):
        case.common.check(pulled(brief, slice(50, 120)))


def mislabelled(recording: Recording) -> Recording:
    """From 3 to 6 s every marker but the feet's carries another one's label: no posture fits."""
    markers = recording.markers.copy()
    others = [k for k, n in enumerate(recording.marker_names) if not n.endswith(("toe", "5meta", "calc"))]
    markers[300:600, others] = np.roll(markers[300:600][:, others], 5, axis=1)
    return replace(recording, name="mislabelled", markers=markers)


def test_a_trial_that_is_lost_is_left_out_and_a_lone_one_refused(case: Case) -> None:
    """0.1 and later identified on it without a word."""
    squat, sitting = (sim.recording for sim in case.sims)
    lost = mislabelled(squat)
    with pytest.raises(LostError, match=r"mislabelled.*the person was lost.*no trial is left to identify on"):
        identify_subject(estimator(), [lost], static=case.common.static)
    with pytest.raises(LostError, match=r"mislabelled.*the person was lost.*one trial is left to identify on"):
        identify_subject(estimator(), [lost, sitting], static=case.common.static)
    found = identify_subject(estimator(), [lost, squat, sitting], static=case.common.static)
    assert found.subject.trials == (squat.name, sitting.name)
    (said,) = found.lost
    assert str(said) == found.subject.report[0] and "left out: " in said.text and "mislabelled" in said.text


def test_frames_in_which_nobody_sees_a_limb_teach_nothing_and_are_told(case: Case) -> None:
    """The pelvis of a squat was 21 deg off meanwhile; the subject's file had no warning."""
    markers = (recording := case.sims[0].recording).markers.copy()
    gone = [k for k, n in enumerate(recording.marker_names) if n.endswith(("toe", "5meta", "calc", "ankle"))]
    gone += [k for k, n in enumerate(recording.marker_names) if "sh" in n and "Shoulder" not in n]
    markers[300:370, gone] = np.nan
    (trial,) = measure_all(case.common, [replace(recording, markers=markers)])
    lost = trial.movement.lost
    assert 10 < lost.sum() < 40 and np.isnan(trial.wrench[lost]).all() and np.isfinite(trial.wrench[~lost]).any()
    assert any("No marker is seen of" in str(message) for message in warned(case.common, [trial]))


def test_lost_frames_of_a_trial_that_is_followed_say_nothing_of_the_body(case: Case) -> None:
    markers = (recording := case.sims[0].recording).markers.copy()
    others = [k for k, n in enumerate(recording.marker_names) if not n.endswith(("toe", "5meta", "calc"))]
    markers[300:370, others] = np.roll(markers[300:370][:, others], 5, axis=1)
    (trial,) = measure_all(case.common, [replace(recording, markers=markers)])
    lost = trial.movement.lost
    assert 10 < lost.sum() < 40 and np.isnan(trial.wrench[lost]).all() and np.isfinite(trial.wrench[~lost]).any()
    assert trial.part(slice(10, 20)).movement.lost.shape == (10,)


def test_a_file_that_does_not_fit_is_refused(
    identified: Identification, files: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    batch = identified.subject.batch
    names = ("inertia/tail/mass", *batch.names[1:])
    identified.subject.model_copy(update={"batch": batch.model_copy(update={"names": names})}).write(
        tmp_path / "tail.toml"
    )
    with pytest.raises(ModelError, match="inertia/tail/mass"):
        with_identified(identified.common.initial, read_identified(tmp_path / "tail.toml"))
    short = batch.model_copy(update={"values": batch.values[1:]})
    identified.subject.model_copy(update={"batch": short}).write(tmp_path / "short.toml")
    with pytest.raises(ModelError, match="27 values for 28 names"):
        read_identified(tmp_path / "short.toml")
    identified.subject.write(tmp_path / "subject.toml")
    other = ["--model", "fullbody", *OPTIONS[2:], "--parameters", str(tmp_path / "subject.toml")]
    forces = files[0].replace("markers.trc", "forces.mot")
    assert main(["run", files[0], "--forces", forces, *other, "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "out").exists()
