"""Under what experiments are computed."""

from fastapi import APIRouter

from gaplab.api.http import event_examples, examples
from gaplab.api.http.dependencies import Id, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import ExperimentRead
from gaplab.services.running import provenance

router = APIRouter(prefix="/experiments", tags=["experiments"])


@router.get(
    "/{id}/provenance",
    summary="Read an experiment's provenance",
    responses={200: examples.shown(event_examples.PROVENANCE, "In the order of their beginnings"), **documented(404)},
)
def read_provenance(id: Id, store: StoreDep) -> ProvenanceRead:
    """The versions of gaplab, Python, engines and libraries, the commit and the machine, as supervisors claimed it."""
    return provenance.read(store, id)


@router.post(
    "/{id}/accept-versions",
    summary="Go on under other versions",
    responses={200: examples.shown(examples.EXPERIMENT, "The next supervisor goes on with it"), **documented(404, 409)},
)
def accept_versions(id: Id, store: StoreDep) -> ExperimentRead:
    """Let an experiment go on under other engines or plug-ins than it was begun with: those of the next supervisor.

    Its numbers need not be those that the first versions would have given, and which were used is recorded.
    """
    return provenance.accept_versions(store, id)
