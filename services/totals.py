"""What the whole database holds, in one short transaction."""

from services.store.repository import totals
from services.store.repository.totals import Totals as Totals
from services.store.session import Store


def read(store: Store) -> Totals:
    """All experiments taken together, and who computes them; from tallies, so that it costs one sum.

    Raises:
        StoreUnavailable: the database cannot be used now.
    """
    with store.reading() as session:
        return totals.totals(session)
