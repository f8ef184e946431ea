"""Progress in a notebook: one display that is replaced as it goes on, with nothing to install beside Jupyter."""

import sys
from collections.abc import Iterable
from html import escape

from gaplab.api.clients import display
from gaplab.api.clients.pace import Pace
from gaplab.schemas.records import ExperimentRead, StudyRead

Watched = ExperimentRead | StudyRead


def in_notebook() -> bool:
    """Whether a Jupyter kernel runs this."""
    if "IPython" not in sys.modules:
        return False
    from IPython import get_ipython

    return hasattr(get_ipython(), "kernel")


def follow_in_notebook(stages: Iterable[Watched]) -> Watched:
    """Show each stage of a study or an experiment in the cell's output; return the last."""
    from IPython.display import HTML
    from IPython.display import display as show

    handle, pace = None, Pace()
    for stage in stages:
        if handle is None:
            handle = show(HTML(bars(stage, pace)), display_id=True)
        else:
            handle.update(HTML(bars(stage, pace)))
    return stage


def bars(stage: Watched, pace: Pace) -> str:
    """A line of HTML with a progress bar for a study and each of its experiments, or for an experiment."""
    parts = (stage, *stage.experiments) if isinstance(stage, StudyRead) else (stage,)
    return f'<table style="text-align: left">{"".join(_row(each, pace.left(each)) for each in parts)}</table>'


def _row(each: Watched, left: str | None) -> str:
    name = escape(each.name.replace("_", " "))
    done = 1.0 if each.state.ended else display.fraction(each.progress)
    return (
        f"<tr><td>{f'<b>{name}</b>' if isinstance(each, StudyRead) else name}</td>"
        f'<td><progress max="1" value="{done:.3f}" aria-label="{name}">{done:.0%}</progress></td>'
        f"<td>{each.state}</td><td>{each.progress.rollouts_done:,} rollouts</td>"
        f"<td>{f'{left} left' if left else ''}</td></tr>"
    )
