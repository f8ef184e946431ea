"""What the whole database holds, in one short transaction."""

from gaplab.services.store.queries import totals
from gaplab.services.store.queries.totals import Totals as Totals
from gaplab.services.store.session import Store


def read(store: Store) -> Totals:
    """All experiments taken together, and who computes them; from tallies, so that it costs one sum.

    Raises:
        StoreUnavailable: the database cannot be used now.
    """
    with store.reading() as session:
        return totals.totals(session)
