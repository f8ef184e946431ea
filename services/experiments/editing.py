"""Names and notes, changed after submission. Each function is one transaction, and raises StoreUnavailable.

`starting_from` protects another person's edit: the change is refused unless the present number of edits is in it.
None permits any number. Progress is no edit.
"""

from collections.abc import Collection

from sqlalchemy import update

from gaplab.schemas.editing import Edit
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.services.core.errors import Changed
from gaplab.services.experiments.views import view_experiments, view_studies
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.experiments import get_experiment, get_study
from gaplab.services.store.session import Session, transaction
from gaplab.services.store.statements import storable


@transaction
def edit_experiment(
    session: Session, experiment_id: str, edit: Edit, *, starting_from: Collection[int] | None
) -> ExperimentRead:
    """Change the experiment's name or notes; its spec stays as it was submitted.

    Raises:
        NotFound: no such experiment.
        Changed: it was edited meanwhile.
    """
    row = get_experiment(session, experiment_id)
    _edit(session, row, edit, starting_from)
    return view_experiments(session, [row])[0]


@transaction
def edit_study(session: Session, study_id: str, edit: Edit, *, starting_from: Collection[int] | None) -> StudyRead:
    """Change the study's name or notes; its experiments keep theirs.

    Raises:
        NotFound: no such study.
        Changed: it was edited meanwhile.
    """
    row = get_study(session, study_id)
    _edit(session, row, edit, starting_from)
    return view_studies(session, [row])[0]


def _edit(session: Session, row: ExperimentRow | StudyRow, edit: Edit, starting_from: Collection[int] | None) -> None:
    table = type(row)
    changes = edit.model_dump(exclude_unset=True)
    values = {name: storable(value) if value is not None else None for name, value in changes.items()}
    statement = update(table).where(table.id == row.id).values(values | {"edits": table.edits + 1})
    if starting_from is not None:
        statement = statement.where(table.edits.in_(sorted(starting_from)))
    if session.execute(statement.returning(table.id)).first() is None:
        raise Changed(f"{row.id!r} was changed by someone else since you read it; read it again, and then decide")
    session.refresh(row)
