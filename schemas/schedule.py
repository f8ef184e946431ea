"""What may be changed of an experiment after it was submitted: its extent, once it has ended, and its turn."""

from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Count, Examples, Frozen, Priority


class ExtensionSpec(Frozen):
    """How large an experiment is to become: totals, not what is added. What is left out stays as it is."""

    EXAMPLES: ClassVar[Examples] = {
        "both": {"summary": "20 iterations and 60 repetitions, in all", "value": {"iterations": 20, "repetitions": 60}}
    }

    iterations: Annotated[Count, Field(le=1_000)] | None = Field(
        default=None, description="real-world evaluations of each repetition, in all; number 0 does not count"
    )
    repetitions: Annotated[Count, Field(le=10_000)] | None = Field(default=None, description="in all")


class ScheduleChange(Frozen):
    """Another turn for an experiment; what is left out stays as it is, and a `max_parallel` of null is no limit."""

    EXAMPLES: ClassVar[Examples] = {
        "urgent": {"summary": "Before all others, on two cores", "value": {"priority": 10, "max_parallel": 2}}
    }

    priority: Priority = 0
    max_parallel: Annotated[Count, Field(le=10_000)] | None = None
