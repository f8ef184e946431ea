"""What a client asks of experiments and studies."""

from typing import TYPE_CHECKING
from urllib.parse import quote

from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.records import AttemptRead, ExperimentRead, StudyRead

if TYPE_CHECKING:
    from gaplab.api.clients.client import Client


def part(id: str) -> str:
    """The id as one part of an address, whatever it is; servers decode a slash before they look for parts."""
    return quote(id.replace("/", "%2F"), safe="", errors="replace").replace(".", "%2E") or "%20"


class LifeCycle:
    """A part of the client: the verbs of `gaplab.schemas.lifecycle`; its methods raise what the client's do."""

    def pause(self: "Client", id: str) -> ExperimentRead | StudyRead:
        """Let a study or an experiment finish the steps under way, and wait until it is resumed."""
        return self._ask(id, Verb.PAUSE)

    def resume(self: "Client", id: str) -> ExperimentRead | StudyRead:
        """Go on with a study or an experiment that was paused."""
        return self._ask(id, Verb.RESUME)

    def stop(self: "Client", id: str) -> ExperimentRead | StudyRead:
        """Let a study or an experiment finish the steps under way, and complete it with what is there."""
        return self._ask(id, Verb.STOP)

    def cancel(self: "Client", id: str) -> ExperimentRead | StudyRead:
        """Call a study or an experiment off at once."""
        return self._ask(id, Verb.CANCEL)

    def extend(
        self: "Client",
        id: str,
        *,
        iterations: int | None = None,
        repetitions: int | None = None,
    ) -> ExperimentRead:
        """Make a completed experiment as large as one submitted with these totals."""
        totals = {"iterations": iterations, "repetitions": repetitions}
        wanted = {name: total for name, total in totals.items() if total is not None}
        return self._read(ExperimentRead, self._request("POST", f"/experiments/{part(id)}/extend", json=wanted))

    def schedule(self: "Client", id: str, **changes: int | None) -> ExperimentRead:
        """Give an experiment another `priority` or `max_parallel`."""
        return self._read(ExperimentRead, self._request("PATCH", f"/experiments/{part(id)}/schedule", json=changes))

    def attempts(self: "Client", id: str, repetition: int) -> tuple[AttemptRead, ...]:
        """Who had a repetition of an experiment, from when to when, and how it ended."""
        address = f"/experiments/{part(id)}/repetitions/{repetition}/attempts"
        return self._read(tuple[AttemptRead, ...], self._request("GET", address))

    def _ask(self: "Client", id: str, verb: Verb) -> ExperimentRead | StudyRead:
        found = self.find(id)
        many = "studies" if isinstance(found, StudyRead) else "experiments"
        return self._read(type(found), self._request("POST", f"/{many}/{part(id)}/{verb}"))
