"""Progress in a terminal: a live table with a bar, or with a curve and each repetition if the snapshots have them."""

from collections.abc import Iterable, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.progress_bar import ProgressBar
from rich.table import Table

from gaplab.api.clients.progress.snapshots import RecordProgress, Snapshot
from gaplab.api.clients.progress.text import COLORS, counts, fraction, left, percent, standing
from gaplab.schemas.curves import Curve, from_before
from gaplab.schemas.records import StudyRead

BLOCKS = "▁▂▃▄▅▆▇█"
MOST_REPETITIONS = 60
"""Repetitions of an experiment that have a block; the others are counted."""


def show(snapshots: Iterable[Snapshot], console: Console, *, keep: bool = False) -> StudyRead:
    """Show each snapshot in place of the one before, and perhaps keep the last on the screen; return its study."""
    with Live(console=console, auto_refresh=False, transient=not keep) as live:
        for snapshot in snapshots:
            live.update(view(snapshot), refresh=True)
    return snapshot.study


def view(snapshot: Snapshot) -> RenderableType:
    """Return a table with a row for a study and each of its experiments."""
    curves = [row.curve for row in snapshot.rows if row.curve]
    scale = [mean for curve in curves for mean in _means(curve)]
    heads = [f"fitness in reality, {curves[0].unit}", "repetitions"] if curves else ["", "rollouts"]
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for head in ("", "state", "progress", "left", *heads):
        table.add_column(head, overflow="fold")
    for row in snapshot.rows:
        name, record = escape(row.name), row.record
        bar = ProgressBar(1.0, fraction(record.progress), width=20), f"{record.progress.rollouts_done:,}"
        table.add_row(
            f"[bold]{name}[/]" if isinstance(record, StudyRead) else name,
            standing(record),
            percent(record.progress),
            left(record),
            *((_curve(row.curve, scale), _repetitions(row)) if curves else bar),
        )
    lines: list[RenderableType] = [table, counts(snapshot.study.progress)]
    return Group(*lines, *([f"[yellow]{snapshot.warning}[/]"] if snapshot.warning else []))


def spark(values: Sequence[float], least: float, greatest: float) -> str:
    """Return numbers as blocks of eight heights, from the least to the greatest."""
    height = (greatest - least) or 1.0
    return "".join(BLOCKS[min(7, int(8 * (value - least) / height))] for value in values)


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
