"""Changes to a submitted experiment: its extent, once it has completed, and its schedule."""

from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Count, Examples, Frozen, Priority


class ExtensionSpec(Frozen):
    """New size of an experiment, as totals. A missing field stays unchanged."""

    EXAMPLES: ClassVar[Examples] = {
        "both": {"summary": "20 iterations and 60 repetitions, in all", "value": {"iterations": 20, "repetitions": 60}}
    }

    iterations: Annotated[Count, Field(le=1_000)] | None = Field(
        default=None, description="total real-world evaluations of each repetition; iteration 0 does not count"
    )
    repetitions: Annotated[Count, Field(le=10_000)] | None = Field(
        default=None, description="total number of repetitions"
    )


class ScheduleChange(Frozen):
    """A new schedule for an experiment. A missing field stays unchanged; a `max_parallel` of null is no limit."""

    EXAMPLES: ClassVar[Examples] = {
        "urgent": {"summary": "Before all others, on two cores", "value": {"priority": 10, "max_parallel": 2}}
    }

    priority: Priority = 0
    max_parallel: Annotated[Count, Field(le=10_000)] | None = None
