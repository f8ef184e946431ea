"""Supervisors tell that they work; each function is one transaction, and raises StoreUnavailable."""

from gaplab.services.store.queries import supervisors
from gaplab.services.store.session import Store


def heartbeat(store: Store, owner: str) -> None:
    """The supervisor works, as of now, whether it has anything to do or not."""
    store.write(lambda session: supervisors.heartbeat(session, owner))


def end(store: Store, owner: str) -> None:
    """The supervisor has stopped in good order, and will not be missed."""
    store.write(lambda session: supervisors.end(session, owner))
