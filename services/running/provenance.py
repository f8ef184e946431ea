"""Under what experiments are computed, and going on under something else. Each function is one transaction.

All of them raise StoreUnavailable while the database cannot be used.
"""

from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import ExperimentRead
from gaplab.services.store.queries import provenance, reads
from gaplab.services.store.session import Store


def read(store: Store, experiment_id: str) -> ProvenanceRead:
    """Under what the experiment was computed, and who has left it alone for having something else.

    Raises:
        NotFound: no such experiment.
    """
    with store.reading() as session:
        return provenance.read(session, experiment_id)


def accept_versions(store: Store, experiment_id: str) -> ExperimentRead:
    """Let the experiment go on under other engines or plug-ins than it was begun with: those of the next supervisor.

    Raises:
        NotFound: no such experiment.
        Conflict: it has ended, or has not begun.
    """
    return store.write(lambda session: reads.read_experiments(session, [provenance.accept(session, experiment_id)])[0])
