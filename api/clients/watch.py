"""Progress as it happens: a bar for each experiment in a terminal, a line now and then in a log."""

import time
from collections.abc import Iterable

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn

from gaplab.api.clients import display
from gaplab.api.clients.pace import Pace
from gaplab.schemas.records import ExperimentRead, StudyRead

Watched = ExperimentRead | StudyRead

LINE_EVERY_S = 10.0


def follow(stages: Iterable[Watched], console: Console) -> Watched:
    """Show each stage of a study or an experiment as it comes; return the last.

    Args:
        stages: at least one, as `Client.watch` gives them.
        console: a terminal gets a live bar, anything else a plain line every ten seconds.
    """
    return _bars(stages, console) if console.is_terminal else _lines(stages, console)


def _bars(stages: Iterable[Watched], console: Console) -> Watched:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        TextColumn("{task.percentage:>3.0f} %"),
        TextColumn("{task.fields[rollouts]}", justify="right"),
        TextColumn("{task.fields[left]}", justify="right"),
    )
    tasks: dict[str, TaskID] = {}
    pace = Pace()
    with Progress(*columns, console=console, expand=True, transient=True) as bars:
        for stage in stages:
            for each in _parts(stage):
                if each.id not in tasks:
                    tasks[each.id] = bars.add_task("", total=1.0, rollouts="", left="")
                _update(bars, tasks[each.id], each, pace.left(each))
    return stage


def _update(bars: Progress, task: TaskID, each: Watched, left: str | None) -> None:
    bold = ("[bold]", "[/]") if isinstance(each, StudyRead) else ("", "")
    bars.update(
        task,
        description=f"{bold[0]}{escape(each.name.replace('_', ' '))}{bold[1]} {display.state(each.state)}",
        completed=1.0 if each.state.ended else display.fraction(each.progress),
        rollouts=f"{each.progress.rollouts_done:,} rollouts",
        left=f"{left} left" if left else "",
    )


def _lines(stages: Iterable[Watched], console: Console) -> Watched:
    said_at, pace = -LINE_EVERY_S, Pace()
    ended: set[str] = set()
    for stage in stages:
        news = [each for each in _parts(stage)[1:] if each.state.ended and each.id not in ended]
        ended |= {each.id for each in news}
        for each in news:
            console.print(f"{_clock()} {escape(each.name)}: {each.state}, {display.numbers(each.progress)}")
        left = pace.left(stage)
        if stage.state.ended or time.monotonic() - said_at >= LINE_EVERY_S:
            said_at = time.monotonic()
            console.print(f"{_clock()} {_line(stage, left)}")
    return stage


def _line(stage: Watched, left: str | None) -> str:
    done = f"{display.percent(stage.progress)}, {display.numbers(stage.progress)}"
    rest = stage.state if stage.state.ended else f"{left} left" if left else "time left not known yet"
    return f"{escape(stage.name)}: {done}; {rest}"


def _parts(stage: Watched) -> tuple[Watched, ...]:
    return (stage, *stage.experiments) if isinstance(stage, StudyRead) else (stage,)


def _clock() -> str:
    return time.strftime("%H:%M:%S")
