"""The states of an experiment and of a repetition, which move to which, and who moves them.

An experiment:

                  claimed          asked           its steps are over
    QUEUED ───────────────> RUNNING ─────> PAUSING ────────────> PAUSED      pause; resume leads back
       │                      │ │             │                    │
       │                      │ └─────────────┴──> STOPPING <──────┘         stop
       │                      │                       │
       │                      ├──> COMPLETED <────────┤   at least one repetition is, none is left to run
       │                      ├──> FAILED    <────────┤   none completed, at least one failed
       └──────────────────────┴──> CANCELLED <────────┘   called off, from any state but an end; or stopped with nothing

    pause    each running repetition finishes its step, stores it, and gives its core back; nothing is claimed. PAUSING
             until the last has; one that never ran, or whose repetitions all wait, is PAUSED at once.
    resume   from PAUSING or PAUSED: RUNNING if a repetition still runs, else QUEUED.
    stop     the same, for good. A repetition that has a point of the curve is COMPLETED with what is there, one that
             has none is CANCELLED; so an experiment that is stopped before its first point ends as CANCELLED, never
             as COMPLETED with nothing.
    cancel   at once: the steps under way are thrown away.
    extend   from COMPLETED: QUEUED again, with more iterations or repetitions; the numbers that are there stand.

A repetition is QUEUED, RUNNING, or at an end. From RUNNING it goes back to QUEUED when it was paused or handed back, or
when its worker was lost: lost is not failed. Its place is its log, from which it goes on. `extend` queues COMPLETED and
CANCELLED ones again; a FAILED one stays, for it would fail again.

A verb whose state is not among `PERMITTED` is refused, also the repetition of one that was obeyed: who pauses twice is
told that it is PAUSED. A verb on a study goes to all of its experiments that permit it.
"""

from enum import StrEnum


class State(StrEnum):
    """Where an experiment, a study or a repetition stands."""

    QUEUED = "QUEUED"
    RUNNING = "RUNNING"
    PAUSING = "PAUSING"
    PAUSED = "PAUSED"
    STOPPING = "STOPPING"
    COMPLETED = "COMPLETED"
    FAILED = "FAILED"
    CANCELLED = "CANCELLED"

    @property
    def ended(self) -> bool:
        """Whether nothing more is computed, unless it is extended."""
        return self in ENDS

    def may_become(self, other: "State") -> bool:
        """Whether the table allows the move."""
        return other in MOVES[self]


class Verb(StrEnum):
    """What a person may ask of an experiment."""

    PAUSE = "pause"
    RESUME = "resume"
    STOP = "stop"
    CANCEL = "cancel"
    EXTEND = "extend"


class Ending(StrEnum):
    """How an attempt at a repetition ended."""

    COMPLETED = "completed"
    PAUSED = "paused"
    STOPPED = "stopped"
    CANCELLED = "cancelled"
    HANDED_BACK = "handed back"
    LOST = "lost"
    FAILED = "failed"


ENDS = frozenset({State.COMPLETED, State.FAILED, State.CANCELLED})

OPEN = tuple(each for each in State if each not in ENDS)
"""Those that are no ends."""

ASKED = (State.PAUSING, State.STOPPING)
"""Running repetitions of such an experiment end with the step that is under way."""

PERMITTED: dict[Verb, tuple[State, ...]] = {
    Verb.PAUSE: (State.QUEUED, State.RUNNING),
    Verb.RESUME: (State.PAUSING, State.PAUSED),
    Verb.STOP: (State.QUEUED, State.RUNNING, State.PAUSING, State.PAUSED),
    Verb.CANCEL: OPEN,
    Verb.EXTEND: (State.COMPLETED,),
}

MOVES: dict[State, frozenset[State]] = {
    State.QUEUED: frozenset({State.RUNNING, State.PAUSED, State.COMPLETED, State.FAILED, State.CANCELLED}),
    State.RUNNING: frozenset({State.QUEUED, State.PAUSING, State.PAUSED, State.STOPPING, *ENDS}),
    State.PAUSING: frozenset({State.RUNNING, State.PAUSED, State.STOPPING, *ENDS}),
    State.PAUSED: frozenset({State.QUEUED, *ENDS}),
    State.STOPPING: ENDS,
    State.COMPLETED: frozenset({State.QUEUED}),
    State.FAILED: frozenset(),
    State.CANCELLED: frozenset({State.QUEUED}),
}
"""Of experiments and repetitions alike; from CANCELLED only a repetition moves, whose experiment is extended."""

CHECK_MOVES = MOVES | {State.FAILED: frozenset({State.QUEUED})}
"""Moves of a sensitivity check: a failed one is queued again when its settings are submitted again."""
