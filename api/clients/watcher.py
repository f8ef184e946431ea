"""Waiting for studies, with their progress shown."""

import time
from collections.abc import Iterator
from dataclasses import replace

from rich.console import Console

from gaplab.api.clients.connection import Of
from gaplab.api.clients.errors import ExperimentFailed, ServiceError, ServiceUnreachable, is_final
from gaplab.api.clients.objects import Study
from gaplab.api.clients.progress import RecordProgress, Snapshot, follow, show
from gaplab.api.clients.results import Results
from gaplab.api.clients.studies import Studies
from gaplab.schemas.lifecycle import State


class Watcher(Studies, Results):
    """Requests that wait for studies, and show their progress."""

    def wait(
        self,
        of: Of,
        *,
        progress: bool | None = None,
        timeout_s: float | None = None,
        every_s: float = 1.0,
        patience_s: float = 60.0,
    ) -> Study:
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
        snapshots = _within(self.snapshots(of, every_s=every_s, patience_s=patience_s), timeout_s)
        ended = follow(snapshots, progress)
        if ended.state is not State.COMPLETED:
            raise ExperimentFailed(ended)
        return ended

    def show(
        self, of: Of, console: Console, *, curves: bool = False, every_s: float = 1.0, patience_s: float = 60.0
    ) -> Study:
        """Show the progress of a study until it has ended, and return it; see `snapshots`.

        A terminal gets a live table, anything else a line every ten seconds. With `curves`, the table has curves and
        repetitions too, and its last state stays on the screen.
        """
        curves = curves and console.is_terminal
        return show(self.snapshots(of, curves=curves, every_s=every_s, patience_s=patience_s), console, keep=curves)

    def snapshots(
        self, of: Of, *, curves: bool = False, every_s: float = 1.0, patience_s: float = 60.0
    ) -> Iterator[Snapshot[Study]]:
        """Yield the progress until the study has ended, perhaps with curves and repetitions.

        While the service is away, snapshots say so; away for longer than `patience_s` is an error.
        """
        details = dict[str, RecordProgress]()
        snapshot = self._snapshot(self.study(of), details, curves=curves)
        yield snapshot
        answered_at = time.monotonic()
        while not snapshot.study.state.ended:
            time.sleep(every_s)
            try:
                snapshot = self._snapshot(self.study(of), details, curves=curves)
            except (ServiceError, ServiceUnreachable) as error:
                away_s = time.monotonic() - answered_at
                if is_final(error) or away_s > patience_s:
                    raise
                snapshot = replace(snapshot, away_s=away_s)
            yield snapshot
            if not snapshot.away_s:
                answered_at = time.monotonic()

    def _snapshot(self, study: Study, details: dict[str, RecordProgress], *, curves: bool) -> Snapshot[Study]:
        """Return the progress; details by id, of those experiments that go on or have changed, are read again."""
        experiments = {each.id: each for each in study.experiments}
        moving = [
            id
            for id, each in experiments.items()
            if not each.state.ended or id not in details or details[id].record != each
        ]
        for curve in self.curves(moving) if curves and moving else ():
            id, repetitions = curve.experiment, self.repetitions(curve.experiment)
            details[id] = RecordProgress(experiments[id], curve, repetitions)
        rows = [details.get(id) or RecordProgress(each) for id, each in experiments.items()]
        return Snapshot(study, (*([RecordProgress(study)] if len(rows) > 1 else []), *rows))


def _within(snapshots: Iterator[Snapshot[Study]], timeout_s: float | None) -> Iterator[Snapshot[Study]]:
    started_at = time.monotonic()
    for snapshot in snapshots:
        yield snapshot
        study = snapshot.study
        if timeout_s is not None and not study.state.ended and time.monotonic() - started_at > timeout_s:
            msg = f"{study.name} ({study.id}) is {study.state} after {timeout_s:g} s; it continues, so wait again"
            raise TimeoutError(msg)
