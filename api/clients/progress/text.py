"""Progress in words and colours, for all renderers."""

import math

from rich.console import Console

from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import Progress

COLORS = {
    State.QUEUED: "dim",
    State.RUNNING: "cyan",
    State.PAUSING: "magenta",
    State.PAUSED: "magenta",
    State.STOPPING: "cyan",
    State.COMPLETED: "green",
    State.FAILED: "bold red",
    State.CANCELLED: "yellow",
}


def console(*, stderr: bool = False) -> Console:
    """Return a console; without a terminal it is wide, so that the lines of a log are not cut at 80 characters."""
    terminal = Console(stderr=stderr, highlight=False)
    return terminal if terminal.is_terminal else Console(stderr=stderr, highlight=False, width=160)


def colored(state: State) -> str:
    """Return a state in its colour."""
    return f"[{COLORS[state]}]{state}[/]"


def fraction(progress: Progress) -> float:
    """Return the finished fraction of the rollouts, because they take most of the time."""
    finished = progress.rollouts_done + progress.rollouts_saved
    return min(1.0, finished / progress.rollouts) if progress.rollouts else 0.0


def percent(progress: Progress) -> str:
    """Return the finished percentage, rounded down, so that 100 % is complete."""
    return f"{math.floor(100 * fraction(progress))} %"


def counts(progress: Progress) -> str:
    """Return the finished repetitions and rollouts as a sentence."""
    failed = f", {progress.failed} failed" if progress.failed else ""
    physics = f", {progress.rollouts_failed:,} of them nan" if progress.rollouts_failed else ""
    return (
        f"{progress.completed} of {progress.repetitions} repetitions{failed}; "
        f"{progress.rollouts_done:,} rollouts{physics}, {progress.rollouts_saved:,} saved, of {progress.rollouts:,}"
    )
