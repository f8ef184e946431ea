"""Progress in words and colours, for all renderers."""

import math
import re
from collections.abc import Iterable
from typing import TypeAlias

from rich.console import Console, ConsoleOptions, RenderableType
from rich.markup import escape
from rich.segment import Segment

from gaplab.schemas.curves import from_before
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, Progress, StudyRead, TimeLeft

Record: TypeAlias = StudyRead | ExperimentRead

COLORS = {
    State.QUEUED: "dim",
    State.RUNNING: "cyan",
    State.PAUSING: "magenta",
    State.PAUSED: "magenta",
    State.STOPPING: "cyan",
    State.COMPLETED: "green",
    State.FAILED: "bold red",
    State.CANCELLED: "yellow",
    State.WAITING: "yellow",
}

_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def printable(text: str) -> str:
    """Return a text without characters that a terminal obeys: names come from others. JSON keeps its meaning."""
    return _CONTROLS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class _Screen(Console):
    """A console whose texts are as `printable` returns them; its own colours and movements stay."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the parts of what is printed."""
        for part in super().render(renderable, options):
            yield part if part.control else part._replace(text=printable(part.text))


def console(*, stderr: bool = False) -> Console:
    """Return a console; without a terminal it is wide, so that the lines of a log are not cut at 80 characters."""
    terminal = _Screen(stderr=stderr, highlight=False)
    return terminal if terminal.is_terminal else _Screen(stderr=stderr, highlight=False, width=160)


def colored(state: State) -> str:
    """Return a state in its colour."""
    return f"[{COLORS[state]}]{state}[/]"


def standing(record: Record) -> str:
    """Return the state of a study or an experiment in its colour, with what the state alone does not say."""
    return f"[yellow]{escape(state_text(record))}[/]" if record.caveat else colored(record.state)


def state_text(record: Record) -> str:
    """Return the state of a study or an experiment, with what the state alone does not say."""
    return f"{record.state}, {record.caveat}" if record.caveat else str(record.state)


def time_left(record: Record) -> str | None:
    """Return the interval of the time left, like "2 to 4 min"; None while it is unknown, and unless it runs."""
    found = record.progress.time_left
    return span(found) if found and record.state is State.RUNNING else None


def span(time: TimeLeft) -> str:
    """Return an interval in minutes, or in hours if it is long."""
    unit, name = (3600, "h") if time.high_s > 3 * 3600 else (60, "min")
    low, high = math.floor(time.low_s / unit), math.ceil(time.high_s / unit)
    return f"{low} to {high} {name}" if low else f"less than {high} {name}"


def left(record: Record) -> str:
    """Return the time left, as a cell of a table."""
    return time_left(record) or ("not known yet" if record.state is State.RUNNING else "-")


def fitness(record: Record) -> str:
    """Return the fitness of an experiment, or of a study's best, with its number of evaluations: "0.585 at 10"."""
    found = record.best if isinstance(record, StudyRead) else record.fitness
    return f"{found.mean:.3f} at {found.evaluations}{from_before(found.known)}" if found else "-"


def best(study: StudyRead) -> list[str]:
    """Return a sentence about the fittest experiment of a study; none without a result."""
    found = study.best
    if not found:
        return []
    evaluations = f"{found.evaluations} real-world evaluation{'' if found.evaluations == 1 else 's'}"
    mean = f"mean {found.mean:.3f} after {evaluations}{from_before(found.known)}"
    return [f"best: {found.name.replace('_', ' ')}, {mean} (n = {found.n})"]


def fraction(progress: Progress) -> float:
    """Return the finished fraction of the rollouts, because they take most of the time."""
    finished = progress.rollouts_done + progress.rollouts_saved
    return min(1.0, finished / progress.rollouts) if progress.rollouts else 0.0


def percent(progress: Progress) -> str:
    """Return the finished percentage, rounded down, so that 100 % is complete."""
    return f"{math.floor(100 * fraction(progress))} %"


def counts(progress: Progress) -> str:
    """Return the finished repetitions, iterations and rollouts as a sentence, with some of the steps under way."""
    failed = f", {progress.failed} failed" if progress.failed else ""
    physics = f", {progress.rollouts_failed:,} of them nan" if progress.rollouts_failed else ""
    iterations = f"{progress.counted_iterations_done} of {progress.counted_iterations} iterations; "
    now = [f"; {each.kind} {each.iteration}: {100 * each.rollouts // each.budget} %" for each in progress.steps]
    return (
        f"{progress.completed} of {progress.repetitions} repetitions{failed}; "
        f"{iterations if progress.counted_iterations else ''}"
        f"{progress.rollouts_done:,} rollouts{physics}, {progress.rollouts_saved:,} saved, of {progress.rollouts:,}"
        f"{''.join(now[:3])}"
    )
