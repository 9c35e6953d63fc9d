"""Tasks in, a table out: in the order of the keys, whoever worked, also where a part was done in an earlier run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dynakin.progress import Progress
from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import Pool
from dynakin.studies.engine.tasks import Function, Outcome, Task


def work(
    pool: Pool,
    function: Function,
    shared: Any,
    tasks: Sequence[Task],
    *,
    journal: Journal | None = None,
    progress: Progress | None = None,
) -> list[Outcome]:
    """Work on all tasks.

    Args:
        function: ``function(shared, payload)``, a function of a module. shared: picklable, what all tasks need.
        tasks: each with a key of its own.
        journal: rows found there are taken, new ones are added as they come. Failures are not kept: they are tried
            again when the run is.
        progress: called with (tasks done, tasks in all).

    Returns:
        An outcome a task, sorted by key.
    """
    assert len({task.key for task in tasks}) == len(tasks), "keys name tasks: each once"
    known = {} if journal is None else journal.rows
    done = {task.key: Outcome(task.key, row=known[task.key]) for task in tasks if task.key in known}
    left = [task for task in tasks if task.key not in done]
    if progress is not None:
        progress(len(done), len(tasks))
    for outcome in pool.run(function, shared, left):
        done[outcome.key] = outcome
        if journal is not None and outcome.row is not None:
            journal.add(outcome.key, outcome.row)
        if progress is not None:
            progress(len(done), len(tasks))
    return [done[key] for key in sorted(done)]
