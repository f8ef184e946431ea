"""Totals over the whole database."""

from gaplab.services.store.queries import totals
from gaplab.services.store.queries.totals import Totals as Totals
from gaplab.services.store.session import Store


def read(store: Store) -> Totals:
    """Return totals over all experiments, and the ages of supervisors; a short query, since tallies are stored.

    Raises:
        StoreUnavailable: the database cannot be used now.
    """
    with store.reading() as session:
        return totals.totals(session)
