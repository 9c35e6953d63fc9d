"""Many independent tasks over all cores or a cluster: the same rows whoever worked on them, and if some were killed.

It knows nothing of filters: a task is a function of something that all share and of something small of its own.
"""

from dynakin.studies.engine.journal import Journal
from dynakin.studies.engine.pools import BACKENDS, Pool, open_pool, work
from dynakin.studies.engine.tasks import Failure, Outcome, Task

__all__ = ["BACKENDS", "Failure", "Journal", "Outcome", "Pool", "Task", "open_pool", "work"]
