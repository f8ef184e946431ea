"""The states of experiments and repetitions, the permitted moves, and the verbs that cause them.

An experiment:

                  claimed          pause           steps ended
    QUEUED ───────────────> RUNNING ─────> PAUSING ────────────> PAUSED      resume leads back
       │                      │ │             │                    │
       │                      │ └─────────────┴──> STOPPING <──────┘         stop
       │                      │                       │
       │                      ├──> COMPLETED <────────┤   a repetition completed, none is left
       │                      ├──> FAILED    <────────┤   none completed, a repetition failed
       └──────────────────────┴──> CANCELLED <────────┘   cancelled; or stopped without any result

    pause    Each running repetition finishes its step, stores it and frees its core; no repetition is claimed. The
             experiment is PAUSING until the last has finished. Without running repetitions it is PAUSED at once.
    resume   From PAUSING or PAUSED, to RUNNING if a repetition still runs, else to QUEUED.
    stop     Like pause, but final. A repetition with a point of the curve is COMPLETED with its results so far; the
             others are CANCELLED. An experiment stopped before its first point is therefore CANCELLED.
    cancel   Immediate: results of the current steps are discarded.
    extend   From COMPLETED, to QUEUED with more iterations or repetitions; existing numbers stay.
    retry    Queues the repetitions that FAILED once more; each goes on from its stored steps.

If reality is a robot on a bench, a repetition is WAITING while a measurement is requested: it holds no core and no
process, for a year if need be, and is QUEUED when the answer is stored. An experiment is WAITING while none of its
repetitions can go on without an answer. To pause, stop or cancel it works as if it were QUEUED.

An error of reality pauses the experiment: a person looks at the robot, and then resumes.

A repetition is QUEUED, RUNNING or ended. It returns from RUNNING to QUEUED when it is paused or handed back, or when
its worker is lost, which is not a failure. It resumes from its log. `extend` queues COMPLETED and CANCELLED repetitions
again; a FAILED one waits for `retry`, because it would fail again.

A verb whose state is not in `PERMITTED` is refused even if redundant: pausing twice is a conflict. A verb on a study
applies to all of its experiments that permit it.
"""

from enum import StrEnum
from typing import Annotated, ClassVar

from pydantic import Field

from gaplab.schemas.base import Count, Examples, Frozen, Priority, Repetitions


class State(StrEnum):
    """State of an experiment, a study or a repetition."""

    QUEUED = "QUEUED"
    RUNNING = "RUNNING"
    PAUSING = "PAUSING"
    PAUSED = "PAUSED"
    STOPPING = "STOPPING"
    COMPLETED = "COMPLETED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"
    WAITING = "WAITING"

    @property
    def ended(self) -> bool:
        """Return whether computing has ended; `extend` may restart it."""
        return self in ENDS


class Verb(StrEnum):
    """Requests that change the state of an experiment."""

    PAUSE = "pause"
    RESUME = "resume"
    STOP = "stop"
    CANCEL = "cancel"
    EXTEND = "extend"
    RETRY = "retry"


class Ending(StrEnum):
    """How an attempt at a repetition ended."""

    COMPLETED = "completed"
    PAUSED = "paused"
    STOPPED = "stopped"
    CANCELLED = "cancelled"
    HANDED_BACK = "handed back"
    WAITING = "waiting"
    LOST = "lost"
    FAILED = "failed"


ENDS = frozenset({State.COMPLETED, State.FAILED, State.CANCELLED})

OPEN = tuple(state for state in State if state not in ENDS)
"""States that have not ended."""

PENDING = (State.QUEUED, State.RUNNING, State.WAITING)
"""States of a repetition that has not ended."""

ASKED = (State.PAUSING, State.STOPPING)
"""States in which running repetitions end with their current step."""

PERMITTED: dict[Verb, tuple[State, ...]] = {
    Verb.PAUSE: (State.QUEUED, State.RUNNING, State.WAITING),
    Verb.RESUME: (State.PAUSING, State.PAUSED),
    Verb.STOP: (State.QUEUED, State.RUNNING, State.WAITING, State.PAUSING, State.PAUSED),
    Verb.CANCEL: OPEN,
    Verb.EXTEND: (State.COMPLETED,),
    Verb.RETRY: (State.QUEUED, State.RUNNING, State.WAITING, State.PAUSED, State.COMPLETED, State.FAILED),
}

MOVES: dict[State, frozenset[State]] = {
    State.QUEUED: frozenset({State.RUNNING, State.WAITING, State.PAUSED, *ENDS}),
    State.RUNNING: frozenset({State.QUEUED, State.WAITING, State.PAUSING, State.PAUSED, State.STOPPING, *ENDS}),
    State.WAITING: frozenset({State.QUEUED, State.RUNNING, State.PAUSED, *ENDS}),
    State.PAUSING: frozenset({State.RUNNING, State.PAUSED, State.STOPPING, *ENDS}),
    State.PAUSED: frozenset({State.QUEUED, State.WAITING, *ENDS}),
    State.STOPPING: ENDS,
    State.COMPLETED: frozenset({State.QUEUED, State.WAITING}),
    State.FAILED: frozenset({State.QUEUED}),
    State.CANCELLED: frozenset({State.QUEUED}),
}
"""Permitted moves of experiments and repetitions. Only repetitions leave CANCELLED, when `extend` queues them again."""


class ExtensionSpec(Frozen):
    """New size of an experiment, as totals. A missing field stays unchanged."""

    EXAMPLES: ClassVar[Examples] = {
        "both": {"summary": "20 iterations and 60 repetitions, in all", "value": {"iterations": 20, "repetitions": 60}}
    }

    iterations: Annotated[Count, Field(le=1_000)] | None = Field(
        None, description="total real-world evaluations of each repetition; iteration 0 does not count"
    )
    repetitions: Repetitions | None = Field(None, description="total number of repetitions")


class ScheduleChange(Frozen):
    """A new schedule for an experiment. A missing field stays unchanged; a `max_parallel` of null is not a limit."""

    EXAMPLES: ClassVar[Examples] = {
        "urgent": {"summary": "Before all others, on two cores", "value": {"priority": 10, "max_parallel": 2}}
    }

    priority: Priority = 0
    max_parallel: Repetitions | None = None
