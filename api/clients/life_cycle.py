"""What a client asks of experiments and studies."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, TypeVar
from urllib.parse import quote

import httpx2

from schemas.lifecycle import Verb
from schemas.records import AttemptRead, ExperimentRead, StudyRead

T = TypeVar("T")


def part(id: str) -> str:  # noqa: A002 - as the API says
    """The id as one part of an address, whatever it is; servers decode a slash before they look for parts."""
    return quote(id.replace("/", "%2F"), safe="").replace(".", "%2E") or "%20"


class LifeCycle:
    """The verbs of `schemas.lifecycle`; of whatever can send a request."""

    @abstractmethod
    def find(self, id: str) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
        """The study of this id, or the experiment."""

    def pause(self, id: str) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
        """Let a study or an experiment finish the steps under way, and wait until it is resumed."""
        return self._ask(id, Verb.PAUSE)

    def resume(self, id: str) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
        """Go on with a study or an experiment that was paused."""
        return self._ask(id, Verb.RESUME)

    def stop(self, id: str) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
        """Let a study or an experiment finish the steps under way, and complete it with what is there."""
        return self._ask(id, Verb.STOP)

    def cancel(self, id: str) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
        """Call a study or an experiment off at once."""
        return self._ask(id, Verb.CANCEL)

    def extend(self, id: str, *, iterations: int | None = None, repetitions: int | None = None) -> ExperimentRead:  # noqa: A002
        """Make a completed experiment as large as one submitted with these totals."""
        totals = {"iterations": iterations, "repetitions": repetitions}
        wanted = {name: total for name, total in totals.items() if total is not None}
        return self._read(ExperimentRead, self._request("POST", f"/experiments/{part(id)}/extend", json=wanted))

    def schedule(self, id: str, **changes: int | None) -> ExperimentRead:  # noqa: A002 - as the API says
        """Give an experiment another `priority` or `max_parallel`."""
        return self._read(ExperimentRead, self._request("PATCH", f"/experiments/{part(id)}", json=changes))

    def attempts(self, id: str, repetition: int) -> tuple[AttemptRead, ...]:  # noqa: A002 - as the API says
        """Who had a repetition of an experiment, from when to when, and how it ended."""
        address = f"/experiments/{part(id)}/repetitions/{repetition}/attempts"
        return self._read(tuple[AttemptRead, ...], self._request("GET", address))

    def _ask(self, id: str, verb: Verb) -> ExperimentRead | StudyRead:  # noqa: A002 - as the API says
        found = self.find(id)
        many = "studies" if isinstance(found, StudyRead) else "experiments"
        return self._read(type(found), self._request("POST", f"/{many}/{part(id)}/{verb}"))

    @abstractmethod
    def _request(
        self, method: str, path: str, *, params: Mapping[str, Any] | None = None, json: object = None
    ) -> httpx2.Response: ...

    @abstractmethod
    def _read(self, kind: type[T], answer: httpx2.Response) -> T: ...
