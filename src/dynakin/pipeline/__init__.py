"""From a recording to a folder of results: `run` estimates and judges, `Result.save` writes."""

from typing import TYPE_CHECKING

from dynakin.lazy import loaded_when_asked

if TYPE_CHECKING:
    from dynakin.pipeline.result import Result
    from dynakin.pipeline.stages import run

__all__ = ["Result", "run"]

__getattr__, __dir__ = loaded_when_asked(
    __name__,
    {
        "result": ("Result",),
        "stages": ("run",),
    },
)
