"""Waiting for studies, with their progress shown."""

import sys
import time
from collections import deque
from collections.abc import Iterator

from rich.console import Console

from gaplab.api.clients.connection import Of
from gaplab.api.clients.errors import ExperimentFailed
from gaplab.api.clients.progress import log, notebook, terminal
from gaplab.api.clients.progress.notebook import in_notebook
from gaplab.api.clients.progress.snapshots import Snapshot, Snapshots
from gaplab.api.clients.progress.text import console
from gaplab.api.clients.records import Records
from gaplab.api.clients.results import Results
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import StudyRead


class Watcher:
    """The progress of studies."""

    def __init__(self, records: Records, results: Results) -> None:
        self._records = records
        self._results = results

    def watch(self, of: Of, *, every_s: float = 1.0, patience_s: float = 60.0) -> Iterator[StudyRead]:
        """Yield a study every `every_s` seconds, until it has ended.

        A service that is away for longer than `patience_s` is an error.
        """
        for snapshot in Snapshots(self._records).of(of, every_s=every_s, patience_s=patience_s):
            if not snapshot.away_s:
                yield snapshot.study

    def wait(
        self,
        of: Of,
        *,
        progress: bool | None = None,
        timeout_s: float | None = None,
        every_s: float = 1.0,
        patience_s: float = 60.0,
    ) -> StudyRead:
        """Wait until a study has completed, and return it.

        Args:
            of: the study, or one experiment of it.
            progress: show progress on standard error or in the notebook; left out: only in a terminal or a notebook.
            timeout_s: longest wait; left out: no limit.
            every_s: interval between requests.
            patience_s: longest time without a service before the error is raised.

        Raises:
            ExperimentFailed: it failed or was cancelled; `ended` is its last state.
            TimeoutError: it has not ended yet. It continues; wait again.
        """
        every_s = every_s if timeout_s is None else min(every_s, timeout_s)
        snapshots = _within(Snapshots(self._records).of(of, every_s=every_s, patience_s=patience_s), timeout_s)
        if progress is None:
            progress = in_notebook() or sys.stderr.isatty()
        if not progress:
            ended = deque(snapshots, maxlen=1).pop().study
        elif in_notebook():
            ended = notebook.show(snapshots)
        else:
            ended = _print(snapshots, console(stderr=True))
        if ended.state is not State.COMPLETED:
            raise ExperimentFailed(ended)
        return ended

    def show(
        self, of: Of, console: Console, *, curves: bool = False, every_s: float = 1.0, patience_s: float = 60.0
    ) -> StudyRead:
        """Show the progress of a study until it has ended, and return it; see `watch`.

        A terminal gets a live table, anything else a line every ten seconds. With `curves`, the table has curves and
        repetitions too, and its last state stays on the screen.
        """
        source = Snapshots(self._records, self._results if curves and console.is_terminal else None)
        return _print(source.of(of, every_s=every_s, patience_s=patience_s), console, keep=curves)


def _print(snapshots: Iterator[Snapshot], console: Console, *, keep: bool = False) -> StudyRead:
    return terminal.show(snapshots, console, keep=keep) if console.is_terminal else log.show(snapshots, console)


def _within(snapshots: Iterator[Snapshot], timeout_s: float | None) -> Iterator[Snapshot]:
    started_at = time.monotonic()
    for snapshot in snapshots:
        yield snapshot
        study = snapshot.study
        if timeout_s is not None and not study.state.ended and time.monotonic() - started_at > timeout_s:
            msg = f"{study.name} ({study.id}) is {study.state} after {timeout_s:g} s; it continues, so wait again"
            raise TimeoutError(msg)
