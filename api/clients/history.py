"""What the client can say of the past: events, and under what experiments were computed."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from gaplab.api.clients.events import follow as follow_events
from gaplab.api.clients.life_cycle import part
from gaplab.schemas.events import EventPage, EventRead
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import ExperimentRead

if TYPE_CHECKING:
    from gaplab.api.clients.client import Client


class History:
    """A part of the client; its methods raise what the client's do."""

    def events(
        self: "Client", *, follow: bool = True, patience_s: float = 60.0, **filters: str | int | Sequence[str] | None
    ) -> Iterator[EventRead]:
        """Events in their order, each once; filters as in the API: experiment, study, kind, after.

        Args:
            follow: go on for ever with what happens, whatever breaks in between; otherwise, end with the latest.
            patience_s: how long the service may be away.
            filters: left out: all.
        """
        if follow:
            yield from follow_events(self._http, filters, patience_s=patience_s)
            return
        while (page := self._read(EventPage, self._get("/events/page", **filters))).items:
            yield from page.items
            filters["after"] = page.last

    def provenance(self: "Client", id: str) -> ProvenanceRead:
        """Under what an experiment was computed."""
        return self._read(ProvenanceRead, self._get(f"/experiments/{part(id)}/provenance"))

    def accept_versions(self: "Client", id: str) -> ExperimentRead:
        """Let an experiment go on under other engines or plug-ins than it was begun with."""
        return self._read(ExperimentRead, self._request("POST", f"/experiments/{part(id)}/accept-versions"))
