"""The engine: the same table whoever works, errors that stay with their task, runs that go on where they stopped."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dynakin.errors import ConfigError, OutputError
from dynakin.studies.engine.journal import Journal, difference
from dynakin.studies.engine.pools import open_pool, work
from dynakin.studies.engine.tasks import Task
from support import engine_tasks as functions

SHARED = {"base": 1.1}
TASKS = [Task(f"{k:03d}", float(k)) for k in range(12)]


def table(backend: str, **options) -> list[dict]:
    with open_pool(backend, 2) as pool:
        outcomes = work(pool, functions.power, SHARED, TASKS[::-1], **options)
    assert [outcome.key for outcome in outcomes] == sorted(task.key for task in TASKS)
    return [outcome.row for outcome in outcomes]


def test_processes_and_threads_give_the_same_table_in_the_order_of_keys():
    expected = [functions.power(SHARED, task.payload) for task in TASKS]
    assert table("threads") == table("processes") == expected


def test_an_error_stays_with_its_task():
    with open_pool("threads", 2) as pool:
        outcomes = work(pool, functions.choosy, None, [Task(str(k), k) for k in range(5)])
    assert [o.row for o in outcomes] == [{"value": 0}, {"value": 1}, None, None, {"value": 4}]
    known, bug = outcomes[2].failure, outcomes[3].failure
    assert known.message == "file 2: not a recording" and not known.unexpected
    assert bug.message == "ZeroDivisionError: nobody foresaw this" and bug.unexpected and "Traceback" in bug.details


def test_a_process_that_dies_once_costs_nothing(tmp_path: Path):
    with open_pool("processes", 2) as pool:
        tasks = [Task(str(k), k) for k in range(6)]
        outcomes = work(pool, functions.dies_once, str(tmp_path / "died"), tasks)
    assert [o.row for o in outcomes] == [{"value": k} for k in range(6)]


@pytest.mark.nightly
def test_a_task_that_kills_each_of_its_workers_is_named_and_the_others_are_done():
    with open_pool("processes", 2) as pool:
        outcomes = work(pool, functions.deadly, None, [Task(str(k), k) for k in range(6)])
    assert [o.key for o in outcomes if o.failure] == ["3"]
    assert "died" in outcomes[3].failure.message


class Stop(Exception):
    pass


def test_a_run_that_was_killed_goes_on_where_it_stopped(tmp_path: Path):
    path = tmp_path / "rows.jsonl"

    def stop_at_five(done: int, total: int) -> None:
        if done == 5:
            raise Stop

    with pytest.raises(Stop):
        table("threads", journal=Journal(path, SHARED), progress=stop_at_five)
    with path.open("a") as file:
        file.write('{"key": "011", "ro')  # killed while it wrote
    journal, seen = Journal(path, SHARED), []
    assert len(journal.rows) == 5
    rows = table("threads", journal=journal, progress=lambda done, total: seen.append((done, total)))
    assert rows == table("threads")
    assert seen[0] == (5, 12) and seen[-1] == (12, 12) and len(seen) == 8
    assert len([json.loads(line) for line in path.read_text().splitlines()]) == 1 + 12
    assert Journal(path, SHARED).rows.keys() == {task.key for task in TASKS}


def test_a_row_that_is_damaged_is_named_by_its_line(tmp_path: Path):
    path = tmp_path / "rows.jsonl"
    table("threads", journal=Journal(path, SHARED))
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    for bad in (b"\xff" + lines[3][1:], lines[3][:-5] + b"\n", b"[]\n"):
        path.write_bytes(b"".join([*lines[:3], bad, *lines[4:]]))
        with pytest.raises(OutputError, match=r"rows\.jsonl, line 4: is damaged.* delete that line"):
            Journal(path, SHARED)
    path.write_bytes(b"".join([*lines[:3], *lines[4:]]))
    assert len(Journal(path, SHARED).rows) == len(TASKS) - 1


def test_rows_of_something_else_are_not_taken(tmp_path: Path):
    path = tmp_path / "rows.jsonl"
    table("threads", journal=Journal(path, SHARED))
    with pytest.raises(OutputError, match=r"belongs to other settings.*\(base: 1\.1, now 1\.2\); name another folder"):
        Journal(path, {"base": 1.2})
    path.write_text('{"dynakin_journal": 1, "belongs_to": "ab"}\n')
    with pytest.raises(OutputError, match="belongs to another version of dynakin"):
        Journal(path, SHARED)
    path.write_text("time,x\n0,1\n")
    with pytest.raises(OutputError, match="is no journal"):
        Journal(path, SHARED)


@pytest.mark.parametrize(
    ("now", "said"),
    [
        ({"trials": {"A/walk": {"mass_kg": 70.0, "lag_s": float("inf")}}, "presets": ["default"]}, ""),
        ({"trials": {"A/walk": {"mass_kg": 71.0, "lag_s": float("inf")}}, "presets": ["default"]},
         "trials, A/walk, mass_kg: 70.0, now 71.0"),
        ({"trials": {"A/walk": {"mass_kg": 70.0}}, "presets": ["default"]},
         "trials, A/walk, lag_s: Infinity, now not set"),
        ({"trials": {"A/walk": {"mass_kg": 70.0, "lag_s": float("inf")}}, "presets": ["paper"]},
         "presets, 1: default, now paper"),
        ({"trials": {"A/walk": {"mass_kg": 70.0, "lag_s": float("inf")}}, "presets": []},
         'presets: ["default"], now []'),
    ],
)  # fmt: skip
def test_what_changed_is_named(now: dict, said: str):
    before = {"trials": {"A/walk": {"mass_kg": 70.0, "lag_s": float("inf")}}, "presets": ["default"]}
    assert difference(before, now) == said


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"backend": "mpi"}, "expected processes, threads, dask"),
        ({"backend": "dask"}, "--scheduler ADDRESS together with --backend dask"),
        ({"scheduler": "tcp://127.0.0.1:1"}, "--scheduler ADDRESS together with --backend dask"),
        ({"jobs": 0}, "expected 1 or more"),
    ],
)
def test_options_that_do_not_go_together_are_refused(options: dict, expected: str):
    with pytest.raises(ConfigError, match=expected):
        open_pool(**options)


def test_a_difference_is_named_whatever_the_values_are() -> None:
    assert difference({"constraint": "none"}, {}) == "constraint: none, now not set"
    assert difference({"trials": {"a": [1, 2]}}, {"trials": {"a": [1, 3]}}) == "trials, a, 2: 2, now 3"
    assert difference({"a": 1}, {"a": 1, "b": "none"}) == "b: not set, now none"
