"""Waiting for what was submitted, with progress where somebody looks."""

import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from gaplab.api.clients.errors import ExperimentFailed, ServiceError, ServiceUnreachable, is_for_good
from gaplab.api.clients.notebook import follow_in_notebook, in_notebook
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, StudyRead

if TYPE_CHECKING:
    from gaplab.api.clients.client import Client


class Waiting:
    """A part of the client; its methods raise what the client's do."""

    def watch(
        self: "Client",
        id: str,
        *,
        every_s: float = 1.0,
        patience_s: float = 60.0,
    ) -> Iterator[ExperimentRead | StudyRead]:
        """A study or an experiment again and again, until it has ended; the last one is what it ended as.

        A service that is away for less than `patience_s` is waited for.
        """
        current = self.find(id)
        again = self.study if isinstance(current, StudyRead) else self.experiment
        yield current
        heard_at = time.monotonic()
        while not current.state.ended:
            time.sleep(every_s)
            try:
                current = again(id)
            except (ServiceError, ServiceUnreachable) as error:
                if is_for_good(error) or time.monotonic() - heard_at > patience_s:
                    raise
                continue
            yield current
            heard_at = time.monotonic()

    def wait(
        self: "Client",
        id: str,
        *,
        progress: bool | None = None,
        timeout_s: float | None = None,
        every_s: float = 1.0,
        patience_s: float = 60.0,
    ) -> ExperimentRead | StudyRead:
        """What a study or an experiment ended as, once it has.

        Args:
            id: of it.
            progress: show a bar for it and for each experiment of a study; left out: in a terminal and in a notebook.
            timeout_s: how long to wait at most; left out: for ever.
            every_s: how often the service is asked.
            patience_s: how long the service may be away.

        Raises:
            ExperimentFailed: it failed, or was cancelled; its `ended` is what it ended as.
            TimeoutError: it has not ended yet. It goes on; wait again.
        """
        stages = _within(self.watch(id, every_s=every_s, patience_s=patience_s), timeout_s)
        ended = _shown(stages) if _somebody_looks(progress) else _last(stages)
        if ended.state is not State.COMPLETED:
            raise ExperimentFailed(ended)
        return ended


def _within(
    stages: Iterator[ExperimentRead | StudyRead], timeout_s: float | None
) -> Iterator[ExperimentRead | StudyRead]:
    began = time.monotonic()
    for stage in stages:
        yield stage
        if timeout_s is not None and not stage.state.ended and time.monotonic() - began > timeout_s:
            msg = f"{stage.name} ({stage.id}) is {stage.state} after {timeout_s:g} s; it goes on"
            raise TimeoutError(msg)


def _somebody_looks(progress: bool | None) -> bool:
    return (in_notebook() or sys.stderr.isatty()) if progress is None else progress


def _shown(stages: Iterator[ExperimentRead | StudyRead]) -> ExperimentRead | StudyRead:
    if in_notebook():
        return follow_in_notebook(stages)
    from gaplab.api.clients.display import console
    from gaplab.api.clients.watch import follow

    return follow(stages, console(stderr=True))


def _last(stages: Iterator[ExperimentRead | StudyRead]) -> ExperimentRead | StudyRead:
    for stage in stages:
        last = stage
    return last
