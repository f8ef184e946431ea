"""A live view of a study or an experiment in a terminal: a curve and the progress of each repetition, as text."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from gaplab.api.clients import display
from gaplab.api.clients.client import Client, ServiceError, ServiceUnreachable
from gaplab.api.clients.errors import is_for_good
from gaplab.schemas.curves import Curve
from gaplab.schemas.records import ExperimentRead, RepetitionRead, StudyRead

T = TypeVar("T")
Watched = ExperimentRead | StudyRead

BLOCKS = "▁▂▃▄▅▆▇█"
MOST_REPETITIONS = 60
"""Of an experiment that are shown; the others are counted."""


@dataclass(frozen=True)
class Look:
    """What is known at a moment.

    Attributes:
        stage: the study or the experiment.
        curves: by experiment.
        repetitions: by experiment.
        away_s: for how long the service has not answered.
    """

    stage: Watched
    curves: dict[str, Curve]
    repetitions: dict[str, tuple[RepetitionRead, ...]]
    away_s: float = 0.0


def looks(client: Client, id: str, *, every_s: float, patience_s: float) -> Iterator[Look]:
    """Look again and again, until it has ended; what is not known while the service is away is as it was.

    Raises:
        ServiceError: the service refuses.
        ServiceUnreachable: it was away for longer than `patience_s`.
    """
    look = _look(client, id, None)
    yield look
    heard_at = time.monotonic()
    while not look.stage.state.ended:
        time.sleep(every_s)
        try:
            look = _look(client, id, look)
            heard_at = time.monotonic()
        except (ServiceError, ServiceUnreachable) as error:
            away_s = time.monotonic() - heard_at
            if is_for_good(error) or away_s > patience_s:
                raise
            look = replace(look, away_s=away_s)
        yield look


def watch(found: Iterator[Look], console: Console) -> Watched:
    """Show each look in place of the one before; the last stays. Returns what it ended as."""
    with Live(console=console, auto_refresh=False) as live:
        for look in found:
            live.update(view(look), refresh=True)
    return look.stage


def view(look: Look) -> RenderableType:
    """A look as text: a line for each experiment, and one for its repetitions."""
    parts = look.stage.experiments if isinstance(look.stage, StudyRead) else (look.stage,)
    values = [mean for curve in look.curves.values() for mean in _means(curve)]
    table = Table(box=SIMPLE_HEAD, pad_edge=False, expand=False)
    unit = next((f", {each.unit}" for each in look.curves.values()), "")
    for column in ("", "state", "progress", "left", f"fitness in reality{unit}", "repetitions"):
        table.add_column(column, overflow="fold")
    for each in parts:
        curve, repetitions = look.curves.get(each.id), look.repetitions.get(each.id, ())
        cells = (display.state(each.state), display.percent(each.progress), display.left(each.progress))
        table.add_row(
            escape(each.name.replace("_", " ")), *cells, _curve(curve, values), _repetitions(each, repetitions)
        )
    lines: list[RenderableType] = [_headline(look.stage), table]
    if look.away_s:
        lines.append(f"[yellow]the service has not answered for {look.away_s:.0f} s; waiting for it[/]")
    return Group(*lines)


def spark(values: list[float], least: float, greatest: float) -> str:
    """Numbers as blocks of eight heights, from the least to the greatest."""
    height = (greatest - least) or 1.0
    return "".join(BLOCKS[min(7, int(8 * (value - least) / height))] for value in values)


def _look(client: Client, id: str, before: Look | None) -> Look:
    stage = client.find(id) if before is None else _again(client, before.stage)
    parts = stage.experiments if isinstance(stage, StudyRead) else (stage,)
    known = before or Look(stage, {}, {})
    moving = [each.id for each in parts if not _ended_before(each, before)]
    curves = {each.experiment: each for each in client.curves_of(moving)} if moving else {}
    repetitions = {each: client.repetitions(each) for each in moving}
    return Look(stage, known.curves | curves, known.repetitions | repetitions)


def _again(client: Client, stage: Watched) -> Watched:
    read: Callable[[str], Watched] = client.study if isinstance(stage, StudyRead) else client.experiment
    return read(stage.id)


def _ended_before(each: ExperimentRead, before: Look | None) -> bool:
    """Whether all of it is known already."""
    if before is None:
        return False
    parts = before.stage.experiments if isinstance(before.stage, StudyRead) else (before.stage,)
    return any(one.id == each.id and one.state.ended for one in parts)


def _headline(stage: Watched) -> str:
    left = "" if stage.state.ended else f"; {display.left(stage.progress)} left"
    return f"[bold]{escape(stage.name)}[/] {display.state(stage.state)}  {display.numbers(stage.progress)}{left}"


def _means(curve: Curve) -> list[float]:
    return [point.mean for point in curve.points if point.mean is not None]


def _curve(curve: Curve | None, values: list[float]) -> str:
    """The means so far as blocks, all experiments on one scale, and the last of them as a number."""
    means = _means(curve) if curve else []
    if not means or curve is None:
        return "-"
    last = [point for point in curve.points if point.mean is not None][-1]
    spread = f"±{last.sd:.2f}" if last.sd is not None else ""
    return f"{spark(means, min(values), max(values))} {last.mean:.2f}{spread} after {last.evaluations}"


def _repetitions(of: ExperimentRead, found: tuple[RepetitionRead, ...]) -> str:
    """A block for each repetition, as high as it has come, in the colour of its state."""
    each_has = max(1, of.progress.iterations // max(1, of.progress.repetitions))
    blocks = [
        f"[{display.COLORS[each.state]}]{spark([min(each.iterations_done, each_has)], 0, each_has)}[/]"
        for each in found[:MOST_REPETITIONS]
    ]
    rest = len(found) - MOST_REPETITIONS
    return "".join(blocks) + (f" and {rest} more" if rest > 0 else "")
