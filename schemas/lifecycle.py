"""The states of an experiment and of a repetition, and which move to which.

    QUEUED ──> RUNNING ──> COMPLETED      at least one repetition finished, none is left to run
       │          ├──────> FAILED         every repetition failed
       └──────────┴──────> CANCELLED      a person called it off; what is stored stays

A repetition moves in the same way, and from RUNNING back to QUEUED when the worker that ran it was lost: lost is not
failed, and it goes on from its stored steps. COMPLETED, FAILED and CANCELLED are ends.
"""

from enum import StrEnum


class State(StrEnum):
    """Where an experiment, a study or a repetition stands."""

    QUEUED = "QUEUED"
    RUNNING = "RUNNING"
    COMPLETED = "COMPLETED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"

    @property
    def ended(self) -> bool:
        """Whether nothing follows this state."""
        return not MOVES[self]

    def may_become(self, other: "State") -> bool:
        """Whether the table allows the move."""
        return other in MOVES[self]


MOVES: dict[State, frozenset[State]] = {
    State.QUEUED: frozenset({State.RUNNING, State.CANCELLED}),
    State.RUNNING: frozenset({State.QUEUED, State.COMPLETED, State.FAILED, State.CANCELLED}),
    State.COMPLETED: frozenset(),
    State.FAILED: frozenset(),
    State.CANCELLED: frozenset(),
}
