"""The software and machines that computed an experiment."""

from fastapi import APIRouter

from gaplab.api.http.dependencies import Id, StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import ExperimentRead
from gaplab.services.running import provenance

router = APIRouter(prefix="/experiments", tags=["experiments"])


@router.get(
    "/{id}/provenance",
    summary="Read an experiment's provenance",
    response_description="In chronological order",
    responses=documented(404),
)
def read_provenance(id: Id, store: StoreDep) -> ProvenanceRead:
    """Return the versions of gaplab, Python, engines and libraries, the commit and the machine of each supervisor."""
    return provenance.read(store, id)


@router.post(
    "/{id}/accept-versions",
    summary="Continue with other versions",
    response_description="The next supervisor continues it",
    responses=documented(404, 409),
)
def accept_versions(id: Id, store: StoreDep) -> ExperimentRead:
    """Let an experiment continue with other engines or plug-ins than it started with: the next supervisor's.

    Its results may differ from those of the first versions. The provenance records which versions were used.
    """
    return provenance.accept_versions(store, id)
