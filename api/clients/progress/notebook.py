"""Progress in a notebook: one display that is replaced, without packages beside Jupyter."""

import sys
from collections.abc import Iterable
from html import escape
from importlib import import_module
from typing import Any

from gaplab.api.clients.progress.snapshots import RecordProgress, Snapshot
from gaplab.api.clients.progress.text import fraction, state_text, time_left
from gaplab.schemas.records import StudyRead


def in_notebook() -> bool:
    """Return whether a Jupyter kernel runs this program."""
    return "IPython" in sys.modules and hasattr(sys.modules["IPython"].get_ipython(), "kernel")


def show(snapshots: Iterable[Snapshot]) -> StudyRead:
    """Show snapshots in the output of the cell; return the last study."""
    ipython: Any = import_module("IPython.display")
    handle = None
    for snapshot in snapshots:
        html = ipython.HTML(table(snapshot))
        if handle is None:
            handle = ipython.display(html, display_id=True)
        else:
            handle.update(html)
    return snapshot.study


def table(snapshot: Snapshot) -> str:
    """Return an HTML table with a progress bar in each row."""
    warning = f"<caption>{snapshot.warning}</caption>" if snapshot.warning else ""
    return f'<table style="text-align: left">{warning}{"".join(map(_row, snapshot.rows))}</table>'


def _row(row: RecordProgress) -> str:
    name, record, left = escape(row.name), row.record, time_left(row.record)
    done = fraction(record.progress)
    return (
        f"<tr><td>{f'<b>{name}</b>' if isinstance(record, StudyRead) else name}</td>"
        f'<td><progress max="1" value="{done:.3f}" aria-label="{name}">{done:.0%}</progress></td>'
        f"<td>{escape(state_text(record))}</td><td>{record.progress.rollouts_done:,} rollouts</td>"
        f"<td>{f'{left} left' if left else ''}</td></tr>"
    )
