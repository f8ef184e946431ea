"""Names and notes, changed after the fact. Each function is one transaction, and raises StoreUnavailable.

`starting_from` guards against undoing what somebody else changed meanwhile: it has the values of `edits` that the
sender takes for the present one; None for whatever it is. Progress is no edit, and refuses none.
"""

from collections.abc import Collection

from gaplab.schemas.editing import Edit
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.store.queries import editing, experiments, reads
from gaplab.services.store.session import Session, Store


def edit_experiment(
    store: Store,
    id: str,  # noqa: A002 - as the API says
    edit: Edit,
    *,
    starting_from: Collection[int] | None,
) -> ExperimentRead:
    """The experiment with its new name or notes; its spec stays as it was submitted.

    Raises:
        NotFound: no such experiment.
        Changed: it was edited meanwhile.
    """

    def work(session: Session) -> ExperimentRead:
        row = experiments.get_experiment(session, id)
        editing.edit(session, row, edit.model_dump(exclude_unset=True), starting_from)
        return reads.read_experiments(session, [row])[0]

    return store.write(work)


def edit_study(
    store: Store,
    id: str,  # noqa: A002 - as the API says
    edit: Edit,
    *,
    starting_from: Collection[int] | None,
) -> StudyRead:
    """The study with its new name or notes; its experiments keep theirs.

    Raises:
        NotFound: no such study.
        Changed: it was edited meanwhile.
    """

    def work(session: Session) -> StudyRead:
        row = experiments.get_study(session, id)
        editing.edit(session, row, edit.model_dump(exclude_unset=True), starting_from)
        return reads.read_studies(session, [row])[0]

    return store.write(work)
