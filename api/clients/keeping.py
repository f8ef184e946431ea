"""Keeping studies and experiments: tags, archived records, deletion, and saved views."""

from collections.abc import Iterable

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.errors import if_found
from gaplab.api.clients.records import Records, path_of
from gaplab.schemas.editing import DeletionRead
from gaplab.schemas.notifications import WebhookRead
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.views import Order, Shown, ViewRead


class Keeping:
    """What people do with studies and experiments once they have results."""

    def __init__(self, connection: Connection, records: Records) -> None:
        self._connection = connection
        self._records = records

    def tag(self, id: str, *tags: str) -> ExperimentRead | StudyRead:
        """Add tags to a study or an experiment, and return it."""
        return self._records.patch(id, {"add_tags": _each(tags)})

    def untag(self, id: str, *tags: str) -> ExperimentRead | StudyRead:
        """Remove tags from a study or an experiment, and return it."""
        return self._records.patch(id, {"remove_tags": _each(tags)})

    def archive(self, id: str) -> ExperimentRead | StudyRead:
        """Leave a study or an experiment that has ended out of lists, and return it."""
        return self._records.apply(id, "archive")

    def unarchive(self, id: str) -> ExperimentRead | StudyRead:
        """List an archived study or experiment again, and return it."""
        return self._records.apply(id, "unarchive")

    def delete(self, id: str) -> DeletionRead:
        """Delete a study or an experiment that has ended, with its results, for good; twice is the same as once."""
        with if_found():
            return self._connection.change(DeletionRead, "DELETE", f"/studies/{segment(id)}")
        return self._connection.change(DeletionRead, "DELETE", f"/experiments/{segment(id)}")

    def notify(self, id: str, url: str | None) -> WebhookRead:
        """Tell a webhook when a study or an experiment has ended; None tells none any more."""
        path = f"{path_of(self._records.find(id))}/webhook"
        if url is None:
            return self._connection.change(WebhookRead, "DELETE", path)
        return self._connection.change(WebhookRead, "PUT", path, json={"url": url})

    def views(self) -> tuple[ViewRead, ...]:
        """Return the saved views, by name."""
        return self._connection.get(tuple[ViewRead, ...], "/views")

    def view(self, name: str) -> ViewRead:
        """Return a saved view."""
        return self._connection.get(ViewRead, _path(name))

    def save_view(
        self,
        name: str,
        query: str | None = None,
        *,
        shows: Shown = "all",
        sort: Order = "-created_at",
    ) -> ViewRead:
        """Save a query under a name that all users of the service share, in place of the view that has it."""
        body = {"query": query, "shows": shows, "sort": sort}
        return self._connection.change(ViewRead, "PUT", _path(name), json=body)

    def delete_view(self, name: str) -> ViewRead:
        """Delete a saved view, and return it."""
        return self._connection.change(ViewRead, "DELETE", _path(name))


def _path(view: str) -> str:
    return f"/views/{segment(view)}"


def _each(tags: Iterable[str]) -> tuple[str, ...]:
    """Return the tags as a tuple.

    Raises:
        ValueError: there is none.
    """
    if not (given := tuple(tags)):
        raise ValueError("give at least one tag")
    return given
