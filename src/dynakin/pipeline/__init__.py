"""From a recording to a folder of results: `run` estimates and judges, `Result.save` writes."""

from dynakin.pipeline.result import Result
from dynakin.pipeline.stages import run

__all__ = ["Result", "run"]
