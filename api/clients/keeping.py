"""Tags, archiving and deletion of studies, and saved views."""

from collections.abc import Iterable

from gaplab.api.clients.connection import Connection, Of, segment
from gaplab.api.clients.records import Records
from gaplab.schemas.keeping import DeletionRead, Order, ViewRead, WebhookRead
from gaplab.schemas.records import StudyRead


class Keeping:
    """Requests that tag, archive and delete studies, notify of their ends, and save views."""

    def __init__(self, connection: Connection, records: Records) -> None:
        self._connection = connection
        self._records = records

    def tag(self, of: Of, *tags: str) -> StudyRead:
        """Add tags to a study, and return it."""
        return self._records.edit(of, {"add_tags": _each(tags)})

    def untag(self, of: Of, *tags: str) -> StudyRead:
        """Remove tags from a study, and return it."""
        return self._records.edit(of, {"remove_tags": _each(tags)})

    def archive(self, of: Of) -> StudyRead:
        """Leave a study that has ended out of lists, and return it."""
        return self._records.apply(of, "archive")

    def unarchive(self, of: Of) -> StudyRead:
        """List an archived study again, and return it."""
        return self._records.apply(of, "unarchive")

    def delete(self, of: Of) -> DeletionRead:
        """Delete a study that has ended, or one experiment of it, for good; twice is the same as once."""
        return self._connection.change(DeletionRead, "DELETE", f"/studies/{segment(of)}")

    def notify(self, of: Of, url: str | None) -> WebhookRead:
        """Tell a webhook when a study has ended; None tells none any more."""
        path = f"/studies/{segment(of)}/webhook"
        if url is None:
            return self._connection.change(WebhookRead, "DELETE", path)
        return self._connection.change(WebhookRead, "PUT", path, json={"url": url})

    def views(self) -> tuple[ViewRead, ...]:
        """Return the saved views, by name."""
        return self._connection.get(tuple[ViewRead, ...], "/views")

    def view(self, name: str) -> ViewRead:
        """Return a saved view."""
        return self._connection.get(ViewRead, _path(name))

    def save_view(self, name: str, query: str | None = None, *, sort: Order = "-created_at") -> ViewRead:
        """Save a query under a name that all users of the service share, in place of the view that has it."""
        body = {"query": query, "sort": sort}
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
