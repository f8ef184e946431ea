"""The progress of a study or an experiment: one view of it, live in a terminal or a notebook, and lines in a log."""

import math
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from io import StringIO
from typing import Any, Generic, TypeAlias, TypeVar

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.progress_bar import ProgressBar
from rich.table import Table

from gaplab.api.clients.screen import console
from gaplab.schemas.curves import Curve, from_before
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, Progress, RepetitionRead, StudyRead

Record: TypeAlias = StudyRead | ExperimentRead
S = TypeVar("S", bound=StudyRead)

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

LINE_EVERY_S = 10.0
"""Time between lines of a log; one for each experiment that ends comes at once."""

BLOCKS = "▁▂▃▄▅▆▇█"
MOST_REPETITIONS = 60
"""Repetitions of an experiment that have a block; the others are counted."""


@dataclass(frozen=True)
class RecordProgress:
    """The progress of a study, or of one experiment.

    Attributes:
        record: the study or the experiment.
        curve: an experiment's curve so far; None unless asked for.
        repetitions: an experiment's repetitions; empty unless asked for.
    """

    record: Record
    curve: Curve | None = None
    repetitions: tuple[RepetitionRead, ...] = ()

    @property
    def name(self) -> str:
        """The name; that of a strategy, which an experiment has by default, with spaces, where a line can break."""
        name = self.record.name
        return name.replace("_", " ") if name == getattr(self.record, "strategy", None) else name


@dataclass(frozen=True)
class Snapshot(Generic[S]):
    """The progress at one moment.

    Attributes:
        study: the study.
        rows: the study and each of its experiments; or the only one.
        away_s: time since the last answer, if the service did not answer; the rows are those of that answer.
    """

    study: S
    rows: tuple[RecordProgress, ...]
    away_s: float = 0.0

    @property
    def warning(self) -> str | None:
        """A sentence about a service that does not answer."""
        return f"the service has not answered for {self.away_s:.0f} s; waiting for it" if self.away_s else None


def in_notebook() -> bool:
    """Return whether a Jupyter kernel runs this program."""
    return "IPython" in sys.modules and hasattr(sys.modules["IPython"].get_ipython(), "kernel")


def follow(snapshots: Iterable[Snapshot[S]], progress: bool | None) -> S:
    """Go through snapshots, shown if so told, or by default in a terminal or a notebook; return the last study."""
    if in_notebook() or sys.stderr.isatty() if progress is None else progress:
        return show(snapshots, console(stderr=True))
    return deque(snapshots, maxlen=1).pop().study


def show(snapshots: Iterable[Snapshot[S]], console: Console, *, keep: bool = False) -> S:
    """Show snapshots until the last, and return its study; a terminal may `keep` it on the screen."""
    if in_notebook():
        return _replace(snapshots, cell())
    if not console.is_terminal:
        return log(snapshots, console)
    with Live(console=console, auto_refresh=False, transient=not keep) as live:
        return _replace(snapshots, lambda shown: live.update(shown, refresh=True))


def log(snapshots: Iterable[Snapshot[S]], console: Console) -> S:
    """Print snapshots as lines, and return the last study."""
    printed_at, ended = -LINE_EVERY_S, set[str]()
    for snapshot in snapshots:
        over = [row.record for row in snapshot.rows[1:] if row.record.state.ended]
        lines = [_line(each) for each in over if each.id not in ended]
        ended |= {each.id for each in over}
        if snapshot.study.state.ended or time.monotonic() - printed_at >= LINE_EVERY_S:
            printed_at = time.monotonic()
            lines.append(snapshot.warning or _line(snapshot.study))
        for line in lines:
            console.print(f"{time.strftime('%H:%M:%S')} {escape(line)}")
    return snapshot.study


def view(snapshot: Snapshot[Any]) -> RenderableType:
    """Return a table with a row for a study and each of its experiments: a bar, or a curve and each repetition."""
    curves = [row.curve for row in snapshot.rows if row.curve]
    scale = [mean for curve in curves for mean in _means(curve)]
    heads = [f"fitness in reality, {curves[0].unit}", "repetitions"] if curves else ["", "rollouts"]
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for head in ("", "state", "progress", "left", *heads):
        table.add_column(head, overflow="fold")
    for row in snapshot.rows:
        name, record = escape(row.name), row.record
        bar = ProgressBar(1.0, record.progress.share, width=20), f"{record.progress.rollouts_done:,}"
        table.add_row(
            f"[bold]{name}[/]" if isinstance(record, StudyRead) else name,
            standing(record),
            percent(record.progress),
            left(record),
            *((_curve(row.curve, scale), _repetitions(row)) if curves else bar),
        )
    lines: list[RenderableType] = [table, snapshot.study.progress.text]
    return Group(*lines, *([f"[yellow]{snapshot.warning}[/]"] if snapshot.warning else []))


def spark(values: Sequence[float], least: float, greatest: float) -> str:
    """Return numbers as a sparkline: a block character for each, of eight heights between the two limits."""
    height = (greatest - least) or 1.0
    return "".join(BLOCKS[min(7, int(8 * (value - least) / height))] for value in values)


def colored(state: State) -> str:
    """Return a state in its colour."""
    return f"[{COLORS[state]}]{state}[/]"


def standing(record: Record) -> str:
    """Return the state of a study or an experiment in its colour, with what the state alone does not say."""
    return f"[yellow]{escape(state_text(record))}[/]" if record.caveat else colored(record.state)


def state_text(record: Record) -> str:
    """Return the state of a study or an experiment, with what the state alone does not say."""
    return f"{record.state}, {record.caveat}" if record.caveat else str(record.state)


def left(record: Record, otherwise: str = "-") -> str:
    """Return the time left, like "2 to 4 min", if the study or the experiment runs."""
    if record.state is not State.RUNNING:
        return otherwise
    return record.progress.time_left.text if record.progress.time_left else "not known yet"


def percent(progress: Progress) -> str:
    """Return the finished percentage, rounded down, so that 100 % is complete."""
    return f"{math.floor(100 * progress.share)} %"


def _replace(snapshots: Iterable[Snapshot[S]], place: Callable[[RenderableType], object]) -> S:
    """Show each snapshot in the place of the one before."""
    for snapshot in snapshots:
        place(view(snapshot))
    return snapshot.study


def cell() -> Callable[[RenderableType], object]:
    """Return a function that shows a text in a notebook's cell, in place of the one before."""
    ipython: Any = import_module("IPython.display")
    handle = ipython.display(ipython.HTML(""), display_id=True)

    def place(text: RenderableType) -> None:
        page = Console(
            record=True, force_terminal=True, force_jupyter=False, file=StringIO(), width=140, highlight=False
        )
        page.print(text)
        handle.update(ipython.HTML(page.export_html(inline_styles=True, code_format="<pre>{code}</pre>")))

    return place


def _line(record: Record) -> str:
    rest = f"time left: {time_left}" if (time_left := left(record, "")) else state_text(record)
    return f"{record.name}: {percent(record.progress)}, {record.progress.text}; {rest}"


def _means(curve: Curve) -> list[float]:
    return [point.mean for point in curve.points if point.mean is not None]


def _curve(curve: Curve | None, scale: Sequence[float]) -> str:
    """Return the means so far as blocks, all experiments on one scale, and the last of them as a number."""
    points = [point for point in curve.points if point.mean is not None] if curve else []
    if not curve or not points:
        return "-" if curve else ""
    sd = f"±{points[-1].sd:.2f}" if points[-1].sd is not None else ""
    after = f"{points[-1].evaluations}{from_before(curve.known)}"
    return f"{spark(_means(curve), min(scale), max(scale))} {points[-1].mean:.2f}{sd} after {after}"


def _repetitions(row: RecordProgress) -> str:
    """Return a block for each repetition, as high as its progress, in the colour of its state."""
    progress = row.record.progress
    iterations = max(1, progress.iterations // max(1, progress.repetitions))
    blocks = [
        f"[{COLORS[each.state]}]{spark([min(each.iterations_done, iterations)], 0, iterations)}[/]"
        for each in row.repetitions[:MOST_REPETITIONS]
    ]
    rest = len(row.repetitions) - MOST_REPETITIONS
    return "".join(blocks) + (f" and {rest} more" if rest > 0 else "")
