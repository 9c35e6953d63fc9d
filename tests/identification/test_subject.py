"""From trials to a subject file and back into the filter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynakin.cli import main
from dynakin.errors import ModelError
from dynakin.filter.extend import initial_covariance
from dynakin.identification import Decision, Identified, change_between, change_in_words
from dynakin.identification.decision import parts_of
from dynakin.model.identified import read_identified, with_identified
from identification.conftest import Case, estimator


def test_a_subject_is_possible_weighs_the_same_and_survives_its_file(identified: Identified, tmp_path: Path) -> None:
    subject = identified.subject
    m, mx, my, izz = np.array(subject.batch.values).reshape(-1, 4).T
    assert (m > 0.0).all() and (m * izz > mx**2 + my**2).all()
    assert m.sum() == pytest.approx(70.0, rel=1e-9)
    subject.write(tmp_path / "subject.toml")
    assert read_identified(tmp_path / "subject.toml") == subject


def test_the_table_is_kept_where_bodies_do_not_predict_better(identified: Identified) -> None:
    ratios = identified.decision.ratios("bodies")
    assert (identified.decision.use == "bodies") == bool(ratios.mean() <= 0.97 and ratios.max() <= 1.10)
    rms = {"table": np.ones((2, 3)), "bodies": np.full((2, 3), 1.01)}
    said = Decision("table", ("a", "b"), rms).in_words()  # type: ignore[arg-type]
    assert said[-1].startswith("The table is kept: held-out gain -1 %")


def test_the_filter_starts_from_an_identified_subject(identified: Identified, case: Case) -> None:
    subject = identified.subject.model_copy(update={"use": "bodies"})
    plain, other = estimator(), estimator()
    other.parameters = subject
    before, after = (e.start(case.sims[0].recording, static=case.common.static) for e in (plain, other))
    at = [after.names.index(name) for name in subject.batch.names]
    np.testing.assert_allclose(after.x0[at], subject.batch.values, rtol=1e-9)
    P = initial_covariance(after, other.noise)
    assert np.linalg.eigvalsh(P / np.sqrt(np.outer(np.diag(P), np.diag(P)))).min() > 0.0
    masses = [after.names.index(n) for n in subject.batch.names if n.endswith("mass")]
    assert np.sqrt(P[np.ix_(masses, masses)].sum()) < 0.5
    assert (after.lower <= after.x0).all() and (after.x0 <= after.upper).all()
    kept = with_identified(before, identified.subject.model_copy(update={"use": "table"}))
    np.testing.assert_array_equal(kept.x0, before.x0)


def test_another_model_or_another_person_is_refused(identified: Identified, case: Case) -> None:
    start = case.common.initial
    with pytest.raises(ModelError, match="of model squat7, expected sagittal7"):
        with_identified(start, identified.subject.model_copy(update={"model": "squat7"}))
    with pytest.raises(ModelError, match=r"of somebody of 60\.0 kg, expected 70\.0 kg"):
        with_identified(start, identified.subject.model_copy(update={"mass_kg": 60.0}))


def test_few_trials_are_halved_and_many_are_not(case: Case) -> None:
    assert len(parts_of(case.trials)) == 4
    assert len(parts_of([*case.trials, case.trials[0]])) == 3


def test_change_between_two_sessions(identified: Identified) -> None:
    before = identified.subject
    assert not any(change.clear for change in change_between(before, before))
    values = np.array(before.batch.values)
    values[before.batch.names.index("inertia/trunk/my")] += 5.0
    batch = before.batch.model_copy(update={"values": tuple(values.tolist())})
    changes = change_between(before, before.model_copy(update={"batch": batch}))
    assert changes[0].clear and changes[0].difference == pytest.approx(5.0, rel=1e-6)
    assert "trunk first moment" in " ".join(change_in_words(changes, (70.0, 70.0)))


def test_command_line(case: Case, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = case.sims[0].save(tmp_path / "trial")
    trial = next(folder.glob("*.trc"))
    forces = folder / "forces.mot"
    file = tmp_path / "subject.toml"
    options = ["--model", "sagittal7", "--markers", "opencap", "--mass", "70", "--sex", "male"]
    assert main(["identify", str(trial), "--forces", str(forces), *options, "-o", str(file)]) == 0
    assert "base parameters" in capsys.readouterr().out
    assert main(["identify", "--compare", str(file), str(file)]) == 0
    assert "None of 22 base parameters changed" in " ".join(capsys.readouterr().out.split())
    out = tmp_path / "out"
    run = ["run", str(trial), "--forces", str(forces), *options, "--parameters", str(file), "-o", str(out)]
    assert main(run) == 0
    assert 'use = "' in file.read_text() and (out / "config.toml").is_file()
    assert main(["identify", str(trial), "--model", "sagittal7"]) == 2
    assert "-o subject.toml" in capsys.readouterr().err
