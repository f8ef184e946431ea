"""Progress in a log: a line every ten seconds, and one for each experiment that ends."""

import time
from collections.abc import Iterable

from rich.console import Console
from rich.markup import escape

from gaplab.api.clients.progress.snapshots import Snapshot
from gaplab.api.clients.progress.text import counts, percent, state_text, time_left
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import StudyRead

LINE_EVERY_S = 10.0


def show(snapshots: Iterable[Snapshot], console: Console) -> StudyRead:
    """Print snapshots as lines; return the last study."""
    printed_at = -LINE_EVERY_S
    ended: set[str] = set()
    for snapshot in snapshots:
        lines = [
            f"{row.record.name}: {state_text(row.record)}; {counts(row.record.progress)}"
            for row in snapshot.rows[1:]
            if row.record.state.ended and row.record.id not in ended
        ]
        ended |= {row.record.id for row in snapshot.rows if row.record.state.ended}
        if snapshot.study.state.ended or time.monotonic() - printed_at >= LINE_EVERY_S:
            printed_at = time.monotonic()
            lines.append(snapshot.warning or _line(snapshot.study))
        for line in lines:
            console.print(f"{time.strftime('%H:%M:%S')} {escape(line)}")
    return snapshot.study


def _line(record: StudyRead) -> str:
    left = time_left(record)
    running = f"{left} left" if left else "time left not known yet"
    rest = running if record.state is State.RUNNING else state_text(record)
    return f"{record.name}: {percent(record.progress)}, {counts(record.progress)}; {rest}"
