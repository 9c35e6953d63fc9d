"""A folder of subjects and trials, each worked on by itself: Table II over all of them, and the bad ones named."""

from dynakin.studies.batch.dataset import Dataset, Session, read_dataset
from dynakin.studies.batch.process import Batch, run_batch

__all__ = ["Batch", "Dataset", "Session", "read_dataset", "run_batch"]
